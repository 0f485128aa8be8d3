"""Mistakes that are possible in any material: in the choice of terms, in units, in channels and in directions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...errors import GonioError
from ...material import BSDF, tree
from ...material.parameters import ChoiceParameter
from ...verify.forensics.factors import widths
from ...verify.subject import Subject
from ..finding import Mistake
from .base import Variant, f_of

_DIRECTIONS = "the directions of the rows"


def variants(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Iterator[Variant]:
    """The material with one value changed, or with its directions or channels swapped."""
    yield from _widths(material, wo, wi)
    yield from _choices(material, wo, wi)
    yield from _units(material, wo, wi)
    yield from _directions(material, wo, wi)
    own = f_of(material, wo, wi)
    if np.any(own != own[:, ::-1]):
        mistake = Mistake("red and blue exchanged: BGR in place of RGB", "the order of the channels")
        yield Variant(mistake, own[:, ::-1])


def _widths(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Iterator[Variant]:
    """alpha^2 or sqrt(alpha) in place of alpha, as in `verify.forensics.factors.widths`."""
    for text, guess, other in widths(Subject(material, type(material).name)):
        yield Variant(Mistake(f"{text}: {guess}", "the roughness: alpha, or roughness"), f_of(other.model, wo, wi))


def _choices(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Iterator[Variant]:
    """A different distribution, masking term, Fresnel term or form, in the material itself or in an inner material."""
    for path, inner in tree.walk(material):
        for name, parameter in type(inner).parameters().items():
            if not isinstance(parameter, ChoiceParameter) or name == "sampling":
                continue
            where = f"{path}.{name}" if path else name
            for option in parameter.choices:
                if option != getattr(inner, name):
                    values = _changed(material, where, option, wo, wi)
                    if values is not None:
                        topic = {"ndf": "D", "masking": "the masking term G", "fresnel": "Fresnel's term F"}.get(
                            name, name
                        )
                        words = f"{name} is {option}, not {getattr(inner, name)}"
                        yield Variant(Mistake(words, topic), values)


def _units(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Iterator[Variant]:
    """Angles in degrees instead of radians; albedos decoded from sRGB, encoded as sRGB or squared."""
    for name, parameter in type(material).parameters().items():
        value = getattr(material, name, None)
        if not isinstance(value, int | float | tuple) or isinstance(value, bool):
            continue
        try:
            numbers = np.asarray(value, float)
        except (TypeError, ValueError):
            continue
        changes: dict[str, np.ndarray] = {}
        if parameter.unit == "rad":
            changes = {"in degrees in place of radians": np.radians(numbers)}
        elif "albedo" in name and np.any(numbers < 1.0):
            changes = {
                "decoded from sRGB": numbers**2.2,
                "encoded as sRGB": numbers ** (1 / 2.2),
                "squared": numbers**2,
            }
        for words, changed in changes.items():
            given = float(changed) if changed.ndim == 0 else tuple(changed.tolist())
            values = _changed(material, name, given, wo, wi)
            if values is not None:
                yield Variant(Mistake(f"{name} is {words}", name), values)


def _directions(material: BSDF, wo: np.ndarray, wi: np.ndarray) -> Iterator[Variant]:
    rotated = [w[:, [2, 0, 1]] for w in (wo, wi)]
    yield Variant(Mistake("the rows have y up: give --up y", _DIRECTIONS), f_of(material, *rotated))
    back = [w[:, [1, 2, 0]] for w in (wo, wi)]
    yield Variant(Mistake("the rows have z up: leave --up y out", _DIRECTIONS), f_of(material, *back))
    yield Variant(Mistake("wi points from the light to the surface", _DIRECTIONS), f_of(material, wo, -wi))
    yield Variant(Mistake("wo points from the eye to the surface", _DIRECTIONS), f_of(material, -wo, wi))
    mirrored = wo * np.array([-1.0, -1.0, 1.0])
    yield Variant(Mistake("wo is mirrored at the normal", _DIRECTIONS), f_of(material, mirrored, wi))


def _changed(material: BSDF, path: str, value: object, wo: np.ndarray, wi: np.ndarray) -> np.ndarray | None:
    """f with one value replaced; None if the material does not allow it."""
    try:
        return f_of(tree.replace(material, {path: value}), wo, wi)
    except (GonioError, ArithmeticError):
        return None
