"""The calibration file: camera, sample, lamps and photographs, and their uncertainties.

All coordinates are in the frame of the camera: x points to the right in the picture, y downward, and z forward. Lengths
may be in any unit, which must be the same throughout. Pixel coordinates start at the upper left corner of the picture,
so the center of the first pixel is at (0.5, 0.5).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, model_validator

from ...bridge.types import Json
from ...errors import InputError
from ...scene.reader import explain
from ...scene.text import read_json
from ...scene.values import NonNegative, Number, Part, Positive, Vector, Whole, invalid, rgb

NAME = "calibration.json"  # in a folder of photographs
Floats = NDArray[np.float64]
Pair = tuple[Number, Number]
Light = Positive | tuple[Positive, Positive, Positive]


class Camera(Part):
    """A pinhole camera with radial distortion."""

    size: tuple[Whole, Whole]
    """[width, height] of a photograph, pixels."""
    focal: Positive
    """Focal length, in the unit of `pixel`."""
    pixel: Positive = 1.0
    """Distance between adjacent pixels on the sensor; if omitted, `focal` is in pixels."""
    principal: Pair | None = None
    """Point where the optical axis intersects the picture, pixels; the center of the picture if omitted."""
    k1: Number = 0.0
    """Radial distortion: x' = x (1 + k1 r^2 + k2 r^4), where x and y are divided by z (Brown1971, as in OpenCV)."""
    k2: Number = 0.0

    @property
    def focal_pixels(self) -> float:
        return self.focal / self.pixel

    @property
    def center(self) -> tuple[float, float]:
        return self.principal or (0.5 * self.size[0], 0.5 * self.size[1])


class Ball(Part):
    """A ball, given by its center or by its outline in the picture. If both are omitted, the outline is detected."""

    radius: Positive
    center: Vector | None = None
    outline: tuple[Number, Number, Positive] | None = None
    """[x, y, radius] of the outline, pixels."""

    @model_validator(mode="after")
    def _one_way(self) -> Ball:
        if self.center is not None and self.outline is not None:
            raise invalid("both center and outline are given", "keep one", "outline")
        if self.center is not None and np.linalg.norm(self.center) <= self.radius:
            raise invalid("the camera is inside the ball", "is center in the camera's frame?", "center")
        return self


class Flat(Part):
    """A flat sample: the parallelogram of points base + s edge0 + t edge1, with s and t from 0 to 1."""

    base: Vector
    edge0: Vector
    edge1: Vector

    @model_validator(mode="after")
    def _spans_a_plane(self) -> Flat:
        area = np.linalg.norm(np.cross(self.edge0, self.edge1))
        if area <= 1e-9 * np.linalg.norm(self.edge0) * np.linalg.norm(self.edge1):
            raise invalid("edge0 and edge1 span no plane", "rotate one of them", "edge1")
        return self


class Reference(Flat):
    """A flat white Lambertian target, from which the intensities of the lamps are determined."""

    albedo: Light
    """Diffuse reflectance of the target, such as 0.99."""


class Lamp(Part):
    """A lamp whose size is small compared to its distance from the sample."""

    position: Vector | None = None
    """Position of the lamp; if omitted, it is determined from the mirror balls."""
    distance: Positive | None = None
    """Distance from the center of the ball; required if there is only one mirror ball."""
    intensity: Light | None = None
    """Radiant intensity, a number or [r, g, b], in units such that a pixel has the value
    f cos theta_i intensity / distance^2 times the exposure time in seconds. If omitted, it is determined from a
    photograph of the reference."""


class Exposure(Part):
    """A picture and its exposure time. If `seconds` is omitted, it is read from the picture file."""

    file: str = Field(min_length=1)
    seconds: Positive | None = None


