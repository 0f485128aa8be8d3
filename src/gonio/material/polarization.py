"""The polarization of light that a material has scattered once, at a smooth facet."""

from __future__ import annotations

from typing import NamedTuple

from ..ops import Direction, Scalar, Spectrum
from ..optics.fresnel.polarization import Diattenuation


class Polarized(NamedTuple):
    """A part of the light scattered from one direction to another, with known polarization.

    value    its contribution to `eval`, or to a delta lobe's weight
    normal   the normal of the scattering facets in the local frame, on either side of the surface
    matrix   the Mueller matrix of such a facet, relative to the plane of incidence, divided by its first entry
    """

    value: Spectrum
    normal: Direction
    matrix: Diattenuation[Spectrum] | Diattenuation[Scalar]

    def times(self, factor: Scalar) -> Polarized:
        """This part multiplied by a factor, such as the weight of its material in a mixture."""
        return self._replace(value=self.value * factor)
