"""Facts that materials state about themselves: known violations, presets, microsurface and interior."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ..ops import Pair, Scalar, Spectrum
from .parameters import Value


class KnownViolation(NamedTuple):
    """A law that a model violates by design.

    reason   the reason, as a clause; the manual and the verifier print it
    size     the largest violation, in the unit of the law's measured value (for `energy`, the gain of the lossless
             variant): a number, or a function of the model; 0 if the law holds with these parameters, math.inf if
             the violation is unbounded
    certain  whether the violation is always present; if so, the verifier fails a model that satisfies the law
    """

    reason: str
    size: Any
    certain: bool = True


class Limit(NamedTuple):
    """Values at which a part of a model is switched off, and the consequences, which the law `limits` tests.

        limits = (
            Limit({"coat_weight": 0.0}, mutes=("coat_*",)),
            Limit({"thickness": 0.0}, equals=lambda one: one.base),
        )

    values  parameter name -> the number, within its range, that switches the part off
    mutes   patterns, as in `fnmatch`, for the names of parameters that then have no effect on `eval`
    equals  function that maps the model with these values to an equal model without the part; None if not stated
    holds   function of the model that returns whether it has this limit; None if it always has
    """

    values: Mapping[str, float]
    mutes: tuple[str, ...] = ()
    equals: Callable[[Any], Any] | None = None
    holds: Callable[[Any], bool] | None = None


class Preset(NamedTuple):
    """Named values of some parameters.

    title   the long name, such as "gold"
    values  parameter name -> value
    source  the reference for the values
    also    other names by which it can be chosen
    """

    title: str
    values: Mapping[str, Value]
    source: str = ""
    also: tuple[str, ...] = ()


class Microsurface(NamedTuple):
    """The rough surface of a material, for which `gonio.energy` computes tables.

    ndf, masking, fresnel  names of the distribution of normals, the masking term and the Fresnel term
    alpha, rotation        the two widths and the rotation, as in the material's parameters
    eta                    index inside divided by index outside, for a dielectric; None for a conductor
    albedo                 scale factor of all scattered light
    transmits              whether light is refracted into the material
    """

    ndf: str
    masking: str
    fresnel: str
    alpha: Pair
    rotation: Pair | None
    eta: Scalar | None
    albedo: Spectrum
    transmits: bool


class Interior(NamedTuple):
    """The medium behind a surface.

    eta         index of the medium, relative to vacuum if media are nested, else relative to the outside
    absorption  absorption coefficient, per unit length
    priority    priority of the medium; where media overlap, the one with the highest priority applies
    """

    eta: Scalar
    absorption: Spectrum
    priority: Scalar
