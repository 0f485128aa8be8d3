"""Compensation by a factor (Turquin2019)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...energy.compensation.lobe import MissingEnergy
from ...energy.compensation.missing import missing_energy
from ...material import BSDF, KnownViolation, Sample, bsdf, method
from ...material.bsdf import InnerAlbedo
from ...ops import Direction, Mode, Scalar, Spectrum, backend, maximum
from ...optics import frame
from ._compensated import INTERPOLATED, AllParts, Parts, _OnBase, with_terms


class Derived(NamedTuple):
    """Values that do not depend on directions: 1 - E of the base at F = 1, and F0."""

    missing: MissingEnergy
    f0: Spectrum


class Turquin(_OnBase):
    """f = f_base (1 + F0 (1 - E(mu_o)) / E(mu_o)): the single-scattering lobe, scaled up (Turquin2019, eq. 16).

    E(mu) is the albedo of the base at F = 1, and F0 is the reflectance at normal incidence. At F = 1, no light is lost.
    The factor preserves the shape of the lobe, so sampling is unchanged. The model is not reciprocal, because the
    factor depends on wo only.
    """

    base: BSDF = bsdf("the material whose energy loss is compensated; it must not transmit")
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "reciprocity": KnownViolation("the compensation factor depends on the view direction only", 4.0, certain=False),
        "energy": INTERPOLATED,
    }
    _takes_glass: ClassVar[bool] = False

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """The base's albedo times the factor."""
        of_base = None if nodes is None or self.anisotropic else inner(self.base, mu, phi)
        if of_base is None:
            return None
        types = backend.types("float64")
        sin = np.sqrt(np.maximum(1.0 - mu * mu, 0.0))
        wo = backend.vector_of(frame.spherical_array(sin, mu, phi), 3, types)
        return of_base * backend.to_numpy(self.bind(types)._factor(wo), len(mu))

    def derive(self) -> Derived:
        """E from its polynomial, and F0."""
        f0 = self.base.normal_reflectance()
        assert f0 is not None, "checked on construction"
        return Derived(missing_energy(self.base), f0)

    def _factor(self, wo: Direction) -> Spectrum:
        """1 + F0 (1 - E(mu_o)) / E(mu_o), with E clamped to >= 0.05."""
        lost, F0 = self.derived
        one_minus_E = ops.minimum(lost.at(wo), 0.95)
        return 1.0 + F0 * (one_minus_E / maximum(1.0 - one_minus_E, 0.05))

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The base times the factor."""
        return self.base.eval(wo, wi, mode) * self._factor(wo)

    @method
    def terms(self, wo: Direction, wi: Direction) -> Parts | AllParts:
        """The base and the increase by the factor: `AllParts` if the base has D, G and F, else `Parts`."""
        single = self.base.eval(wo, wi)
        return with_terms(self.base, wo, wi, single, single * (self._factor(wo) - 1.0))

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The density of the base, because the factor preserves the shape of the lobe."""
        return self.base.pdf(wo, wi)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """The base's sample, with its weight multiplied by the factor."""
        s = self.base.sample(wo, u, mode)
        return Sample(s.wi, s.weight * self._factor(wo), s.pdf, s.delta, s.eta)
