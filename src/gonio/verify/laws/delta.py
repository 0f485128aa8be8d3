"""Delta lobes: mirrors and smooth glass are held to Snell, Fresnel and the way back like any other lobe."""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ...material import BSDF, binding, tree
from ...ops import backend
from .. import directions, estimators, lobes, severity, statistics
from ..effort import Effort
from ..forensics.ratio import Cause
from ..lobes import Lobes
from ..subject import Subject, guarded
from ..verdict import DoesNotApply, Finding, Trial
from .base import Law

EXACT, SINGLE = 1e-6, 2e-3
SLOPES = 1e-4  # of gradients
FORWARD = 1e-4  # what carries less than this share need not come back
FLAT = 1e-3  # how far an index may be from 1 and still bend nothing
INDICES = {"eta": 1.0, "int_ior": 1.0}  # parameters that name the index below, over that above


class Miss(NamedTuple):
    """One thing that is wrong: how much, in words, and where; the mean over the views that have the lobe, and the share
    of them that is off by more than a hundredth; whether only derivatives are wrong; and what it comes from."""

    size: float
    text: str
    wo: np.ndarray
    wi: np.ndarray
    average: float = 1.0
    share: float = 1.0
    slope: bool = False
    cause: str = ""


class DeltaLobes(Law):
    """A delta lobe goes where Snell or the mirror says, carries (eta_o / eta_i)^2 in radiance, reflects as Fresnel's
    equations for its own index say, comes back the same way, and is chosen as often as its pdf says."""

    number = 10
    name = "delta"
    title = "delta lobes obey Snell and Fresnel, and come back the way they went"
    meaning = "What is seen in mirrors and through glass is in the wrong place, too bright or too dark."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        wo = _views(subject, effort, seed)
        seen = lobes.of(subject, wo, seed)
        power = lobes.of(subject, wo, seed, "importance") if subject.transmits else seen
        if not seen.found.any() and not power.found.any():
            raise DoesNotApply("it has no delta lobe")
        if subject.leans:
            raise DoesNotApply("its normal leans, and the law is about the surface's own")
        exact = subject.best == "float64"
        tolerance = EXACT if exact else SINGLE
        finding = Finding(
            figure=0.0,
            tolerance=tolerance,
            reason="a few roundings" if exact else "a few roundings of float32",
            shown=_shown(seen),
        )
        checks = [_direction, _indices, _modes, _back, _fresnel, _turned, _tinted]
        if exact:
            checks += [_single, _slopes]
        worst: Miss | None = None
        misses: list[Miss] = []
        finding.details = misses
        for check in checks:
            wrong = max(check(subject, wo, seen, power, seed), key=lambda one: one.size, default=None)
            if wrong is None or not wrong.size > tolerance:
                continue
            misses.append(wrong)
            pair = f"wo at {_angles(wrong.wo)}, wi at {_angles(wrong.wi)} degrees"
            finding.problems.append(f"{wrong.text} ({pair})")
            if worst is None or wrong.size > worst.size:
                worst = wrong
        if worst is not None:
            finding.figure = worst.size
            finding.shown = f"off by {worst.size:.2g}" if np.isfinite(worst.size) else "not found again"
            finding.worst = f"wo at {_angles(worst.wo)}, wi at {_angles(worst.wi)} degrees"
        finding.trials += _frequencies(subject, effort, seed)
        return finding

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias:
        """The share of a lobe's light that goes astray or is too much or too little; all of what goes elsewhere."""
        misses: list[Miss] = finding.details  # type: ignore[assignment]
        pictures = [miss for miss in misses if not miss.slope]
        if not misses:
            return estimators.sampling_bias(subject)  # chosen more or less often than said
        worst = max(pictures or misses, key=lambda miss: miss.average)
        where = f"wo at {_angles(worst.wo)} degrees, in its delta lobe"
        size, average = min(worst.size, 1.0), min(worst.average, 1.0)
        return severity.Bias(size, average, worst.share, where, "bias" if pictures else "derivatives")

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Cause]:
        for miss in finding.details:  # type: ignore[attr-defined]
            if miss.cause:
                yield Cause(miss.cause, miss.cause)
        seen = lobes.of(subject, _views(subject, effort, seed), seed, "importance")
        words = _choice(seen.share[seen.found], seen.pdf[seen.found], seen.carried[seen.found])
        if words:
            yield Cause(words, words)


