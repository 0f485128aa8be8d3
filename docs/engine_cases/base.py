"""What is measured of an engine: white furnaces, trials that isolate a cause, and the causes.

A cause names functions and tables of the engine. Figures in it come from the trials; `{name}` stands for one.
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
Make = Callable[..., BSDF]  # a material of a class by its parameters


class Furnace(NamedTuple):
    """A white furnace: the material, and its parameters for a roughness.

    title    its key in cards.json and in the output of the programs
    heading  its name on the page and in the picture; empty: the title
    """

    title: str
    material: str
    parameters: Callable[[float], dict[str, float]]
    heading: str = ""

    @property
    def label(self) -> str:
        """The name to print."""
        return self.heading or self.title


class Engine(NamedTuple):
    """What is measured of an engine.

    package    of npm
    page       name of the page, its picture and its programs, without suffix
    title      and `home`, the address of the repository
    intro      sentences above the tables
    materials  the shaders to verify
    furnaces   white furnaces, one table each; `remarks` on them, by title
    trials     folder of the adopted shaders -> figures that isolate causes
    sections   figures by version -> further sections of the page
    causes     (material, law) or (material, law, version) -> cause and remedy
    programs   files of report-cards/engines/programs that show it without Gonio
    origin     where a release comes from, as the page words it
    source     the first words of the page with `{version}` in them; empty: package, release and origin
    again      for an engine that is not on npm: the commands that make the folder of shaders, `{version}` in them
    made       the folder of a release holds the shaders and adapters themselves
    language   suffix of the shaders
    laws       the laws to judge by, all if empty
    tsl        its TSL build is measured too
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
    """The file of a material."""
    return next(one for one in (folder / f"{name}.glsl", folder / f"{name}.wgsl") if one.is_file())


def furnace(one: BSDF, cosines: tuple[float, ...] = COSINES) -> list[float]:
    """Albedo of the first channel at each cosine."""
    return [float(value) for value in np.asarray(go.albedo(one, mu=list(cosines)).value)[..., 0]]


@functools.cache
def single_scattering(roughness: float, cosines: tuple[float, ...]) -> list[float]:
    """E of GGX with the height-correlated Smith term at F = 1."""
    return furnace(go.Metal(r0=1.0, edge=1.0, alpha=roughness * roughness), cosines)


def asymmetry(one: BSDF, count: int = 4000) -> float:
    """Largest relative difference of f(wo, wi) and f(wi, wo), of pairs to 89 degrees."""
    wo, wi = _pairs(count)
    return _apart(*(np.asarray(one.f(*pair, precision="float64")) for pair in ((wo, wi), (wi, wo))))


def difference(one: BSDF, other: BSDF, count: int = 4000) -> float:
    """Largest relative difference of two materials, of pairs to 89 degrees."""
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
