"""Base classes of the compensated materials: a base material plus a broad lobe that returns its lost energy."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...energy.compensation import missing, reflecting
from ...energy.compensation.lobe import MissingEnergy
from ...material import BSDF, KnownViolation, Sample, bsdf, method
from ...material.bsdf import Delta, InnerAlbedo
from ...material.polarization import Polarized
from ...ops import Direction, Mask, Mode, Scalar, Spectrum, backend, function, maximum, mean, safe_div, vec3, where
from ...ops.backend import Array
from ...optics import frame
from ...optics.special import gauss

GAIN_OF_TWO_WIDTHS, LOSS_OF_TWO_WIDTHS = 0.008, 0.01  # errors of interpolated tables, measured by benchmarks/energy.py
INTERPOLATED = KnownViolation(
    "tables for anisotropic bases are interpolated; benchmarks/energy.py measures the error",
    lambda model: GAIN_OF_TWO_WIDTHS if model.anisotropic else 0.0,
    certain=False,
)
ALMOST_ONE = 0.99999994  # the largest float32 below 1


class Parts(NamedTuple):
    """The two terms of a compensated material, times |cos theta_i|.

    single  the base: light scattered once
    multi   the compensation: light scattered more than once
    """

    single: Spectrum
    multi: Spectrum


class AllParts(NamedTuple):
    """The microfacet `Terms` of the base, followed by `Parts`."""

    D: Scalar
    G: Scalar
    F: Spectrum
    single: Spectrum
    multi: Spectrum


class _OnBase(BSDF):
    """A material that compensates for the energy lost by its base and otherwise has the properties of the base."""

    base: BSDF = bsdf("the material whose energy loss is compensated")
    _takes_glass: ClassVar[bool] = True  # whether the base may transmit
    _loss: ClassVar[float | None] = 2e-3  # allowed in a white furnace if isotropic; None if not claimed
    _takes_any: ClassVar[bool] = False  # whether the base may be something other than a microsurface

    def __post_init__(self) -> None:
        super().__post_init__()
        missing.check_base(self.base, f"{type(self).__name__}.base", self._takes_glass, self._takes_any)

    # ------------------------------------------------------------------ facts

    @property
    def anisotropic(self) -> bool:
        """Whether the base has different widths along x and y."""
        return reflecting.has_two_widths(self.plain.base)

    @property
    def lossless_tolerance(self) -> float | None:  # type: ignore[override]
        """The loss allowed in a white furnace: the error of the tables."""
        return LOSS_OF_TWO_WIDTHS if self._loss is not None and self.anisotropic else self._loss

    @property
    def transmits(self) -> bool:
        return self.base.transmits

    @property
    def delta(self) -> Delta:
        return self.base.delta

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """The polarized parts of the base, which represent light scattered once; the compensation is unpolarized."""
        return self.base.polarized(wo, wi, delta, mode)

    def tint(self, wo: Direction) -> Spectrum:
        """The base's tint."""
        return self.base.tint(wo)


