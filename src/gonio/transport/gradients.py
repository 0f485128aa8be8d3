"""Derivatives of a picture with respect to values of its materials.

    render = Gradients(scene, settings, [Along(plugin, "alpha")])
    render.advance(64)
    render.image(), render.slopes()         # (H, W, 3), and one of these for each

The samples are those of the integrator itself: where a path goes, and with which density, stays as it is while a value
moves (detached sampling), and what its materials send along it is differentiated (attached evaluation). That is without
bias for whatever does not move the paths: Vicini2021 has the theory. Derivatives go forward along the
path with its throughput, so that one walk gives the picture and all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import ModuleType

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ..bridge.adapter.material import PlacedMaterial
from ..bridge.adapter.slots import Slot
from ..bridge.types import (
    BSDFSample,
    Float,
    Mask,
    MitsubaBSDF,
    Radiance,
    Scene,
    Sensor,
    SurfaceInteraction,
    UInt,
    Vector,
)
from ..errors import InputError
from ..material.parameters import IndexParameter
from .integrators import Integrator, Render, Settings, Transport
from .integrators.sums import Sums
from .integrators.transport import PathState


@dataclass(frozen=True)
class Along:
    """What a picture is differentiated along: a value of a material, or a channel of a colour.

    plugin   the material in the scene, one of Gonio's
    path     of the value in it: "alpha", "base.alpha"
    channel  0 to 2; None: all channels together, and both widths of a pair
    """

    plugin: MitsubaBSDF
    path: str
    channel: int | None = None

    @property
    def slot(self) -> Slot:
        *inner, name = self.path.split(".")
        placed: PlacedMaterial = self.plugin.placed
        for step in inner:
            held = placed.inner[step][1]
            assert isinstance(held, PlacedMaterial)
            placed = held
        return placed.slots[name]


class Gradients(Render):
    """A render that carries derivatives along: `slopes` beside `image`.

    Raises InputError for integrators and values that have none.
    """

    def __init__(self, scene: Scene, settings: Settings, along: Sequence[Along], sensor: Sensor | None = None):
        program = settings.program
        where = "gradient"
        if not issubclass(program, Transport) or program.splats or program.merges:
            raise InputError(f"{settings.integrator} has no derivatives", where, "use path or direct")
        self.along = list(along)
        self.features = 3 * len(self.along)
        self._carrying = type("Carrying", (_Carrying, program), {"along": self.along})
        super().__init__(scene, settings, sensor)
        if not self.mi.is_rgb:
            raise InputError(f"variant {self.mi.variant()}, and derivatives are of RGB", where, "leave out spectral")
        index = any(isinstance(one.slot.parameter, IndexParameter) for one in self.along)
        assert isinstance(self._integrator, Transport)
        if index and self._integrator.media.known:
            what = "an index in a scene of nested or absorbing media, whose neighbours depend on it"
            raise InputError(what, where, "leave priority and absorption out, or name another value")
        if self._integrator.ambient is not None:
            raise InputError("ambient light has no derivative", where, "leave ambient out")

    def _program(self) -> Integrator:
        return self._carrying(self.mi, self.scene, self.sensor, self.settings, aovs=False)

    def slopes(self) -> list[NDArray[np.float32]]:
        """The picture's derivative along each, (height, width, 3)."""
        return [self._mean(self._sums.features[3 * i : 3 * i + 3]) for i in range(len(self.along))]


@dataclass
class _Carried:
    """A path, and along each value the derivatives of its throughput and of what it has found."""

    path: PathState
    throughput: list[Radiance]
    radiance: list[Radiance]


