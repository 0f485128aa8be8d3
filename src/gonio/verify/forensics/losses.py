"""The reason for a loss of light in a white furnace: parameters at whose extreme values the loss vanishes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from ...material import BSDF, tree
from .ratio import Cause

if TYPE_CHECKING:
    from ..subject import Subject

MOST = 6  # largest number of parameters that are moved to their ends
LITTLE = 0.2  # fraction of the loss that counts as none


def causes(white: Subject, loss: Callable[[Subject], float], claim: float) -> Iterator[Cause]:
    """The parameters on which a loss depends: a mixture of several, or a single one with which it increases.

    white  the subject without absorption
    loss   function that returns the largest loss of a subject in a furnace
    claim  the loss that the material declares
    """
    if not isinstance(white.model, BSDF) or white.stochastic:
        return
    here = loss(white)
    small = max(claim, LITTLE * here)
    for path, value, ends in _ranges(white.model)[:MOST]:
        try:
            lost = [here if end == value else loss(white.replace(**{path: end})) for end in ends]
        except InputError:
            continue
        none = [one <= small for one in lost]
        text = " and ".join(f"{one:.4f} at {path} = {end:g}" for one, end in zip(lost, ends, strict=True))
        if all(none):
            words = (
                f"the loss is {here:.4f} at {path} = {value:g}, and {text}: are parameters mixed instead of two lobes?"
            )
            yield Cause(words, f"mixed {path}")
        elif any(none):
            yield Cause(f"the loss depends on {path}: {text}", f"loss by {path}")


def _ranges(model: BSDF) -> list[tuple[str, float, tuple[float, float]]]:
    """The numeric parameters with a finite range, except colors: path, value, and the ends of the range."""
    result: list[tuple[str, float, tuple[float, float]]] = []
    for leaf in tree.surface(model):
        parameter, value = leaf.parameter, leaf.value
        low, high = (float(getattr(parameter, end, np.inf)) for end in ("low", "high"))
        plain = isinstance(value, int | float) and not isinstance(value, bool)
        if parameter.numeric and plain and parameter.white is None and np.isfinite([low, high]).all() and low < high:
            number: Any = value
            result.append((leaf.path, float(number), (low, high)))
    return result
