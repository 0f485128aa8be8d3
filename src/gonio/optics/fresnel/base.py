"""The base class of all Fresnel kinds. A subclass must define `curve`, or `conductor` and `dielectric`.

`eta` is the index on the far side divided by the index on the incident side; for conductors, eta and k are those of the
metal divided by the index of the outer dielectric. Cosines are >= 0 and relative to the facet's normal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar, TypeVar

from ...members import Family, instances_of
from ...ops import Scalar, Spectrum, fma, function, maximum, safe_sqrt, sqr, where, zeros_like
from ..part import Part
from ..special import gauss

R = TypeVar("R", Scalar, Spectrum)
N = TypeVar("N", float, Scalar, Spectrum)

# number of nodes of the Gauss-Legendre rule in sqrt(mu); the error is 2e-7 for all metal presets and 4e-8 for glass
# with eta from 1.05 to 3
NODES = 10


class Fresnel(Part):
    """Reflectance of unpolarized light at a smooth interface, as a function of the angle and on average.

    The first line of a subclass's docstring is its title in the manual.

    white  whether it reflects all light at any angle and index, as furnace tests and tables require
    """

    name: ClassVar[str] = ""
    family: ClassVar[Family[Fresnel]]
    white: ClassVar[bool] = False
    formulas: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "curve": ("float", "spectrum", "spectrum"),
        "conductor": ("float", "spectrum", "spectrum", "spectrum"),
        "dielectric": ("float", "float", "float", "float"),
    }

    def missing(self) -> str:
        own = type(self)
        written = (own.curve, own.conductor, own.dielectric) != (Fresnel.curve, Fresnel.conductor, Fresnel.dielectric)
        return "" if written else "curve(self, cos_i, r0)"  # a kind may be defined for metals only

    def curve(self, cos_i: Scalar | float, r0: R) -> R:
        """Reflectance at cos_i of an interface that reflects r0 at normal incidence."""
        raise self.lacks("neither `curve` nor `conductor` and `dielectric`", "curve(self, cos_i, r0)")

    def conductor(self, cos_i: Scalar | float, eta: Spectrum, k: Spectrum) -> Spectrum:
        """Reflectance of a metal with complex index eta + i k; by default, `curve` for its R0."""
        return self.curve(cos_i, r0_conductor(eta, k))

    def dielectric(self, cos_i: Scalar, cos_t: Scalar, eta: Scalar) -> Scalar:
        """Reflectance of a dielectric; by default, `curve` for its R0.

        cos_i, cos_t  cosines of incidence and transmission; cos_t is 0 for total reflection
        From the denser side, the curve is evaluated at the transmitted angle, so that it is 1 at the critical angle.
        """
        return where(cos_t > 0.0, self.curve(where(eta < 1.0, cos_t, cos_i), r0_dielectric(eta)), 1.0)

    def conductor_average(self, eta: Spectrum, k: Spectrum) -> Spectrum:
        """F_avg = 2 int F mu dmu of a metal, by Gauss-Legendre quadrature in sqrt(mu) with an error of 2e-7."""
        return average(lambda mu: self.conductor(mu, eta, k))

    def dielectric_average(self, eta: Scalar) -> Scalar:
        """F_avg of a dielectric of index eta or 1 / eta from its less dense side, by the same rule, with an error of
        4e-8.

        From the denser side, it is 1 - (1 - F_avg) / eta^2 for eta > 1, by reciprocity.
        """
        eta = maximum(eta, 1.0 / eta)

        def at(mu: float) -> Scalar:
            cos = mu + zeros_like(eta)
            return self.dielectric(cos, cos_transmitted(cos, eta), eta)

        return average(at)


Fresnel.family = Family("Fresnel kind", "gonio.fresnels", (__package__,), instances_of(Fresnel), "fresnel")


def kind(name: str) -> Fresnel:
    """The Fresnel kind of this name. Raises InputError if there is none."""
    return Fresnel.family.get(name)


def average(reflectance: Callable[[float], R]) -> R:
    """2 int F(mu) mu dmu for a function F of the cosine, as a sum of fixed length, which can be recorded."""
    rule = [(float(x), float(w)) for x, w in zip(*gauss(NODES), strict=True)]  # NumPy floats would absorb Dr.Jit values
    (x, w), *others = rule
    total = reflectance(x * x) * (4.0 * w * x**3)
    for x, w in others:
        total = total + reflectance(x * x) * (4.0 * w * x**3)
    return total


@function
def cos_transmitted(cos_i: Scalar, eta: Scalar) -> Scalar:
    """Cosine of the refracted direction by Snell's law; 0 at and beyond the critical angle.

    It is sqrt(1 - (1 - cos^2) / eta^2), with eta^2 - 1 computed as a product, so that digits cancel only at the
    critical angle.
    """
    return safe_sqrt(fma(cos_i, cos_i, (eta - 1.0) * (eta + 1.0))) / eta


@function
def r0_dielectric(eta: N) -> N:
    """Reflectance at normal incidence, ((eta - 1) / (eta + 1))^2 (course sheet, eq. 12)."""
    return sqr((eta - 1.0) / (eta + 1.0))


@function
def r0_conductor(eta: N, k: N) -> N:
    """Reflectance at normal incidence, ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2) (course sheet, eq. 11)."""
    return (sqr(eta - 1.0) + sqr(k)) / (sqr(eta + 1.0) + sqr(k))
