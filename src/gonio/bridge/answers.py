"""The result of a call of a BSDF's methods, for the law `calls` of the verifier."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Rows = tuple[str, str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Answer(NamedTuple):
    """A call and its result.

    what   name of the call, such as "eval_pdf"
    wrong  description of the error in the result; "" if there is no error
    share  error as a fraction of the reflected light, if the error affects pictures
    worst  largest relative error for a single pair of directions
    rows   two sets of values that should be equal: their names, wo and wi, (N, 3), and the values, (N, channels)
    """

    what: str
    wrong: str
    share: float = 0.0
    worst: float = 0.0
    rows: Rows | None = None
