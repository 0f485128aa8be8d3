"""Student-T with gamma = 3: a tail between GGX (gamma = 2) and Beckmann (gamma -> infinity)."""

from __future__ import annotations

from typing import Any

from ... import ops
from ...ops import abs, function, maximum, normalize, sincos, sqr, sqrt, vec3, where
from .base import NDF
from .ggx import slant2


class StudentT(NDF):
    """Student-T with gamma = 3: a tail between GGX (gamma = 2) and Beckmann (gamma -> infinity).

    D = 1 / (pi alpha_x alpha_y m_z^4 (1 + (m_x^2 / alpha_x^2 + m_y^2 / alpha_y^2) / (2 m_z^2))^3) (Ribardiere2017).

    At gamma = 3 all is algebraic. The slope along a direction has density 3 / (4 s) (1 + x^2 / s^2)^(-5/2) with
    s^2 = 2 alpha^2, and Smith's integral of it is closed.
    """

    name = "student-t"

    @function
    def D(self, m: Any, alpha: Any) -> Any:
        """Student-T density of normals, 1/sr; multiplied through by m_z^6, so nothing vanishes at grazing."""
        z2 = sqr(m.z)
        spread = z2 + 0.5 * (sqr(m.x / alpha.x) + sqr(m.y / alpha.y))
        return where(m.z > 0.0, z2 / (ops.pi * alpha.x * alpha.y * spread * sqr(spread)), 0.0)

    @function
    def Lambda(self, v: Any, alpha: Any) -> Any:
        """Smith's Lambda, from 1/mu int_mu^inf (x - mu) P(x) dx with mu = cot and P the density above.

        With t = mu / s and c = 1 / sqrt(1 + t^2):  Lambda = c^3 / (4 t) - 1/2 + (3/4) (t c - (t c)^3 / 3).
        """
        t = abs(v.z) / maximum(sqrt(2.0 * slant2(v, alpha)), 1e-9)
        t = maximum(t, 1e-15)
        c = 1.0 / sqrt(1.0 + sqr(t))
        w = t * c
        # 1/2 - (3/4)(w - w^3/3) = (1 - w)^2 (2 + w) / 4, and 1 - w = c^2 / (1 + w): no cancellation for large t
        return c * sqr(c) * (1.0 / t - c * (2.0 + w) / sqr(1.0 + w)) * 0.25

    @function
    def sample(self, u1: Any, u2: Any, alpha: Any) -> Any:
        """A normal with density D(m) m.z: tan^2 = 2 alpha^2 ((1 - u)^(-1/2) - 1)."""
        r = sqrt(2.0 * (1.0 / sqrt(1.0 - u1) - 1.0))
        phi = (2.0 * ops.pi) * u2
        s, c = sincos(phi)
        return normalize(vec3(r * c * alpha.x, r * s * alpha.y, 1.0 + 0.0 * r))
