"""An answer to one way of asking a BSDF, as the verifier's law of calls takes it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Rows = tuple[str, str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Answer(NamedTuple):
    """What was asked, and what came.

    what   the call, "eval_pdf"
    wrong  what is wrong with the answer, "" where nothing is
    share  of the reflected light by which it is wrong, where a picture shows it
    worst  the same for a single pair of directions
    rows   two values that should be one: their names, wo, wi, (N, 3), and the values, (N, channels)
    """

    what: str
    wrong: str
    share: float = 0.0
    worst: float = 0.0
    rows: Rows | None = None
