"""Glass under a thin film."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...material.bsdf import InnerAlbedo, KnownViolation, Limit, Microsurface
from ...material.parameters import Colour, Number, choice, number, spectrum
from ...ops import Mask, Scalar, Spectrum, abs, function, mean, ones_like, safe_div, sqr, where, zeros_like
from ...optics import fresnel
from ...optics.fresnel import average as mean_over_angles
from ...optics.fresnel import film
from ...optics.fresnel.polarization import Diattenuation, reflected_by_glass
from .dielectric import Dielectric, _Facet
from .film_conductor import FRESNELS, film_form, film_index, thickness_number, without_film


def bare(one: Dielectric) -> Dielectric:
    """The glass without its film."""
    return Dielectric(**{name: getattr(one, name) for name in Dielectric.parameters()})


class FilmDielectric(Dielectric):
    """Rough glass under a thin clear film: `dielectric` with thin-film interference in F (Belcour2017).

    Light that the film does not reflect is transmitted, in the complementary colors. The film is on the outside; for
    light from inside, F is evaluated for the refracted direction outside. `form` and its limitations are the same as in
    `film-conductor`. With eta = film_eta = 1, there is no surface; eta = 1 and film_eta = 1.33 represent a soap bubble.
    """

    if TYPE_CHECKING:  # the dielectric's parameters, which mypy does not recognize as declared
        eta: Number = number(1.5)
        albedo: Colour = spectrum(1.0)
    fresnel: str = choice("exact", "Fresnel reflectance", FRESNELS, white="one")
    thickness: Number = thickness_number()
    film_eta: Number = film_index()
    form: str = film_form()

    limits: ClassVar[tuple[Limit, ...]] = without_film(bare)
    reads_wavelengths: ClassVar[bool] = True
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "delta": KnownViolation(
            "the reflectance is that of the coated interface, not the Fresnel reflectance for `eta` alone",
            1.0,
            certain=False,
        )
    }

    @function
    def reflectance(self, cos_o: Scalar, cos_t: Scalar, eta: Scalar) -> Spectrum:  # type: ignore[override]
        """F of the film at the cosines of incidence, cos_o, and of transmission, cos_t (0 for total reflection)."""
        white = ones_like(self.albedo)
        if self.fresnel == "one":
            return white * ones_like(cos_o)
        filmed = film.reflectance(where(self._inside(eta), cos_t, cos_o), self._film())
        return where(cos_t > 0.0, filmed, white)

    def _inside(self, eta: Scalar) -> Mask:
        """Whether light comes from inside the glass, by eta, the index on the far side divided by that on the near
        side."""
        return (eta - 1.0) * (self.eta - 1.0) < 0.0

    def _film(self) -> film.Film:
        zero = zeros_like(self.albedo)
        return film.Film(zero + self.eta, zero, self.film_eta, self.thickness, self.form, self.wavelengths)

    def _share(self, f: Spectrum) -> Scalar:  # type: ignore[override]
        return mean(f) if self.transmission else ones_like(mean(f))

    def _over_chance(self, facet: _Facet, eta: Scalar) -> Spectrum:
        """As in `Dielectric`, except that the mean of the color is the probability of a lobe."""
        _, smooth = self._widths()  # no facet is determined if light is not deflected
        cos_o, cos_i = (
            where(smooth, abs(w.z), abs(dot)) for w, dot in ((facet.wo, facet.dot_o), (facet.wi, facet.dot_i))
        )
        f = self.reflectance(cos_o, where(facet.reflects, fresnel.cos_transmitted(cos_o, eta), cos_i), eta)
        share = self._share(f)
        if not self.transmission:
            return self.albedo * f
        return self.albedo * where(facet.reflects, safe_div(f, share), safe_div(1.0 - f, 1.0 - share))

    def _polarization(  # type: ignore[override]
        self, cos_o: Scalar, cos_i: Scalar, eta: Scalar
    ) -> tuple[Diattenuation[Spectrum], Diattenuation[Spectrum]]:
        """As in `Dielectric`. For light from inside, the Stokes relations are used: the amounts are equal, and the
        phases are those of time reversal."""
        inside = self._inside(eta)
        cos_t = fresnel.cos_transmitted(cos_o, eta)
        back, _ = film.polarization(where(inside, cos_t, cos_o), self._film())
        _, on = film.polarization(where(inside, cos_i, cos_o), self._film())
        through = film.polarization(where(inside, cos_t, cos_o), self._film())[1]
        size = 1.0 / (sqr(through.c) + sqr(through.s) + 1e-12)
        cos2, sin2 = (sqr(through.c) - sqr(through.s)) * size, 2.0 * through.c * through.s * size
        from_inside = Diattenuation(back.d, back.c * cos2 + back.s * sin2, back.c * sin2 - back.s * cos2)
        total, white = reflected_by_glass(cos_o, eta), ones_like(self.albedo)

        def chosen(place: int) -> Spectrum:
            return where(cos_t > 0.0, where(inside, from_inside[place], back[place]), white * total[place])

        return Diattenuation(chosen(0), chosen(1), chosen(2)), on

    @property
    def microsurface(self) -> Microsurface | None:  # type: ignore[override]
        """None, because the energy tables are those of bare glass."""
        return None

    def mean_reflectance(self, average: str = "exact") -> Spectrum:  # type: ignore[override]
        """F_avg from outside, by quadrature; its ten angles resolve films up to about 1 um."""
        if self.fresnel == "one":
            return ones_like(self.albedo)
        one = ones_like(self.film_eta)
        return mean_over_angles(lambda mu: film.reflectance(mu * one, self._film()))

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """The albedo of smooth glass; None without transmission."""
        return super().known_albedo(mu, phi, inner, nodes) if self.transmission else None