class _Carrying(Transport):
    """What `Gradients` changes in an integrator."""

    along: Sequence[Along] = ()

    def __init__(self, mi: ModuleType, scene: Scene, sensor: Sensor, settings: Settings, aovs: bool):
        super().__init__(mi, scene, sensor, settings, aovs)
        self.plugins: list[MitsubaBSDF] = []
        for one in self.along:
            if not any(one.plugin is other for other in self.plugins):
                self.plugins.append(one.plugin)
        self.slots = list({id(one.slot): one.slot for one in self.along}.values())
        self._values: dict[Slot, dict[str, Float]] = {}

    def sample(self, pixel: UInt, key: UInt, index: UInt) -> list[Float]:
        mi = self.mi
        none = [mi.Spectrum(0) for _ in self.along]
        state = _Carried(self.first(pixel, key, index), none, list(none))
        state = self.step(state, key, first=True)
        if self.goes_on:
            state = dr.while_loop(
                (state,),
                lambda s: s.path.active,
                lambda s: (self.step(s, key),),
                mode="symbolic",
                label="vertices",
            )[0]
        found = [*self.rgb(state.path.radiance, state.path.ray.wavelengths)]
        for slope in state.radiance:
            found += [*slope]
        return found

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        return Integrator.accumulate(self, pixel, key, first, last, sums)

    def step(self, state: _Carried, key: UInt, first: bool = False) -> _Carried:
        """One vertex, by the integrator's own `extend`, with derivatives."""
        path, mi = state.path, self.mi
        with dr.resume_grad():
            throughput, radiance = mi.Spectrum(path.throughput), mi.Spectrum(path.radiance)
            self._values = {one: {key: type(v)(v) for key, v in one.values.items()} for one in self.slots}
            leaves = [throughput, radiance, *(v for values in self._values.values() for v in values.values())]
            dr.enable_grad(leaves)
            moved = replace(path, throughput=throughput, radiance=radiance)
            following, _ = self.extend(moved, key, first)
            # a value of its own: Dr.Jit forgets derivatives of what others are made from
            outgoing = [dr.select(following.active, following.throughput, 0), following.radiance]
            found = []
            for one, before in zip(self.along, zip(state.throughput, state.radiance, strict=True), strict=True):
                dr.clear_grad([*leaves, *outgoing])
                dr.set_grad(throughput, before[0])
                dr.set_grad(radiance, before[1])
                for value in self._values[one.slot].values():
                    if one.channel is None:
                        dr.set_grad(value, 1)
                    else:
                        dr.set_grad(value, mi.Color3f(*(float(i == one.channel) for i in range(3))))
                dr.enqueue(dr.ADMode.Forward, leaves)
                dr.traverse(dr.ADMode.Forward, flags=dr.ADFlag.ClearInterior)
                found.append([mi.Spectrum(dr.grad(x)) for x in outgoing])
        throughput, radiance = (dr.detach(x) for x in outgoing)
        following = replace(following, throughput=throughput, radiance=radiance)
        return _Carried(following, [t for t, _ in found], [r for _, r in found])

    def attached(
        self,
        si: SurfaceInteraction,
        bsdf: MitsubaBSDF,
        toward: Vector,
        value: Radiance,
        bs: BSDFSample,
        weight: Radiance,
        active: Mask,
    ) -> tuple[Radiance, Radiance]:
        """The same value and weight, with derivatives where the material is one of those that move."""
        mi = self.mi
        outer = 1.0 + si.duv_dx.x if self.media.known else None
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        density = dr.select(delta | (bs.pdf <= 0), 0, dr.rcp(bs.pdf))
        with self._moved():
            for plugin in self.plugins:
                here = active & (bsdf == mi.BSDFPtr(plugin))
                model = plugin.placed.at(si, here, outer=outer)
                toward_light, sampled = (mi.Spectrum(model.eval(si.wi, w)) for w in (toward, bs.wo))
                value = value + dr.select(here, toward_light - dr.detach(toward_light), 0)
                weight = weight + dr.select(here, (sampled - dr.detach(sampled)) * density, 0)
        return value, weight

    @contextmanager
    def _moved(self) -> Iterator[None]:
        """Inside, the materials have values that are differentiated, and derive what follows from them anew."""
        before = [(slot, slot.values) for slot in self.slots]
        derived = [(placed, placed.derived) for plugin in self.plugins for placed in _all(plugin.placed)]
        try:
            for slot, _ in before:
                slot.values = {**slot.values, **self._values[slot]}
            for placed, _ in derived:
                placed.derived = None
            yield
        finally:
            for slot, values in before:
                slot.values = values
            for placed, value in derived:
                placed.derived = value


def _all(placed: PlacedMaterial) -> Iterator[PlacedMaterial]:
    """A placed material and those inside it."""
    yield placed
    for _, held in placed.inner.values():
        if isinstance(held, PlacedMaterial):
            yield from _all(held)
