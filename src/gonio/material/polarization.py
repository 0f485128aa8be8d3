"""How a material polarizes: the light that single smooth facets have reflected or refracted."""

from __future__ import annotations

from typing import NamedTuple

from ..ops import Direction, Scalar, Spectrum
from ..optics.fresnel.polarization import Diattenuation


class Polarized(NamedTuple):
    """A part of what a material sends from one direction to another, whose polarization is known.

    value    how much: its part of `eval`, or of a delta lobe's weight
    normal   of the facets that it met, in the local frame, either side
    matrix   the Mueller matrix of such a facet, in the plane of incidence, over its first entry
    """

    value: Spectrum
    normal: Direction
    matrix: Diattenuation[Spectrum] | Diattenuation[Scalar]

    def times(self, factor: Scalar) -> Polarized:
        """The part of a material that has this share."""
        return self._replace(value=self.value * factor)
