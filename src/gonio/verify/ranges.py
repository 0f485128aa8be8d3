"""The declared ranges of the parameters of a BSDF, as axes along which the BSDF is tested."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from ..errors import InputError
from ..material import BSDF, Parameter, tree
from ..material.parameters import pair_of
from .subject import Subject

WIDE = 30.0  # ratio of the ends above which a range is scanned and sampled in steps of equal ratio
MARGIN = 0.02  # fraction of a range that is left out at an excluded end
MIN_ALBEDO = 0.01  # for plugins whose failed samples have weight 0: samples of black would count as failed
TURNS = (0.4, 5.8)  # range of angles: at 0 or a full turn, a missing rotation would not be detected
MIN_RATIO = 1e-4  # first value divided by the last, for a range that starts at 0 and has steps of equal ratio


@dataclasses.dataclass(frozen=True)
class Axis:
    """The range of one parameter, along which the BSDF is tested. `ratio` states whether steps have equal ratios."""

    path: str
    low: float
    high: float
    ratio: bool
    kind: str = "float"

    def at(self, share: float | np.ndarray) -> Any:
        """The value at a position in the range: 0 is the low end, 1 the high end."""
        if not self.ratio:
            return self.low + share * (self.high - self.low)
        low = self.low if self.low > 0.0 else MIN_RATIO * self.high
        value = low * (self.high / low) ** share
        return np.where(np.asarray(share) <= 0.0, self.low, value) if self.low <= 0.0 else value


def axes(subject: Subject) -> list[Axis]:
    """The ranges of all parameters that declare one, including those of inner materials."""
    if not isinstance(subject.model, BSDF):
        return []
    axes_ = []
    for leaf in tree.surface(subject.model):
        ends = _ends(leaf.parameter, leaf.value)
        if ends is None:
            continue
        low, high, ratio = ends
        if leaf.parameter.kind == "spectrum" and subject.zero_weight_is_failure:
            low = max(low, min(MIN_ALBEDO, high))
        if leaf.owner is not subject.model and _becomes_delta(subject, leaf.path, low):
            low += MARGIN * (high - low)
        # fitted widths and powers are spectra too, but not colors
        color = leaf.parameter.kind == "spectrum" and leaf.parameter.high <= 1.0
        axes_.append(Axis(leaf.path, low, high, ratio, "color" if color else leaf.parameter.kind))
    return axes_


def _becomes_delta(subject: Subject, path: str, value: float) -> bool:
    """Whether an inner material has a delta lobe at this value, although the outer one declares none and therefore does
    not support delta lobes."""
    if _hides_delta(subject.model):
        return False  # this is already so at the given values, which are tested anyway
    try:
        return _hides_delta(subject.replace(**{path: value}).model)
    except InputError:
        return False


def _hides_delta(model: BSDF) -> bool:
    inner = tree.children(model).values()
    return any((model.delta == "never" and one.delta != "never") or _hides_delta(one) for one in inner)


def _ends(parameter: Parameter, value: Any) -> tuple[float, float, bool] | None:
    if not parameter.numeric or value is None:
        return None
    if parameter.kind == "angle":
        return *TURNS, False
    low, high = parameter.low, parameter.high
    if not math.isfinite(low):
        return None
    if not math.isfinite(high):
        # no upper end is declared or assumed: the range ends at the given value
        high = float(np.max(np.asarray(pair_of(value) if parameter.kind == "alpha" else value, float)))
    if not low < high:
        return None
    return low, high, high > WIDE * max(low, 1.0) or parameter.kind == "alpha"