def _choice(share: np.ndarray, pdf: np.ndarray, carried: np.ndarray) -> str:
    """What is wrong between how often lobes are met, the probability that they state, and their weight, over all."""
    met = (share > 0.02) & (pdf > 0.0)
    if met.sum() < 8:
        return ""
    share, pdf, weight = share[met], pdf[met], (carried[met] / pdf[met][:, None]).max(1)
    if np.all(np.abs(pdf - 1.0) < 1e-6) and np.mean(share < 0.97) > 0.2:
        return "the pdf of delta samples is 1, and they come in a part of the draws: the probability of the choice?"
    factor = weight / pdf
    if np.ptp(pdf) > 0.1 and np.ptp(factor) < 1e-3 * factor.mean():
        return "the weight of delta samples follows the probability of their choice: not divided by it?"
    return ""


def _shown(seen: Lobes) -> str:
    most = int(seen.found.sum(1).max(initial=0))
    return "1 lobe" if most == 1 else f"{most} lobes"


def _angles(w: np.ndarray) -> str:
    theta, phi = directions.angles(w)
    return f"{theta:.4g}, {phi:.4g}"


def _views(subject: Subject, effort: Effort, seed: int) -> np.ndarray:
    """Views from each side that answers, from the normal to 89 degrees."""
    rng = np.random.default_rng([seed, 91])
    count = 48 if effort.full else 16
    mu = np.concatenate([[1.0], (np.arange(count) + rng.uniform(size=count)) / count])
    theta = np.degrees(np.arccos(np.clip(mu, np.cos(np.radians(89.0)), 1.0)))
    sides = subject.sides or (1, -1)
    return directions.single(
        np.concatenate(
            [directions.at(theta if s > 0 else 180.0 - theta, 360.0 * rng.uniform(size=len(theta))) for s in sides]
        )
    )


Wrong = Iterator[Miss]


def _each(wo: np.ndarray, part: Lobes) -> Iterator[tuple[np.ndarray, int]]:
    """The views that have an n-th lobe, and n."""
    for n in range(part.found.shape[1]):
        rows = np.flatnonzero(part.found[:, n])
        if len(rows):
            yield rows, n


def _direction(subject: Subject, wo: np.ndarray, seen: Lobes, power: Lobes, seed: int) -> Wrong:
    """Unit vectors; refraction by Snell's law with the lobe's own eta. What reflects elsewhere than the mirror, or goes
    on without bending the light by an index, is judged by the way back alone: gratings and corner cubes do."""
    for rows, n in _each(wo, seen):
        o, i, eta = wo[rows], seen.wi[rows, n], seen.eta[rows, n]
        off = np.abs(np.linalg.norm(i, axis=1) - 1.0)
        yield _worst(off, "a delta lobe's direction is no unit vector", o, i)
        through = o[:, 2] * i[:, 2] < 0.0
        bends = through & (np.abs(eta - 1.0) > FLAT)
        if bends.any():
            snell = np.abs(i[:, :2] + o[:, :2] / eta[:, None]).max(1) * bends
            other = np.abs(i[:, :2] + o[:, :2] * eta[:, None]).max(1) * bends
            text = "not refracted by Snell's law with the eta that the sample states"
            cause = ""
            wrong = snell > SINGLE
            if wrong.any() and other[wrong].max() < SINGLE:
                text += ", but with 1 / eta"
                cause = "Snell's law holds with 1 / eta: bent the wrong way, or `eta` is that of the other side?"
            yield _worst(snell, text, o, i)._replace(cause=cause)
        flat = through & ~bends
        if flat.any():
            sin_o, sin_i = np.hypot(o[:, 0], o[:, 1]), np.hypot(i[:, 0], i[:, 1])
            usable = flat & (sin_o > 0.1) & (sin_i > 0.1)
            index = sin_o[usable] / sin_i[usable]
            if len(index) > 3 and np.ptp(index) < 1e-3 * index.mean() and abs(index.mean() - 1.0) > FLAT:
                size = np.where(usable, abs(index.mean() - 1.0), 0.0)
                text = f"bends by an index of {index.mean():.4g}, and states eta = 1"
                yield _worst(size, text, o, i)._replace(cause="`eta` of transmitted samples is left at 1?")
        mirror = o * [-1.0, -1.0, 1.0]
        # a grating's orders lie beside the mirror direction, and one of them in it
        _, also = lobes.along(lobes.rows_of(seen, rows), mirror)
        # not about the normal, where all these and the way back to wo are one
        near = ~through & ~also & (np.abs(i - mirror).max(1) < 0.1) & (np.hypot(o[:, 0], o[:, 1]) > 0.2)
        miss = np.abs(i - mirror).max(1) * near
        yield _worst(miss, "beside the mirror direction", o, i)


