"""A metal under a thin film."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...material.bsdf import BSDF, Limit
from ...material.parameters import Colour, Number, choice, number, spectrum
from ...ops import Scalar, Spectrum, backend, function, ones_like
from ...optics.fresnel import average as mean_over_angles
from ...optics.fresnel import film
from ...optics.fresnel.polarization import Diattenuation
from .conductor import Conductor

FRESNELS = {"exact": "interference of the waves reflected in the film", "one": "F = 1, a perfect mirror"}


def thickness_number() -> Number:
    """Declare the film's thickness."""
    return number(default=300.0, doc="thickness of the film", low=0.0, high=3000.0, unit="nm")


def film_index() -> Number:
    """Declare the film's index."""
    return number(default=1.38, doc="refractive index of the film, relative to the outside", low=1.0, high=3.0)


def film_form() -> str:
    """Declare how RGB colors are computed from the interference."""
    return choice("local", "how RGB colors are computed", film.FORMS)


def bare(one: Conductor) -> Conductor:
    """The metal without its film. If its indices vary with the wavelength, this is the metal under a film of index 1,
    because F under a film is evaluated at all wavelengths, and that of `conductor` at three."""
    values = {name: getattr(one, name) for name in Conductor.parameters()}
    varies = any(backend.is_drjit(x) or np.ptp(np.asarray(x, float)) > 0.0 for x in (values["eta"], values["k"]))
    return FilmConductor(**values, thickness=0.0, film_eta=1.0) if varies else Conductor(**values)


def without_film(bare: Callable[[Any], BSDF]) -> tuple[Limit, ...]:
    """The limits of a film: thickness 0 and index 1, both of which give the surface that `bare` returns. The colors of
    `belcour-barla` are approximate, so it has none."""

    def exact(one: Any) -> bool:
        return bool(one.form != "belcour-barla")

    return (
        Limit({"thickness": 0.0}, mutes=("film_eta",), equals=bare, holds=exact),
        Limit({"film_eta": 1.0}, mutes=("thickness",), equals=bare, holds=exact),
    )


class FilmConductor(Conductor):
    """A rough metal under a thin clear film: `conductor` with thin-film interference in F (Belcour2017).

    The film covers each facet. In spectral variants, F is evaluated at each wavelength. In RGB variants, `form`
    determines how the color of F is computed; the metal's indices are given at 650, 550 and 450 nm and interpolated
    linearly. For films thicker than 2 or 3 um, the 20 nm steps of `local` do not resolve the fringes.
    """

    if TYPE_CHECKING:  # the conductor's parameters, which mypy does not recognize as declared
        eta: Colour = spectrum(0.0)
        k: Colour = spectrum(1.0)
        albedo: Colour = spectrum(1.0)
    fresnel: str = choice("exact", "Fresnel reflectance", FRESNELS, white="one")
    thickness: Number = thickness_number()
    film_eta: Number = film_index()
    form: str = film_form()

    limits: ClassVar[tuple[Limit, ...]] = without_film(bare)
    reads_wavelengths: ClassVar[bool] = True

    @function
    def reflectance(self, cos_theta: Scalar) -> Spectrum:
        """`albedo` times F of the film at the cosine of incidence on a facet."""
        if self.fresnel == "one":
            return self.albedo * ones_like(cos_theta)
        return self.albedo * film.reflectance(cos_theta, self._film())

    def _film(self) -> film.Film:
        return film.Film(self.eta, self.k, self.film_eta, self.thickness, self.form, self.wavelengths)

    def _polarization(self, cos_theta: Scalar) -> Diattenuation[Spectrum]:
        return film.polarization(cos_theta, self._film())[0]

    def mean_reflectance(self, average: str = "exact") -> Spectrum:
        """F_avg by quadrature, for any `average`; its ten angles resolve films up to about 1 um."""
        if self.fresnel == "one":
            return ones_like(self.eta)
        one = ones_like(self.film_eta)
        return mean_over_angles(lambda mu: film.reflectance(mu * one, self._film()))
