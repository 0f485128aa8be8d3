"""The base class of integrators, which define the computation for every sample of a pixel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...bridge.types import Color, Float, Hit, Radiance, Ray, Scene, Sensor, SurfaceInteraction, UInt
from ...errors import InputError, did_you_mean
from ...members import Family, subclasses_of
from .. import sampler
from ..camera import FIRST_FREE as FIRST_FREE
from ..scene_data import SceneData
from ..sums import Sums
from ..surfaces import Surfaces

Picture = NDArray[np.float32]

SAMPLERS: dict[str, str] = {
    "default": f"lowest error: {sampler.DEFAULT[0]} for pixels and lamps, {sampler.DEFAULT[1]} for directions",
    **sampler.SAMPLERS,
}


@dataclass(frozen=True)
class Settings:
    """The settings of a render.

    integrator  name of an `Integrator`
    max_depth   maximum path length in segments, for integrators with a depth; N allows N - 1 shaded vertices
    sampler     a name in `SAMPLERS`
    seed        a 32-bit integer; equal seeds give bit-identical pictures
    ambient     ambient radiance of the scene, (r, g, b). Every shaded vertex adds `ambient` times the attribute
                "ambient" of the BSDF, if it has one (Phong's ka)
    radius      factor by which the default initial radius is multiplied, for an integrator that blurs
    measures    whether an integrator that blurs also measures its blur
    """

    integrator: str = "path"
    max_depth: int = 5
    sampler: str = "default"
    seed: int = 0
    ambient: tuple[float, ...] | None = None
    radius: float = 1.0
    measures: bool = False

    def __post_init__(self) -> None:
        check_sampler(self.sampler)
        if not 1 <= self.max_depth < 2**31:
            raise InputError(
                f"max_depth {self.max_depth}", "max_depth", "give 1 for lights only, 2 for direct light, and so on"
            )
        if not 0 <= self.seed < 2**32:
            raise InputError(f"seed {self.seed}", "seed", "give a whole number from 0 to 4294967295")
        _ = self.program

    @property
    def program(self) -> type[Integrator]:
        """The class of the integrator. Raises InputError for an unknown name."""
        return Integrator.family.get(self.integrator)


def check_sampler(name: str, location: str = "sampler") -> None:
    """Raise InputError, which names `location`, if there is no sampler with the given name."""
    if name not in SAMPLERS:
        raise InputError(f"unknown sampler '{name}'", location, did_you_mean(name, list(SAMPLERS)))


class Integrator:
    """Computes the quantity that a picture shows. The first line of the docstring of a subclass is its title.

        class Depth(Integrator):
            '''The distance to the visible surface, in units of the scene.'''

            name = "depth"

            def show(self, si, key, index):
                return self.mi.Color3f(si.t)

    A subclass implements `show`, which receives a surface, or `sample`, which may trace rays. A subclass that computes
    light transport derives from `LightTransport` or from `Path`. Its parameters and those of the scene must be kernel
    data (`dr.opaque`) instead of Python numbers; otherwise every change of a value recompiles the kernel.

    name           value of `--integrator` and of "integrator" in a scene
    takes_depth    whether `Settings.max_depth` applies; if so, a scene must define maxDepth
    samples_lobes  whether BSDFs are sampled in addition to the lights
    splats         whether samples contribute to other pixels than their own, as integers in units of `unit`
                   (`Sums.splats`)
    blurs          whether the picture has a bias that vanishes as the number of samples grows; this number must then be
                   the same for all pixels
    shrinking      exponent of the number of samples in the radius of the blur, a negative number
    measured       number of values that are computed per sample in addition to the color, see `differences`

    data, settings, mi  the data of the scene (`SceneData`), the settings, and Mitsuba with its variant
    """

    family: ClassVar[Family[type[Integrator]]]
    name: ClassVar[str] = ""
    takes_depth: ClassVar[bool] = False
    splats: ClassVar[bool] = False
    blurs: ClassVar[bool] = False
    unit: float = 1.0  # radiance of a splat with the value 1
    shrinking: ClassVar[float] = 0.0
    samples_lobes: ClassVar[bool] = True
    measured: int = 0

    def __init__(self, data: SceneData, settings: Settings):
        self.data, self.settings, self.mi = data, settings, data.mi

    # ------------------------------------------------------------------ a subclass implements one of these two

    def show(self, si: SurfaceInteraction, key: UInt, index: UInt) -> Color:
        """The color (r, g, b) of the surface that a sample hits. The result is ignored on lanes without a hit.

        key, index  key of the pixel and index of the sample: `self.pair(key, index, FIRST_FREE)` returns two random
                    numbers in [0, 1), and `self.direction_pair(...)` two random numbers for a direction
        """
        raise NotImplementedError(f"{type(self).__name__} has neither show nor sample")

    def sample(self, pixel: UInt, key: UInt, index: UInt) -> list[Float]:
        """The color of a sample, [r, g, b], followed by the albedo and the normal of the first surface if `aovs` is
        set.

        The albedo and the normal consist of three numbers each.
        """
        ray, _, hit = self.first_hit(pixel, key, index)
        si = self.surfaces.interaction(hit, ray)
        features = (0, 0, 0, *si.sh_frame.n) if self.data.aovs else ()
        return [dr.select(si.is_valid(), v, 0) for v in (*self.show(si, key, index), *features)]

    # ------------------------------------------------------------------ provided by this class

    def differences(self, measured: Picture, samples: int) -> list[Picture]:
        """The result of `Render.differences`, computed from the mean of the measured values over `samples` samples."""
        return []

    def stages(self, first: int, last: int) -> Iterator[tuple[int, int]]:
        """Divide samples [first, last) into kernel launches, and prepare the data of each before it is yielded."""
        yield first, last

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        """Add samples [first, last) of every pixel to the sums, in the order of the samples."""

        def step(index: UInt, sums: Sums) -> tuple[UInt, Sums]:
            values, every = self.sample(pixel, key, index), self.mi.Bool(True)
            return index + 1, sums.add(values[:3], every, values[3:], every)

        state = (first + dr.zeros(self.mi.UInt32, dr.width(pixel)), sums)
        return dr.while_loop(state, lambda i, _: i < last, step, mode="symbolic", label="samples")[1]

    def first_hit(self, pixel: UInt, key: UInt, index: UInt) -> tuple[Ray, Radiance, Hit]:
        """The camera ray of a sample, its weight, and its first hit."""
        return self.data.first_hit(pixel, key, index)

    def pair(self, key: UInt, index: UInt, dimension: UInt) -> tuple[Float, Float]:
        """Two random numbers in [0, 1) for a decision of a sample.

        dimension  number of the decision, at least FIRST_FREE
        """
        return self.data.pair(key, index, dimension)

    def direction_pair(self, key: UInt, index: UInt, dimension: UInt) -> tuple[Float, Float]:
        """Two random numbers in [0, 1) for the choice of a direction."""
        return self.data.direction_pair(key, index, dimension)

    @property
    def scene(self) -> Scene:
        """The Mitsuba scene."""
        return self.data.scene

    @property
    def sensor(self) -> Sensor:
        """The Mitsuba camera."""
        return self.data.sensor

    @property
    def surfaces(self) -> Surfaces:
        """The surfaces of the scene, with the methods `nearest`, `blocked` and `interaction`."""
        return self.data.surfaces

    def advice(self) -> str:
        """Advice to the user about the choice of this integrator for this scene; "" if there is none."""
        return ""


Integrator.family = Family("integrator", "gonio.integrators", [__package__], subclasses_of(Integrator))
