"""A library of a hundred materials: published parametric fits to the measured BRDFs of the MERL database.

    go.material("alum-bronze")                                  the fit of Bagher2012, a `shifted-gamma`
    go.material("alum-bronze", fit="low2012/lowsmooth_E2")      another fit, FILE/FIT; go.fits("alum-bronze") lists them

On the command line and in scenes, the second is written alum-bronze:low2012/lowsmooth_E2. The files in `published/`
contain the values as printed, and this module converts them to parameters. Every fit is also a preset of its model.
"""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from ..errors import InputError, did_you_mean
from ..material import model, models
from ..material.bsdf import BSDF, Preset
from ..material.parameters import Value

Figures: TypeAlias = "dict[str, Value]"  # values as printed, by their names in the publication

FILES = ("bagher2012", "low2012", "ngan2005")
DEFAULT = "bagher2012/sgd"  # the most recent fit, which includes all hundred materials
_FOLDER = Path(__file__).parent / "published"


class Fit(NamedTuple):
    """The fits of one model to several materials, from one paper.

    name       FILE/FIT, such as "low2012/lowsmooth_E2"
    model      name of the model
    source     the paper, as a key in docs/references.bib
    materials  parameters of the model, by the name of the material
    """

    name: str
    model: str
    source: str
    materials: Mapping[str, Mapping[str, Value]]


def materials() -> list[str]:
    """The names of all materials in the library, in alphabetical order."""
    return sorted(published()[DEFAULT].materials)


def fits(name: str) -> list[str]:
    """The names FILE/FIT of all fits of a material; the default is first. Raises InputError for an unknown material."""
    _known(name, "material")
    return [fit.name for fit in published().values() if name in fit.materials]


def knows(text: str) -> bool:
    """Whether a string names a material of the library, possibly with an unknown fit."""
    return text.partition(":")[0] in published()[DEFAULT].materials


def resembles(text: str) -> bool:
    """Whether a string is, or is most similar to, the name of a library material rather than that of a model."""
    near = difflib.get_close_matches(text.partition(":")[0].lower(), [*materials(), *models()], n=1, cutoff=0.75)
    return bool(near) and near[0] in materials()


def named(text: str, where: str = "material") -> tuple[type[BSDF], str]:
    """The class, and the name of its preset, for NAME or NAME:FILE/FIT.

    Raises InputError, which names `where`, for an unknown material or fit.
    """
    name, _, fit = text.partition(":")
    _known(name, where)
    fit = fit or DEFAULT
    if fit not in published():
        raise InputError(f"unknown fit '{fit}'", where, did_you_mean(fit, fits(name)))
    if name not in published()[fit].materials:
        raise InputError(f"{fit} does not include '{name}'", where, "it has " + ", ".join(fits(name)))
    return model(published()[fit].model), _key(name, fit)


def presets(model_name: str) -> dict[str, Preset]:
    """The fits of a model as presets, named "alum-bronze" for the default fit and
    "alum-bronze:low2012/lowsmooth_E2" for others."""
    return {
        key: Preset(key, values, fit.source)
        for fit in published().values()
        if fit.model == model_name
        for name, values in fit.materials.items()
        for key in [_key(name, fit.name)]
    }


@lru_cache(maxsize=1)
def published() -> dict[str, Fit]:
    """All fits by their names FILE/FIT; the default is first."""
    fits: dict[str, Fit] = {}
    for file in FILES:
        data = json.loads((_FOLDER / f"{file}.json").read_text())
        for name, one in data["fits"].items():
            model_name, translate = _MEANING[one["model"]]
            shapes = {parameter: tuple(shape) for parameter, shape in one["parameters"].items()}
            of_material = {}
            for key, numbers in one["materials"].items():
                figures = _unpacked(numbers, shapes)
                of_material[key] = {"diffuse": figures["diffuse"], **translate(figures)}
            fits[f"{file}/{name}"] = Fit(f"{file}/{name}", model_name, data["source"], of_material)
    return fits


def _unpacked(numbers: list[float], shapes: Mapping[str, tuple[int, ...]]) -> Figures:
    """Convert the flat list of a material's numbers to values by parameter: numbers, colors, and pairs of colors."""
    figures: Figures = {}
    at = 0
    for name, shape in shapes.items():
        size = math.prod(shape)
        part = np.reshape(numbers[at : at + size], shape)
        figures[name] = float(part) if not shape else _tuples(part)
        at += size
    return figures


def _tuples(array: np.ndarray) -> Value:
    return tuple(map(_tuples, array)) if array.ndim > 1 else tuple(array.tolist())