def _indices(subject: Subject, wo: np.ndarray, seen: Lobes, power: Lobes, seed: int) -> Wrong:
    """Reflection stays in its medium, eta 1; from below eta is the inverse of that from above; a parameter that names
    the index means it."""
    named = _named_index(subject)
    for rows, n in _each(wo, seen):
        o, i, eta = wo[rows], seen.wi[rows, n], seen.eta[rows, n]
        through = o[:, 2] * i[:, 2] < 0.0
        yield _worst(np.abs(eta - 1.0) * ~through, "a reflection states an eta that is not 1", o, i)
        above = np.where(o[:, 2] > 0.0, eta, 1.0 / np.where(eta > 0.0, eta, np.nan))[through]
        if not len(above):
            continue
        if np.all(np.abs(above - 1.0) < FLAT):
            continue  # straight through: no index at all
        if named is not None:
            off = np.zeros(len(o))
            off[through] = np.abs(above / named - 1.0)
            said = above[np.argmax(np.abs(above / named - 1.0))]
            text = f"eta, seen from above, is {said:.4g}, the parameters say {named:.4g}"
            yield _worst(off, text, o, i)
        elif np.ptp(above) > FLAT * np.median(above):
            off = np.zeros(len(o))
            off[through] = np.abs(above / np.median(above) - 1.0)
            yield _worst(off, "eta from below is not the inverse of that from above", o, i)


def _named_index(subject: Subject) -> float | None:
    """The index below over that above, where parameters of the material itself name it."""
    names = subject.parameters
    try:
        if "eta" in names and names["eta"].kind == "float":
            return float(subject.model.eta)
        if "int_ior" in names:
            return float(subject.model.int_ior) / float(getattr(subject.model, "ext_ior", 1.000277))
    except TypeError:
        pass
    return None


def _modes(subject: Subject, wo: np.ndarray, seen: Lobes, power: Lobes, seed: int) -> Wrong:
    """Radiance carries (eta_o / eta_i)^2 = 1 / eta^2 of what power does, in transmission alone (Veach1997, 5.2)."""
    if not subject.transmits:
        return
    for rows, n in _each(wo, seen):
        o, i = wo[rows], seen.wi[rows, n]
        radiance, _ = lobes.along(lobes.rows_of(seen, rows), i)
        carried, there = lobes.along(lobes.rows_of(power, rows), i)
        through = o[:, 2] * i[:, 2] < 0.0
        factor = np.where(through, seen.eta[rows, n] ** -2.0, 1.0)
        off = _relative(radiance, carried * factor[:, None]) * there
        row = int(np.argmax(off))
        ratio = float(radiance[row].mean() / max(carried[row].mean(), 1e-12))
        what = "transmits" if through[row] else "reflects"
        text = f"{what} {ratio:.4g} times as much radiance as power, {factor[row]:.4g} expected (1 / eta^2)"
        yield _worst(off, text, o, i)._replace(cause=_power_of(radiance, carried, seen.eta[rows, n], through & there))


def _power_of(radiance: np.ndarray, power: np.ndarray, eta: np.ndarray, usable: np.ndarray) -> str:
    """What the ratio of radiance to power is, where it is one power of the index for all of transmission."""
    if usable.sum() < 8 or np.all(np.abs(eta[usable] - 1.0) < FLAT):
        return ""
    ratio = radiance[usable].sum(1) / np.maximum(power[usable].sum(1), 1e-12)
    for exponent, words in ((0.0, "is missing"), (2.0, "is upside down"), (-4.0, "stands there twice")):
        if np.all(np.abs(ratio / eta[usable] ** exponent - 1.0) < 1e-3):
            return f"radiance over power is {f'eta^{exponent:g}' if exponent else '1'}: the factor 1 / eta^2 {words}?"
    return ""


