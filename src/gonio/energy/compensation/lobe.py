"""The interface for missing energy, and functions that its three implementations share."""

from __future__ import annotations

from typing import Protocol

from ... import ops
from ...ops import Direction, Mask, Mode, Scalar, Spectrum, clamp, function, sincos, sqrt, vec3, where
from ...ops.backend import Array

NOTHING = 1e-5  # smaller values of M_avg are errors of the fit and are not compensated


class MissingEnergy(Protocol):
    """The energy lost by single scattering, M(mu) = 1 - E(mu), where E is the directional albedo of a base at F = 1,
    and the broad lobe, proportional to M(mu_i) mu_i, that restores this energy.

    average  M_avg = 1 - E_avg = 2 int M mu dmu
    F_avg    fraction of the light that remains after one bounce, per color channel
    factor   factor applied once to all light that leaves the surface
    """

    @property
    def average(self) -> Scalar: ...

    @property
    def F_avg(self) -> Spectrum: ...

    @property
    def factor(self) -> Spectrum | float: ...

    def at(self, w: Direction) -> Scalar:
        """M for a direction on either side of the surface."""

    def over_average(self, w: Direction) -> Scalar:
        """1 / (pi M_avg) on w's side; 0 if no energy is lost."""

    def share(self, wo: Direction, wi: Direction) -> Scalar | float:
        """The fraction of the energy lost for wo that leaves on wi's side: 1 above a surface that only reflects."""

    def radiance(self, wo: Direction, wi: Direction, mode: Mode) -> Scalar | float:
        """(eta_o / eta_i)^2 for radiance that is transmitted to the other side, else 1."""

    def given(self, wo: Direction) -> Scalar:
        """M(mu_o) as used for sampling the lobe; 0 if no energy is lost."""

    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density of `sample`: M(mu_i) mu_i / (pi M_avg) for wi's side, times the fraction for that side."""

    def sample(self, wo: Direction, u: Direction) -> Direction:
        """A direction with the density `pdf`."""

    def eta(self, wo: Direction, wi: Direction) -> Scalar:
        """Index on wi's side divided by the index on wo's side."""


def above(wo: Direction, wi: Direction) -> Mask:
    """Whether both directions lie above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


@function
def over_pi(average: Scalar) -> Scalar:
    """1 / (pi M_avg), or 0 if no energy is lost."""
    some = average > NOTHING
    return where(some, ops.inv_pi / where(some, average, 1.0), 0.0)


def from_square(mu2: Array, u: Scalar) -> Direction:
    """The direction above the surface with squared cosine mu2 and azimuth 2 pi u."""
    mu2 = clamp(mu2, 1e-12, 1.0)
    sin_theta, (s, c) = sqrt(1.0 - mu2), sincos((2.0 * ops.pi) * u)
    return vec3(sin_theta * c, sin_theta * s, sqrt(mu2))
