"""The albedos of a BSDF that different estimators compute, and the resulting bias of a picture.

A path tracer uses a BSDF in two ways. It traces sampled directions, whose mean weight is an albedo; and it samples
lights, with `eval` as the value and `pdf` for the balance heuristic that combines both (Veach1997, eq. 9.10). In a
furnace of radiance 1, every estimator must return int eval dwi. The difference, as a fraction of the reflected light,
is the bias of a picture.

    bias = estimators.sampling_bias(subject)     bias.worst, bias.average, bias.share, bias.words
"""

from __future__ import annotations

import dataclasses
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from ..energy.albedo import cubature
from ..material.sample import SampleArrays
from ..ops import Direction, Mode, Scalar, backend
from . import directions
from .severity import ACCURACY, Bias, Grade, degrees, percent, seeds, summed, views
from .subject import Subject

SAMPLES = 1 << 13  # per wo; stratified, so that the mean is accurate to about 1e-3 of a weight
NEGLIGIBLE = 2e-4  # largest difference between two albedos that is ignored
SPHERE = 0.25 / np.pi  # density of light samples: uniform on the sphere, as for a constant environment
BINS = 16  # four quadrants of azimuth, within 45 degrees of the normal and beyond, on each side of the surface
UNDEFINED = 512  # random wi per wo at which non-finite values are counted
TAIL = 64  # largest weights per wo, from which the exponent of the tail is estimated

Part: TypeAlias = Literal["all", "weights", "pdf"]


class Estimates(NamedTuple):
    """Directional albedos by each estimator, for N directions wo.

    wo, mass  directions and their fractions of the hemispheres, from `severity.views`
    value     int eval dwi plus the light of the delta lobes, (N, channels), the limit of light sampling
    sampled   mean weight, (N, channels), the limit of BSDF sampling
    both      the two combined by the balance heuristic, with light samples uniform on the sphere
    consistent, consistent_both  `sampled` and `both` with each sample weighted by eval / pdf: their difference from
              `value` is due to the pdf; the rest of the difference of `sampled` and `both` is due to the weights
    noise     two standard errors of `sampled` and `both`
    parts     `value`, `sampled` and `consistent` per bin of wi, averaged over the channels, (3, N, BINS)
    doubt     three standard errors of the last two, (N, BINS)
    unseen    fraction of light that rare samples of very large weight may add to the observed light, (N,)
    claimed   int pdf dwi, (N,)
    drawn     fraction of samples that have not failed and are not delta samples, (N,)
    """

    wo: np.ndarray
    mass: np.ndarray
    value: np.ndarray
    sampled: np.ndarray
    both: np.ndarray
    consistent: np.ndarray
    consistent_both: np.ndarray
    noise: np.ndarray
    parts: np.ndarray
    doubt: np.ndarray
    unseen: np.ndarray
    claimed: np.ndarray
    drawn: np.ndarray


def of_subject(subject: Subject) -> Estimates:
    """The estimates for radiance. They are computed when the first law fails, and cached for all laws."""
    if "estimates" not in subject.memo:
        subject.memo["estimates"] = estimate(subject)
    estimates: Estimates = subject.memo["estimates"]
    return estimates