class _Compensated(_OnBase):
    """A base plus its lost energy, sampled by a mixture of the base and a lobe proportional to the lost energy.

    A subclass defines `compensation`, an `eval` that adds it to the base, and `derive`, whose result has the fields
    `missing` and `ratio`.
    """

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """The albedo of the base plus that of the compensation, which is rotationally symmetric."""
        of_base = None if nodes is None or self.stochastic or self.anisotropic else inner(self.base, mu, phi)
        if nodes is None or of_base is None:
            return None
        types = backend.types("float64")
        bound = self.bind(types)
        x, w = gauss(nodes)
        total = np.array(of_base)
        for row, (cosine, azimuth) in enumerate(zip(mu, phi, strict=True)):
            wo = _direction(types, np.array([cosine]), azimuth)
            for side in (1.0, -1.0) if self.transmits else (float(np.sign(cosine)),):
                value = backend.to_numpy(bound.compensation(wo, _direction(types, side * x**2), "importance"), len(x))
                total[row] += 2.0 * np.pi * (2.0 * x * w) @ value
        return total

    # ------------------------------------------------------------------ formulas

    def compensation(self, wo: Direction, wi: Direction, mode: Mode) -> Spectrum:
        """The term added to the base, times |cos theta_i|."""
        raise NotImplementedError

    @function
    def M(self, w: Direction) -> Scalar:
        """1 - E(mu), the energy lost by single scattering for w on either side; E is the base's albedo at F = 1."""
        return self.derived.missing.at(w)

    @method
    def terms(self, wo: Direction, wi: Direction) -> Parts | AllParts:
        """`AllParts` if the base has D, G and F, else `Parts`."""
        return with_terms(self.base, wo, wi, self.base.eval(wo, wi), self.compensation(wo, wi, "radiance"))

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """A mixture of the density of the base and one proportional to (1 - E(mu_i)) mu_i, weighted by the energies of
        both."""
        share = self._share(wo)
        return self.base.pdf(wo, wi) * (1.0 - share) + self._lobe_pdf(wo, wi) * share

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u.x selects the base or the broad lobe and is then rescaled."""
        share = self._share(wo)
        broad = u.x < share
        u_remapped = where(broad, safe_div(u.x, share), safe_div(u.x - share, 1.0 - share))
        u = vec3(ops.minimum(u_remapped, ALMOST_ONE), u.y, u.z)
        s = self.base.sample(wo, u, mode)
        wi = where(broad, self._lobe_sample(wo, u), s.wi)
        delta = s.delta & ~broad
        # the pdf of the base's own sample is more precise than one computed from the rounded direction
        base_pdf = where(broad, self.base.pdf(wo, wi), s.pdf)
        base_value = where(broad, self.base.eval(wo, wi, mode), s.weight * s.pdf)
        density = base_pdf * (1.0 - share) + self._lobe_pdf(wo, wi) * share
        pdf = where(broad | (s.pdf > 0.0), where(delta, s.pdf * (1.0 - share), density), 0.0)
        value = base_value + self.compensation(wo, wi, mode)
        value = value * where((pdf > 0.0) & ~delta, safe_div(1.0, pdf), 0.0)
        eta = where(broad, self.derived.missing.eta(wo, wi), s.eta)
        # a smooth base loses no energy, so `share` is 0
        return Sample(wi, where(delta, s.weight * safe_div(1.0, 1.0 - share), value), pdf, delta, eta)

    @function
    def _lobe_pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """M(mu_i) mu_i / (pi M_avg), the density of the broad lobe."""
        return self.derived.missing.pdf(wo, wi)

    @function
    def _lobe_sample(self, wo: Direction, u: Direction) -> Direction:
        """A direction with the density `_lobe_pdf`: mu^2 is read from a table of its inverse distribution function, and
        the azimuth is uniform."""
        return self.derived.missing.sample(wo, u)

    @function
    def _share(self, wo: Direction) -> Scalar:
        """Probability of the broad lobe: its fraction of the total power, averaged over the channels."""
        lost = self.derived.missing.given(wo)
        given = lost * self.derived.ratio
        return safe_div(given, given + maximum(1.0 - lost, 0.0))


def with_terms(base: BSDF, wo: Direction, wi: Direction, single: Spectrum, multi: Spectrum) -> Parts | AllParts:
    """`AllParts` with D, G and F of the base if it has them, else `Parts`."""
    if not base.has_terms:
        return Parts(single, multi)
    d, g, f = base.terms(wo, wi)
    return AllParts(d, g, f, single, multi)


@function
def lobe_ratio(f_add: Spectrum, lost: MissingEnergy) -> Scalar:
    """The color of the compensation divided by the color of single scattering, each averaged over the channels."""
    return safe_div(mean(f_add), maximum(mean(lost.F_avg * lost.factor), 1e-6))


def _direction(types: backend.Types, mu: NDArray[np.float64], phi: float = 0.0) -> Array:
    sin = np.sqrt(np.maximum((1.0 - mu) * (1.0 + mu), 0.0))
    return backend.vector_of(frame.spherical_array(sin, mu, phi), 3, types)
