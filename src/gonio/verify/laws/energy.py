"""Energy: no more light is reflected than arrives."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ... import ops
from ...energy.albedo import cubature
from ...errors import InputError
from ...material import BSDF, tree
from ...ops import Direction, Mode, Scalar, backend
from .. import directions, estimators, histogram, lobes, severity, statistics
from ..effort import Effort
from ..figures import AlbedoCurves
from ..forensics import channels, gains, losses, rounded
from ..forensics.causes import place_of
from ..forensics.masking import mismatch
from ..forensics.ratio import SPREAD, Cause, factor_key, written
from ..subject import Subject, guarded
from ..verdict import Finding, Trial
from .base import Law, pairs, where_found

GAIN = 1e-3
PROBES = 4096  # pairs of directions at which eval is tested before it is integrated
FINER = 100.0  # how many times as accurate an integral is when it is repeated
STATED = "the stated albedo"
LOST = "loss in a white furnace:"
COARSE = (10.0, 40.0, 60.0, 80.0)  # degrees of wo at which the parameters behind a loss are sought
MOST_ALONE = 6  # largest number of parameters that are made lossless one at a time
ELSEWHERE = 88.0  # degrees of the most oblique view at other parameter values
GRAZING = (85.0, 88.0, 89.0, 89.5, 89.9)  # degrees; where errors of Fresnel and masking terms appear first


class Energy(Law):
    """The directional albedo for power is at most 1 for every wo, and the quadrature of `eval` and the model's own
    sampling give the same albedo.

    albedo(wo) = int f*(wo, wi) |cos theta_i| dwi over both sides, where f* is f without the radiance factor of
    transmission.
    """

    number = 3
    name = "energy"
    title = "directional albedo <= 1; quadrature and sampling agree"
    meaning = "An albedo above 1 adds light at each bounce, so that interiors glow; one that is too low loses light."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        wo = _views(subject, effort)
        finding = Finding(
            figure=0.0, tolerance=GAIN, reason="a quarter of an 8-bit step; the integrals are ten times more accurate"
        )
        value, error, defined = _light(subject, wo, effort, seed)
        guided = subject.drawn_by is not None  # its own guide is computed at the given values only
        mean, noise, heavy = _sampling(subject, wo, effort.furnace_samples, seed) if not guided else [value] * 3
        curves = AlbedoCurves(wo, value, error, mean, noise)
        excess = value.max(1) - error.max(1) - 1.0
        row = int(np.argmax(excess))
        finding.figure = float(max(excess[row], 0.0))
        channel = int(np.argmax(value[row]))
        theta = directions.angles(wo)[:, 0]
        finding.worst = f"wo at {theta[row]:.4g} degrees, channel {channel}: albedo {value[row, channel]:.5f}"
        finding.shown = f"albedo {value.min():.4f} to {value.max():.4f}"
        if finding.figure > GAIN:
            finding.shown = f"gain {finding.figure:.4f}"
        for i in range(0 if guided else len(wo)):
            p = _agreement(value[i], error[i], mean[i], noise[i], heavy[i])

            def repeat(i: int = i) -> float:
                # the integral too: its cells may have missed the edge of a narrow lobe
                finer = dataclasses.replace(effort, accuracy=effort.accuracy / FINER)
                integral = _quadrature(subject, wo[i : i + 1], finer, seed + 7919)
                second = _sampling(subject, wo[i : i + 1], effort.furnace_samples, seed + 7919)
                return _agreement(*(part[0] for part in (*integral, *second)))

            text = f"albedo {value[i].mean():.5f} by quadrature and {mean[i].mean():.5f} by sampling"
            text += f", wo at {theta[i]:.4g} degrees"
            finding.trials.append(Trial(p, text, repeat))
        self._known(subject, wo, value, error, finding)
        _stated(subject, wo, value, error, finding)
        masking = mismatch(subject) if effort.full else ""
        if masking:
            finding.problems.append(masking)
        white = _judged_lossless(subject)
        if white is not None and subject.guided:  # computing its own guide would take seconds
            white = dataclasses.replace(white, drawn_by=subject.sampler)
        if white is not None:
            self._furnace(white, wo, effort, seed, finding, curves)
            self._one_at_a_time(subject, wo, effort, seed, finding)
        if not defined:
            finding.notes.append("values of eval that are not finite count as 0")
            if finding.figure <= GAIN:
                finding.figure, finding.shown = np.nan, "eval is not finite"
        finding.evidence = curves
        return finding

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias:
        subject = where_found(subject, finding)
        if not np.isfinite(finding.figure):
            return estimators.undefined_bias(subject, seed)
        biases = [estimators.sampling_bias(subject)]
        if finding.figure > finding.tolerance:
            biases.append(estimators.gain_bias(subject))
            white = lossless_variant(subject)
            if white is not None and biases[-1].average == 0.0:
                gained = estimators.gain_bias(white)
                biases.append(dataclasses.replace(gained, where=f"{gained.where}, without absorption"))
        others = [problem for problem in finding.problems if not problem.startswith(STATED)]
        if others and (white := _judged_lossless(subject)) is not None:
            biases.append(estimators.loss_bias(white))
        if len(others) < len(finding.problems):
            biases.append(estimators.stated_bias(subject))
        return max(biases, key=lambda bias: bias.average)

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Cause]:
        yield from (Cause(problem, "masking") for problem in finding.problems if problem.startswith("the masking"))
        yield from (Cause(problem, "stated albedo") for problem in finding.problems if problem.startswith(STATED))
        white = lossless_variant(subject) or subject
        claim = getattr(white.model, "lossless_tolerance", None)
        if claim is not None and any(problem.startswith(LOST) for problem in finding.problems):
            coarse = dataclasses.replace(effort, accuracy=1e-3)
            wo = directions.single(directions.at(np.array(COARSE), 37.0))

            def loss(one: Subject) -> float:
                return 1.0 - float(_quadrature(one, wo, coarse, seed)[0].mean(1).min())

            yield from losses.causes(white, loss, claim)
        curves = finding.evidence
        if not isinstance(curves, AlbedoCurves):
            return
        yield from _never_sampled(curves)
        if finding.figure <= finding.tolerance:
            return
        yield from gains.of_lobes(where_found(subject, finding), seed)
        there = where_found(subject, finding)
        steps = rounded.named(there) if there.has_density and not there.stochastic else None
        if steps is not None:
            yield steps
        mix = channels.mixed(there, *pairs(there, 4096, seed)) if there.has_density else None
        if mix is not None and not _gains_in_gray(there, curves, effort, seed):
            yield mix
        yield from self._of_albedo(curves)
        view = directions.single(directions.at(np.array(gains.VIEWS), 37.0))
        coarse = dataclasses.replace(effort, accuracy=3e-3, full=False)

        def albedo(one: Subject) -> np.ndarray:
            # computing its own guide would take seconds
            one = dataclasses.replace(one, drawn_by=subject.sampler) if subject.guided else one
            return _quadrature(one, view, coarse, seed)[0]

        yield from gains.causes(white, albedo)

    def _of_albedo(self, curves: AlbedoCurves) -> Iterator[Cause]:
        """Causes of a gain that follow from the albedo curves alone."""
        # the correct albedo is known only where nothing is absorbed
        albedo = curves.quadrature if curves.furnace is None else curves.furnace
        if np.ptp(albedo, axis=1).max() > SPREAD:
            if curves.furnace is not None and albedo.shape[1] == 3:
                yield from _one_channel(albedo)
            return
        a = albedo.mean(1)
        if np.ptp(a) < SPREAD * a.mean():
            if (curves.furnace is not None or a.mean() > 1.0) and abs(a.mean() - 1.0) > 2.0 * SPREAD:
                factor = written(float(a.mean()))
                guess = "a constant factor"
                if factor == "2":
                    guess = "a constant factor, a lobe counted twice, or light sent to both sides of the surface"
                words = f"the albedo is {factor} for every wo; possible mistake: {guess}"
                yield Cause(words, factor_key(float(a.mean())))
            return
        bad = np.abs(a - 1.0) > SPREAD
        place = place_of(curves.wo, curves.wo, bad)
        # a sharp edge, not a gradual rise
        if place and np.abs(a[bad] - 1.0).min() > 0.1 * np.abs(a[bad] - 1.0).max():
            words = f"{place.replace('from wi', 'from wo')}"
            yield Cause(f"unknown; the albedo is {np.median(a[bad]):.4g} instead of 1 {words}", words)

    def _known(self, subject: Subject, wo: np.ndarray, value: np.ndarray, error: np.ndarray, finding: Finding) -> None:
        """Check that the closed form of a material's albedo equals the integral of `eval`."""
        if not isinstance(subject.model, BSDF) or subject.stochastic:
            return

        def inner(material: BSDF, mu: np.ndarray, phi: np.ndarray) -> np.ndarray | None:
            return material.known_albedo(mu, phi, inner, None)

        stated = subject.model.known_albedo(wo[:, 2], np.arctan2(wo[:, 1], wo[:, 0]), inner, None)
        if stated is None:
            return
        off = np.abs(stated - value).max(1) - error.max(1)
        row = int(np.argmax(off))
        if off[row] > GAIN:
            theta = directions.angles(wo)[row, 0]
            finding.problems.append(
                f"known_albedo is {stated[row].max():.5f} at {theta:.4g} degrees, but the integral of eval is "
                f"{value[row].max():.5f}"
            )

    def _furnace(
        self, white: Subject, wo: np.ndarray, effort: Effort, seed: int, finding: Finding, curves: AlbedoCurves
    ) -> None:
        """Test the lossless variant, with every albedo 1 and F = 1, which loses only light that the model neglects."""
        value, error = _quadrature(white, wo, effort, seed)
        curves.furnace = value
        gain = float((value - error).max() - 1.0)
        theta = directions.angles(wo)[:, 0]
        if gain > finding.figure:
            finding.figure, finding.known = gain, white.breaches.get("energy")
            if gain > GAIN:
                finding.shown = f"gain {gain:.4f} in a white furnace"
            finding.worst = (
                f"white furnace, wo at {theta[int(np.argmax(value.max(1)))]:.4g} degrees: albedo {value.max():.5f}"
            )
        lost = np.round(1.0 - value.mean(1), 6) + 0.0  # not -0
        above = wo[:, 2] > 0.0
        order = np.argsort(wo[above, 2])
        mu, loss = wo[above, 2][order], lost[above][order]
        average = (
            float(np.trapezoid(2.0 * mu * loss, mu) / max(np.trapezoid(2.0 * mu, mu), 1e-9)) if len(mu) > 1 else 0.0
        )
        where = int(np.argmax(lost))
        if average < 0.0:
            most = int(np.argmin(lost))
            text = f"gain in a white furnace: {-average:.4f} on average, {-lost[most]:.4f} at {theta[most]:.4g} degrees"
        else:
            text = f"{LOST} {average + 0.0:.4f} on average, {lost[where]:.4f} at {theta[where]:.4g} degrees"
        known = float(error.max())
        finding.notes.append(text + (f", accurate to {known:.1g}" if known > 1e-3 else ""))
        curves.loss = average
        claim = getattr(white.model, "lossless_tolerance", None)
        # a claim refers to the given values: at others, such as a weight of 0, nothing may be reflected
        judged = effort.full or value.max() > 0.0
        if claim is not None and judged and lost[where] > claim + float(error.max()):
            finding.problems.append(
                f"{LOST} {lost[where]:.4f} at {theta[where]:.4g} degrees, more than the declared {claim:g}"
            )

    def _one_at_a_time(self, subject: Subject, wo: np.ndarray, effort: Effort, seed: int, finding: Finding) -> None:
        """Look for a gain with a single albedo or F set to 1, because another term may hide it if all of them are 1."""
        if not effort.full or not isinstance(subject.model, BSDF) or subject.stochastic or subject.model.needs_uniform:
            return
        white = {
            leaf.path: leaf.parameter.white
            for leaf in tree.leaves(subject.model)
            if leaf.parameter.white is not None and not leaf.parameter.inner and leaf.path not in subject.model.fixed
        }
        coarse = dataclasses.replace(effort, accuracy=3e-4)
        for path, value in [*white.items()][:MOST_ALONE] if len(white) > 1 else ():
            try:
                whitened = subject.replace(**{path: value})
            except InputError:
                continue
            whitened = dataclasses.replace(whitened, drawn_by=subject if subject.guided else None)
            albedo, error = _quadrature(whitened, wo[:: max(len(wo) // 4, 1)], coarse, seed)
            gain = float((albedo - error).max() - 1.0)
            if gain > max(finding.figure, GAIN):
                finding.figure, finding.settings = gain, {path: value}
                finding.known = whitened.breaches.get("energy")
                finding.shown = f"gain {gain:.4f}"
                finding.worst = f"{path} = {value}: albedo {albedo.max():.5f}"


def _judged_lossless(subject: Subject) -> Subject | None:
    """The lossless variant, or the subject itself if it has no albedos to set but claims to be lossless."""
    claimed = getattr(subject.model, "lossless_tolerance", None) is not None
    return lossless_variant(subject) or (subject if claimed else None)


def _stated(subject: Subject, wo: np.ndarray, value: np.ndarray, error: np.ndarray, finding: Finding) -> None:
    """Check that the albedo by which the authors of a model weight other layers is the integral of `eval`."""
    stated = subject.model.stated_albedo(wo) if isinstance(subject.model, BSDF) and not subject.stochastic else None
    if stated is None:
        return
    off = np.abs(stated.value - value).max(1) - error.max(1) - stated.tolerance
    row = int(np.argmax(off))
    if off[row] > 0.0:
        channel = int(np.argmax(np.abs(stated.value[row] - value[row])))
        theta = directions.angles(wo)[row, 0]
        finding.problems.append(
            f"{STATED}, {stated.source}, is {stated.value[row, channel]:.4f} at {theta:.4g} degrees, but the integral "
            f"of eval is {value[row, channel]:.4f}"
        )


def _never_sampled(curves: AlbedoCurves) -> Iterator[Cause]:
    """A cause for each side from which every sample fails or carries no light although `eval` is positive."""
    for sign, side in ((1.0, "above"), (-1.0, "below")):
        mine = curves.wo[:, 2] * sign > 0.0
        if mine.any() and not curves.sampling[mine].any() and curves.quadrature[mine].max(1).min() > GAIN:
            words = f"for wo {side} the surface, no sample carries light although eval is positive"
            guess = "a test of the side that is missing from `eval` or from `sample`"
            yield Cause(f"{words}; possible mistake: {guess}", f"never sampled from {side}")


def _one_channel(furnace: np.ndarray) -> Iterator[Cause]:
    """A cause if one channel of a white furnace is a constant times the other two, which are equal."""
    for channel, name in enumerate(("red", "green", "blue")):
        a, b = np.delete(furnace, channel, axis=1).T
        factor = furnace[:, channel] / np.maximum(a, 1e-9)
        middle = float(np.median(factor))
        if np.abs(a - b).max() < SPREAD and np.ptp(factor) < SPREAD * middle:
            words = f"without absorption, {name} is {written(middle)} times the other channels for every wo"
            yield Cause(f"{words}; possible mistake: a constant in that channel", f"{factor_key(middle)} in {name}")


def _gains_in_gray(subject: Subject, curves: AlbedoCurves, effort: Effort, seed: int) -> bool:
    """Whether more light is reflected than arrives if all channels of every color have the value of the largest one."""
    gray = {
        name: (max(value),) * 3
        for name, parameter in subject.parameters.items()
        if parameter.kind == "spectrum" and isinstance(value := getattr(subject.model, name, None), tuple | list)
    }
    worst = int(np.argmax(curves.quadrature.max(1)))
    value, error = _quadrature(subject.replace(**gray), curves.wo[worst : worst + 1], effort, seed)
    return bool((value - error).max() - 1.0 > GAIN)


def _views(subject: Subject, effort: Effort) -> np.ndarray:
    """Directions wo on each side of the surface that reflects or transmits: in equal steps of the cosine, along the
    normal, and near grazing angles."""
    # not at midpoints: steps of a material lie at simple fractions, which the two precisions may round differently
    mu = (np.arange(effort.furnace) + 0.47) / effort.furnace
    # the normal itself as well, where tangents and azimuths are undefined
    theta = np.concatenate([np.degrees(np.arccos(mu)), (0.0, *GRAZING) if effort.full else (ELSEWHERE,)])
    wo = [directions.at(theta if side > 0 else 180.0 - theta, 37.0) for side in (subject.sides or (1,))]
    return directions.single(np.concatenate(wo))


class Light(NamedTuple):
    """Reflected and transmitted light.

    value    int eval dwi for power plus the light of the delta lobes, (N, channels); 0 where eval is not finite
    error    the error of this sum, (N, channels)
    defined  whether eval is finite everywhere
    """

    value: np.ndarray
    error: np.ndarray
    defined: bool


def _light(subject: Subject, wo: np.ndarray, effort: Effort, seed: int) -> Light:
    ideal = _deltas(subject, wo, seed, effort.full)
    if not subject.has_density:
        return Light(ideal, np.full_like(ideal, 1e-6), True)
    if subject.stochastic:
        return Light(*_randomly(subject, wo, effort.furnace_samples, seed), True)
    sample, power = subject.sampler.sample, subject.power()
    if "defined" not in subject.memo:
        subject.memo["defined"] = bool(np.isfinite(subject.eval(*pairs(subject, PROBES, seed))).all())
    defined = subject.memo["defined"]
    if defined:
        integral = cubature.integrate(sample, power, wo, effort.accuracy, seed, effort.attempts)
        defined = bool(np.isfinite(integral.value).all())
    if not defined:  # one value that is not finite would hide a gain elsewhere

        def finite(wo: Direction, wi: Direction) -> list[Scalar]:
            return [ops.where(ops.isfinite(channel), channel, 0.0) for channel in power(wo, wi)]

        integral = cubature.integrate(sample, finite, wo, effort.accuracy, seed, effort.attempts)
    return Light(integral.value + ideal, integral.error + effort.accuracy, defined)


def _quadrature(subject: Subject, wo: np.ndarray, effort: Effort, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Value and error of `Light`."""
    return _light(subject, wo, effort, seed)[:2]


def _deltas(subject: Subject, wo: np.ndarray, seed: int, full: bool) -> np.ndarray:
    """The light of all delta lobes, (N, channels)."""
    if subject.drawn_by is not None and subject.guided and getattr(subject.model, "delta", "maybe") == "never":
        return np.zeros((len(wo), subject.eval(wo[:1], wo[:1], precision="float32").shape[1]))
    power = lobes.of(subject, wo, seed, "importance")
    carried = power.carried
    if not full and carried.size:
        # lobes that coincide at some parameter values are sampled as one, twice as often as each states
        often = np.where(power.share > 0.05, np.round(power.share / np.maximum(power.pdf, 0.01)), 1.0)
        carried = carried * np.maximum(often, 1.0)[..., None]
    return np.sum(carried * power.valid[..., None], axis=1)


def _randomly(subject: Subject, wo: np.ndarray, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """The integral of a stochastic `eval` by random directions, half of them from the model, and three standard
    errors."""
    values, errors = [], []
    half, even = count // 2, 0.25 / np.pi
    for i, one in enumerate(wo):
        rng = np.random.default_rng([seed, 41, i])
        many = np.tile(one, (half, 1))
        drawn = subject.sample(many, directions.numbers(rng, half), "importance")
        usable = (drawn.pdf > 0.0) & ~drawn.delta & (np.abs(np.linalg.norm(drawn.wi, axis=1) - 1.0) < 1e-3)
        wi = np.concatenate([np.where(usable[:, None], drawn.wi, [0.0, 0.0, 1.0]), directions.uniform(rng, half)])
        density = 0.5 * (subject.pdf(np.tile(one, (2 * half, 1)), wi) + even)
        value = subject.eval(np.tile(one, (2 * half, 1)), wi, "importance") / density[:, None]
        value[:half][~usable] = 0.0
        values.append(value.mean(0))
        errors.append(3.0 * value.std(0) / np.sqrt(2 * half))
    return np.array(values), np.array(errors)


def _sampling(subject: Subject, wo: np.ndarray, count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mean weight for power, its standard error, and the largest single contribution, (N, channels) each."""
    dr = backend.drjit()
    single, exact = backend.types("float32"), backend.types("float64")
    model = subject.bound()
    mode: Mode = "importance" if subject.transmits else "radiance"
    means, errors, largest = [], [], []
    rows = max(1, (1 << 22) // count)
    for start in range(0, len(wo), rows):
        part = wo[start : start + rows]
        index = dr.arange(single.module.UInt32, len(part) * count)
        which = index // dr.opaque(single.module.UInt32, count)
        many = single.vec3(*[dr.gather(single.float, backend.float_of(column, single), which) for column in part.T])
        u = histogram.random_numbers(single, index, seed + 8191 * start)
        s = guarded(subject.model, "sample", lambda many=many, u=u: model.sample(many, u, mode))
        weight = single.vec3(s[1])
        weight = exact.vec3(dr.select((s[2] > 0.0) & ~dr.isnan(weight), weight, 0.0)) + dr.zeros(
            exact.float, len(part) * count
        )
        dr.eval(weight)  # all channels together: each reduction would draw the samples again
        sums = [dr.block_sum(channel, count) for channel in weight]
        squares = [dr.block_sum(dr.square(channel), count) for channel in weight]
        most = [dr.block_reduce(dr.ReduceOp.Max, channel, count) for channel in weight]
        dr.eval(sums, squares, most)
        mean, square, top = (np.stack([one.numpy() for one in column], -1) for column in (sums, squares, most))
        means.append(mean / count)
        errors.append(np.sqrt(np.maximum(square / count - (mean / count) ** 2, 0.0) / count))
        largest.append(top / count)
    return np.concatenate(means), np.concatenate(errors), np.concatenate(largest)


def _agreement(value: np.ndarray, error: np.ndarray, mean: np.ndarray, noise: np.ndarray, heavy: np.ndarray) -> float:
    """The p-value for the mean over the channels. If the contribution of a single sample is comparable to the noise,
    the noise is underestimated and is therefore increased.

    heavy  the largest single contribution
    """
    spread = float(np.hypot(noise.mean(), 1e-6))
    if float(heavy.mean()) > 0.2 * spread:
        spread += float(heavy.mean())
    # twice: where a step crosses many cells, the stated error may be a few percent too small
    distance = max(abs(float(value.mean() - mean.mean())) - 2.0 * float(error.mean()), 0.0)
    return statistics.normal_two_sided(distance / spread)


def lossless_variant(subject: Subject) -> Subject | None:
    """The subject with every albedo 1 and F = 1; None if it has neither."""
    try:
        variant = subject.model.lossless()
    except InputError:
        return None
    return None if variant is subject.model else Subject(variant, subject.target, subject.settings)
