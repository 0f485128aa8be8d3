"""The error of a material computed entirely in half precision: why `gonio emit --half` keeps arithmetic in 32 bits.

python benchmarks/half_precision.py [MATERIAL...]

Every operation of the recorded `eval` is rounded to float16, for the pairs of `gonio.shaders.vectors`; directions are
in half precision too. Prints the fractions of pairs whose error exceeds 1 % and 10 %, and of results that are not
finite.
"""

from __future__ import annotations

import sys
from unittest import mock

import gonio as go
import numpy as np
from gonio.ops import graph
from gonio.ops.evaluation import operate
from gonio.shaders.manifest import numbers_of
from gonio.shaders.read_back import recorded, values_of
from gonio.shaders.vectors import pairs

PAIRS = 65_536
DEFAULT = [f"conductor(preset=Au, alpha={alpha})" for alpha in (0.05, 0.3)] + ["dielectric(alpha=0.3)", "oren-nayar"]


def half(value: object) -> object:
    """Numbers rounded to float16; masks unchanged."""
    array = np.asarray(value)
    return array if array.dtype == bool else array.astype(np.float16).astype(float)


def rounding(op: str, static: object, args: list[object]) -> object:
    """The result of an operation in half precision."""
    return half(operate(op, static, [half(arg) for arg in args]))


def main() -> None:
    """Print one line per material."""
    for text in sys.argv[1:] or DEFAULT:
        model = go.material(text)
        wo, wi = pairs(np.random.default_rng(0), PAIRS, bool(model.transmits))
        fields = {path: np.repeat(np.reshape(v, (-1, 1)), PAIRS, 1) for path, v in numbers_of(model)}
        fields = {path: rows if len(rows) > 1 else rows[0] for path, rows in fields.items()}
        given = {"wo": wo.T, "wi": wi.T, "u": np.zeros((3, PAIRS))}
        made = recorded(model, ["eval"])
        exact = np.stack(values_of(made, ["eval"], given, fields)["eval"])
        with mock.patch.object(graph, "operate", rounding), np.errstate(all="ignore"):
            coarse = np.stack(values_of(made, ["eval"], given, fields)["eval"])
        good = exact.max(0) > 1e-6
        error = np.abs(coarse - exact).max(0)[good] / exact.max(0)[good]
        lost = ~np.isfinite(error)
        over = [float(np.mean(lost | (error > bound))) for bound in (0.01, 0.1)]
        print(f"{text}: {over[0]:.1%} of pairs over 1 %, {over[1]:.1%} over 10 %, {lost.mean():.1%} not finite")


if __name__ == "__main__":
    main()
