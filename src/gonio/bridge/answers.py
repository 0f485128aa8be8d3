"""The result of one kind of query to a BSDF, for the verifier's `calls` law."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Rows = tuple[str, str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Answer(NamedTuple):
    """A query and its result.

    what   the call, such as "eval_pdf"
    wrong  a description of the error in the result; "" if there is none
    share  error as a fraction of the reflected light, if the error affects pictures
    worst  largest error relative to the value for a single pair of directions
    rows   two values that should be equal: their names, wo and wi, (N, 3), and the values, (N, channels)
    """

    what: str
    wrong: str
    share: float = 0.0
    worst: float = 0.0
    rows: Rows | None = None
