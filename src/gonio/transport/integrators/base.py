"""What an integrator is: the program that the kernel runs for every sample of a pixel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...bridge.types import Colour, Float, Hit, Mask, Point, Radiance, Ray, Scene, Sensor, SurfaceInteraction, UInt
from ...errors import InputError, did_you_mean
from ...members import Family, subclasses_of
from .. import sampler
from ..surfaces import Surfaces
from .sums import Sums

Picture = NDArray[np.float32]

# Dimensions: each decision of a sample has a number of its own, see `sampler`. From FIRST_FREE on they are the
# integrator's.
PIXEL, TIME, APERTURE, FIRST_FREE = 0, 1, 2, 3

NEARLY = 1e-6  # of a distance: as far as float32 tells it from the next

# The integral of the CIE 1931 luminosity curve as Mitsuba tabulates it (nm): white of radiance 1 has Y = 1.
CIE_Y_INTEGRAL = 106.7502593994140625

SAMPLERS: dict[str, str] = {
    "default": f"what measures best: {sampler.DEFAULT[0]} for pixels and lamps, {sampler.DEFAULT[1]} for directions",
    **sampler.SAMPLERS,
}


@dataclass(frozen=True)
class Settings:
    """How to render.

    integrator  the name of an `Integrator`
    max_depth   for integrators that take a depth: the longest path in segments, so N gives N - 1 shaded vertices
    sampler     a name of `SAMPLERS`
    seed        any integer of 32 bits; the same seed gives the same picture to the bit
    ambient     scene-wide ambient radiance (r, g, b): at every shaded vertex adds `ambient` times the BSDF's own
                attribute "ambient", where it has one (Phong's ka)
    radius      of an integrator that blurs: how wide it begins, over what it would choose
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
                f"max_depth {self.max_depth}", "max_depth", "1 shows lights only, 2 direct light, and so on"
            )
        if not 0 <= self.seed < 2**32:
            raise InputError(f"seed {self.seed}", "seed", "a whole number from 0 to 4294967295")
        _ = self.program

    @property
    def program(self) -> type[Integrator]:
        """The integrator's class. InputError where there is none of that name."""
        return Integrator.family.get(self.integrator)


def check_sampler(name: str, where: str = "sampler") -> None:
    """Raise InputError where no sampler has that name."""
    if name not in SAMPLERS:
        raise InputError(f"unknown sampler '{name}'", where, did_you_mean(name, list(SAMPLERS)))


