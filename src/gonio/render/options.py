"""The options of a render, shared by requests, `go.render`, `go.study` and the command line.

`RenderOptions` declares the options, with their help texts. `RenderKeywords` repeats their types, because type checkers
cannot derive the types of `**options` from a class. This module imports only small modules, because
`gonio render --help` loads it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple, TypedDict

from ..arguments import takes_fields


class Shown(NamedTuple):
    """The help of an option: the placeholder for its value ("" for a flag), and a description."""

    metavar: str
    help: str


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)  # fewer methods to compile whenever `gonio` starts
class RenderOptions:
    """The options of a render. For None, the value in the scene is used."""

    spp: Annotated[int | None, Shown("N", "Samples per pixel.")] = None
    size: Annotated[tuple[int, int] | None, Shown("WxH", "Film size in pixels, such as 640x480.")] = None
    integrator: Annotated[
        str | None, Shown("NAME", "Integrator: direct, path, caustics, light, normal, ... or FILE.py:CLASS.")
    ] = None
    max_depth: Annotated[
        int | None, Shown("N", "Maximum path length, for the integrators path, caustics and light.")
    ] = None
    sampler: Annotated[str | None, Shown("NAME", "Random-number sampler: sobol, independent, ...")] = None
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
    allow_code: Annotated[bool, Shown("", "Allow the scene to run the Python files and plugins it refers to.")] = False


class RenderKeywords(TypedDict, total=False):
    """The fields of `RenderOptions` as keyword arguments, for type checkers."""

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
