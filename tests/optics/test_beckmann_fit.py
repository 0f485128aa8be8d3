"""Beckmann's G1 in float32, a fit, is the exact one."""

from __future__ import annotations

import numpy as np
from gonio.ops import backend
from gonio.optics.ndf import distribution


def test_float32_g1_is_the_exact_one_to_float32s_last_digits() -> None:
    theta = np.linspace(1e-3, np.pi / 2 - 1e-4, 4001)
    for width in (0.01, 0.1, 0.5, 1.0):
        found = {}
        for precision in ("float32", "float64"):
            kind = backend.types(precision)
            v = kind.vec3(kind.float(np.sin(theta)), kind.float(0.0 * theta), kind.float(np.cos(theta)))
            alpha = kind.vec2(kind.float(width), kind.float(width))
            found[precision] = distribution("beckmann").G1(v, alpha).numpy().astype(float)
        np.testing.assert_allclose(found["float32"], found["float64"], rtol=2e-6)
