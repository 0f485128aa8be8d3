"""Energy-preserving Oren-Nayar."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...material.bsdf import BSDF, InnerAlbedo, Limit
from ...material.calling import method
from ...material.parameters import Colour, Number, choice, number, spectrum
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, atan2, dot, fma, function, inv_pi, maximum, sqr, vec3, where
from ...optics import frame
from ...optics.frame import rotate, rotate_back, sin2
from .lambert import Lambert

# The albedo of FON (Fujii's Oren-Nayar) is A (1 + r G / pi). GRAZING is G(0) / pi, and AVERAGE the cosine-weighted mean
# of G / pi (Portsmouth2025, eqs. 17 and 21).
GRAZING = 0.5 - 2.0 / (3.0 * math.pi)
AVERAGE = 2.0 / 3.0 - 28.0 / (15.0 * math.pi)
FIT = (0.0571085289, 0.491881867, -0.332181442, 0.0714429953)  # coefficients of G / pi in powers of 1 - mu (eq. 64)

FORMS = {
    "exact": "the closed form, which requires an arc cosine",
    "fit": "a polynomial in the cosine, accurate to within a thousandth",
}


class Eon(BSDF):
    """Energy-preserving Oren-Nayar: Fujii's single-scattering model with its energy loss compensated (Portsmouth2025).

    f = rho / pi A (1 + r s / t) + rho_ms / pi (1 - E(mu_o)) (1 - E(mu_i)) / (1 - E_avg),  mu = cos theta
    s = wo.wi - mu_o mu_i,  t = max(mu_o, mu_i) where s > 0, else 1,  A = 1 / (1 + (1/2 - 2 / (3 pi)) r)
    E = A (1 + r G(mu) / pi), the albedo of the first term at rho = 1; E_avg is its cosine-weighted mean
    G = sin theta (theta - sin theta cos theta) + 2/3 (tan theta (1 - sin^3 theta) - sin theta)
    rho_ms = rho^2 E_avg / (1 - rho (1 - E_avg)), the color of light that bounces twice or more

    Unlike `oren-nayar`, the model loses no light at rho = 1 for any roughness and angle, has no dark ring at grazing
    angles, and becomes more saturated as roughness increases. It is reciprocal. Directions are sampled from a mixture
    of a clipped linearly transformed cosine and a uniform density (sec. 4 of the paper).
    """

    albedo: Colour = spectrum(default=0.5, doc="rho, the fraction of light reflected per bounce", low=0.0, high=1.0)
    roughness: Number = number(default=0.5, doc="r: 0 is Lambertian, 1 is roughest", low=0.0, high=1.0)
    energy: str = choice("exact", "how the albedo E is computed", FORMS)

    limits: ClassVar[tuple[Limit, ...]] = (Limit({"roughness": 0.0}, equals=lambda one: Lambert(one.albedo)),)
    lossless_tolerance: ClassVar[float | None] = 1e-3  # the error of the fit; "exact" has none

    @function
    def _lost(self, w: Direction) -> Scalar:
        """(1 - E(mu)) / (A r) = 1/2 - 2 / (3 pi) - G(mu) / pi, computed without a difference of albedos; 0 at grazing
        angles.

        G = sin (theta - sin cos) + 2/3 (tan (1 - sin^3) - sin), where (1 - sin^3) / cos is computed with
        1 - sin = cos^2 / (1 + sin).
        """
        mu = w.z
        if self.energy == "fit":
            low = 1.0 - mu
            g = fma(fma(fma(low, FIT[3], FIT[2]), low, FIT[1]), low, FIT[0]) * low
            return maximum(GRAZING - g, 0.0)
        sin = ops.safe_sqrt(sin2(w))
        over = 1.0 + sin
        cubes = sin * mu * (over + sqr(sin)) / over  # tan (1 - sin^3)
        g = sin * (atan2(sin, mu) - sin * mu) + (2.0 / 3.0) * (cubes - sin)
        return maximum(GRAZING - inv_pi * g, 0.0)

    @function
    def _single(self) -> Scalar:
        """A, the normalization of the single-scattering lobe."""
        return 1.0 / (1.0 + GRAZING * self.roughness)

    @function
    def _interreflected(self) -> Spectrum:
        """rho_ms, the color of multiple scattering."""
        E_avg = self._single() * (1.0 + AVERAGE * self.roughness)
        return sqr(self.albedo) * E_avg / (1.0 - self.albedo * (1.0 - E_avg))

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """f cos theta_i above the surface; (1 - E)^2 / (1 - E_avg) is A r times a ratio that is independent of r."""
        A, r = self._single(), self.roughness
        s = wo.x * wi.x + wo.y * wi.y
        t = where(s > 0.0, maximum(maximum(wo.z, wi.z), 1e-7), 1.0)  # both are 0 only where the result is masked
        once = self.albedo * (A * (1.0 + r * s / t))
        multiple = self._interreflected() * (A * r * self._lost(wo) * self._lost(wi) / (GRAZING - AVERAGE))
        return (once + multiple) * where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The mixture of the density of the transformed cosine and the uniform density."""
        even = _uniform_share(wo.z, self.roughness)
        cosine = _Clipped(*_coefficients(wo, self.roughness)).pdf(rotate(wi, frame.azimuth(wo)))
        density = (1.0 - even) * cosine + even * (0.5 * inv_pi)
        return where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u.x selects the uniform hemisphere or the clipped lobe."""
        r = self.roughness
        lobe = rotate_back(_Clipped(*_coefficients(wo, r)).draw(u.y, u.z), frame.azimuth(wo))
        phi = (2.0 * ops.pi) * u.z
        sin, cos = ops.sincos(phi)
        across = ops.safe_sqrt((1.0 - u.y) * (1.0 + u.y))
        wi = where(u.x < _uniform_share(wo.z, r), vec3(across * cos, across * sin, u.y), lobe)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return Sample.of_density(wi, weight, pdf)

    def tint(self, wo: Direction) -> Spectrum:
        """rho E_avg + rho_ms (1 - E_avg), the mean albedo."""
        E_avg = self._single() * (1.0 + AVERAGE * self.roughness)
        return self.albedo * E_avg + self._interreflected() * (1.0 - E_avg)

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """rho E + rho_ms (1 - E) for wo above the surface; None for the fit, which is approximate."""
        if self.energy != "exact":
            return None
        r, rho = float(self.roughness), np.asarray(self.albedo, float)  # type: ignore[arg-type]
        sin, theta = np.sqrt(np.maximum(1.0 - mu * mu, 0.0)), np.arccos(np.clip(mu, 0.0, 1.0))
        g = sin * (theta - sin * mu) + 2.0 / 3.0 * (sin * mu * (1.0 + sin + sin**2) / (1.0 + sin) - sin)
        A = 1.0 / (1.0 + GRAZING * r)
        E, E_avg = A * (1.0 + r * g / np.pi), A * (1.0 + AVERAGE * r)
        multiple = rho**2 * E_avg / (1.0 - rho * (1.0 - E_avg))
        value = rho * E[:, None] + multiple * (1.0 - E[:, None])
        return np.where(mu > 0.0, 1.0, 0.0)[:, None] * np.broadcast_to(value, (len(mu), 3))


# --------------------------------------------------------------------------- sampling (Portsmouth2025, sec. 4)


@function
def _uniform_share(mu: Scalar, r: Scalar) -> Scalar:
    """The probability of a uniform direction, by the fit in eq. 39."""
    return ops.pow(r, 0.1) * (0.162925 + mu * (-0.372058 + (0.538233 - 0.290822 * mu) * mu))


@function
def _coefficients(wo: Direction, r: Scalar) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """The fitted entries a, b, c, d of the matrix M = ((a, 0, b), (0, c, 0), (d, 0, 1)), which maps a cosine to the
    lobe.

    In the published fit, in powers of mu, b and d are differences of nearly equal numbers near the normal. Here, they
    are expressed in powers of 1 - mu.
    """
    mu = wo.z
    low = sin2(wo) / (1.0 + ops.abs(mu))  # 1 - mu
    wider = r * (0.303392 + (-0.518982 + 0.111709 * mu) * mu + (-0.276266 + 0.335918 * mu) * r)
    a = 1.0 + wider
    b = r * ((0.00071 + 0.150105 * low) * r - (0.00548 + 1.15859 * low)) / (mu * mu * mu - 1.43545)
    c = 1.0 + (0.20013 + (-0.506373 + 0.261777 * mu) * mu) * r
    d = r * (0.000006 - (0.065466 + 0.475392 * low) * low) / (0.0017372 + (2.0725628 - low) * low)
    return a, b, c, d


class _Clipped:
    """The cosine lobe transformed by the matrix M of `_coefficients`, restricted to directions above the surface.

    A direction h of the cosine lobe is mapped above the surface if d h_x + h_z > 0. This condition cuts half an ellipse
    from the disk of (h_x, h_y) and leaves the fraction (1 + v) / 2, with v = 1 / sqrt(1 + d^2). x is compressed
    accordingly, so that no sample is lost.
    """

    def __init__(self, a: Scalar, b: Scalar, c: Scalar, d: Scalar) -> None:
        self.a, self.b, self.c, self.d = a, b, c, d

    def _acceptance(self) -> Scalar:
        """The fraction of the disk that remains."""
        return 0.5 * (1.0 + ops.rsqrt(self.d * self.d + 1.0))

    def draw(self, u1: Scalar, u2: Scalar) -> Direction:
        """A direction of the lobe, for wo in the x-z plane."""
        radius = ops.sqrt(u1)
        sin, cos = ops.sincos((2.0 * ops.pi) * u2)
        y = radius * sin
        share = self._acceptance()
        x = -(ops.safe_sqrt(1.0 - y * y) * (1.0 - share) + radius * cos * share)
        z = ops.safe_sqrt(1.0 - (x * x + y * y))
        return ops.normalize(vec3(self.a * x + self.b * z, self.c * y, self.d * x + z))

    def pdf(self, w: Direction) -> Scalar:
        """Density of `draw`, 1/sr: h_z det(M)^2 / (pi acceptance |h|^4), with h = adj(M) w and the adjugate adj(M)."""
        across = self.a - self.b * self.d
        height = self.c * (self.a * w.z - self.d * w.x)
        h = vec3(self.c * (w.x - self.b * w.z), across * w.y, height)
        size = self.c * across
        return sqr(size / maximum(dot(h, h), frame.TINY)) * maximum(height, 0.0) * inv_pi / self._acceptance()
