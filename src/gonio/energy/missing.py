"""What each kind of base misses, and the lobes that give it back: the rules behind compensated materials.

A rule is a class of functions over (material, derived values, directions): one for metals, one for rough glass, and
one for any other base (`gonio.energy.measured`). All values are of the vocabulary of `gonio.ops`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from .. import ops
from ..errors import InputError
from ..models import BSDF, microfacet
from ..models.conductor import Conductor
from ..models.dielectric import Dielectric
from ..models.two_sided import TwoSided
from ..ops import (
    abs,
    backend,
    clamp,
    copysign,
    function,
    inset,
    lookup,
    maximum,
    mean,
    minimum,
    safe_div,
    sincos,
    sqr,
    sqrt,
    vec3,
    where,
)
from ..optics import frame
from . import curves, fresnel_average
from .measured import Measured

# M_avg below this is less than the polynomials' own error: nothing is missing
NOTHING = 1e-5


def check_base(base: BSDF, where_: str, transmitting: bool, any_base: bool = False) -> None:
    """Raise InputError where a base cannot be compensated.

    transmitting  whether a rough Dielectric may transmit
    any_base      whether other bases than Conductor and Dielectric are taken: any that reflects by a finite lobe
    """
    name = type(base).__name__
    if isinstance(base, Conductor | Dielectric):
        if base.transmits and not transmitting:
            hint = "Dielectric(transmission=False), or KullaConty, which splits the energy between both sides"
            raise InputError(f"{name} transmits, a material that only reflects expected", where_, hint)
        return
    hint = "compensate a conductor or a dielectric first, then mix it or make it two-sided"
    if not any_base or not base.name or isinstance(base, TwoSided):
        expected = "a Gonio material seen from one side" if any_base else "Conductor or Dielectric"
        raise InputError(f"{name or 'a foreign BSDF'} given, {expected} expected", where_, hint)
    if base.transmits:
        raise InputError(f"{name} transmits, a material that only reflects expected", where_, hint)
    if base.delta != "never" or base.stochastic:
        why = "has a perfectly specular part" if base.delta != "never" else "is random"
        raise InputError(f"{name} {why}, a material with a finite lobe expected", where_, hint)
    if not base.isotropic:
        raise InputError(f"{name} has two widths inside, one expected", where_, hint)


def rule(base: Any) -> Any:
    """The rule of a base."""
    if not isinstance(base, Conductor | Dielectric):
        return Measured
    return Glass if base.transmits else Metal


def turned(base: BSDF) -> bool:
    """Whether an unbound microfacet base has, or may have, two widths that differ; it shapes the code."""
    if not isinstance(base, Conductor | Dielectric):
        return False
    alpha = base.alpha
    if isinstance(alpha, tuple | list):
        plain = all(isinstance(a, int | float) for a in alpha)
        return not (plain and alpha[0] == alpha[1])
    return backend.is_drjit(alpha) and backend.drjit().is_vector_v(alpha)


class Metal:
    """Bases that only reflect: conductors, and dielectrics without transmission."""

    @staticmethod
    def derive(material: Any) -> dict[str, Any]:
        """Polynomial of M, its average, and f_add / (pi M_avg)."""
        base = material.base
        alpha, _ = microfacet.widths(base.alpha)
        two = material.turned
        width = sqrt(alpha.x * alpha.y) if two else alpha.x
        found = curves.coefficients(base.ndf, base.masking, width)
        form = curves.form_of(base.ndf, base.masking)
        bend = curves.knee(form, base.masking, width)
        average = lobe_average = maximum(found[-1], 0.0)
        more: dict[str, Any] = {}
        if two:
            big, small = maximum(alpha.x, alpha.y), minimum(alpha.x, alpha.y)
            at = (inset(sqrt(small / big), curves.ASPECTS), inset(sqrt(big), curves.ASPECT_ROWS))
            channels = lookup(curves.anisotropic(base.ndf, base.masking), *at)
            average = maximum(channels[-1], 0.0)
            more = {"turned": channels[:-1], "alpha": alpha}
        f_avg, albedo = _reflectance_average(material)
        added = _bounces(getattr(material, "color", "bounce"), f_avg, 1.0 - average) * albedo
        return {
            "missing": found[:-1],
            "bend": bend,
            "scale": _scale(lobe_average),
            "added": added * _scale(average),
            "ratio": safe_div(mean(added), maximum(mean(f_avg * albedo), 1e-6)),
            "row": inset(sqrt(width), curves.ROWS),
            **more,
        }

    @staticmethod
    @function
    def _isotropic(material: Any, found: dict[str, Any], w: Any) -> Any:
        """M at a direction above the surface, of the mean of the widths."""
        form = curves.form_of(material.base.ndf, material.base.masking)
        return curves.missing(form, found["missing"], found["bend"], w.z)

    @staticmethod
    @function
    def missing(material: Any, found: dict[str, Any], w: Any) -> Any:
        """M at a direction above the surface."""
        if not material.turned:
            return Metal._isotropic(material, found, w)
        base = material.base
        at = _azimuth(frame.rotate(w, base.rotation), found["alpha"])
        form = curves.form_of(base.ndf, base.masking)
        rows = curves.turn(found["turned"], at.along, at.across)
        return curves.missing(form, rows, curves.knee(form, base.masking, at.seen), w.z)

    @staticmethod
    @function
    def added(material: Any, found: dict[str, Any], wo: Any, wi: Any, mode: str) -> Any:
        """f_add f_ms |cos theta_i|."""
        m_o, m_i = Metal.missing(material, found, wo), Metal.missing(material, found, wi)
        return found["added"] * where((wo.z > 0.0) & (wi.z > 0.0), m_o * m_i * wi.z, 0.0)

    @staticmethod
    @function
    def share(material: Any, found: dict[str, Any], wo: Any) -> Any:
        """Probability of the broad lobe: the power it carries over all the power, at the mean colour."""
        m_o = where((found["scale"] > 0.0) & (wo.z > 0.0), Metal._isotropic(material, found, wo), 0.0)
        given = m_o * found["ratio"]
        return safe_div(given, given + (1.0 - m_o))

    @staticmethod
    @function
    def pdf(material: Any, found: dict[str, Any], wo: Any, wi: Any) -> Any:
        """M(mu_i) mu_i / (pi M_avg); of the mean of two widths."""
        return Metal._isotropic(material, found, wi) * maximum(wi.z, 0.0) * found["scale"]

    @staticmethod
    @function
    def sample(material: Any, found: dict[str, Any], wo: Any, u: Any) -> Any:
        """A direction of that density: mu^2 from the table of its inverse, any azimuth."""
        base = material.base
        (mu2,) = lookup(curves.lobe(base.ndf, base.masking), found["row"], inset(u.y, curves.LOBE_NODES))
        mu2 = clamp(mu2, 1e-12, 1.0)
        phi = (2.0 * ops.pi) * u.z
        sin_theta, (s, c) = sqrt(1.0 - mu2), sincos(phi)
        return vec3(sin_theta * c, sin_theta * s, sqrt(mu2))

    @staticmethod
    def eta(material: Any, wo: Any, wi: Any) -> Any:
        """Index on wi's side over index on wo's side."""
        return 1.0 + 0.0 * wo.z


class Azimuth(NamedTuple):
    """Where a direction stands between the axes of the larger and the smaller width, and the width it sees."""

    along: Any
    across: Any
    seen: Any


@function
def _azimuth(w: Any, alpha: Any) -> Azimuth:
    """(1 + y) / 2, (1 - y) / 2 and the width alpha_phi seen along w; at the normal itself any azimuth will do."""
    sin2 = maximum(frame.sin2(w), 1e-12)
    along_x, along_y = sqr(w.x) / sin2, sqr(w.y) / sin2
    seen = sqrt(maximum(sqr(alpha.x) * along_x + sqr(alpha.y) * along_y, sqr(microfacet.SMOOTH)))
    turned = frame.sin2(w) > 1e-12
    x, y = where(turned, alpha.x * along_x, 1.0), where(turned, alpha.y * along_y, 1.0)
    larger_x = alpha.x >= alpha.y
    return Azimuth(where(larger_x, x, y) / (x + y), where(larger_x, y, x) / (x + y), seen)


def _scale(average: Any) -> Any:
    """1 / (pi M_avg), or 0 where nothing is missing."""
    some = average > NOTHING
    return where(some, ops.inv_pi / where(some, average, 1.0), 0.0)


def either(a: Any, b: Any) -> Any:
    """a or b, not both."""
    return (a & ~b) | (b & ~a)


def _bounces(color: str, f_avg: Any, e_avg: Any) -> Any:
    """f_add: what the geometric series of bounces leaves of the light, by name."""
    series = f_avg * e_avg / (1.0 - f_avg * (1.0 - e_avg))
    return series * f_avg if color == "bounce" else series


def _reflectance_average(material: Any) -> tuple[Any, Any]:
    """(F_avg, albedo) of a base that only reflects."""
    base = material.base
    if hasattr(base, "k"):
        return fresnel_average.of_metal(base, getattr(material, "average", "exact")), base.albedo
    return fresnel_average.of_glass(base), base.albedo


def normal_reflectance(base: Any) -> Any:
    """F0 of a base that only reflects, its albedo included."""
    if hasattr(base, "k"):
        return base.reflectance(1.0 + 0.0 * base.alpha.x)
    return base.reflectance(1.0 + 0.0 * base.eta, 1.0 + 0.0 * base.eta, base.eta) * base.albedo


class Glass:
    """Bases that reflect and transmit.

    From side a a share T_a of what is missing goes to side b, the rest back to a (power, not radiance):
        f_reflected = (1 - T_a) M_a(o) M_a(i) / (pi M_avg,a),    f_transmitted = T_a M_a(o) M_b(i) / (pi M_avg,b),
    so that a's albedo is made whole whatever T_a is. Reciprocity, f_ab / n_b^2 = f_ba / n_a^2, asks for
    T_a / (n_b^2 M_avg,b) = T_b / (n_a^2 M_avg,a). As (1 - F_avg,a) n_a^2 = (1 - F_avg,b) n_b^2, it is met by
    T_a = (1 - F_avg,a) M_avg,b / (M_avg,a + M_avg,b)  (Kulla2017, p. 30).
    """

    @staticmethod
    def derive(material: Any) -> dict[str, Any]:
        """Polynomials and averages of both sides, and the shares; "thin" is the side of the lower index."""
        base = material.base
        alpha, _ = microfacet.widths(base.alpha)
        width = sqrt(alpha.x * alpha.y)
        eta = maximum(base.eta, 1.0 / base.eta)
        place = (
            inset(sqrt(maximum(eta - 1.0, 1e-6) / ((eta + 1.0) * curves.LARGEST_ROOT)), curves.GLASS_ETAS),
            inset(sqrt(width), curves.GLASS_ROWS),
        )
        tables = curves.glass(base.ndf, base.masking, base.fresnel)
        thin, dense = (lookup(tables[side], *place) for side in curves.SIDES)
        m_thin, m_dense = maximum(thin[-1], 0.0), maximum(dense[-1], 0.0)
        enters = 1.0 - fresnel_average.of_glass(base)
        total = maximum(m_thin + m_dense, 2.0 * NOTHING)
        some = (m_thin > NOTHING) & (m_dense > NOTHING) & (abs(base.eta - 1.0) > 1e-4)
        bends = {
            side: curves.knee(curves.form_of(base.ndf, base.masking, side), base.masking, width)
            for side in curves.SIDES
        }
        tint = _bounces(getattr(material, "color", "bounce"), base.albedo, 1.0 - 0.5 * (m_thin + m_dense))
        return {
            "thin": thin[:-1],
            "dense": dense[:-1],
            "bends": bends,
            "scale_thin": where(some, ops.inv_pi / maximum(m_thin, NOTHING), 0.0),
            "scale_dense": where(some, ops.inv_pi / maximum(m_dense, NOTHING), 0.0),
            "through_thin": enters * m_dense / total,
            "through_dense": enters / sqr(eta) * m_thin / total,
            "added": tint,
            "ratio": safe_div(mean(tint), maximum(mean(base.albedo), 1e-6)),
            "place": place,
        }

    @staticmethod
    @function
    def _thin(material: Any, w: Any) -> Any:
        """Whether a direction lies on the side of the lower index."""
        inside = w.z < 0.0
        return where(material.base.eta >= 1.0, ~inside, inside)

    @staticmethod
    @function
    def missing(material: Any, found: dict[str, Any], w: Any, thin: Any) -> Any:
        """M at a direction, from its own side."""
        mu = abs(w.z)
        sides = []
        for side in curves.SIDES:
            form = curves.form_of(material.base.ndf, material.base.masking, side)
            sides.append(curves.missing(form, found[side], found["bends"][side], mu))
        return where(thin, *sides)

    @staticmethod
    @function
    def _through(found: dict[str, Any], thin: Any) -> Any:
        """T, the share of what is missing on a side that goes to the other."""
        return where(thin, found["through_thin"], found["through_dense"])

    @staticmethod
    @function
    def added(material: Any, found: dict[str, Any], wo: Any, wi: Any, mode: str) -> Any:
        """The broad lobes times |cos theta_i|."""
        thin = Glass._thin(material, wo)
        value = Glass.missing(material, found, wo, thin) * Glass.pdf(material, found, wo, wi)
        if mode == "radiance":
            reflects = wo.z * wi.z > 0.0
            value = value * where(reflects, 1.0, 1.0 / sqr(Glass.eta(material, wo, wi)))
        return found["added"] * value

    @staticmethod
    @function
    def share(material: Any, found: dict[str, Any], wo: Any) -> Any:
        """Probability of the broad lobes: the power they carry over all the power."""
        m_o = Glass.missing(material, found, wo, Glass._thin(material, wo))
        given = where(found["scale_thin"] > 0.0, m_o, 0.0) * found["ratio"]
        return safe_div(given, given + maximum(1.0 - m_o, 0.0))

    @staticmethod
    @function
    def pdf(material: Any, found: dict[str, Any], wo: Any, wi: Any) -> Any:
        """M(mu_i) mu_i / (pi M_avg) of wi's side, times the share of that side."""
        thin_o, thin_i = Glass._thin(material, wo), Glass._thin(material, wi)
        through = Glass._through(found, thin_o)
        chance = where(wo.z * wi.z > 0.0, 1.0 - through, through)
        scale = where(thin_i, found["scale_thin"], found["scale_dense"])
        value = Glass.missing(material, found, wi, thin_i) * abs(wi.z) * scale * chance
        return where(wo.z * wi.z != 0.0, value, 0.0)

    @staticmethod
    @function
    def sample(material: Any, found: dict[str, Any], wo: Any, u: Any) -> Any:
        """A side by u1, then a direction of that density."""
        base = material.base
        thin = Glass._thin(material, wo)
        passes = u.x < Glass._through(found, thin)
        tables = curves.glass_lobe(base.ndf, base.masking, base.fresnel)
        at = inset(u.y, tables["thin"].shape[-1])
        (of_thin,), (of_dense,) = (lookup(tables[side], *found["place"], at) for side in curves.SIDES)
        mu2 = clamp(where(either(thin, passes), of_thin, of_dense), 1e-12, 1.0)
        phi = (2.0 * ops.pi) * u.z
        sin_theta, (s, c) = sqrt(1.0 - mu2), sincos(phi)
        z = copysign(sqrt(mu2), wo.z)
        return vec3(sin_theta * c, sin_theta * s, where(passes, -z, z))

    @staticmethod
    def eta(material: Any, wo: Any, wi: Any) -> Any:
        """Index on wi's side over index on wo's side."""
        eta = material.base.eta
        return where(wo.z * wi.z > 0.0, 1.0, where(wo.z >= 0.0, eta, 1.0 / eta))