def estimate(subject: Subject, mode: Mode = "radiance") -> Estimates:
    """The results of all estimators for each wo of `severity.views`."""
    wo, mass = views(subject.sides)
    n = len(wo)
    many = np.repeat(wo, SAMPLES, axis=0)
    s = subject.sample(many, np.tile(_stratified(SAMPLES), (n, 1)), mode, "float32")
    weight = _followed_weight(subject, many, s)
    good = (s.pdf > 0.0) & ~s.delta
    own, own_pdf = _eval_over_pdf(subject, many, s.wi, weight, good, mode)
    heuristic = np.nan_to_num(np.where(s.delta, 1.0, s.pdf / np.maximum(s.pdf + SPHERE, 1e-30)))
    own_heuristic = np.where(good, own_pdf / (own_pdf + SPHERE), 1.0)
    (sampled, error), (sampled_part, part_error) = _batched(weight, n), _batched(weight * heuristic[:, None], n)
    consistent, consistent_part = _batched(own, n)[0], _batched(own * own_heuristic[:, None], n)[0]
    bins = _bins(s.wi) * good[:, None]
    (drawn_bins, bin_error), (own_bins, own_bin_error) = (
        _batched(w.mean(1, keepdims=True) * bins, n) for w in (weight, own)
    )
    integral = _integral(subject, many, wo, weight.shape[1], mode)
    channels = weight.shape[1]
    by_eval, by_lights, claimed, value_bins = np.split(integral, [channels, 2 * channels, 2 * channels + 1], axis=1)
    value = by_eval + _deltas(s.wi, weight, s.pdf, s.delta, n)
    unseen = _unseen(weight, n)
    random = 0.02 if subject.stochastic else 0.0
    return Estimates(
        wo,
        mass,
        value,
        sampled,
        sampled_part + by_lights,
        consistent,
        consistent_part + by_lights,
        unseen + 2.0 * np.maximum(error, part_error) + random * value,
        np.stack([value_bins, drawn_bins, own_bins]),
        unseen + 3.0 * np.maximum(bin_error, own_bin_error) + random * value_bins,
        unseen[:, 0] / np.maximum(value.mean(1), 1e-12),
        claimed[:, 0],
        good.reshape(n, SAMPLES).mean(1),
    )


def _followed_weight(subject: Subject, wo: np.ndarray, s: SampleArrays) -> np.ndarray:
    """Weights of the samples that a path tracer follows, 0 for the others, (N, channels)."""
    valid = s.pdf > 0.0
    if not subject.transmits:
        # a sample through the surface of an opaque solid ends in its dark interior
        valid = valid & (s.wi[:, 2] * wo[:, 2] > 0.0)
    return np.where(valid[:, None], np.nan_to_num(s.weight, posinf=0.0, neginf=0.0), 0.0)


def _integral(subject: Subject, many: np.ndarray, wo: np.ndarray, channels: int, mode: Mode) -> np.ndarray:
    """The integrals over wi of `eval`, of `eval` times the balance heuristic of light samples, of `pdf`, and of the
    mean of `eval` per bin, (N, 2 channels + 1 + BINS)."""

    def answers(o: np.ndarray, i: np.ndarray) -> np.ndarray:
        value = np.nan_to_num(subject.eval(o, i, mode), posinf=0.0, neginf=0.0)
        pdf = np.maximum(np.nan_to_num(subject.pdf(o, i), posinf=0.0, neginf=0.0), 0.0)
        return np.concatenate([value, pdf[:, None]], axis=1)

    asked = cubature.of_rows(answers)

    def integrand(o: Direction, i: Direction) -> list[Scalar]:
        *value, pdf = asked(o, i)
        split = _split(sum(value[1:], start=value[0]) / len(value), i)
        return [*value, *(channel * (SPHERE / (pdf + SPHERE)) for channel in value), pdf, *split]

    if not subject.has_density:
        return np.zeros((len(wo), 2 * channels + 1 + BINS))
    if subject.stochastic or not subject.steady:  # random values: no cell would ever be accurate enough
        wi = directions.uniform(np.random.default_rng(43), len(many))
        vectors = (backend.vector_of(w, 3, backend.types("float64")) for w in (many, wi))
        columns = np.stack([backend.to_numpy(column, len(wi)) for column in integrand(*vectors)], axis=-1)
        return np.asarray(columns.reshape(len(wo), SAMPLES, -1).mean(1) / SPHERE)
    return cubature.integrate(seeds(subject), integrand, wo, ACCURACY).value


def _unseen(weight: np.ndarray, n: int) -> np.ndarray:
    """The contribution of samples beyond the largest observed weight to the mean, (N, 1); 0 if weights are bounded.

    It uses Hill's estimate of the exponent of the tail: P(w > t) ~ t^-a gives a mean of a / (a - 1) t P(w > t) above t.
    """
    largest = np.partition(weight.mean(1).reshape(n, SAMPLES), -TAIL, axis=1)[:, -TAIL:]
    least, most = np.maximum(largest.min(1), 1e-30), largest.max(1)
    exponent = 1.0 / np.maximum(np.log(np.maximum(largest, least[:, None]) / least[:, None]).mean(1), 1e-6)
    beyond = exponent / np.maximum(exponent - 1.0, 0.05) * most / SAMPLES
    return np.where(exponent < 2.5, beyond, 0.0)[:, None]


