"""How much a broken law changes a picture: what integrators return, and what they should.

A path tracer uses a BSDF in two ways. It follows samples, whose mean weight is an albedo; and it looks at lamps with
`eval` and `pdf`, and weighs both by the balance heuristic (Veach1997, eq. 9.10). In a furnace of radiance 1 all of them
must give int eval dwi. By how much they do not, as a share of the reflected light, is the bias of a picture; averaged
over a hemisphere of wo with the cosine it is that of a whole ball under an orthographic camera.

    found = of_sampling(subject)     found.worst, found.average, found.share, found.words
"""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

import numpy as np

from ..energy.albedo import cubature
from ..ops import Direction, Scalar, backend
from ..optics.lattice import r_steps
from . import directions

if TYPE_CHECKING:
    from .subject import Subject

Kind: TypeAlias = Literal["bias", "lost", "gained", "nan", "noise", "derivatives", "interface"]
Mode: TypeAlias = Literal["radiance", "importance"]
# (wo, wi), (N, 3) each: two values (N, channels) that should be one, the right one first where it is known
Pair: TypeAlias = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]

SAMPLES = 1 << 13  # for each wo; stratified, so that the mean is good to about 1e-3 of a weight
ACCURACY = 4e-3  # stated of integrals, which are ten times better: that is what cells are divided for
LEAST = 2e-4  # differences of albedos that are none
FLOOR = 0.02  # of the brightest channel: what a nearly black one is off by, nobody sees
SPHERE = 0.25 / np.pi  # density of light samples: a constant environment's


class Grade(enum.StrEnum):
    """What a failure is worth; limits of the average and of the worst direction stand in `LIMITS`.

    NAN, NOISE, FITTING and INTERFACE (a call that integrators do not make, or whose answer they drop) are no bias of a
    picture; BY_NATURE and INNER say that the fault is not this material's own.
    """

    INVISIBLE = "invisible"
    SMALL = "small"
    VISIBLE = "visible"
    BROKEN = "broken"
    NAN = "NaN"
    NOISE = "noise"
    FITTING = "fitting only"
    INTERFACE = "interface"
    BY_NATURE = "by nature"
    INNER = "inner"


# (average, worst). A quarter of an 8-bit step is .1 %, and 1 % at single directions drowns in a render's noise. Two
# pictures side by side show 1 % of a flat tone (Weber); 10 % is seen without the other one, as a wrong material.
LIMITS = {Grade.INVISIBLE: (1e-3, 0.01), Grade.SMALL: (0.01, 0.1), Grade.VISIBLE: (0.1, 0.5)}
_KINDS = {"nan": Grade.NAN, "noise": Grade.NOISE, "derivatives": Grade.FITTING, "interface": Grade.INTERFACE}


@dataclasses.dataclass(frozen=True)
class Bias:
    """What a violation does to a picture, in shares of the reflected light (1 is all of it).

    worst    at the worst wo, in the worst channel
    average  over the hemisphere of wo, with the cosine
    share    of that hemisphere over which it exceeds 1 %
    where    the worst wo, or what else says where, in words
    kind     "bias", "lost" or "gained" energy; "nan", whose shares are those of directions; "noise", which costs
             samples and biases nothing; "derivatives", which only fitting sees; "interface", which only those see who
             call what `where` names
    furnace  the average under light from everywhere alike, where errors of both signs cancel; None where it is no
             matter of sampling
    both     the same where light and BSDF samples are combined
    """

    worst: float
    average: float
    share: float
    where: str
    kind: Kind
    furnace: float | None = None
    both: float | None = None

    @property
    def grade(self) -> Grade:
        if self.kind in _KINDS:
            return _KINDS[self.kind]
        for grade, (average, worst) in LIMITS.items():
            if self.average < average and self.worst < worst:
                return grade
        return Grade.BROKEN

    @property
    def words(self) -> str:
        """ "loses 4.8 % of the reflected light on average, 12 % at worst (wo at 85 degrees), ..."."""
        if self.kind == "noise":
            return f"costs samples, biases nothing: {self.where}"
        if self.kind == "interface":
            return f"no picture of a plain path tracer changes: {self.where}"
        if self.kind == "derivatives" and not self.average:
            return f"no picture is wrong; derivatives are no numbers: {self.where}"
        if self.kind == "derivatives":
            return f"no picture is wrong; derivatives are, by {percent(self.average)} on average: {self.where}"
        if self.kind == "nan":
            if not self.worst:
                return f"NaN at single directions only: {self.where}"
            text = f"{percent(self.average)} of all pairs of directions are no number or negative"
            return f"{text}, {percent(self.worst)} at worst ({self.where})"
        verb = {"lost": "loses", "gained": "gains", "bias": "is wrong by"}[self.kind]
        text = f"{verb} {percent(self.average)} of the reflected light on average, {percent(self.worst)} at worst"
        text += f" ({self.where})"
        if self.share:
            text += f", more than 1 % over {percent(self.share)} of directions"
        if self.furnace is not None and self.furnace < 0.9 * self.average:
            text += f"; under light from everywhere alike {percent(self.furnace)}"
        if self.both is not None and abs(self.both - self.average) > 0.1 * self.average:
            text += f"; light and BSDF sampling together: {percent(self.both)}"
        return text


