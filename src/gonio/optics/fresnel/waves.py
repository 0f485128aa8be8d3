"""The complete Fresnel equations: amplitudes, phases and Mueller matrices for s and p polarization, in NumPy.

Fields vary as exp(-i omega t), so an absorbing medium has n = eta + i k with k >= 0. With w = n cos_t =
sqrt(n^2 - sin^2), the root that decays into the surface (Born1999, sec. 1.5 and 14.2; Hecht2017, sec. 4.6):

    r_s = (cos - w) / (cos + w)              t_s = 2 cos / (cos + w)
    r_p = (n^2 cos - w) / (n^2 cos + w)      t_p = 2 n cos / (n^2 cos + w)

For both rays, s points along the cross product of normal and direction, and p is s rotated toward the surface: at
normal incidence, r_p = -r_s.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError

Reals: TypeAlias = NDArray[np.float64]
Waves: TypeAlias = NDArray[np.complex128]


class Interface(NamedTuple):
    """The response of a smooth interface to a plane wave, as arrays of the broadcast shape of angle, eta and k.

    r_s, r_p      complex amplitudes of the reflected field relative to the incident one
    t_s, t_p      complex amplitudes of the refracted field; in a metal, just below the surface
    R_s, R_p, R   reflectances, fractions of the power; R, the mean of R_s and R_p, is that for unpolarized light
    T_s, T_p, T   transmittances, R + T = 1; for a metal, the absorbed fractions
    phase_s, phase_p  phase lag of the reflected field, radians in (-pi, pi]: the angles of r_s and r_p
    brewster      angle of the smallest R_p, radians: arctan(eta) for k = 0, where R_p = 0; for a metal, the
                  pseudo-Brewster angle
    critical      critical angle of total reflection, radians: arcsin(eta) for eta < 1 and k = 0, else NaN
    """

    r_s: Waves
    r_p: Waves
    t_s: Waves
    t_p: Waves
    R_s: Reals
    R_p: Reals
    R: Reals
    T_s: Reals
    T_p: Reals
    T: Reals
    phase_s: Reals
    phase_p: Reals
    brewster: Reals
    critical: Reals

    @property
    def reflection(self) -> Reals:
        """Mueller matrix of the reflection, (..., 4, 4), for Stokes vectors (I, Q, U, V) with Q = s minus p.

        The convention is that of `mi.mueller.specular_reflection`: U is the difference between the two diagonals, as
        seen by an observer who looks toward the source.
        """
        return mueller(self.R_s, self.R_p, self.r_s * np.conj(self.r_p))

    @property
    def refraction(self) -> Reals:
        """Mueller matrix of the refraction, (..., 4, 4), in power, as in `mi.mueller.specular_transmission`."""
        cross = self.t_s * np.conj(self.t_p)
        size = np.abs(cross)
        # beam width and index scale s and p by the same factor: sqrt(T_s T_p) with the phase between them
        turn = np.divide(cross, size, out=np.ones_like(cross), where=size > 0.0)
        return mueller(self.T_s, self.T_p, np.sqrt(np.maximum(self.T_s * self.T_p, 0.0)) * turn)


def fresnel(theta: ArrayLike, eta: ArrayLike, k: ArrayLike = 0.0) -> Interface:
    """The exact Fresnel equations of a smooth interface, in float64.

        at = go.fresnel(np.radians(60), eta=1.5)
        at.R_s, at.R_p, np.degrees(at.brewster)
        go.fresnel(np.radians(60), eta=1 / 1.5).phase_s          # from inside glass, beyond the critical angle

    theta   angle of incidence from the normal, radians, 0 to pi/2
    eta     real part of the index on the far side divided by that on the near side, > 0; 1 / 1.5 from inside glass
    k       imaginary part of this ratio, >= 0; sign convention n = eta + i k, exp(-i omega t)
    The three arguments are numbers or arrays that broadcast. Returns an `Interface`. Raises InputError for values out
    of range. The equations are not valid for thin films or for light that arrives through an absorbing medium.
    """
    angle, eta, k = (_real(x, name) for x, name in ((theta, "theta"), (eta, "eta"), (k, "k")))
    if np.any((angle < 0.0) | (angle > np.pi / 2 * (1.0 + 1e-15))):
        raise InputError("an angle is outside 0 to pi/2", "fresnel: theta", "give radians from the normal")
    check_index(eta, k, "fresnel")
    brewster = brewster_angle(eta, k)
    try:
        angle, eta, k = np.broadcast_arrays(angle, eta, k)
    except ValueError:
        shapes = f"{angle.shape}, {eta.shape} and {k.shape}"
        raise InputError(f"arrays of shapes {shapes}, which do not broadcast", "fresnel") from None
    cos = np.maximum(np.cos(angle), 0.0)
    square = (eta**2 - k**2) + 2j * eta * k
    # n^2 - sin^2 with n^2 - 1 as a product: near n = 1 it would cancel
    w = np.sqrt((eta - 1.0) * (eta + 1.0) - k**2 + cos**2 + 2j * eta * k)
    s, p = cos + w, square * cos + w
    grazing = s == 0.0  # index 1 at grazing incidence: there is no interface
    s, p = np.where(grazing, 1.0, s), np.where(p == 0.0, 1.0, p)
    r_s, r_p = (cos - w) / s, (square * cos - w) / p
    t_s: Waves = np.divide(2.0 * cos, s)
    t_p: Waves = np.divide(2.0 * (eta + 1j * k) * cos, p)
    T_s = 4.0 * cos * w.real / np.abs(s) ** 2
    T_p = 4.0 * cos * (np.conj(square) * w).real / np.abs(p) ** 2
    R_s, R_p = np.abs(r_s) ** 2, np.abs(r_p) ** 2
    critical = np.where((eta < 1.0) & (k == 0.0), np.arcsin(np.minimum(eta, 1.0)), np.nan)
    R, T = 0.5 * (R_s + R_p), 0.5 * (T_s + T_p)
    phase_s, phase_p = np.angle(r_s), np.angle(r_p)
    brewster = np.broadcast_to(brewster, cos.shape)
    return Interface(r_s, r_p, t_s, t_p, R_s, R_p, R, T_s, T_p, T, phase_s, phase_p, brewster, critical)


def brewster_angle(eta: ArrayLike, k: ArrayLike = 0.0) -> Reals:
    """The angle of the smallest R_p, radians: arctan(eta) for k = 0; for a metal, from a cubic equation in sin^2.

    With e = n^2 and u = sin^2, the equation is
    2 (|e|^2 + Re e) u^3 + |e|^2 (|e|^2 - 3) u^2 - 2 |e|^4 u + |e|^4 = 0 (HumphreysOwen1961).
    """
    eta, k = np.broadcast_arrays(_real(eta, "eta"), _real(k, "k"))
    check_index(eta, k, "brewster_angle")
    angles = np.array(np.arctan(eta))
    metal = k > 0.0
    if np.any(metal):
        e = (eta[metal] + 1j * k[metal]) ** 2
        size = np.abs(e) ** 2
        companion = np.zeros((*e.shape, 3, 3))  # matrix of the cubic in 1 / u, whose leading coefficient is never 0
        companion[..., 1, 0] = companion[..., 2, 1] = 1.0
        for row, coefficient in enumerate((2.0 * (size + e.real), size * (size - 3.0), -2.0 * size**2)):
            companion[..., row, 2] = -coefficient / size**2
        roots = np.linalg.eigvals(companion)
        inside = (np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real >= 1.0)
        least = 1.0 / np.max(np.where(inside, roots.real, 0.0), axis=-1, initial=np.finfo(float).tiny)
        angles[metal] = np.arcsin(np.sqrt(np.where(least <= 1.0, least, np.nan)))
    return angles


def mueller(along_s: Reals, along_p: Reals, cross: Waves) -> Reals:
    """The Mueller matrix, (..., 4, 4), of an interface that does not mix s and p.

    along_s, along_p  fractions of the power in s and p
    cross             amplitude of s times the conjugate of that of p
    """
    half_sum, half_difference, zero = 0.5 * (along_s + along_p), 0.5 * (along_s - along_p), 0.0 * along_s
    rows = [
        [half_sum, half_difference, zero, zero],
        [half_difference, half_sum, zero, zero],
        [zero, zero, cross.real, -cross.imag],
        [zero, zero, cross.imag, cross.real],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def check_index(eta: Reals, k: Reals, location: str) -> None:
    """Raise InputError for an index that no medium can have."""
    if np.any(eta <= 0.0):
        raise InputError(f"eta = {np.min(eta):g}, a positive index expected", f"{location}: eta", "that of air is 1")
    if np.any(k < 0.0):
        what = f"k = {np.min(k):g}, which would amplify light"
        raise InputError(what, f"{location}: k", "an absorbing medium has eta + i k with k >= 0")


def _real(value: ArrayLike, name: str) -> Reals:
    if np.iscomplexobj(value):
        raise InputError("a complex number given, a real one expected", f"fresnel: {name}", "give eta and k separately")
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{value!r} given, a number or an array expected", f"fresnel: {name}") from None
    if not np.all(np.isfinite(array)):
        raise InputError("a value is not finite", f"fresnel: {name}")
    return array
