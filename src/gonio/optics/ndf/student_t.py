"""The Student-T distribution with gamma = 3."""

from __future__ import annotations

from ... import ops
from ...ops import Direction, Scalar, abs, function, sqr, sqrt
from ..frame import sin2
from .base import Stretched


class StudentT(Stretched):
    """Student-T with gamma = 3, whose tail lies between GGX (gamma = 2) and Beckmann (gamma -> infinity).

    D = 1 / (pi alpha_x alpha_y m_z^4 (1 + (m_x^2 / alpha_x^2 + m_y^2 / alpha_y^2) / (2 m_z^2))^3) (Ribardiere2017). For
    gamma = 3, all formulas are algebraic.
    """

    name = "student-t"

    @function
    def density(self, n: Direction) -> Scalar:
        """1 / (pi n_z^4 (1 + tan^2 / 2)^3), as a quotient whose denominator does not vanish at grazing angles."""
        z2 = sqr(n.z)
        spread = z2 + 0.5 * sin2(n)
        return ops.inv_pi * z2 / (spread * sqr(spread))

    @function
    def area(self, v: Direction) -> Scalar:
        """(h + |v.z|)^2 / (4 h) with h^2 = v.z^2 + 2 sin^2.

        From Smith's Lambda = int_cot^inf (x / cot - 1) P(x) dx, where P(x) = 3 / (4 s) (1 + x^2 / s^2)^(-5/2), s^2 = 2,
        is the density of slopes along v: Lambda = c^3 / (4 t) - 1/2 + 3/4 (t c - (t c)^3 / 3) for t = cot / s and
        c = 1 / sqrt(1 + t^2), and |v.z| / h = t c.
        """
        z = abs(v.z)
        h = sqrt(sqr(z) + 2.0 * sin2(v))
        return 0.25 * sqr(h + z) / h

    @function
    def slope(self, u: Scalar) -> Scalar:
        """tan theta with tan^2 theta = 2 ((1 - u)^(-1/2) - 1)."""
        return sqrt(2.0 * (1.0 / sqrt(1.0 - u) - 1.0))