def _key(name: str, fit: str) -> str:
    return name if fit == DEFAULT else f"{name}:{fit}"


def _known(name: str, where: str) -> None:
    if name not in published()[DEFAULT].materials:
        raise InputError(f"unknown material '{name}'", where, did_you_mean(name, materials()))


# --------------------------------------------------------------------------- conversion of the printed values


def _index(f0: float) -> float:
    """The index of refraction with the normal reflectance f0, because Gonio's Schlick term takes F0 as an index."""
    root = math.sqrt(f0)
    return (1.0 + root) / (1.0 - root)


def _times(colour: tuple[float, ...], factor: float) -> tuple[float, ...]:
    return tuple(factor * c for c in colour)


def _ward(p: Figures) -> Figures:
    return {"specular": p["albedo"], "alpha": p["roughness"]}


def _phong(p: Figures) -> Figures:
    return {"specular": p["albedo"], "exponent": p["sharpness"]}


def _lafortune(p: Figures) -> Figures:
    """Convert a Lafortune lobe, which is divided by max(|Cz|, |Cxy|)^n."""
    largest = max(abs(p["Cz"]), abs(p["Cxy"]))
    cxy, cz = p["Cxy"] / largest, p["Cz"] / largest
    return {"specular": p["albedo"], "cx": cxy, "cy": cxy, "cz": cz, "exponent": p["sharpness"]}


def _ngan_cook_torrance(p: Figures) -> Figures:
    """Convert a Cook-Torrance lobe, whose D contains 1 / pi and is divided by pi again; `eta` is F0 for Schlick."""
    values = {"alpha": p["roughness"], "eta": _index(p["eta"]), "fresnel": "schlick"}
    return {"specular": _times(p["albedo"], 1.0 / math.pi), **values}


def _ngan_ashikhmin_shirley(p: Figures) -> Figures:
    values = {"exponent": p["sharpness"], "eta": _index(p["fresnelReflectance"]), "fresnel": "schlick"}
    return {"specular": p["albedo"], **values}


def _he(p: Figures) -> Figures:
    """Convert a He lobe; lengths are converted to micrometers."""
    lengths = {"sigma": 1000.0 * p["roughness"], "tau": 1000.0 * p["autocorrelation"]}
    return {"specular": p["albedo"], **lengths, "eta": p["eta"]}


def _low_ashikhmin_shirley(p: Figures) -> Figures:
    """Convert an Ashikhmin-Shirley lobe, where `fresnelReflectance` is the index for the exact Fresnel equations."""
    values = {"exponent": p["sharpness"], "eta": p["fresnelReflectance"], "fresnel": "exact"}
    return {"specular": p["albedo"], **values}


def _low_cook_torrance(p: Figures) -> Figures:
    return {"specular": p["albedo"], "alpha": p["roughness"], "eta": p["eta"]}


def _abc(p: Figures) -> Figures:
    return {"specular": p["A"], "b": p["B"], "c": p["C"], "eta": p["eta"]}


def _shifted_gamma(p: Figures) -> Figures:
    """Convert a shifted gamma lobe, where `eta` is the pair F0, F1, and c = reach^-k."""
    f0, f1 = p["eta"]
    return {
        "specular": p["albedo"],
        "alpha": p["alpha"],
        "p": p["p"],
        "f0": f0,
        "f1": f1,
        "normalization": p["K"],
        "Lambda": p["Lambda"],
        "reach": tuple(math.exp(-math.log(c) / k) for c, k in zip(p["c"], p["k"], strict=True)),
        "k": p["k"],
        "theta0": p["theta0"],
    }


_MEANING: dict[str, tuple[str, Callable[[Figures], Figures]]] = {
    "Bagher": ("shifted-gamma", _shifted_gamma),
    "LowAshikhminShirley": ("ashikhmin-shirley", _low_ashikhmin_shirley),
    "LowCookTorrance": ("cook-torrance", _low_cook_torrance),
    "LowMicrofacetFit": ("low-microfacet", _abc),
    "LowSmooth": ("low-smooth", _abc),
    "NganAshikhminShirley": ("ashikhmin-shirley", _ngan_ashikhmin_shirley),
    "NganBlinnPhong": ("lafortune", _phong),
    "NganCookTorrance": ("cook-torrance", _ngan_cook_torrance),
    "NganHe": ("he-torrance", _he),
    "NganLafortune": ("lafortune", _lafortune),
    "NganWard": ("ward", _ward),
    "NganWardDuer": ("ward-duer", _ward),
}