def _bins(w: np.ndarray) -> np.ndarray:
    """1 in the column of each direction's bin, else 0, (N, BINS). The edges of the bins are edges of the first cells of
    the cubature."""
    number = (w[:, 0] > 0.0) + 2 * (w[:, 1] > 0.0) + 4 * (np.abs(w[:, 2]) > np.sqrt(0.5)) + 8 * (w[:, 2] > 0.0)
    return (number[:, None] == np.arange(BINS)).astype(float)


def _split(value: Scalar, w: Direction) -> list[Scalar]:
    """A Dr.Jit value in the entry of its bin, and 0 in the others. This runs in the kernel that sums the values:
    sixteen columns in NumPy take longer than most models."""
    dr = backend.drjit()
    sides = [(~side, side) for side in (w.x > 0.0, w.y > 0.0, dr.abs(w.z) > np.sqrt(0.5), w.z > 0.0)]

    def inside(number: int) -> Any:
        a, b, c, d = (choice[number >> bit & 1] for bit, choice in enumerate(sides))
        return a & b & c & d

    return [dr.select(inside(number), value, 0.0) for number in range(BINS)]


def _eval_over_pdf(
    subject: Subject, wo: np.ndarray, wi: np.ndarray, weight: np.ndarray, good: np.ndarray, mode: Mode
) -> tuple[np.ndarray, np.ndarray]:
    """eval / pdf of the samples with a density, or the weights of other samples; and the pdf."""
    weight, pdf = weight.copy(), np.zeros(len(wo))
    if good.any():
        unit = wi[good] / np.maximum(np.linalg.norm(wi[good], axis=1, keepdims=True), 1e-12)
        value = subject.eval(wo[good], unit, mode, "float32")
        pdf[good] = np.maximum(np.nan_to_num(subject.pdf(wo[good], unit, "float32"), posinf=0.0), 0.0)
        over = np.divide(value, pdf[good, None], out=np.zeros_like(value), where=pdf[good, None] > 0.0)
        weight[good] = np.nan_to_num(over, posinf=0.0, neginf=0.0)
    return weight, pdf


def _stratified(count: int) -> np.ndarray:
    """A low-discrepancy sequence in [0, 1)^3, of multiples of inverse powers of the positive root of x^4 = x + 1."""
    steps = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    u = (0.5 + np.arange(count)[:, None] * steps) % 1.0
    return directions.single(np.minimum(u, 1.0 - 2.0**-24))