def _back(subject: Subject, wo: np.ndarray, seen: Lobes, power: Lobes, seed: int) -> Wrong:
    """The lobe along wi, seen from wi, leads back to wo and carries the same power."""
    for rows, n in _each(wo, power):
        o, i = wo[rows], power.wi[rows, n]
        there, _ = lobes.along(lobes.rows_of(power, rows), i)
        fine = np.isfinite(i).all(1) & (np.abs(np.linalg.norm(i, axis=1) - 1.0) < SINGLE) & (np.abs(i[:, 2]) > 1e-3)
        fine &= there.max(1) > FORWARD
        if not fine.any():
            continue
        o, i, there = o[fine], i[fine], there[fine]
        back, found = lobes.along(lobes.of(subject, i, seed, "importance"), o)
        yield _worst(np.where(found, 0.0, np.inf), "goes along wi, and no lobe leads back from there", o, i)
        off = _relative(there, back) * found
        row = int(np.argmax(off))
        text = f"carries {there[row].mean():.4g} of the power one way and {back[row].mean():.4g} the other"
        yield _worst(off, text, o, i)


def _fresnel(subject: Subject, wo: np.ndarray, seen: Lobes, power: Lobes, seed: int) -> Wrong:
    """A material that names its index reflects as Fresnel's equations say, or Schlick's curve, times a constant."""
    index = _named_index(subject)
    through = power.through(wo)
    bends = through & (np.abs(power.eta - 1.0) > FLAT)
    if index is None or abs(index - 1.0) < FLAT or (through.any() and not bends.any()):
        return  # a thin slab lets light through straight, and is another curve
    if "delta" in subject.breaches:
        return  # a film's, as the material declares: its index is not all that it reflects by
    cos = np.abs(wo[:, 2])
    ratio = np.where(wo[:, 2] > 0.0, index, 1.0 / index)
    exact, schlick = _dielectric(cos, ratio), _schlick(cos, ratio)
    same = power.found & ~power.through(wo)
    reflected = np.sum(power.carried * same[..., None], axis=1)
    rest = np.sum(power.carried * power.through(wo)[..., None], axis=1)
    for curve in (exact, schlick):
        off = np.maximum(_off_constant(reflected, curve), _off_constant(rest, 1.0 - curve))
        if curve is exact:
            answer = off
        if off.max() < 1e-4 if subject.best == "float64" else off.max() < 5e-3:
            return
    row = int(np.argmax(answer))
    wi = wo[row] * [-1.0, -1.0, 1.0]
    cause = ""
    for known, words in ((ratio**-1.0, "of the other side's index"), (ratio**2.0, "of the index squared")):
        curve = _dielectric(cos, known)
        if np.maximum(_off_constant(reflected, curve), _off_constant(rest, 1.0 - curve)).max() < 1e-4:
            cause = f"it reflects by Fresnel's equations {words}?"
    text = f"reflects {reflected[row].mean():.4g} where Fresnel's equations for eta = {index:.4g} give {exact[row]:.4g}"
    yield _worst(answer, text, wo, np.tile(wi, (len(wo), 1)))._replace(cause=cause)


