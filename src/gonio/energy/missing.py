"""What each kind of base misses, and the lobes that give it back: the rules behind compensated materials.

A rule is a class of functions over (material, derived values, directions), one for metals, one for rough glass. All
values are of the vocabulary of `gonio.ops`.
"""

from __future__ import annotations

from typing import Any

from .. import ops
from ..errors import InputError
from ..models import BSDF, microfacet
from ..models.conductor import Conductor
from ..models.dielectric import Dielectric
from ..ops import clamp, inset, lookup, maximum, mean, safe_div, sincos, sqrt, vec3, where
from . import curves, fresnel_average

# M_avg below this is less than the polynomials' own error: nothing is missing
NOTHING = 1e-5


def check_base(base: BSDF, where_: str, transmitting: bool) -> None:
    """Raise InputError where a base cannot be compensated."""
    hint = "compensate a conductor or a dielectric first, then mix it or make it two-sided"
    if not isinstance(base, Conductor | Dielectric):
        raise InputError(f"{type(base).__name__} given, Conductor or Dielectric expected", where_, hint)
    if base.transmits and not transmitting:
        hint = "Dielectric(transmission=False), or KullaConty, which splits the energy between both sides"
        raise InputError(f"{type(base).__name__} transmits, a material that only reflects expected", where_, hint)


def rule(base: Any) -> type[Metal]:
    """The rule of a base."""
    return Glass if base.transmits else Metal


def anisotropic(base: Any) -> bool:
    """Whether the base was given two widths; known before anything runs."""
    alpha = base.__dict__.get("_given_alpha", base.alpha)
    return isinstance(alpha, tuple | list) and alpha[0] is not alpha[1]


class Metal:
    """Bases that only reflect: conductors, and dielectrics without transmission."""

    @staticmethod
    def derive(material: Any) -> dict[str, Any]:
        """Polynomial of M, its average, and f_add / (pi M_avg)."""
        base = material.base
        alpha, _ = microfacet.widths(base.alpha)
        width = alpha.x
        found = curves.coefficients(base.ndf, base.masking, width)
        bend = curves.knee(base.masking, width)
        average = maximum(found[-1], 0.0)
        f_avg, albedo = _reflectance_average(material)
        added = _bounces(material.color, f_avg, 1.0 - average) * albedo
        scale = safe_div(ops.inv_pi, where(average > NOTHING, average, 0.0))
        return {
            "missing": found[:-1],
            "bend": bend,
            "top": safe_div(2.0, curves.squeeze(base.masking, 1.0 + 0.0 * width, bend)),
            "scale": scale,
            "added": added * scale,
            "ratio": safe_div(mean(added), maximum(mean(f_avg * albedo), 1e-6)),
            "row": inset(sqrt(width), curves.ROWS),
        }

    @staticmethod
    def missing(material: Any, found: dict[str, Any], w: Any) -> Any:
        """M at a direction; 0 below the surface."""
        mu = maximum(w.z, 1e-6)
        return where(
            w.z > 0.0, curves.missing(material.base.masking, found["missing"], found["bend"], found["top"], mu), 0.0
        )

    @staticmethod
    def added(material: Any, found: dict[str, Any], wo: Any, wi: Any, mode: str) -> Any:
        """f_add f_ms |cos theta_i|."""
        m_o, m_i = Metal.missing(material, found, wo), Metal.missing(material, found, wi)
        return found["added"] * (m_o * m_i * wi.z)

    @staticmethod
    def share(material: Any, found: dict[str, Any], wo: Any) -> Any:
        """Probability of the broad lobe: the power it carries over all the power, at the mean colour."""
        m_o = where(found["scale"] > 0.0, Metal.missing(material, found, wo), 0.0)
        given = m_o * found["ratio"]
        return safe_div(given, given + (1.0 - m_o))

    @staticmethod
    def pdf(material: Any, found: dict[str, Any], wo: Any, wi: Any) -> Any:
        """M(mu_i) mu_i / (pi M_avg)."""
        return Metal.missing(material, found, wi) * maximum(wi.z, 0.0) * found["scale"]

    @staticmethod
    def sample(material: Any, found: dict[str, Any], wo: Any, u: Any) -> Any:
        """A direction of that density: mu^2 from the table of its inverse, any azimuth."""
        base = material.base
        (mu2,) = lookup(curves.lobe(base.ndf, base.masking), found["row"], inset(u.y, curves.LOBE_NODES))
        mu2 = clamp(mu2, 1e-12, 1.0)
        sin, (s, c) = sqrt(1.0 - mu2), sincos((2.0 * ops.pi) * u.z)
        return vec3(sin * c, sin * s, sqrt(mu2))

    @staticmethod
    def eta(material: Any, wo: Any, wi: Any) -> Any:
        """Index on wi's side over index on wo's side."""
        return 1.0 + 0.0 * wo.z


def _bounces(color: str, f_avg: Any, e_avg: Any) -> Any:
    """f_add: what the geometric series of bounces leaves of the light, by name."""
    series = f_avg * e_avg / (1.0 - f_avg * (1.0 - e_avg))
    return series * f_avg if color == "bounce" else series


def _reflectance_average(material: Any) -> tuple[Any, Any]:
    """(F_avg, albedo) of a base that only reflects."""
    base = material.base
    if hasattr(base, "k"):
        return fresnel_average.of_metal(base, material.average), base.albedo
    return fresnel_average.of_glass(base), base.albedo


class Glass(Metal):
    """Rough dielectrics."""
