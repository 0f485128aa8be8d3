"""The base class of integrators: the program that the kernel runs for every sample of a pixel."""

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
    """Options of a render.

    integrator  the name of an `Integrator`
    max_depth   for integrators that take a depth: maximum path length in segments; N allows N - 1 shaded vertices
    sampler     a name of `SAMPLERS`
    seed        an integer of 32 bits; the same seed gives a bit-identical picture
    ambient     scene-wide ambient radiance (r, g, b): every shaded vertex adds `ambient` times the BSDF's own
                attribute "ambient", if it has one (Phong's ka)
    radius      factor applied to the default initial radius of an integrator that blurs
    measures    whether such an integrator also measures its blur
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
        """The integrator's class. Raises InputError for an unknown name."""
        return Integrator.family.get(self.integrator)


def check_sampler(name: str, location: str = "sampler") -> None:
    """Raise InputError if no sampler has that name; `location` is the place that the error names."""
    if name not in SAMPLERS:
        raise InputError(f"unknown sampler '{name}'", location, did_you_mean(name, list(SAMPLERS)))


class Integrator:
    """Computes what a picture shows. The first line of its docstring is its title.

        class Depth(Integrator):
            '''The distance to the visible surface, in units of the scene.'''

            name = "depth"

            def show(self, si, key, index):
                return self.mi.Color3f(si.t)

    A subclass implements `show`, which gets one surface, or `sample`, which may trace rays; a subclass that follows
    light derives from `LightTransport` or from `Path`. Its parameters and the scene's must reach the kernel as data
    (`dr.opaque`), not as Python numbers; otherwise each changed value recompiles the kernel.

    name           value of `--integrator` and of a scene's "integrator"
    takes_depth    whether `Settings.max_depth` applies; if so, a scene must give maxDepth
    samples_lobes  whether BSDFs are sampled in addition to the lights
    splats         whether a sample adds to pixels other than its own, as integers of size `unit` (`Sums.splats`)
    blurs          whether it has a bias that vanishes as the number of samples grows; this number must then be equal
                   for all pixels
    shrinking      exponent of the number of samples in the radius of the blur, negative
    measured       how many numbers it computes per sample besides the color, see `differences`

    data, settings, mi  the scene's data (`SceneData`), the options, and Mitsuba with its variant
    """

    family: ClassVar[Family[type[Integrator]]]
    name: ClassVar[str] = ""
    takes_depth: ClassVar[bool] = False
    splats: ClassVar[bool] = False
    blurs: ClassVar[bool] = False
    unit: float = 1.0  # radiance of one unit of the splats
    shrinking: ClassVar[float] = 0.0
    samples_lobes: ClassVar[bool] = True
    measured: int = 0

    def __init__(self, data: SceneData, settings: Settings):
        self.data, self.settings, self.mi = data, settings, data.mi

    # ------------------------------------------------------------------ a subclass implements one of these two

    def show(self, si: SurfaceInteraction, key: UInt, index: UInt) -> Color:
        """The color (r, g, b) of the surface that a sample hits; the result is ignored on lanes without a hit.

        key, index  key of the pixel and index of its sample: `self.pair(key, index, FIRST_FREE)` gives two numbers in
                    [0, 1), and `self.direction_pair(...)` two for a direction
        """
        raise NotImplementedError(f"{type(self).__name__} has neither show nor sample")

    def sample(self, pixel: UInt, key: UInt, index: UInt) -> list[Float]:
        """[r, g, b] of a sample; with `aovs`, followed by albedo and normal of its first surface, three numbers
        each."""
        ray, _, hit = self.first_hit(pixel, key, index)
        si = self.surfaces.interaction(hit, ray)
        features = (0, 0, 0, *si.sh_frame.n) if self.data.aovs else ()
        return [dr.select(si.is_valid(), v, 0) for v in (*self.show(si, key, index), *features)]

    # ------------------------------------------------------------------ provided by this class

    def differences(self, measured: Picture, samples: int) -> list[Picture]:
        """The result of `Render.differences`, from the mean of the measured numbers over `samples` samples."""
        return []

    def stages(self, first: int, last: int) -> Iterator[tuple[int, int]]:
        """Samples [first, last) divided into kernel launches; the data of each is prepared before it is yielded."""
        yield first, last

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        """Add samples [first, last) of every pixel to the sums, each sum in the order of the samples."""

        def step(index: UInt, sums: Sums) -> tuple[UInt, Sums]:
            values, every = self.sample(pixel, key, index), self.mi.Bool(True)
            return index + 1, sums.add(values[:3], every, values[3:], every)

        state = (first + dr.zeros(self.mi.UInt32, dr.width(pixel)), sums)
        return dr.while_loop(state, lambda i, _: i < last, step, mode="symbolic", label="samples")[1]

    def first_hit(self, pixel: UInt, key: UInt, index: UInt) -> tuple[Ray, Radiance, Hit]:
        """A sample's camera ray, its weight, and its first hit."""
        return self.data.first_hit(pixel, key, index)

    def pair(self, key: UInt, index: UInt, dimension: UInt) -> tuple[Float, Float]:
        """Two numbers in [0, 1) for one decision of a sample; `dimension` identifies the decision, from FIRST_FREE."""
        return self.data.pair(key, index, dimension)

    def direction_pair(self, key: UInt, index: UInt, dimension: UInt) -> tuple[Float, Float]:
        """Two numbers in [0, 1) for a decision about a direction."""
        return self.data.direction_pair(key, index, dimension)

    @property
    def scene(self) -> Scene:
        """Mitsuba's scene."""
        return self.data.scene

    @property
    def sensor(self) -> Sensor:
        """Mitsuba's camera."""
        return self.data.sensor

    @property
    def surfaces(self) -> Surfaces:
        """The surfaces that rays hit: `nearest`, `blocked`, `interaction`."""
        return self.data.surfaces

    def advice(self) -> str:
        """Advice to a user who chose this integrator for this scene; "" if there is none."""
        return ""


Integrator.family = Family("integrator", "gonio.integrators", [__package__], subclasses_of(Integrator))
