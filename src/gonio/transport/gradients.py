"""The derivatives of a picture with respect to parameters of the materials in a scene.

    render = Gradients(scene, settings, [Along(plugin, "alpha")])
    render.advance(64)
    render.image(), render.slopes()         # (H, W, 3), and a list of one such array per value

The paths are those of the integrator. Their directions and densities do not depend on the parameter (detached
sampling), and the light that the materials scatter along them is differentiated (attached evaluation). This is unbiased
for every parameter that does not move the paths; see Vicini2021 for the theory. The derivatives are propagated forward
along the path, like the throughput, so one traversal gives the picture and all derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from types import ModuleType
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ..bridge.adapter.material import PlacedMaterial
from ..bridge.adapter.slots import Slot
from ..bridge.faults.lost_derivatives import own_variable
from ..bridge.types import BSDFPlugin, BSDFSample, Float, Mask, Point, Radiance, Scene, Sensor, UInt, Vector
from ..errors import InputError
from ..material.parameters import IndexParameter
from .integrators import Integrator, LightTransport, Path, Render, Settings
from .integrators.light_transport import PathState
from .media import Media
from .scattering import Scattering, Vertex
from .scene_data import SceneData


@dataclass(frozen=True)
class Along:
    """The variable of a derivative: a parameter of a material, or a channel of a color.

    plugin   the material in the scene, which must be one of Gonio's
    path     path of the parameter in the material, such as "alpha" or "base.alpha"
    channel  index of a channel, 0 to 2; None for all channels together, or for both alphas of a pair
    """

    plugin: BSDFPlugin
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
    """A render that computes derivatives, returned by `slopes`, in addition to the picture, returned by `image`.

    Raises InputError for integrators and parameters without derivatives.
    """

    def __init__(self, scene: Scene, settings: Settings, along: Sequence[Along], sensor: Sensor | None = None):
        program = settings.program
        location = "gradient"
        if not issubclass(program, LightTransport) or program.splats or program.blurs:
            raise InputError(f"{settings.integrator} has no derivatives", location, "use path or direct")
        self.along = list(along)
        self.features = 3 * len(self.along)
        super().__init__(scene, settings, sensor)
        if not self.mi.is_rgb:
            what = f"variant {self.mi.variant()} is set, but derivatives need RGB"
            raise InputError(what, location, "leave out spectral")
        index = any(isinstance(one.slot.parameter, IndexParameter) for one in self.along)
        assert isinstance(self._integrator, _ForwardDerivatives)
        if index and self._integrator.walked.media.known:
            what = "the index of a medium that others in the scene depend on (nested or absorbing media)"
            raise InputError(what, location, "leave priority and absorption out, or name another value")
        if self._integrator.walked.ambient is not None:
            raise InputError("ambient light has no derivative", location, "leave ambient out")

    def _integrator_of(self, data: Callable[..., SceneData] = SceneData) -> Integrator:
        walked = super()._integrator_of(partial(_AttachedData, self.along))
        assert isinstance(walked, LightTransport)
        return _ForwardDerivatives(walked, self.along)

    def slopes(self) -> list[NDArray[np.float32]]:
        """The derivatives of the picture with respect to each parameter, as arrays of shape (height, width, 3)."""
        return [self._mean(self._sums.features[3 * i : 3 * i + 3]) for i in range(len(self.along))]


@dataclass
class _Derivatives:
    """A path, and the derivatives of its throughput and of its radiance with respect to each parameter."""

    path: PathState
    throughput: list[Radiance]
    radiance: list[Radiance]


class _ForwardDerivatives(Integrator):
    """Traces the paths of another integrator and computes derivatives at each vertex.

    walked  the integrator that generates the paths
    """

    def __init__(self, walked: LightTransport, along: Sequence[Along]):
        super().__init__(walked.data, walked.settings)
        self.walked, self.along = walked, along
        scattering = walked.scattering
        assert isinstance(scattering, _AttachedScattering)
        self.attached = scattering

    def sample(self, pixel: UInt, key: UInt, index: UInt) -> list[Float]:
        """The color of a sample, [r, g, b], followed by its derivative with respect to each parameter."""
        mi = self.mi
        zeros = [mi.Spectrum(0) for _ in self.along]
        state = _Derivatives(self.walked.camera_path(pixel, key, index), zeros, list(zeros))
        state = self.bounce(state, key)
        if isinstance(self.walked, Path) and not self.walked.one_bounce:
            state = dr.while_loop(
                (state,),
                lambda s: s.path.active,
                lambda s: (self.bounce(s, key),),
                mode="symbolic",
                label="vertices",
            )[0]
        values = [*self.data.rgb(state.path.radiance, state.path.ray.wavelengths)]
        for slope in state.radiance:
            values += [*slope]
        return values

    def bounce(self, state: _Derivatives, key: UInt) -> _Derivatives:
        """Process one vertex of the path, and propagate the derivatives by the chain rule."""
        path, mi = state.path, self.mi
        with dr.resume_grad():
            throughput, radiance = mi.Spectrum(path.throughput), mi.Spectrum(path.radiance)
            values = self.attached.fresh_values()
            leaves = [throughput, radiance, *(v for named in values.values() for v in named.values())]
            dr.enable_grad(leaves)
            following, _ = self.walked.bounce(replace(path, throughput=throughput, radiance=radiance), key)
            outgoing = [own_variable(following.throughput, following.active), following.radiance]
            slopes = []
            for one, before in zip(self.along, zip(state.throughput, state.radiance, strict=True), strict=True):
                dr.clear_grad([*leaves, *outgoing])
                dr.set_grad(throughput, before[0])
                dr.set_grad(radiance, before[1])
                for value in values[one.slot].values():
                    if one.channel is None:
                        dr.set_grad(value, 1)
                    else:
                        dr.set_grad(value, mi.Color3f(*(float(i == one.channel) for i in range(3))))
                dr.enqueue(dr.ADMode.Forward, leaves)
                dr.traverse(dr.ADMode.Forward, flags=dr.ADFlag.ClearInterior)
                slopes.append([mi.Spectrum(dr.grad(x)) for x in outgoing])
        throughput, radiance = (dr.detach(x) for x in outgoing)
        following = replace(following, throughput=throughput, radiance=radiance)
        return _Derivatives(following, [t for t, _ in slopes], [r for _, r in slopes])


class _AttachedData(SceneData):
    """A scene whose materials are differentiated with respect to some of their parameters."""

    def __init__(self, along: Sequence[Along], *parts: Any, **options: Any) -> None:
        super().__init__(*parts, **options)
        self.along = along

    @cached_property
    def scattering(self) -> Scattering:
        return _AttachedScattering(self.mi, self.media, self.along)


class _AttachedScattering(Scattering):
    """BSDFs whose values and weights have derivatives, but whose sampled directions and densities have none."""

    def __init__(self, mi: ModuleType, media: Media, along: Sequence[Along]) -> None:
        super().__init__(mi, media)
        self.media = media
        self.plugins: list[BSDFPlugin] = []
        for one in along:
            if not any(one.plugin is other for other in self.plugins):
                self.plugins.append(one.plugin)
        self.slots = list({id(one.slot): one.slot for one in along}.values())
        self._values: dict[Slot, dict[str, Float]] = {}

    def fresh_values(self) -> dict[Slot, dict[str, Float]]:
        """New copies of the differentiated parameters, which the materials use from then on."""
        self._values = {one: {key: type(v)(v) for key, v in one.values.items()} for one in self.slots}
        return self._values

    def eval(self, vertex: Vertex, toward: Vector, active: Mask) -> Radiance:
        value = super().eval(vertex, toward, active)
        bs, weight = dr.zeros(self.mi.BSDFSample3f), self.mi.Spectrum(0)
        return self._attach(vertex, toward, value, bs, weight, active)[0]

    def sample(self, vertex: Vertex, lobe: Float, u: Point, active: Mask) -> tuple[BSDFSample, Radiance]:
        bs, weight = super().sample(vertex, lobe, u, active)
        return bs, self._attach(vertex, bs.wo, self.mi.Spectrum(0), bs, weight, active)[1]

    def eval_pdf_sample(
        self, vertex: Vertex, toward: Vector, lobe: Float, u: Point, active: Mask
    ) -> tuple[Radiance, Float, BSDFSample, Radiance]:
        value, pdf, bs, weight = super().eval_pdf_sample(vertex, toward, lobe, u, active)
        value, weight = self._attach(vertex, toward, value, bs, weight, active)
        return value, pdf, bs, weight

    def _attach(
        self, vertex: Vertex, toward: Vector, value: Radiance, bs: BSDFSample, weight: Radiance, active: Mask
    ) -> tuple[Radiance, Radiance]:
        """The given value toward a light and the given weight of a sample, with the derivatives of the materials."""
        mi, si = self.mi, vertex.si
        outer = 1.0 + si.duv_dx.x if self.media.known else None
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        density = dr.select(delta | (bs.pdf <= 0), 0, dr.rcp(bs.pdf))
        with self._differentiated():
            for plugin in self.plugins:
                here = active & (vertex.bsdf == mi.BSDFPtr(plugin))
                model = plugin.placed.at(si, here, outer=outer)
                toward_light, sampled = (mi.Spectrum(model.eval(si.wi, w)) for w in (toward, bs.wo))
                value = value + dr.select(here, toward_light - dr.detach(toward_light), 0)
                weight = weight + dr.select(here, (sampled - dr.detach(sampled)) * density, 0)
        return value, weight

    @contextmanager
    def _differentiated(self) -> Iterator[None]:
        """Inside the `with` block, materials use the differentiated parameters and quantities derived from them."""
        before = [(slot, slot.values) for slot in self.slots]
        derived = [(placed, placed.derived) for plugin in self.plugins for placed in _with_inner(plugin.placed)]
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


def _with_inner(placed: PlacedMaterial) -> Iterator[PlacedMaterial]:
    """A placed material and all materials nested in it."""
    yield placed
    for _, held in placed.inner.values():
        if isinstance(held, PlacedMaterial):
            yield from _with_inner(held)
