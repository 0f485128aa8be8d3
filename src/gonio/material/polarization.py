"""The polarization of a material: light that single smooth facets have reflected or refracted."""

from __future__ import annotations

from typing import NamedTuple

from ..ops import Direction, Scalar, Spectrum
from ..optics.fresnel.polarization import Diattenuation


class Polarized(NamedTuple):
    """A part of the light scattered from one direction to another, with known polarization.

    value    its contribution to `eval`, or to a delta lobe's weight
    normal   of the scattering facets, in the local frame, on either side
    matrix   the Mueller matrix of such a facet, in the plane of incidence, divided by its first entry
    """

    value: Spectrum
    normal: Direction
    matrix: Diattenuation[Spectrum] | Diattenuation[Scalar]

    def times(self, factor: Scalar) -> Polarized:
        """This part, scaled by the fraction of its material in a mixture."""
        return self._replace(value=self.value * factor)