class Integrator:
    """What a picture shows. Its docstring's first line is its title.

        class Depth(Integrator):
            '''The distance to what is seen, in units of the scene.'''

            name = "depth"

            def show(self, si, key, index):
                return self.mi.Color3f(si.t)

    A subclass writes `show`, which sees one surface, or `sample`, which may trace rays of its own; one that follows
    light derives from `Transport`. Its parameters and the scene's must reach the kernel as data (`dr.opaque`), not as
    Python numbers: else a changed value compiles again.

    name         as `--integrator` and a scene's "integrator" have it
    takes_depth  whether `Settings.max_depth` means something: then a scene must give maxDepth
    splats       whether a sample adds to other pixels than its own, in whole numbers of `unit` (`Sums.splats`)
    blurs        whether its bias goes away with the number of samples, of which all pixels then need as many
    """

    family: ClassVar[Family[type[Integrator]]]
    name: ClassVar[str] = ""
    takes_depth: ClassVar[bool] = False
    splats: ClassVar[bool] = False
    blurs: ClassVar[bool] = False
    unit: float = 1.0  # what one of its splats counts
    shrinking: ClassVar[float] = 0.0  # power of the number of samples by which the radius of a blur goes to 0
    measured: int = 0  # numbers that it finds of each sample beside its colour, see `differences`

    def __init__(self, mi: ModuleType, scene: Scene, sensor: Sensor, settings: Settings, aovs: bool):
        self.mi, self.scene, self.sensor, self.settings, self.aovs = mi, scene, sensor, settings, aovs
        names = sampler.DEFAULT if settings.sampler == "default" else [settings.sampler] * 2
        self.pair, self.direction_pair = (sampler.PAIRS[name] for name in names)
        self.surfaces = Surfaces(mi, scene)
        size = sensor.film().crop_size()
        self.width = dr.opaque(mi.UInt32, int(size[0]))
        self.inverse_size = (dr.opaque(mi.Float, 1 / size[0]), dr.opaque(mi.Float, 1 / size[1]))

    # ------------------------------------------------------------------ what a subclass writes, one of these two

    def show(self, si: SurfaceInteraction, key: UInt, index: UInt) -> Colour:
        """The colour (r, g, b) of the surface that a sample sees; where it sees none, what is returned is left out.

        key, index  of the pixel and of its sample: `self.pair(key, index, FIRST_FREE)` gives two numbers in [0, 1), and
                    `self.direction_pair(...)` two for a direction
        """
        raise NotImplementedError(f"{type(self).__name__} has neither show nor sample")

    def sample(self, pixel: UInt, key: UInt, index: UInt) -> list[Float]:
        """[r, g, b] of a sample; with `aovs` also albedo and normal of what it sees first, three numbers each."""
        ray, _, hit = self.first_hit(pixel, key, index)
        si = self.surfaces.interaction(hit, ray)
        features = (0, 0, 0, *si.sh_frame.n) if self.aovs else ()
        return [dr.select(si.is_valid(), v, 0) for v in (*self.show(si, key, index), *features)]

    # ------------------------------------------------------------------ what it has

    def differences(self, measured: Picture, samples: int) -> list[Picture]:
        """`Render.differences`, from the mean of what so many samples have measured: (height, width, `measured`)."""
        return []

    def stages(self, first: int, last: int) -> Iterator[tuple[int, int]]:
        """Samples [first, last) cut into what one kernel takes: what it needs is there when it is asked for."""
        yield first, last

    def accumulate(self, pixel: UInt, key: UInt, first: UInt, last: UInt, sums: Sums) -> Sums:
        """Add samples [first, last) of every pixel to the sums, each sum in the order of the samples."""

        def step(index: UInt, sums: Sums) -> tuple[UInt, Sums]:
            values, every = self.sample(pixel, key, index), self.mi.Bool(True)
            return index + 1, sums.add(values[:3], every, values[3:], every)

        state = (first + dr.zeros(self.mi.UInt32, dr.width(pixel)), sums)
        return dr.while_loop(state, lambda i, _: i < last, step, mode="symbolic", label="samples")[1]

    def first_hit(self, pixel: UInt, key: UInt, index: UInt, active: Mask = True) -> tuple[Ray, Radiance, Hit]:
        """A sample's camera ray, its weight, and the first thing that it meets."""
        ray, weight = self.camera_ray(pixel, key, index)
        ray = self.mi.Ray3f(ray)
        return ray, weight, self.surfaces.nearest(ray, active, coherent=True)

    def camera_ray(self, pixel: UInt, key: UInt, index: UInt) -> tuple[Ray, Radiance]:
        """A ray through a point of the pixel, and its weight."""
        mi = self.mi
        row = pixel // self.width
        column = pixel - row * self.width
        x, y = self.pair(key, index, PIXEL)
        position = mi.Point2f((mi.Float(column) + x) * self.inverse_size[0], (mi.Float(row) + y) * self.inverse_size[1])
        own, time = self.pair(key, index, TIME)
        wavelength = self.hue(index, own)
        aperture = mi.Point2f(0.5)
        if self.sensor.needs_aperture_sample():
            aperture = mi.Point2f(*self.pair(key, index, APERTURE))
        time = self.sensor.shutter_open() + time * self.sensor.shutter_open_time()
        return self.sensor.sample_ray(time, wavelength, position, aperture)

    def hue(self, index: UInt, own: Float) -> Float:
        """The number in [0, 1) that chooses a sample's wavelengths; `own` is one that no other sample has."""
        return own

    def advice(self) -> str:
        """What to tell a person who chose it for this scene; "" is nothing."""
        return ""

    def unoccluded(self, si: SurfaceInteraction, point: Point, active: Mask) -> Mask:
        """Lanes whose surface sees the point, which is on none itself."""
        ray = si.spawn_ray_to(point)
        # To the very point: Mitsuba's rays end a thousandth of the way before, through what is so close to a lamp.
        ray.maxt = dr.norm(point - ray.o) * (1 - NEARLY)
        return active & ~self.surfaces.blocked(ray, active)

    def rgb(self, radiance: Radiance, wavelengths: Sequence[Float]) -> Colour:
        """Radiance at a sample's wavelengths as linear RGB."""
        mi = self.mi
        if mi.is_spectral:
            responses = [mi.cie1931_xyz(wavelength) * r for wavelength, r in zip(wavelengths, radiance, strict=True)]
            return mi.xyz_to_srgb(sum(responses) / (len(responses) * CIE_Y_INTEGRAL))
        if mi.is_monochromatic:
            return mi.Color3f(radiance[0])
        return radiance


Integrator.family = Family("integrator", "gonio.integrators", [__package__], subclasses_of(Integrator))