def percent(share: float) -> str:
    """ "4.8 %", "120 %"."""
    if share > 100.0:
        return "more than 10,000 %"
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.0f} %"


# --------------------------------------------------------------------------- over which directions


def views(sides: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """16 wo a side, and each one's share of the cosine-weighted hemisphere; shares sum to 1 over all sides."""
    # equal steps of sin^2 theta are equal shares, and their middles are no round angles at which a material may change;
    # the normal itself is left out, where azimuths have no value
    middles = np.degrees(np.arcsin(np.sqrt((np.arange(12) + 0.5) / 12.0)))
    theta = np.concatenate([[1.0], middles, [82.0, 86.0, 89.5]])
    s = np.sin(np.radians(theta)) ** 2
    edges = np.concatenate([[0.0], 0.5 * (s[1:] + s[:-1]), [1.0]])
    phi = 137.508 * np.arange(len(theta))
    found = [directions.at(theta if side > 0 else 180.0 - theta, phi) for side in sides or (1,)]
    return directions.single(np.concatenate(found)), np.tile(np.diff(edges), len(found)) / len(found)


def summed(
    off: np.ndarray, light: np.ndarray, wo: np.ndarray, mass: np.ndarray, kind: Kind | None = None, where: str = ""
) -> Bias:
    """The bias of values that are `off` by so much where `light` is reflected, (N, channels) each.

    off  signed; without a `kind`, one that has one sign nearly everywhere is lost or gained energy
    """
    floor = np.maximum(FLOOR * light.max(1, keepdims=True), 1e-3 * light.max(initial=0.0))
    relative = off / np.maximum(np.maximum(light, floor), 1e-12)
    channel = np.argmax(np.abs(relative), axis=1)
    signed = relative[np.arange(len(off)), channel]
    size = np.abs(signed)
    row = int(np.argmax(size))
    average = float(mass @ size)
    if kind is None:
        kind = "bias" if abs(float(mass @ signed)) < 0.9 * average else "lost" if signed[row] < 0.0 else "gained"
    theta = float(directions.angles(wo[row])[0])
    place = f"wo at {theta:.3g} degrees"
    if off.shape[1] == 3 and np.ptp(relative[row]) > 0.1 * size[row]:
        place += f", in {('red', 'green', 'blue')[int(channel[row])]}"
    return Bias(float(size[row]), average, float(mass[size > 0.01].sum()), f"{place}{where}", kind)


def between(
    subject: Subject, pair: Pair, kind: Kind | None = "bias", signed: bool = False, where: str = ""
) -> Bias | None:
    """The bias of one value against another that it should equal: int |a - b| dwi / int |a| dwi.

    signed  int (a - b) dwi in its place: what a furnace shows, where errors of both signs cancel
    None where nothing is reflected, or where values are random.
    """
    if subject.stochastic or not subject.has_density or not subject.steady:
        return None
    wo, mass = views(subject.sides)

    def integrand(o: np.ndarray, i: np.ndarray) -> np.ndarray:
        a, b = (np.nan_to_num(value, nan=0.0, posinf=0.0, neginf=0.0) for value in pair(o, i))
        return np.concatenate([a - b if signed else np.abs(a - b), np.abs(a)], axis=1)

    value = cubature.integrate(_seeds(subject), cubature.of_rows(integrand), wo, ACCURACY).value
    off, light = np.split(value, 2, axis=1)
    return summed(off, light, wo, mass, kind, where) if np.any(light > 0.0) else None


def by_samples(subject: Subject, pair: Pair, where: str = "") -> Bias | None:
    """As `between`, over directions that are sampled, half of them uniformly: for differences too ragged for cells."""
    if subject.stochastic or not subject.steady:
        return None
    wo, mass = views(subject.sides)
    count = 2048
    rng = np.random.default_rng(12)
    o = np.repeat(wo, count, axis=0)
    wi = directions.uniform(rng, len(o))
    s = subject.sample(o, directions.numbers(rng, len(o)))
    drawn = (rng.random(len(o)) < 0.5) & (s.pdf > 0.0) & ~s.delta
    wi[drawn] = directions.single(s.wi[drawn])
    density = 0.5 * subject.pdf(o, wi)[:, None] + 0.5 * SPHERE
    a, b = (np.nan_to_num(v, nan=0.0, posinf=0.0, neginf=0.0) / density for v in pair(o, wi))
    off, light = (v.reshape(len(wo), count, -1).mean(1) for v in (np.abs(a - b), np.abs(a)))
    return summed(off, light, wo, mass, "bias", where) if np.any(light > 0.0) else None


def _seeds(subject: Subject) -> cubature.Sampler:
    def sample(wo: np.ndarray, u: np.ndarray) -> object:
        s = subject.sample(wo, u, precision="float32")
        lengths = np.linalg.norm(np.nan_to_num(s.wi), axis=1)
        return s._replace(pdf=np.where(np.abs(lengths - 1.0) < 1e-3, np.nan_to_num(s.pdf), 0.0))

    return sample


# --------------------------------------------------------------------------- what integrators return


class Estimates(NamedTuple):
    """Directional albedos by each way of finding them, for some wo.

    wo, mass  as `views` gives them
    value     int eval dwi and the delta lobes' shares, (N, channels): what light samples converge to
    sampled   mean weight (N, channels): what BSDF samples alone converge to
    both      the two combined by the balance heuristic, light samples uniform on the sphere
    consistent, consistent_both  the same two where each sample weighs eval / pdf: what is left of the difference
              to `sampled` and `both` is the weights' fault, what is left to `value` the pdf's
    noise     two standard errors of `sampled` and `both`
    parts     `value`, `sampled` and `consistent`, means of the channels, by where the light comes from: (3, N, bins)
    doubt     three standard errors of the latter two, (N, bins)
    unseen    share of light that rare samples of huge weight may still add, (N,)
    claimed   int pdf dwi, (N,)
    drawn     share of samples that did not fail and are no delta, (N,)
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


def estimates(subject: Subject, mode: Mode = "radiance") -> Estimates:
    """What the three integrators return for each of `views`."""
    wo, mass = views(subject.sides)
    n = len(wo)
    u = np.tile(_stratified(SAMPLES), (n, 1))
    many = np.repeat(wo, SAMPLES, axis=0)
    s = subject.sample(many, u, mode, "float32")
    found = s.pdf > 0.0
    if not subject.transmits:
        # what goes through the surface of a solid that does not transmit meets its inside, which is dark
        found = found & (s.wi[:, 2] * many[:, 2] > 0.0)
    weight = np.where(found[:, None], np.nan_to_num(s.weight, posinf=0.0, neginf=0.0), 0.0)
    channels = weight.shape[1]
    heuristic = np.where(s.delta, 1.0, s.pdf / np.maximum(s.pdf + SPHERE, 1e-30))
    followed = (_batched(weight, n), _batched(weight * np.nan_to_num(heuristic)[:, None], n))
    good = (s.pdf > 0.0) & ~s.delta
    own = _eval_over_pdf(subject, many, s.wi, weight, good, mode)
    heuristic = np.where(good, own.pdf / (own.pdf + SPHERE), 1.0)
    expected = _batched(own.weight, n), _batched(own.weight * heuristic[:, None], n)
    bins = _bins(s.wi)
    apart = [_batched(w.mean(1, keepdims=True) * bins * good[:, None], n) for w in (weight, own.weight)]

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
        integral = np.zeros((n, 2 * channels + 1 + BINS))
    elif subject.stochastic or not subject.steady:  # values are random: no cell would ever be good enough
        wi = directions.uniform(np.random.default_rng(43), len(many))
        vectors = (backend.vector_of(w, 3, backend.types("float64")) for w in (many, wi))
        columns = np.stack([backend.to_numpy(column, len(wi)) for column in integrand(*vectors)], axis=-1)
        integral = columns.reshape(n, SAMPLES, -1).mean(1) / SPHERE
    else:
        integral = cubature.integrate(_seeds(subject), integrand, wo, ACCURACY).value
    seen, claimed, split = np.split(integral, [2 * channels, 2 * channels + 1], axis=1)
    ideal = _deltas(s.wi, weight, s.pdf, s.delta, n)
    (sampled, spread), (part, other) = followed
    unseen = _unseen(weight, n)
    value = seen[:, :channels] + ideal
    return Estimates(
        wo,
        mass,
        value,
        sampled,
        part + seen[:, channels:],
        expected[0][0],
        expected[1][0] + seen[:, channels:],
        unseen + 2.0 * np.maximum(spread, other) + (0.02 * value if subject.stochastic else 0.0),
        np.stack([split, apart[0][0], apart[1][0]]),
        unseen + 3.0 * np.maximum(apart[0][1], apart[1][1]) + (0.02 * split if subject.stochastic else 0.0),
        unseen[:, 0] / np.maximum(value.mean(1), 1e-12),
        claimed[:, 0],
        good.reshape(n, SAMPLES).mean(1),
    )


TAIL = 64  # largest weights of a wo that say how a tail falls


def _unseen(weight: np.ndarray, n: int) -> np.ndarray:
    """What samples beyond the largest weight that was seen may add to the mean, (N, 1); 0 where weights are bounded.

    The tail's exponent is Hill's: P(w > t) ~ t^-a gives a mean of a / (a - 1) t P(w > t) beyond t.
    """
    largest = np.partition(weight.mean(1).reshape(n, SAMPLES), -TAIL, axis=1)[:, -TAIL:]
    least, most = np.maximum(largest.min(1), 1e-30), largest.max(1)
    falls = 1.0 / np.maximum(np.log(np.maximum(largest, least[:, None]) / least[:, None]).mean(1), 1e-6)
    beyond = falls / np.maximum(falls - 1.0, 0.05) * most / SAMPLES
    return np.where(falls < 2.5, beyond, 0.0)[:, None]


BINS = 16  # four quarters of the azimuth, within 45 degrees of the normal and beyond, on each side of the surface


def _bins(w: np.ndarray) -> np.ndarray:
    """1 in the column of the bin that a direction lies in, (N, BINS); edges are those of cubature's first cells."""
    number = (w[:, 0] > 0.0) + 2 * (w[:, 1] > 0.0) + 4 * (np.abs(w[:, 2]) > np.sqrt(0.5)) + 8 * (w[:, 2] > 0.0)
    return (number[:, None] == np.arange(BINS)).astype(float)


def _split(value: Scalar, w: Direction) -> list[Scalar]:
    """A value of Dr.Jit in its bin, 0 in the others: in the kernel that sums them, as sixteen columns of NumPy's take
    longer than most models."""
    dr = backend.drjit()
    sides = (w.x > 0.0, w.y > 0.0, dr.abs(w.z) > np.sqrt(0.5), w.z > 0.0)
    within = [[~side, side] for side in sides]
    found = []
    for number in range(BINS):
        a, b, c, d = (choice[number >> bit & 1] for bit, choice in enumerate(within))
        found.append(dr.select(a & b & c & d, value, 0.0))
    return found


class _Own(NamedTuple):
    weight: np.ndarray
    pdf: np.ndarray


def _eval_over_pdf(
    subject: Subject, wo: np.ndarray, wi: np.ndarray, weight: np.ndarray, good: np.ndarray, mode: Mode
) -> _Own:
    """What samples with a density should weigh, and their pdf, by `eval` and `pdf`; others keep what they have."""
    weight, pdf = weight.copy(), np.zeros(len(wo))
    if good.any():
        unit = wi[good] / np.maximum(np.linalg.norm(wi[good], axis=1, keepdims=True), 1e-12)
        value = subject.eval(wo[good], unit, mode, "float32")
        pdf[good] = np.maximum(np.nan_to_num(subject.pdf(wo[good], unit, "float32"), posinf=0.0), 0.0)
        over = np.divide(value, pdf[good, None], out=np.zeros_like(value), where=pdf[good, None] > 0.0)
        weight[good] = np.nan_to_num(over, posinf=0.0, neginf=0.0)
    return _Own(weight, pdf)


def _stratified(count: int) -> np.ndarray:
    """A sequence of low discrepancy in [0, 1)^3: the R sequence."""
    u = (0.5 + np.arange(count)[:, None] * r_steps(3)) % 1.0
    return directions.single(np.minimum(u, 1.0 - 2.0**-24))


def _batched(values: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean over each wo's samples and its standard error from eight interleaved parts, (N, channels) each."""
    parts = values.reshape(n, SAMPLES // 8, 8, -1).mean(1)
    return parts.mean(1), parts.std(1) / np.sqrt(7.0)


def _deltas(wi: np.ndarray, weight: np.ndarray, pdf: np.ndarray, delta: np.ndarray, n: int) -> np.ndarray:
    """Sum over the delta directions that occur of weight times probability, (N, channels)."""
    result = np.zeros((n, weight.shape[1]))
    chosen = delta & (pdf > 0.0)
    if not chosen.any():
        return result
    for i in range(n):
        rows = i * SAMPLES + np.flatnonzero(chosen[i * SAMPLES : (i + 1) * SAMPLES])
        if len(rows):
            _, first = np.unique(np.round(wi[rows], 4), axis=0, return_index=True)
            result[i] = np.sum(weight[rows[first]] * pdf[rows[first], None], axis=0)
    return result


Part: TypeAlias = Literal["all", "weights", "pdf"]


def of_sampling(subject: Subject, part: Part = "all", light: Estimates | None = None) -> Bias:
    """By how much BSDF sampling, alone or with light samples, misses what light samples alone converge to.

    part  how much of that is due to weights that are not eval / pdf, or to a pdf that is not that of the samples
    The larger of the two counts; `both` keeps the second.
    """
    light = light or subject.light
    found = []
    for sampled, consistent in ((light.sampled, light.consistent), (light.both, light.consistent_both)):
        off = (consistent if part == "pdf" else sampled) - (consistent if part == "weights" else light.value)
        off = np.where(np.abs(off) > light.noise + LEAST, off, 0.0)
        found.append(summed(off, np.maximum(light.value, 0.0), light.wo, light.mass))
    alone, both = found
    # the same light from a lamp: bin by bin, so that too much on one side does not make up for too little on another
    value, drawn, own = light.parts
    apart = np.abs((own if part == "pdf" else drawn) - (own if part == "weights" else value))
    # a lobe that the edge of a bin cuts in two lies on either side by chance: half a per cent of all light is nothing
    doubt = light.doubt + 5e-3 * np.abs(value).sum(1, keepdims=True)
    apart = np.where(apart > doubt, apart, 0.0).sum(1, keepdims=True)
    lamp = summed(apart, light.value.mean(1, keepdims=True).clip(min=0.0), light.wo, light.mass, alone.kind)
    worse = max((alone, both, lamp), key=lambda bias: bias.average)
    if lamp.average > 1.1 * max(alone.average, both.average) and alone.kind != "bias":
        worse = dataclasses.replace(worse, kind="bias")
    worse = dataclasses.replace(worse, furnace=alone.average, both=both.average)
    if worse.grade is Grade.INVISIBLE and part != "pdf" and light.unseen.max() > 0.01:
        row = int(np.argmax(light.unseen))
        theta = float(directions.angles(light.wo[row])[0])
        where = (
            f"single samples hold more than {percent(float(light.unseen[row]))} of the light, wo at {theta:.3g} degrees"
        )
        return dataclasses.replace(worse, kind="noise", where=where)
    if subject.transmits and light is subject.light and worse.grade == Grade.INVISIBLE:
        other = of_sampling(subject, part, estimates(subject, "importance"))
        if other.average > worse.average:
            return dataclasses.replace(other, where=f"{other.where}, light tracing")
    return worse


def gain(subject: Subject, mode: Mode = "importance") -> Bias:
    """What is reflected beyond what came in, as a share of the latter; power, so without the radiance factor."""
    light = estimates(subject, mode) if subject.transmits else subject.light
    over = np.where(light.value > 1.0 + 5.0 * LEAST, light.value - 1.0, 0.0)
    return summed(over, np.ones_like(over), light.wo, light.mass, "gained")


def loss(subject: Subject) -> Bias:
    """What a subject that claims to reflect all light, a white twin, does not reflect."""
    light = estimates(subject, "importance") if subject.transmits else subject.light
    lost = np.maximum(1.0 - light.value, 0.0)
    return summed(-lost, np.ones_like(lost), light.wo, light.mass, "lost")
