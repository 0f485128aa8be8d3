"""Whether a BSDF gives the same answer to the same question: what does not cannot be judged by any law."""

from __future__ import annotations

import warnings

import numpy as np

from ..errors import GonioError, GonioWarning
from . import directions
from .subject import Fault, Subject

PAIRS = 256


def changes(subject: Subject) -> str:
    """What changed between two calls with the same arguments, in words; "" where nothing did, or where the BSDF says
    that its values are random."""
    if subject.stochastic:
        return ""
    rng = np.random.default_rng(11)
    wo, wi = (directions.single(directions.uniform(rng, PAIRS)) for _ in range(2))
    u = directions.numbers(rng, PAIRS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", GonioWarning)
            for name, ask in (
                ("eval", lambda: subject.eval(wo, wi, precision="float32")),
                ("pdf", lambda: subject.pdf(wo, wi, "float32")[:, None]),
                ("sample", lambda: np.hstack(list(subject.sample(wo, u, precision="float32")[:2]))),
            ):
                first, second = ask(), ask()
                other = ~((first == second) | (np.isnan(first) & np.isnan(second)))
                if other.any():
                    before, after = first[other][0], second[other][0]
                    return (
                        f"{name} changed its answer between two calls with the same arguments, {before:.6g} and then "
                        f"{after:.6g}: declare `stochastic = True` if its values are random"
                    )
    except (Fault, TimeoutError, GonioError):
        return ""  # which the laws report
    return ""


__all__ = ["changes"]