def _off_constant(value: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """How far values (N, channels) are from a multiple of a curve (N,), relative to the largest, (N,)."""
    size = float(np.sum(curve**2))
    scale = value.T @ curve / size if size > 0.0 else np.zeros(value.shape[1])
    most = np.maximum(np.abs(value).max(0), 1e-6)
    return (np.abs(value - curve[:, None] * scale) / most).max(1)


def _dielectric(cos: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Unpolarized reflectance for eta = index beyond over index before: (R_s + R_p) / 2, 1 in total reflection."""
    sin2 = (1.0 - cos**2) / eta**2
    inside = np.sqrt(np.maximum(1.0 - sin2, 0.0))
    s = (cos - eta * inside) / (cos + eta * inside)
    p = (eta * cos - inside) / (eta * cos + inside)
    return np.where(sin2 >= 1.0, 1.0, 0.5 * (s**2 + p**2))


def _schlick(cos: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Schlick's curve, in the cosine on the side of the smaller index."""
    r0 = ((eta - 1.0) / (eta + 1.0)) ** 2
    sin2 = (1.0 - cos**2) / eta**2
    outer = np.where(eta < 1.0, np.sqrt(np.maximum(1.0 - sin2, 0.0)), cos)
    return np.where(sin2 >= 1.0, 1.0, r0 + (1.0 - r0) * (1.0 - outer) ** 5)


def _turned(subject: Subject, wo: np.ndarray, seen: Lobes, power: Lobes, seed: int) -> Wrong:
    """Isotropic lobes turn with the view."""
    if not subject.isotropic:
        return
    angle = np.random.default_rng([seed, 92]).uniform(0.0, 2.0 * np.pi, len(wo))
    turned = lobes.of(subject, directions.turned(wo, angle), seed)
    for rows, n in _each(wo, seen):
        o, i = wo[rows], seen.wi[rows, n]
        carried, _ = lobes.along(lobes.rows_of(seen, rows), i)
        other, found = lobes.along(lobes.rows_of(turned, rows), directions.turned(i, angle[rows]))
        lost = np.where(found | (carried.max(1) < FORWARD), 0.0, np.inf)
        yield _worst(lost, "declared isotropic, but a turn of the view moves the lobe", o, i)
        off = _relative(carried, other) * found
        yield _worst(off, "declared isotropic, but a turn of the view changes what the lobe carries", o, i)


def _tinted(subject: Subject, wo: np.ndarray, seen: Lobes, power: Lobes, seed: int) -> Wrong:
    """What a lobe carries is affine in each albedo, unless values are declared not to be."""
    if "linearity" in subject.breaches:
        return
    names = [name for name, p in subject.parameters.items() if p.kind == "spectrum" and p.high == 1.0]
    for name in names:
        low, high, middle = (lobes.of(subject.replace(**{name: v}), wo, seed) for v in (0.125, 0.875, 0.3125))
        for rows, n in _each(wo, middle):
            i = middle.wi[rows, n]
            a, b, c = (lobes.along(lobes.rows_of(part, rows), i)[0] for part in (low, high, middle))
            yield _worst(
                _relative(c, 0.75 * a + 0.25 * b), f"what the lobe carries is not linear in {name}", wo[rows], i
            )


def _single(subject: Subject, wo: np.ndarray, seen: Lobes, power: Lobes, seed: int) -> Wrong:
    """float32 goes the same way and carries the same; not within 3 degrees of grazing, where an edge may be near."""
    rough = lobes.of(subject, wo, seed, precision="float32")
    for rows, n in _each(wo, seen):
        o, i = wo[rows], seen.wi[rows, n]
        exact, _ = lobes.along(lobes.rows_of(seen, rows), i)
        single, found = lobes.along(lobes.rows_of(rough, rows), i)
        matters = (np.abs(i[:, 2]) > 0.05) & (exact.max(1) > FORWARD)
        yield _worst(np.where(found | ~matters, 0.0, np.inf), "float32 has no such lobe", o, i)
        off = _relative(single, exact) * (found & matters)
        off = np.where(off > SINGLE, off, 0.0)
        yield _worst(off, "float32 carries another share of the light than float64", o, i)


def _slopes(subject: Subject, wo: np.ndarray, seen: Lobes, power: Lobes, seed: int) -> Wrong:
    """d (weight x pdf) / d parameter by autodiff equals differences, at fixed random numbers."""
    if not isinstance(subject.model, BSDF) or subject.stochastic:
        return
    dr = backend.drjit()
    kind = backend.types("float64")
    pick = slice(None, None, 3)
    views = wo[pick]
    views = views[np.abs(views[:, 2]) > 0.1]
    u = lobes.chosen(16, seed)
    many, numbers = np.repeat(views, len(u), axis=0), np.tile(u, (len(views), 1))
    a, b = (backend.vector_of(w, 3, kind) for w in (many, numbers))
    numeric = [
        leaf
        for leaf in tree.leaves(subject.model)
        if leaf.parameter.numeric and leaf.parameter.kind not in ("angle", "alpha") and np.ndim(leaf.value) <= 1
    ]
    for leaf in numeric:
        # all are moved, the others by 0: one kernel serves for each of them
        own = {one.path: dr.opaque(kind.float, float(one is leaf)) for one in numeric}

        def carried(shift: Any, own: dict[str, Any] = own) -> tuple[Any, Any]:
            bound = subject.model.bind(kind)
            for path, much in own.items():
                bound = binding.shift(bound, path, functools.partial(operator.add, much * shift))
            s = guarded(subject.model, "sample", lambda: bound.sample(a, b, "radiance"))
            return kind.vec3(s[1]) * s[2], kind.bool(s[3]) & (s[2] > 0.0)

        def slope(own: dict[str, Any] = own) -> tuple[np.ndarray, Any]:
            delta = dr.opaque(kind.float, 0.0)
            dr.enable_grad(delta)
            value, lit = carried(delta, own)
            if not dr.grad_enabled(value):
                return np.zeros((len(many), 3)), lit
            dr.forward(delta)
            return np.asarray(backend.to_numpy(dr.grad(value), len(many))), lit

        exact, lit = slope()
        if not np.isfinite(exact).all():  # where another has no derivative, which 0 times does not mend
            exact, lit = slope({leaf.path: own[leaf.path]})
        size = float(np.max(np.abs(np.asarray(leaf.value, float)))) or 1.0
        step = 1e-4 * size
        ends = [carried(dr.opaque(kind.float, s * step)) for s in (-1.0, -0.5, 0.5, 1.0, 0.0)]
        shown = [np.broadcast_to(backend.to_numpy(v, len(many)), (len(many), 3)) for v, _ in ends]
        there = np.all(
            [np.broadcast_to(backend.to_numpy(m, len(many)), (len(many),)) for m in [lit, *(m for _, m in ends)]],
            axis=0,
        )
        wide, narrow = ((shown[3] - shown[0]) / (2.0 * step), (shown[2] - shown[1]) / step)
        before, after = (shown[4] - shown[1]) / (0.5 * step), (shown[2] - shown[4]) / (0.5 * step)
        smooth = there & np.all(np.abs(wide - narrow) <= 1e-3 * np.abs(narrow) + 1e-7 / size, axis=1)
        differences = narrow + (narrow - wide) / 3.0
        # a kink at the very value, such as where black is held above 0: any slope between those of its sides is right
        kink = np.abs(after - before) > 0.01 * (np.abs(after) + np.abs(before))
        between = np.clip(exact, np.minimum(before, after), np.maximum(before, after))
        differences = np.where(kink, between, differences)
        floor = max(1e-3 * float(np.max(np.abs(differences[smooth]), initial=0.0)), 1e-6 / size)
        off = (np.abs(exact - differences) / np.maximum(np.abs(differences), floor)).max(1) * smooth
        off = np.where(off > SLOPES, off, 0.0)
        wi = many * [-1.0, -1.0, 1.0]
        yield _worst(
            off, f"the derivative of what the lobe carries by {leaf.path} is not that of differences", many, wi
        )


def _relative(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Largest difference over channels, relative to the larger brightest channel, (N,)."""
    size = np.maximum(np.maximum(np.abs(a).max(1), np.abs(b).max(1)), 1e-6)
    return np.abs(a - b).max(1) / size


def _worst(off: np.ndarray, text: str, wo: np.ndarray, wi: np.ndarray) -> Miss:
    off = np.where(np.isnan(off), np.inf, off)
    if not len(off):
        return Miss(0.0, text, wo, wi)
    row = int(np.argmax(off))
    average, share = float(np.minimum(off, 1.0).mean()), float(np.mean(off > 0.01))
    return Miss(float(off[row]), text, wo[row], wi[row], average, share)


def _frequencies(subject: Subject, effort: Effort, seed: int) -> list[Trial]:
    """Each lobe is chosen as often as its pdf, a probability, says."""
    angles = [(25.0, 40.0), (70.0, 200.0)] if effort.full else [(50.0, 100.0)]
    wo = np.concatenate(
        [[directions.at(t if side > 0 else 180.0 - t, p) for t, p in angles] for side in subject.sides or (1,)]
    )
    wo = directions.single(wo)
    count = min(effort.furnace_samples, 1 << 16)
    known = lobes.of(subject, wo, seed, precision="float32")
    # where parameters make two lobes one, both together are met twice as often as each says
    times = np.ones(known.pdf.shape)
    if not effort.full:
        times = np.where(known.share > 0.05, np.round(known.share / np.maximum(known.pdf, 0.01)), 1.0)
        times = np.maximum(times, 1.0)
    trials = []

    def p_value(row: int, lobe: int, seed: int) -> float:
        u = directions.numbers(np.random.default_rng([seed, 21, row]), count)
        s = subject.sample(np.tile(wo[row], (count, 1)), u, precision="float32")
        mine = s.delta & (s.pdf > 0.0) & (np.abs(s.wi - known.wi[row, lobe]).max(1) < lobes.NEAR)
        here = known.found[row] & (np.abs(known.wi[row] - known.wi[row, lobe]).max(1) < lobes.NEAR)
        probability = float(np.sum(known.pdf[row] * times[row] * here))
        return statistics.binomial_two_sided(int(mine.sum()), count, min(max(probability, 0.0), 1.0))

    for row, lobe in np.argwhere(known.found):

        def repeat(row: int = int(row), lobe: int = int(lobe)) -> float:
            return p_value(row, lobe, seed + 7919)

        text = f"how often the lobe toward {_angles(known.wi[row, lobe])} is chosen, seen from {_angles(wo[row])}"
        trials.append(Trial(p_value(int(row), int(lobe), seed), text, repeat))
    return trials


__all__ = ["DeltaLobes"]