class Shot(Part):
    """A photograph: one picture, or a series of several exposures of one view."""

    file: str | None = Field(default=None, min_length=1)
    seconds: Positive | None = None
    exposures: list[Exposure] = Field(default_factory=list)
    light: str = "lamp"
    """Name of the lamp in `lights` that was on."""
    sample: Literal["ball", "flat", "reference"] = "ball"

    @model_validator(mode="after")
    def _some_file(self) -> Shot:
        if (self.file is None) == (not self.exposures):
            raise invalid("exactly one of file and exposures expected", 'such as {"file": "a.exr", "seconds": 0.1}')
        return self

    @property
    def pictures(self) -> list[Exposure]:
        return self.exposures or [Exposure(file=self.file or "", seconds=self.seconds)]


class Uncertainty(Part):
    """Standard deviations of the calibration. Omitted quantities count as exact, but if the outline of the ball is
    detected, its uncertainty is that of the detection."""

    light: NonNegative = 0.0
    """Standard deviation of a lamp's direction along each axis, degrees."""
    intensity: NonNegative = 0.0
    """Relative standard deviation of each lamp's intensity."""
    scale: NonNegative = 0.0
    """Relative standard deviation of a scale factor common to all intensities."""
    seconds: NonNegative = 0.0
    """Relative standard deviation of each exposure time. Its error is the same in all series with this setting."""
    center: NonNegative | None = None
    """Standard deviation of the ball's center along each axis, pixels."""
    radius: NonNegative | None = None
    """Relative standard deviation of the ball's radius in the picture."""


class Calibration(Part):
    """The setup with which the photographs were taken, and its uncertainty."""

    camera: Camera
    response: Literal["linear", "srgb"] | list[Pair] = "linear"
    """Response of files with integer values: linear, sRGB, or a curve of [value, light] pairs from [0, 0] to [1, 1].
    Files with floating-point values are linear."""
    saturation: Annotated[Number, Field(gt=0, le=1)] = 0.99
    """Value at and above which a pixel of a file with integer values is saturated."""
    ball: Ball | None = None
    flat: Flat | None = None
    reference: Reference | None = None
    mirrors: list[Ball] = Field(default_factory=list)
    """Mirror balls in the pictures."""
    lights: dict[str, Lamp]
    photographs: list[Shot]
    """The photographs, in any order; empty if Gonio is to plan the first ones."""
    uncertainty: Uncertainty = Uncertainty()

    @model_validator(mode="after")
    def _complete(self) -> Calibration:
        for shot in self.photographs:
            if shot.light not in self.lights:
                raise invalid(f"no light '{shot.light}'", "known: " + ", ".join(self.lights), "photographs")
            if getattr(self, shot.sample) is None:
                raise invalid(f"a photograph shows the {shot.sample}, which is not described", f'add "{shot.sample}"')
        if isinstance(self.response, list):
            curve = np.array(self.response)
            steps = np.diff(curve, axis=0)
            if len(curve) < 2 or np.any(steps <= 0.0) or not np.allclose(curve[[0, -1]], [[0, 0], [1, 1]]):
                raise invalid("the curve does not rise from [0, 0] to [1, 1]", "sort and scale it", "response")
        return self

    def intensity(self, light: str) -> Floats | None:
        """The intensity of a lamp, (3,); None if it is not given."""
        given = self.lights[light].intensity
        return None if given is None else np.array(rgb(given))


def read(path: Path) -> Calibration:
    """Read a calibration file. Raises InputError if anything in it is invalid."""
    if not path.is_file():
        raise InputError("no calibration file", str(path), f"name one with --calibration, or add {NAME} to the folder")
    return made(read_json(path), path)


def made(raw: Mapping[str, Json], path: Path) -> Calibration:
    """A calibration from the JSON contents of a calibration file, as `read` returns it.

    path  the file, for errors and for relative paths
    """
    given = json.loads(json.dumps(dict(raw)))
    try:
        return Calibration.model_validate(given)
    except ValidationError as error:
        explained = explain(error, given, path)
        raise InputError(
            explained.what, explained.where, explained.hint.replace("`gonio schema`", "docs/capture.md")
        ) from None
