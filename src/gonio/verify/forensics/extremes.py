"""The conditions under which values are negative or not finite: parameter values, random numbers or sides."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import InputError
from ..subject import Fault, Subject
from .ratio import Cause

MOST = 4  # largest number of parameters that are reset one by one to find those that matter
OFTEN = 0.2  # smallest fraction of bad rows among those with a random number, for this number to be the reason
STEEP = 15.0  # degrees; smaller angles count as none
NUMBERS = ("first", "second", "third")

# (kind of the values, whether each row is bad, random numbers (N, 3) or None if they do not matter)
Bad = tuple[str, np.ndarray, np.ndarray | None]


def of_parameters(subject: Subject, settings: Mapping[str, Any], fault: str, fails: Callable[[Subject], bool]) -> str:
    """The changed parameters without which a fault does not occur, as text: "only for tint = 0; ..."; "" if there are
    none or too many.

    settings  parameter values at which the fault occurs
    fault     the fault: "not finite" or "negative"
    fails     function that returns whether a subject has the fault
    """
    if not settings or len(settings) > MOST or fails(subject):
        return ""
    needed = []
    for name, value in settings.items():
        try:
            without = subject.replace(**{k: v for k, v in settings.items() if k != name})
            if not fails(without):
                needed.append(f"{name} = {_written(value)}")
        except (Fault, InputError):
            return ""
    if not needed:  # each of several parameters is sufficient
        return ""
    zero = all(np.all(np.asarray(settings[part.split(" = ")[0]], float) == 0.0) for part in needed)
    guess = {
        (True, "not finite"): "a division by it, or its logarithm",
        (False, "not finite"): "an overflow or a division by 0",
        (True, "negative"): "a subtracted term that is not clamped",
        (False, "negative"): "a term that exceeds its range and is not clamped",
    }[zero, fault]
    return f"only for {' and '.join(needed)}; possible mistake: {guess}"


def of_numbers(rows: Sequence[Bad], corners: Sequence[float], fault: str) -> Cause | None:
    """A cause if the extreme value of a random number causes the fault; None if it also occurs at other values."""
    for what, bad, u in rows:
        if u is None or not bad.any():
            continue
        for dimension, name in enumerate(NUMBERS):
            for corner in corners:
                there = u[:, dimension] == corner
                if not np.any(bad & ~there) and np.sum(bad & there) > OFTEN * there.sum():
                    value = "0" if corner == 0.0 else "just below 1" if corner > 0.9 else f"{corner:g}"
                    other = "1 - " if corner > 0.9 else ""
                    words = f"{what} is {fault}, but only where the {name} random number is {value}"
                    guess = f"a logarithm of {other}u, or a division by {other}u"
                    return Cause(f"{words}; possible mistake: {guess}", f"{fault} at u")
    return None


def of_views(what: str, wo: np.ndarray, bad: np.ndarray, fault: str, transmits: bool) -> Cause | None:
    """A cause that names the side of the surface, or the angles, of the views with a fault; None if neither
    distinguishes them.

    what     name of the faulty quantity
    wo, bad  directions of samples, (N, 3), and whether each sample has the fault, (N,)
    """
    below = wo[:, 2] < 0.0
    sides = [side for side in (below, ~below) if side.any() and not np.any(bad & ~side)]
    if not bad.any() or not sides:
        return None
    side = sides[0]
    angle = np.degrees(np.arccos(np.clip(np.abs(wo[:, 2]), 0.0, 1.0)))
    first = float(angle[bad].min())
    beyond = side & (angle >= first)
    if np.sum(bad & beyond) < OFTEN * beyond.sum() or (first < STEEP and side.all()):
        return None
    name = "below" if side is below else "above"
    words = f"{what} is {fault}, but only for wo {name} the surface"
    if first < STEEP:
        return Cause(words, f"{fault} {name}")
    guess = "; possible reason: total internal reflection" if transmits else ""
    where = f"{first:.3g} degrees or more from the normal" if first < 89.95 else "at grazing angles (90 degrees)"
    return Cause(f"{words}, {where}{guess}", f"{fault} {name}")


def _written(value: Any) -> str:
    numbers = np.unique(np.asarray(value, float))
    return f"{numbers[0]:.4g}" if len(numbers) == 1 else "(" + ", ".join(f"{v:.4g}" for v in np.ravel(value)) + ")"