def _batched(values: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """The mean over the samples of each wo, and its standard error from eight interleaved batches, (N, channels)
    each."""
    parts = values.reshape(n, SAMPLES // 8, 8, -1).mean(1)
    return parts.mean(1), parts.std(1) / np.sqrt(7.0)


def _deltas(wi: np.ndarray, weight: np.ndarray, pdf: np.ndarray, delta: np.ndarray, n: int) -> np.ndarray:
    """The sum of weight times probability over the sampled delta directions, (N, channels)."""
    result = np.zeros((n, weight.shape[1]))
    chosen = (delta & (pdf > 0.0)).reshape(n, SAMPLES)
    for i in range(n):
        rows = i * SAMPLES + np.flatnonzero(chosen[i])
        if len(rows):
            _, first = np.unique(np.round(wi[rows], 4), axis=0, return_index=True)
            result[i] = np.sum(weight[rows[first]] * pdf[rows[first], None], axis=0)
    return result


# --------------------------------------------------------------------------- the bias of a picture


def sampling_bias(subject: Subject, part: Part = "all", light: Estimates | None = None) -> Bias:
    """The bias of BSDF sampling relative to the limit of light sampling.

    part   "all", or only the part that is due to weights other than eval / pdf ("weights") or to a pdf other than that
           of the samples ("pdf")
    light  the estimates to use; None for those of the subject for radiance
    The bias is the largest of three errors: without light samples, with light samples, and under a small light. The
    field `both` of the result is the error with light samples.
    """
    light = light or of_subject(subject)
    biases = []
    for sampled, consistent in ((light.sampled, light.consistent), (light.both, light.consistent_both)):
        off = (consistent if part == "pdf" else sampled) - (consistent if part == "weights" else light.value)
        off = np.where(np.abs(off) > light.noise + NEGLIGIBLE, off, 0.0)
        biases.append(summed(off, np.maximum(light.value, 0.0), light.wo, light.mass))
    by_samples, both = biases
    # the same under a small light, per bin: an excess on one side does not cancel a deficit on the other
    value, drawn, own = light.parts
    apart = np.abs((own if part == "pdf" else drawn) - (own if part == "weights" else value))
    # a bin edge may cut a lobe, whose samples then fall on either side by chance: half a percent of all light is
    # ignored
    doubt = light.doubt + 5e-3 * np.abs(value).sum(1, keepdims=True)
    apart = np.where(apart > doubt, apart, 0.0).sum(1, keepdims=True)
    lamp = summed(apart, light.value.mean(1, keepdims=True).clip(min=0.0), light.wo, light.mass, by_samples.kind)
    worse = max((by_samples, both, lamp), key=lambda bias: bias.average)
    if lamp.average > 1.1 * max(by_samples.average, both.average) and by_samples.kind != "bias":
        worse = dataclasses.replace(worse, kind="bias")
    worse = dataclasses.replace(worse, furnace=by_samples.average, both=both.average)
    if worse.grade is Grade.INVISIBLE and part != "pdf" and light.unseen.max() > 0.01:
        row = int(np.argmax(light.unseen))
        share, theta = percent(float(light.unseen[row])), float(directions.angles(light.wo[row])[0])
        where = f"individual samples carry more than {share} of the light for wo at {degrees(theta)}"
        return dataclasses.replace(worse, kind="noise", where=where)
    if subject.transmits and light is subject.memo.get("estimates") and worse.grade is Grade.INVISIBLE:
        other = sampling_bias(subject, part, estimate(subject, "importance"))
        if other.average > worse.average:
            return dataclasses.replace(other, where=f"{other.where}, in light tracing")
    return worse


def _of_power(subject: Subject) -> Estimates:
    """The estimates for power, without the factor eta^2 of radiance."""
    return estimate(subject, "importance") if subject.transmits else of_subject(subject)


def gain_bias(subject: Subject) -> Bias:
    """The power reflected in excess of the incident power, as a fraction of the latter."""
    light = _of_power(subject)
    over = np.where(light.value > 1.0 + 5.0 * NEGLIGIBLE, light.value - 1.0, 0.0)
    return summed(over, np.ones_like(over), light.wo, light.mass, "gained")


def loss_bias(subject: Subject) -> Bias:
    """The power lost by the lossless variant of a material, which should reflect all of it."""
    light = _of_power(subject)
    lost = np.maximum(1.0 - light.value, 0.0)
    return summed(-lost, np.ones_like(lost), light.wo, light.mass, "lost")


def stated_bias(subject: Subject) -> Bias:
    """The reflected power minus the stated albedo, which is also the error of a base layer weighted by that albedo."""
    light = _of_power(subject)
    stated = subject.model.stated_albedo(light.wo)
    off = light.value - stated.value
    return summed(off, np.ones_like(off), light.wo, light.mass)


def undefined_bias(subject: Subject, seed: int) -> Bias:
    """The fraction of random wi for which values are not finite.

    seed  seed of the directions
    """
    wo, mass = views(subject.sides)
    many = np.repeat(wo, UNDEFINED, axis=0)
    rng = np.random.default_rng([seed, 10])
    wi = directions.single(directions.uniform(rng, len(many)))
    if not subject.transmits:
        wi = np.where(wi[:, 2:] * many[:, 2:] < 0.0, wi * [1.0, 1.0, -1.0], wi)
    wrong = np.zeros((len(wo), UNDEFINED), bool)
    for precision in subject.precisions:
        s = subject.sample(many, directions.numbers(rng, len(many)), precision=precision)
        for values in (
            subject.eval(many, wi, precision=precision),
            subject.pdf(many, wi, precision)[:, None],
            s.weight,
        ):
            wrong |= ~np.isfinite(values).all(1).reshape(wrong.shape)
    bad = wrong.mean(1)
    theta = directions.angles(wo[int(np.argmax(bad))])[0]
    where = f"wo at {degrees(theta)}"
    return Bias(float(bad.max()), float(mass @ bad), float(mass[bad > 0.01].sum()), where, "nan")
