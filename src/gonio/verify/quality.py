"""The quality of a BSDF's sampling: measurements, not verdicts.

    gonio models --quality
    go.verify("conductor").cards[0].quality.words       # "sampling: 3.9 % of the samples fail, ..."

A path tracer multiplies the throughput by the weight of each sample. The variance of the weight therefore causes noise,
and a failed sample wastes a path. Both can be large even if every law holds.
"""

from __future__ import annotations

import dataclasses
import math
import warnings

import numpy as np

from ..catalog import notation
from ..errors import GonioError, GonioWarning, InputError
from ..material import BSDF, models
from . import directions
from .subject import Fault, Subject
from .subject import of as subject_of

THETA = (6.0, 17.0, 28.0, 39.0, 51.0, 62.0, 73.0, 84.0)  # of wo, degrees: the midpoints of eight equal intervals
SAMPLES = 1 << 12  # per wo: the fraction of failed samples is accurate to half a percent
INNER = ("conductor", "lambert")  # inner materials for those that require some
POWER = "importance"
ROUNDING = 1e-9  # relative variance below which it counts as 0


@dataclasses.dataclass(frozen=True)
class Quality:
    """Measures of sampling quality, averaged over the directions wo with reflected or transmitted light.

    failed    fraction of failed samples, those with pdf = 0
    variance  variance of the weight, divided by its squared mean; a failed sample has weight 0
    cosine    variance of cosine sampling (on both sides for transmitting materials), divided by that of the model's
              sampling; None with a delta lobe, which cosine sampling never hits, or if the model's variance is 0
    ideal     mean^2 / (mean^2 + variance), the efficiency relative to sampling without variance
    """

    failed: float
    variance: float
    cosine: float | None
    ideal: float

    def as_dict(self) -> dict[str, float | None]:
        return {name: None if value is None else float(f"{value:.4g}") for name, value in vars(self).items()}

    @property
    def words(self) -> str:
        """The measures as text: "sampling: 2.1 % of the samples fail, the relative variance of ... is 0.04, ..."."""
        failed, variance, cosine, ideal = self.numbers
        compared = f"{cosine} times that of cosine sampling and " if cosine else ""
        return (
            f"sampling: {failed} of the samples fail, the relative variance of the weights is {variance}, "
            f"and the efficiency is {compared}{ideal} of the ideal"
        )

    @property
    def texts(self) -> tuple[str, str, str, str]:
        """The four measures as labeled text; "" for a measure that is None."""
        failed, variance, cosine, ideal = self.numbers
        return (
            f"{failed} of the samples fail",
            f"relative variance of the weights: {variance}",
            cosine and f"efficiency relative to cosine sampling: {cosine}",
            f"efficiency relative to ideal sampling: {ideal}",
        )

    @property
    def numbers(self) -> tuple[str, str, str, str]:
        """The four measures as numbers with units; "" for a measure that is None."""
        cosine = "" if self.cosine is None else _short(self.cosine)
        return f"{100.0 * self.failed:.2g} %", _short(self.variance), cosine, f"{100.0 * self.ideal:.3g} %"


def _short(value: float) -> str:
    """The value with two significant digits: 0.013, 31, 4200."""
    if value < ROUNDING:
        return "0"
    value = float(f"{value:.2g}")
    return f"{value:.{max(0, 1 - math.floor(math.log10(value)))}f}"


def of(subject: Subject, seed: int = 1) -> Quality | None:
    """The quality of a subject's sampling; None if it cannot be sampled or is black.

    seed  seed of the samples
    """
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", GonioWarning)
            return _measured(subject, seed)
    except (Fault, TimeoutError, GonioError):
        return None  # the laws report the failure


def of_models() -> dict[str, tuple[str, Quality | None]]:
    """The title and the quality of every material at its defaults, by name."""
    return {name: (one.title, of(one)) for name, cls in models().items() for one in [_default(cls)]}


def _default(cls: type[BSDF]) -> Subject:
    """A material at its defaults. Required inner materials are the first of INNER that it accepts."""
    required = [name for name, parameter in cls.parameters().items() if parameter.required]
    for turn in range(len(INNER)):
        inner = {name: INNER[(turn + i) % len(INNER)] for i, name in enumerate(required)}
        try:
            return subject_of(cls(**{name: notation.named(text)[0] for name, text in inner.items()}))
        except GonioError:
            continue
    raise InputError(f"{cls.name} takes none of {', '.join(INNER)}", "quality")


def _measured(subject: Subject, seed: int) -> Quality | None:
    if not subject.sides:
        return None
    rng = np.random.default_rng([seed, 91])
    wo = np.concatenate([side * directions.at(np.array(THETA), 20.0) for side in subject.sides])
    rows = directions.single(np.repeat(wo, SAMPLES, axis=0))
    # power: the factor eta^2 of radiance cancels when light exits again, and causes no noise
    s = subject.sample(rows, directions.numbers(rng, len(rows)), POWER, "float32")
    shape = (len(wo), SAMPLES)
    valid = (s.pdf > 0.0).reshape(shape)
    weight = np.where(valid, s.weight.mean(1).reshape(shape), 0.0)
    mean = weight.mean(1)
    lit = mean > 0.0  # false for NaN
    if not lit.any():
        return None
    spread = np.where(lit, weight.var(1) / np.square(mean), 0.0)
    # The second moment of eval / p_cos under cosine sampling is the mean of eval^2 / (p_cos pdf) under the model's own,
    # which finds the narrow lobes that a few thousand cosine samples would miss.
    eval_ = s.weight.mean(1) * s.pdf
    if subject.stochastic:  # the weight and eval use different random numbers
        eval_ = subject.eval(rows, s.wi, POWER, "float32").mean(1)
    by_cosine = np.abs(s.wi[:, 2]) / (np.pi * (2.0 if subject.transmits else 1.0))
    second = np.where(s.pdf > 0.0, np.square(eval_) / (by_cosine * s.pdf), 0.0).reshape(shape).mean(1)
    delta = (s.delta & (s.pdf > 0.0)).any()
    model, cosine = (float(spread[lit].mean()), float((second[lit] / np.square(mean[lit]) - 1.0).mean()))
    if not ((math.isfinite(model) and math.isfinite(cosine)) or delta):
        return None
    quotient = None
    if not delta and max(model, cosine) < 1e-6:  # no variance beyond rounding in either: equal
        quotient = 1.0
    elif not delta and model > ROUNDING:
        quotient = max(cosine, 0.0) / model
    return Quality(
        failed=float(1.0 - valid[lit].mean()),
        variance=model,
        cosine=quotient,
        ideal=float((1.0 / (1.0 + spread[lit])).mean()),
    )


__all__ = ["Quality", "of", "of_models"]
