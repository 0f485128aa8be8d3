"""The options of a render, shared by requests, `go.render`, `go.study` and the command line.

`RenderOptions` declares them, with their help texts. `RenderKeywords` repeats their types for type checks of
`**options`, since Python cannot derive them from a class. This module imports nothing large, since
`gonio render --help` loads it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple, TypedDict

from ..arguments import takes_fields


class Shown(NamedTuple):
    """The help of an option: the placeholder of its value ("" for a flag) and a description."""

    metavar: str
    help: str


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)  # fewer methods to compile whenever `gonio` starts
class RenderOptions:
    """Options of a render; None selects the scene's value."""

    spp: Annotated[int | None, Shown("N", "Samples per pixel.")] = None
    size: Annotated[tuple[int, int] | None, Shown("WxH", "Film size in pixels, such as 640x480.")] = None
    integrator: Annotated[str | None, Shown("NAME", "Integrator: direct, path, caustics, light, normal, ...")] = None
    max_depth: Annotated[
        int | None, Shown("N", "Maximum path length, for the integrators path, caustics and light.")
    ] = None
    sampler: Annotated[str | None, Shown("NAME", "Sampler of random numbers: sobol, independent, ...")] = None
    seed: Annotated[int | None, Shown("N", "Seed of all random numbers; the same seed gives the same result.")] = None
    device: Annotated[str, Shown("cpu|cuda|auto", "Device to compute on; auto selects cuda if it is available.")] = (
        "cpu"
    )
    spectral: Annotated[bool, Shown("", "Render with wavelengths instead of RGB, so that glass disperses light.")] = (
        False
    )
    threads: Annotated[int | None, Shown("N", "Number of CPU cores to use; all by default.")] = None
    denoise: Annotated[bool, Shown("", "Remove noise with Open Image Denoise.")] = False
    exposure: Annotated[
        float | Literal["auto"], Shown("EV|auto", "Exposure of a .png file in stops; auto derives it from the picture.")
    ] = 0.0
    allow_outside: Annotated[bool, Shown("", "Allow the scene to read files outside its folder.")] = False
    allow_code: Annotated[bool, Shown("", "Allow the scene to run the Python files and plugins that it names.")] = False


class RenderKeywords(TypedDict, total=False):
    """The types of `RenderOptions` as keywords."""

    spp: int | None
    size: tuple[int, int] | None
    integrator: str | None
    max_depth: int | None
    sampler: str | None
    seed: int | None
    device: str
    spectral: bool
    threads: int | None
    denoise: bool
    exposure: float | Literal["auto"]
    allow_outside: bool
    allow_code: bool


takes_render_options = takes_fields(RenderOptions, RenderKeywords)
