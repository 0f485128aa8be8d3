"""Camera rays through the pixels of a film."""

from __future__ import annotations

from types import ModuleType

import drjit as dr

from ..bridge.types import Float, Radiance, Ray, Sensor, UInt
from .sampler import PairFunction

# The sample dimensions of the camera. Each random decision of a sample has its own dimension, see `sampler`.
PIXEL, TIME, APERTURE, FIRST_FREE = 0, 1, 2, 3


class Camera:
    """The sensor of a scene; `width` is that of its film, in pixels."""

    def __init__(self, mi: ModuleType, sensor: Sensor, pair: PairFunction) -> None:
        self.mi, self.sensor, self.pair = mi, sensor, pair
        size = sensor.film().crop_size()
        self.width = dr.opaque(mi.UInt32, int(size[0]))
        self.inverse_size = (dr.opaque(mi.Float, 1 / size[0]), dr.opaque(mi.Float, 1 / size[1]))

    def ray(self, pixel: UInt, key: UInt, index: UInt, wavelength: Float | None = None) -> tuple[Ray, Radiance]:
        """A ray through a random point of the pixel, and its weight.

        key, index  key of the pixel and index of the sample, see `sampler`
        wavelength  a number in [0, 1) that selects the wavelengths; None selects different wavelengths for every sample
        """
        mi = self.mi
        row = pixel // self.width
        column = pixel - row * self.width
        x, y = self.pair(key, index, PIXEL)
        position = mi.Point2f((mi.Float(column) + x) * self.inverse_size[0], (mi.Float(row) + y) * self.inverse_size[1])
        own, time = self.pair(key, index, TIME)
        aperture = mi.Point2f(0.5)
        if self.sensor.needs_aperture_sample():
            aperture = mi.Point2f(*self.pair(key, index, APERTURE))
        time = self.sensor.shutter_open() + time * self.sensor.shutter_open_time()
        return self.sensor.sample_ray(time, own if wavelength is None else wavelength, position, aperture)
