"""The reason why a material reflects more light than arrives: the lobe that gains energy, and the relevant parameters.

Without absorption, the albedo of a normalized lobe is at most 1. The albedos of the lossless variant therefore reveal
causes:

    parts       one color 1 and the others 0: a lobe gains energy by itself, or only the sum of the lobes does
    parameters  the albedo is proportional to a power of a parameter, which is missing from the normalization; or there
                is no gain at one end of the range of a parameter
    lobes       at a smooth interface, transmission and reflection do not add up to 1
    views       the albedo is 1 at the normal and a power of cos_o elsewhere: the normalization holds only at the normal
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ...errors import GonioError
from ...material import BSDF, tree
from .. import directions, lobes
from ..subject import Fault, Subject
from .ratio import Cause, written

Albedo = Callable[[Subject], np.ndarray]  # maps a subject to its albedos at VIEWS, (views, channels)

VIEWS = (2.0, 40.0, 60.0, 75.0, 85.0)  # degrees of wo; the first stands for the normal
GAIN = 5e-3
VALUES = 5  # values of a parameter
SPAN = 4.0  # factor by which a parameter is divided and multiplied
POWER = 0.15  # largest difference of an exponent from an integer
RESIDUAL = 0.05  # of a logarithm: Fresnel terms and losses at the horizon vary too
LEAST_AT_NORMAL = 0.8  # smallest albedo at the normal of a material that gains energy only at grazing views
NARROW = 0.3  # largest width at which little light is lost at the horizon
MOST = 6  # largest number of parameters, or of colors


def causes(white: Subject, albedo: Albedo) -> Iterator[Cause]:
    """The lobes, parameters and views on which a gain depends.

    white   the subject without absorption
    albedo  function that returns the albedos of a subject
    """
    if not isinstance(white.model, BSDF) or white.stochastic:
        return
    here = albedo(white)
    if here.max() < 1.0 + GAIN:
        return
    part = _parts(white, albedo, float(here.max()))
    power, end = _power(white, albedo, here)
    one = power or (None if part else end)
    if one is not None:
        yield Cause(f"{one.words}{part and '; ' + part}", one.key)
    elif part:
        yield Cause(part, "gain of a part")
    view = _views(here)
    if view is not None:
        yield view


def _parts(white: Subject, albedo: Albedo, here: float) -> str:
    """A description of the colors whose lobes gain energy on their own; "" if there is none or only one color."""
    colors = {
        leaf.path: leaf.parameter
        for leaf in tree.leaves(white.model)
        if leaf.parameter.kind == "spectrum" and not leaf.parameter.inner and leaf.path not in white.model.fixed
    }
    if not 2 <= len(colors) <= MOST:
        return ""
    by_part: dict[str, float] = {}
    for path in colors:
        black: dict[str, Any] = {other: _low(parameter) for other, parameter in colors.items() if other != path}
        value = _of(white, black, albedo)
        if value is None:
            return ""
        by_part[path] = float(value.max())
    # other colors scale or shift the sum, and do not belong to a single lobe
    if min(by_part.values()) < GAIN or here > sum(by_part.values()) + GAIN:
        return ""
    wrong = [path for path, value in by_part.items() if value > 1.0 + GAIN]
    text = ", ".join(f"{value:.4g} with {path} alone" for path, value in by_part.items())
    if not wrong:
        words = f"the albedo is {text}, but {here:.4g} for all together"
        return f"{words}: is one lobe not attenuated by the reflectance of the other?"
    if len(wrong) < len(colors):
        guess = f"a wrong normalization of the lobe with {' and '.join(wrong)}"
        return f"the largest albedo is {text}; possible mistake: {guess}"
    return ""


def _low(parameter: Any) -> float:
    return max(float(parameter.low), 0.0) if np.isfinite(parameter.low) else 0.0


def _of(subject: Subject, values: dict[str, Any], albedo: Albedo) -> np.ndarray | None:
    try:
        value = albedo(subject.replace(**values))
    except (GonioError, Fault, ValueError, TypeError):
        return None
    return value if np.all(np.isfinite(value)) else None


# --------------------------------------------------------------------------- parameters


def _numbers(white: Subject) -> Iterator[tuple[str, str, Callable[[float], Any], float, float, float]]:
    """The numeric parameters except colors and angles, with each width separately: name, path, the function from a
    number to the value of the parameter, the current number, and its range."""
    for leaf in tree.leaves(white.model):
        parameter, value = leaf.parameter, leaf.value
        if not parameter.numeric or parameter.white is not None or parameter.kind in ("angle", "spectrum"):
            continue
        low, high = float(getattr(parameter, "low", -np.inf)), float(getattr(parameter, "high", np.inf))
        if parameter.kind == "alpha":
            pair = tuple(float(one) for one in value) if isinstance(value, tuple | list) else (float(value),) * 2
            yield f"{leaf.path}.x", leaf.path, functools.partial(_pair, other=pair[1], first=True), pair[0], low, high
            yield f"{leaf.path}.y", leaf.path, functools.partial(_pair, other=pair[0], first=False), pair[1], low, high
        elif isinstance(value, int | float) and not isinstance(value, bool) and float(value) > 0.0:
            yield leaf.path, leaf.path, float, float(value), low, high


def _pair(value: float, other: float, first: bool) -> tuple[float, float]:
    return (value, other) if first else (other, value)


def _power(white: Subject, albedo: Albedo, here: np.ndarray) -> tuple[Cause | None, Cause | None]:
    """A description of the powers of parameters to which the albedo at the normal is proportional, or of an end of a
    range without gain."""
    powers: dict[str, float] = {}
    ends: list[Cause] = []
    scale = 1.0
    for name, path, value_of, now, low, high in list(_numbers(white))[:MOST]:
        least = max(now / SPAN, low + 1e-3 * max(now, 1e-3)) if np.isfinite(low) else now / SPAN
        most = min(now * SPAN, high) if np.isfinite(high) else now * SPAN
        if path.rpartition(".")[2] == "alpha" and now < NARROW:
            most = min(most, NARROW)
        at = np.geomspace(least, most, VALUES) if 0.0 < least < most else np.empty(0)
        results = [(float(x), _of(white, {path: value_of(float(x))}, albedo)) for x in at]
        known = [(x, one) for x, one in results if one is not None]
        if len(known) < 3:
            continue
        x, normal = np.log([x for x, _ in known]), np.log([max(float(one[0].mean()), 1e-9) for _, one in known])
        slope, start = np.polyfit(x, normal, 1)
        power = float(np.round(slope))
        fits = np.abs(normal - (slope * x + start)).max() < RESIDUAL and abs(slope - power) < POWER
        if fits and power != 0.0:
            powers[name] = power
            scale *= now**power
            continue
        largest = np.array([float(one.max()) for _, one in known])
        gains = largest > 1.0 + GAIN
        steps = np.diff(largest)
        if not (np.all(steps > -GAIN) or np.all(steps < GAIN)):
            continue  # as for interference
        if gains.all() and np.isfinite(low):  # the end itself, which has no logarithm if it is 0
            end = _of(white, {path: value_of(low)}, albedo)
            if end is not None and end.max() < 1.0 + GAIN:
                x, largest, gains = np.append(x, -np.inf), np.append(largest, end.max()), np.append(gains, False)
        if gains.any() and not gains.all() and here.max() - largest.min() > 0.5 * (here.max() - 1.0):
            least = float(x[np.argmin(largest)])
            none = float(np.exp(least)) if np.isfinite(least) else low
            words = f"without absorption, the largest albedo is {largest.min():.4g} at {name} = {none:.3g} and "
            words += f"{largest.max():.4g} at {float(np.exp(x[np.argmax(largest)])):.3g}"
            guess = f"a normalization, masking or compensation term that depends on {name} and is too large there"
            ends.append(Cause(f"{words}; possible mistake: {guess}", f"gain by {name}"))
    if powers:
        formula = " ".join(name if power == 1.0 else f"{name}^{power:g}" for name, power in powers.items())
        constant = float(here[0].mean()) / scale
        times = "" if abs(constant - 1.0) < 2.0 * RESIDUAL else f"{written(constant, RESIDUAL)} "
        words = f"without absorption, the albedo at normal incidence is {times}{formula}"
        guess = "powers that are missing from the normalization or applied twice"
        return Cause(f"{words}; possible mistake: {guess}", f"gain {formula}"), None
    return None, ends[0] if ends else None


# --------------------------------------------------------------------------- views


def _views(here: np.ndarray) -> Cause | None:
    """A cause if the albedo is 1 at the normal and proportional to a power of the cosine elsewhere."""
    a = here.mean(1)
    if a[0] < LEAST_AT_NORMAL or a[0] > 1.0 + GAIN or a.max() < 1.0 + GAIN:
        return None
    mu = np.cos(np.radians(VIEWS))
    slope, start = np.polyfit(np.log(mu), np.log(np.maximum(a, 1e-9)), 1)
    guess = "wrong masking, a normalization that holds only at normal incidence, or a missing factor at grazing angles"
    row = int(np.argmax(a))
    words = f"without absorption, the albedo is {a[0]:.4g} at the normal and {a[row]:.4g} at {VIEWS[row]:g} degrees"
    if abs(slope) > 0.05 and np.abs(np.log(a) - (slope * np.log(mu) + start)).max() < 3.0 * RESIDUAL:
        words += f", proportional to cos_o^{slope:.2g}"
    return Cause(f"{words}; possible mistake: {guess}", "gain at grazing views")


# --------------------------------------------------------------------------- delta lobes

EXACT = 1e-3  # tolerance for the light of delta lobes


def of_lobes(subject: Subject, seed: int) -> Iterator[Cause]:
    """Causes from the delta lobes, if the sum of their reflected and transmitted light is not 1."""
    wo = directions.single(directions.at(np.array(VIEWS[1:]), 37.0))
    known = lobes.of(subject, wo, seed, "importance")
    through = known.through(wo)
    if not through.any():
        return
    light = known.carried * known.valid[..., None]
    R, T = (np.sum(light * side[..., None], axis=1) for side in (known.valid & ~through, through))
    if (R + T).max() < 1.0 + GAIN:
        return

    def near(a: np.ndarray) -> bool:
        return bool(np.abs(T - a).max() < EXACT)

    row = int(np.argmax((R + T).max(1)))
    words = f"delta lobes reflect {R[row].max():.4g} and transmit {T[row].max():.4g} at {VIEWS[1 + row]:g} degrees"
    if np.ptp(R, axis=1).max() > EXACT and near(1.0 - R.mean(1, keepdims=True)):
        yield Cause(f"{words}: is the transmittance 1 minus the mean reflectance of the channels?", "T of mean R")
    elif near(1.0 - R / np.maximum(2.0 - R, 1e-6)):
        yield Cause(
            f"{words}: is the reflectance that of both faces of a pane, but the transmittance that of one?", "T of one"
        )
    elif T.min() > EXACT:
        yield Cause(f"{words}: is the transmittance not reduced by the reflectance?", "T not reduced by R")
