"""Detection of colors whose channels affect one another, as if each were replaced by a mean, maximum or luminance."""

from __future__ import annotations

import numpy as np

from ...errors import InputError
from ..subject import Fault, Subject
from .ratio import Cause

MIXED = 1e-4  # relative change of a channel by another one that rounding cannot explain
FIRST, SECOND = (0.6, 0.3, 0.2), (0.6, 0.1, 0.9)  # equal in red only


def mixed(subject: Subject, wo: np.ndarray, wi: np.ndarray) -> Cause | None:
    """A color whose green and blue channels affect red values; None if there is none."""
    names = [name for name, p in subject.parameters.items() if p.kind == "spectrum" and p.high <= 1.0]
    for name in names:
        low = subject.parameters[name].low
        span = subject.parameters[name].high - low
        try:
            one, other = (
                subject.replace(**{name: tuple(low + span * c for c in color)}).eval(wo, wi)[:, 0]
                for color in (FIRST, SECOND)
            )
        except (Fault, InputError):
            continue
        size = np.maximum(one, other)
        lit = np.isfinite(one) & np.isfinite(other) & (size > 1e-6 * np.max(size, initial=0.0, where=np.isfinite(size)))
        if lit.any() and np.mean(np.abs(one - other)[lit] > MIXED * size[lit]) > 0.05:
            words = f"the red channel of the result depends on the green and blue channels of {name}"
            guess = "a mean, a maximum or a luminance in place of the channel itself"
            return Cause(f"{words}; possible mistake: {guess}", "channels")
    return None
