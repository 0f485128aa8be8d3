"""The request for a render, as the command line and `go.render` create it."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from .. import files
from ..errors import InputError
from ..material import BSDF
from ..pictures import denoise, exposures, images
from ..scene.film_size import check_film
from .options import RenderOptions

MAX_COUNT = 1 << 30  # maximum number of samples per pixel and of path segments, which kernels count in 32 bits
MAX_SPP_UNTIL = 1 << 16  # default limit of samples per pixel for `until_error`
MAX_THREADS = 1024


@dataclass(frozen=True)
class Request(RenderOptions):
    """A request for a render: the scene or material, and the options."""

    scene: Path  # the name of the material if there is no scene
    output: Path | None = None
    timeout: float | None = None
    overrides: Mapping[str, object] = field(default_factory=dict)
    material: BSDF | None = None  # shown on a ball, in place of a scene
    checkpoint: Path | None = None  # file of the accumulated samples; if it exists, the render continues from it
    until_error: float | None = None  # relMSE at which to stop; `spp` is then the maximum
    gradient: tuple[str, ...] = ()  # paths of values in the scene with respect to which the picture is differentiated

    @property
    def is_mitsuba(self) -> bool:
        """Whether the scene is a Mitsuba XML file."""
        return self.material is None and self.scene.suffix.lower() == ".xml" and os.path.isfile(self.scene)

    def check(self) -> None:
        """Raise InputError for an invalid option, before anything is loaded."""
        if self.spp is not None and not 1 <= self.spp <= MAX_COUNT:
            raise InputError(f"{self.spp} samples per pixel", "--spp", f"give 1 to {MAX_COUNT}")
        if self.max_depth is not None and not 1 <= self.max_depth <= MAX_COUNT:
            raise InputError(f"depth {self.max_depth}", "--max-depth", f"give 1 to {MAX_COUNT}")
        if self.seed is not None and not 0 <= self.seed < 1 << 32:
            raise InputError(f"seed {self.seed} is out of range", "--seed", "give 0 to 4294967295")
        if self.threads is not None and not 1 <= self.threads <= MAX_THREADS:
            raise InputError(f"{self.threads} threads requested", "--threads", f"give 1 to {MAX_THREADS}")
        if self.timeout is not None and not self.timeout > 0:
            raise InputError(f"a time limit of {self.timeout:g} seconds", "--timeout", "give more than 0")
        if self.until_error is not None:
            check_error(self.until_error, self.spp)
        for option, given in (
            ("denoise", self.denoise),
            ("until_error", self.until_error),
            ("spectral", self.spectral),
        ):
            if self.gradient and given:
                raise InputError(f"{option} and derivatives cannot be combined", "gradient", f"leave {option} out")
        exposures.check(self.exposure)
        if self.size is not None:
            check_film(self.size, "--size")
        if self.denoise:
            denoise.require()
        if self.output is not None:
            images.check_writable(self.output)
        if self.checkpoint is not None:
            files.check_file(self.checkpoint)


def check_error(error: float, spp: int | None) -> None:
    """Raise InputError for a requested error that is not positive and finite, or for too few samples to estimate it."""
    if not (math.isfinite(error) and error > 0.0):
        raise InputError(f"a relMSE of {error:g}", "--until-error", "give more than 0, such as 0.01")
    if spp == 1:
        raise InputError("one sample per pixel gives no error estimate", "--until-error", "give --spp 2 or more")


def parse_size(text: str) -> tuple[int, int]:
    """Parse a size such as "640x480" to (width, height)."""
    match = re.fullmatch(r"\s*(\d{1,9})\s*[xX×]\s*(\d{1,9})\s*", text)  # noqa: RUF001 - people paste it
    if not match:
        raise InputError(f"'{text}' is not a size", "--size", "give width x height in pixels, such as 640x480")
    return int(match[1]), int(match[2])
