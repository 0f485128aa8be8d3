"""The measurements for an engine: white furnaces, trials that isolate a cause, and the causes.

The text of a cause names functions and tables of the engine. `{name}` in it is replaced by that value of the trials.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import gonio as go
import numpy as np
from gonio.material import BSDF

COSINES = (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)
ROUGHNESSES = (0.1, 0.25, 0.5, 0.75, 1.0)
Make = Callable[..., BSDF]  # constructs a material from its parameters


class Furnace(NamedTuple):
    """A white furnace: the material, and its parameters as a function of roughness.

    title    key in cards.json and in the output of the programs
    heading  name on the page and in the picture; if empty, the title is used
    """

    title: str
    material: str
    parameters: Callable[[float], dict[str, float]]
    heading: str = ""

    @property
    def label(self) -> str:
        """The name on the page and in the picture."""
        return self.heading or self.title


class Engine(NamedTuple):
    """The measurements for an engine, and the texts of its report card.

    package    name of the npm package
    page       name of the page, its picture and its programs, without suffix
    title      name of the engine; `home` is the address of its repository
    intro      sentences above the tables
    materials  the shaders to verify
    furnaces   white furnaces, one table each; `remarks` on them are keyed by title
    trials     maps the folder of the adopted shaders to values that isolate causes
    sections   maps these values, keyed by version, to further sections of the page
    causes     cause and remedy, keyed by (material, law) or (material, law, version)
    programs   files of report-cards/engines/programs that reproduce findings without Gonio
    origin     where a release comes from, as printed on the page
    source     the tested release as printed on the page, with `{version}`; if empty, package, release and origin
    again      for an engine that is not on npm: commands that create the folder of shaders, with `{version}`
    made       whether the folder of a release already contains the shaders and adapters
    language   suffix of the shaders
    laws       the laws to test; all laws if empty
    tsl        whether the TSL build is measured, too
    """

    package: str
    page: str
    title: str
    home: str
    intro: str
    materials: tuple[str, ...]
    furnaces: tuple[Furnace, ...]
    remarks: Mapping[str, str]
    trials: Callable[[Path], dict[str, float]]
    sections: Callable[[dict[str, dict[str, float]]], str]
    causes: Mapping[tuple[str, ...], str]
    programs: tuple[str, ...]
    origin: str = "npm"
    source: str = ""
    again: str = ""
    made: bool = False
    language: str = "glsl"
    laws: tuple[str, ...] = ()
    tsl: bool = False


def material(folder: Path, name: str, **parameters: float) -> Any:
    """A material of an adopted package."""
    return go.Shader(shader(folder, name), **parameters)


def shader(folder: Path, name: str) -> Path:
    """Path of a material's shader file."""
    return next(one for one in (folder / f"{name}.glsl", folder / f"{name}.wgsl") if one.is_file())


def furnace(one: BSDF, cosines: tuple[float, ...] = COSINES) -> list[float]:
    """Directional albedo of the first channel at each cosine of the view angle."""
    return [float(value) for value in np.asarray(go.albedo(one, mu=list(cosines)).value)[..., 0]]


@functools.cache
def single_scattering(roughness: float, cosines: tuple[float, ...]) -> list[float]:
    """Directional albedo E of GGX with the height-correlated Smith term and F = 1."""
    return furnace(go.Metal(r0=1.0, edge=1.0, alpha=roughness * roughness), cosines)


def asymmetry(one: BSDF, count: int = 4000) -> float:
    """Largest relative difference between f(wo, wi) and f(wi, wo), for directions up to 89 degrees."""
    wo, wi = _pairs(count)
    return _apart(*(np.asarray(one.f(*pair, precision="float64")) for pair in ((wo, wi), (wi, wo))))


def difference(one: BSDF, other: BSDF, count: int = 4000) -> float:
    """Largest relative difference between two materials, for directions up to 89 degrees."""
    return _apart(*(np.asarray(each.eval(*_pairs(count), precision="float64")) for each in (one, other)))


def _pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(1)

    def directions() -> np.ndarray:
        z, phi = random.uniform(0.02, 1.0, count), random.uniform(0.0, 2.0 * np.pi, count)
        r = np.sqrt(1.0 - z * z)
        return np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)

    return directions(), directions()


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.max(np.abs(one - other) / np.maximum(np.maximum(np.abs(one), np.abs(other)), 1e-12)))
