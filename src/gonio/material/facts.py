"""Facts that materials state about themselves: known violations, presets, microsurface and interior."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ..ops import Pair, Scalar, Spectrum
from .parameters import Value


class KnownViolation(NamedTuple):
    """A law that a model violates by design.

    reason   why, as part of a sentence; the manual and the verifier print it
    size     the largest violation, in the unit of the law's measured value (for `energy`, the gain of the lossless
             variant): a number, or a function of the model; 0 if the law holds with these parameters, math.inf if
             nothing bounds the violation
    certain  whether the violation is always present: the verifier then fails a model that satisfies the law
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

    values  the parameters that switch it off, by name; numbers within their ranges
    mutes   patterns, as in `fnmatch`, of the parameters that then have no effect on `eval`
    equals  function of the model with these values that returns the model without that part; None to state only `mutes`
    """

    values: Mapping[str, float]
    mutes: tuple[str, ...] = ()
    equals: Callable[[Any], Any] | None = None


class Preset(NamedTuple):
    """Named values of some parameters.

    title   the long name, "gold"
    values  parameter -> value
    source  the reference for the values
    """

    title: str
    values: Mapping[str, Value]
    source: str = ""


class Microsurface(NamedTuple):
    """The rough surface that a material consists of, for which `gonio.energy` has tables.

    ndf, masking, fresnel  by name
    alpha, rotation        widths and rotation, as the parameters hold them
    eta                    index inside divided by index outside, for a dielectric; None for a conductor
    albedo                 factor on all scattered light
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

    eta         index inside, relative to vacuum if media are nested, else relative to the outside
    absorption  absorbed fraction per unit length (absorption coefficient)
    priority    where media overlap, the one with the highest priority is present
    """

    eta: Scalar
    absorption: Spectrum
    priority: Scalar
