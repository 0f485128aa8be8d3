"""A material on both sides of a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...material.bsdf import BSDF, Delta, InnerAlbedo
from ...material.calling import method
from ...material.parameters import bsdf
from ...material.polarization import Polarized
from ...material.sample import Sample
from ...ops import Direction, Mask, Mode, Scalar, Spectrum, function, vec3, where


class TwoSided(BSDF):
    """A base material applied to both sides of a surface, which then look the same. The base must not transmit."""

    base: BSDF = bsdf("the material on both sides; it must not transmit")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.base.transmits:
            raise InputError(
                f"{type(self.base).__name__} transmits, a material that only reflects expected",
                "TwoSided.base",
                "a transmitting material has two sides of its own",
            )

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The value of the base. Both directions are mirrored if wo is below the surface."""
        return self.base.eval(_toward_front(wo, wo), _toward_front(wi, wo), mode)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The density of the base, with the directions mirrored as in `eval`."""
        return self.base.pdf(_toward_front(wo, wo), _toward_front(wi, wo))

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """The base's sample, mirrored back."""
        s = self.base.sample(_toward_front(wo, wo), u, mode)
        return Sample(_toward_front(s.wi, wo), s.weight, s.pdf, s.delta, s.eta)

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """The polarized parts of the base, mirrored back."""
        parts = self.base.polarized(_toward_front(wo, wo), _toward_front(wi, wo), delta, mode)
        return tuple(part._replace(normal=_toward_front(part.normal, wo)) for part in parts)

    def tint(self, wo: Direction) -> Spectrum:
        """The base's tint."""
        return self.base.tint(_toward_front(wo, wo))

    @property
    def delta(self) -> Delta:
        return self.base.delta

    @property
    def two_sided(self) -> bool:
        return True

    @property
    def back_differs(self) -> bool:
        return False

    @property
    def ambient(self) -> Spectrum | None:
        """The ambient reflectance of the base."""
        return self.base.ambient

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """The base's albedo, which is the same from both sides."""
        return inner(self.base, np.abs(mu), phi)


@function
def _toward_front(w: Direction, wo: Direction) -> Direction:
    """w with its z mirrored if wo is below the surface."""
    return vec3(w.x, w.y, where(wo.z < 0.0, -w.z, w.z))
