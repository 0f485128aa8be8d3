"""Checks of delta lobes: direction, index, radiance versus power, the reverse path, Fresnel's equations, rotation,
tint, float32 and derivatives.

Each check yields a `Miss` per kind of error; `laws/delta.py` turns these into a verdict.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..material import BSDF, binding, tree
from ..ops import backend
from . import directions, lobes, statistics
from .forensics.factors import dielectric, schlick_curve
from .lobes import Lobes
from .subject import Subject, guarded

SINGLE = 2e-3  # tolerated error of float32
SLOPES = 1e-4  # tolerated error of derivatives
FORWARD = 1e-4  # fraction of light below which a lobe need not be reciprocal
CLOSE = 0.9  # fraction of oblique views at which a lobe must lie next to the mirror direction to count as an error
BOUNCED = 1e-6  # relative deviation from a line that rounding cannot explain
FLAT = 1e-3  # difference of an index from 1 below which nothing is refracted


class Probe(NamedTuple):
    """A subject, directions wo (N, 3), and its delta lobes for these directions, in radiance and in power."""

    subject: Subject
    wo: np.ndarray
    radiance: Lobes
    power: Lobes
    seed: int

    def lobes(self, part: Lobes) -> Iterator[tuple[np.ndarray, int, np.ndarray, np.ndarray]]:
        """For each lobe, by its number n: the indices of the wo that have it, n, and wo and wi for these indices."""
        for n in range(part.valid.shape[1]):
            rows = np.flatnonzero(part.valid[:, n])
            if len(rows):
                yield rows, n, self.wo[rows], part.wi[rows, n]


class Miss(NamedTuple):
    """An error of delta lobes.

    size     relative error for the worst direction
    text     description of the error
    wo, wi   the worst direction wo, and the direction of its lobe
    average  mean error over the directions wo that have the lobe
    share    fraction of these directions with an error of more than 0.01
    cause    the probable mistake
    """

    size: float
    text: str
    wo: np.ndarray
    wi: np.ndarray
    average: float = 1.0
    share: float = 1.0
    cause: str = ""


Misses: TypeAlias = Iterator[Miss]


def _miss(off: np.ndarray, text: str, wo: np.ndarray, wi: np.ndarray, cause: str = "") -> Miss:
    off = np.where(np.isnan(off), np.inf, off)
    if not len(off):
        return Miss(0.0, text, wo, wi)
    row = int(np.argmax(off))
    average, share = float(np.minimum(off, 1.0).mean()), float(np.mean(off > 0.01))
    return Miss(float(off[row]), text, wo[row], wi[row], average, share, cause=cause)


def _relative(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The largest difference over the channels, relative to the brightest channel of the two values, (N,)."""
    size = np.maximum(np.maximum(np.abs(a).max(1), np.abs(b).max(1)), 1e-6)
    return np.asarray(np.abs(a - b).max(1) / size)


def distinct(a: float, b: float) -> tuple[str, str]:
    """Two numbers as text, with as many digits as needed to distinguish them, at least four."""
    for digits in range(4, 18):
        texts = f"{a:.{digits}g}", f"{b:.{digits}g}"
        if texts[0] != texts[1]:
            break
    return texts


# --------------------------------------------------------------------------- the direction of a lobe


def direction(probe: Probe) -> Misses:
    """Check that directions are unit vectors, and that refraction follows Snell's law with the lobe's own eta.

    Reflection far from the mirror direction, and transmission without refraction, are tested only for reciprocity,
    because gratings and corner cubes have such lobes.
    """
    for rows, n, o, i in probe.lobes(probe.radiance):
        eta = probe.radiance.eta[rows, n]
        off = np.abs(np.linalg.norm(i, axis=1) - 1.0)
        yield _miss(off, "the direction of a delta lobe is not a unit vector", o, i)
        through = o[:, 2] * i[:, 2] < 0.0
        refracted = through & (np.abs(eta - 1.0) > FLAT)
        if refracted.any():
            yield _snell(o, i, eta, refracted)
        straight = through & ~refracted
        if straight.any():
            yield from _unstated_index(o, i, straight)
        mirror = o * [-1.0, -1.0, 1.0]
        # a grating has orders next to the mirror direction, with one exactly along it or in pairs on both sides of it
        _, exact = lobes.along(there := lobes.rows_of(probe.radiance, rows), mirror)
        _, paired = lobes.along(there, _opposite_order(o, i))
        # not near the normal, where the mirror direction and the direction back to wo coincide
        oblique = ~through & (np.hypot(o[:, 0], o[:, 1]) > 0.2)
        close = oblique & ~exact & ~paired & (np.abs(i - mirror)[:, :2].max(1) < 0.1)
        if close.sum() < CLOSE * oblique.sum():
            continue  # the lobe only crosses the mirror direction at some views
        yield _miss(
            np.abs(i - mirror).max(1) * close, "a reflected lobe is close to the mirror direction, but not in it", o, i
        )


def _opposite_order(o: np.ndarray, i: np.ndarray) -> np.ndarray:
    """For each order i of a grating, the direction of the order -i: their tangential components sum to -2 o."""
    tangential = -2.0 * o[:, :2] - i[:, :2]
    squared = 1.0 - np.sum(tangential**2, axis=1)
    return np.column_stack([tangential, np.sign(i[:, 2]) * np.sqrt(np.maximum(squared, 0.0))])


def _snell(o: np.ndarray, i: np.ndarray, eta: np.ndarray, refracted: np.ndarray) -> Miss:
    off = np.abs(i[:, :2] + o[:, :2] / eta[:, None]).max(1) * refracted
    inverse = np.abs(i[:, :2] + o[:, :2] * eta[:, None]).max(1) * refracted
    text, cause = "not refracted according to Snell's law for the eta of the sample", ""
    wrong = off > SINGLE
    if wrong.any() and np.abs(i + o)[wrong].max() < SINGLE:
        cause = "the light passes straight through, but `eta` is not 1: is it the eta of another lobe?"
    elif wrong.any() and inverse[wrong].max() < SINGLE:
        text += ", but for 1 / eta"
        cause = "Snell's law holds for 1 / eta: is the refraction inverted, or is `eta` that of the other side?"
    return _miss(off, text, o, i, cause)


def _unstated_index(o: np.ndarray, i: np.ndarray, straight: np.ndarray) -> Misses:
    """Check that samples with eta = 1 are not refracted."""
    sin_o, sin_i = np.hypot(o[:, 0], o[:, 1]), np.hypot(i[:, 0], i[:, 1])
    usable = straight & (sin_o > 0.1) & (sin_i > 0.1)
    index = sin_o[usable] / sin_i[usable]
    if len(index) > 3 and np.ptp(index) < 1e-3 * index.mean() and abs(index.mean() - 1.0) > FLAT:
        size = np.where(usable, abs(index.mean() - 1.0), 0.0)
        text = f"light is refracted with an index of {index.mean():.4g}, but eta of the samples is 1"
        yield _miss(size, text, o, i, "`eta` of transmitted samples is 1: was it never set?")


def indices(probe: Probe) -> Misses:
    """Check that eta is 1 for reflection, that eta from below is the inverse of eta from above, and that it agrees with
    a parameter that defines the index."""
    named = _named_index(probe.subject)
    for rows, n, o, i in probe.lobes(probe.radiance):
        eta = probe.radiance.eta[rows, n]
        through = o[:, 2] * i[:, 2] < 0.0
        yield _miss(np.abs(eta - 1.0) * ~through, "eta of a reflected sample is not 1", o, i)
        above = np.where(o[:, 2] > 0.0, eta, 1.0 / np.where(eta > 0.0, eta, np.nan))[through]
        if not len(above) or np.all(np.abs(above - 1.0) < FLAT):
            continue  # nothing is transmitted, or nothing is refracted
        off = np.zeros(len(o))
        if named is not None:
            off[through] = np.abs(above / named - 1.0)
            stated, expected = distinct(float(above[np.argmax(np.abs(above / named - 1.0))]), named)
            yield _miss(off, f"eta from above is {stated}, but should be {expected} according to the parameters", o, i)
        elif np.ptp(above) > FLAT * np.median(above):
            off[through] = np.abs(above / np.median(above) - 1.0)
            yield _miss(off, "eta from below is not the inverse of eta from above", o, i)


def _named_index(subject: Subject) -> float | None:
    """The index below divided by that above, if a parameter of the material defines it."""
    names = subject.parameters
    try:
        if "eta" in names and names["eta"].kind == "float":
            return float(subject.model.eta)
        if "int_ior" in names:
            return float(subject.model.int_ior) / float(getattr(subject.model, "ext_ior", 1.000277))
    except TypeError:
        pass
    return None


# --------------------------------------------------------------------------- the light of a lobe


def modes(probe: Probe) -> Misses:
    """Check that the light in radiance is 1 / eta^2 times that in power for transmission, and equal to it for
    reflection (Veach1997, 5.2)."""
    if not probe.subject.transmits:
        return
    for rows, n, o, i in probe.lobes(probe.radiance):
        eta = probe.radiance.eta[rows, n]
        radiance, _ = lobes.along(lobes.rows_of(probe.radiance, rows), i)
        power, exists = lobes.along(lobes.rows_of(probe.power, rows), i)
        through = o[:, 2] * i[:, 2] < 0.0
        factor = np.where(through, eta**-2.0, 1.0)
        off = _relative(radiance, power * factor[:, None]) * exists
        row = int(np.argmax(off))
        ratio, expected = distinct(float(radiance[row].mean() / max(power[row].mean(), 1e-12)), float(factor[row]))
        verb = "transmits" if through[row] else "reflects"
        text = f"{verb} {ratio} times as much radiance as power instead of {expected} times (1 / eta^2)"
        total = np.sum(probe.power.carried[rows] * probe.power.valid[rows][..., None], axis=1)
        cause = _power_of_index(radiance, power, eta, through & exists, total)
        cause = cause or _one_side(radiance, power, eta, through & exists, o[:, 2] > 0.0)
        yield _miss(off, text, o, i, cause)


def _power_of_index(
    radiance: np.ndarray, power: np.ndarray, eta: np.ndarray, usable: np.ndarray, total: np.ndarray
) -> str:
    """The cause if radiance divided by power (mode "importance") is the same power of the index for all transmission.

    total  power of all lobes, (N, channels); if it is 1 only without such a factor, power is wrong, not radiance
    """
    if usable.sum() < 8 or np.all(np.abs(eta[usable] - 1.0) < FLAT):
        return ""
    ratio = radiance[usable].sum(1) / np.maximum(power[usable].sum(1), 1e-12)
    full, carried, squared = total[usable], power[usable], eta[usable, None] ** 2.0

    def conserved(scale: np.ndarray | float) -> bool:
        return bool(np.all(np.abs(full - carried + scale * carried - 1.0) < 1e-3))

    for exponent, right, wrong in (
        (-1.0, "1 / eta in place of 1 / eta^2", "power has a factor eta that it should not have"),
        (0.0, "the factor 1 / eta^2 is missing", "power has the factor 1 / eta^2, which only radiance should have"),
        (2.0, "the factor 1 / eta^2 is inverted", "the two modes are exchanged"),
        (-4.0, "the factor 1 / eta^2 is applied twice", "power has a factor eta^2 that it should not have"),
    ):
        if np.all(np.abs(ratio / eta[usable] ** exponent - 1.0) < 1e-3):
            of_power = not conserved(1.0) and conserved(squared if exponent >= 0.0 else 1.0 / squared)
            text = "1 / eta" if exponent == -1.0 else f"eta^{exponent:g}" if exponent else "1"
            known = of_power or conserved(1.0)
            guess = wrong if of_power else right if known else f"{right}, or {wrong}"
            return f"the ratio of radiance to power is {text}; possible mistake: {guess}"
    return ""


def _one_side(radiance: np.ndarray, power: np.ndarray, eta: np.ndarray, usable: np.ndarray, outside: np.ndarray) -> str:
    """The cause if radiance divided by power is correct from one side of the surface only."""
    ratio = radiance.sum(1) / np.maximum(power.sum(1), 1e-12)
    for right, wrong, name in ((outside, ~outside, "inside"), (~outside, outside, "outside")):
        a, b = usable & right, usable & wrong
        if min(a.sum(), b.sum()) < 4 or np.abs(eta[b] - 1.0).max() < FLAT:
            continue
        if np.all(np.abs(ratio[a] * eta[a] ** 2.0 - 1.0) < 1e-3):
            for exponent, text in (
                (2.0, "inverted"),
                (0.0, "missing"),
                (-4.0, "applied twice"),
                (-1.0, "replaced by 1 / eta"),
            ):
                if np.all(np.abs(ratio[b] / eta[b] ** exponent - 1.0) < 1e-3):
                    return f"for wo {name}, the factor 1 / eta^2 of radiance is {text}, but correct for the other side"
    return ""


def way_back(probe: Probe) -> Misses:
    """Check that, for a lobe along wi, a lobe viewed from wi leads back to wo and carries the same power."""
    for rows, _, o, i in probe.lobes(probe.power):
        there, _ = lobes.along(lobes.rows_of(probe.power, rows), i)
        fine = np.isfinite(i).all(1) & (np.abs(np.linalg.norm(i, axis=1) - 1.0) < SINGLE) & (np.abs(i[:, 2]) > 1e-3)
        fine &= there.max(1) > FORWARD
        if not fine.any():
            continue
        o, i, there = o[fine], i[fine], there[fine]
        back, exists = lobes.along(lobes.of(probe.subject, i, probe.seed, "importance"), o)
        yield _miss(np.where(exists, 0.0, np.inf), "a lobe leads from wo to wi, but none leads back", o, i)
        off = _relative(there, back) * exists
        row = int(np.argmax(off))
        one_way, other_way = distinct(there[row].mean(), back[row].mean())
        cause = _of_way_back(probe, o, there, back, exists & (o[:, 2] * i[:, 2] < 0.0))
        yield _miss(off, f"carries {one_way} of the power from wo to wi, but {other_way} from wi to wo", o, i, cause)


def _of_way_back(probe: Probe, o: np.ndarray, there: np.ndarray, back: np.ndarray, through: np.ndarray) -> str:
    """The cause if the light carried in one direction is a constant times that carried in the reverse direction for
    all views of a side, or if reflection from the denser side follows Schlick's curve at the angle on that side."""
    off = (_relative(there, back) > 1e-4) & through
    if off.sum() < 4:
        return ""
    wo, power = probe.wo, probe.power
    for side, where in ((1.0, "outside"), (-1.0, "inside")):
        rows = off & (o[:, 2] * side > 0.0) & (back.min(1) > 0.0)
        ratio = there[rows] / back[rows]
        if rows.sum() >= 4 and np.ptp(ratio, axis=0).max() < 1e-3 * ratio.max():
            color = ", ".join(f"{c:.3g}" for c in np.median(ratio, axis=0))
            words = f"light from {where} carries ({color}) times the power of its reverse"
            return f"{words}; possible mistake: a tint in one direction only"
    reflected = np.sum(power.carried * (power.valid & ~power.through(wo))[..., None], axis=1).mean(1)
    eta = np.sum(power.eta * power.through(wo), axis=1)
    for side, where in ((1.0, "outside"), (-1.0, "inside")):
        rows = (wo[:, 2] * side > 0.0) & (reflected > 0.0) & (reflected < 0.999)
        x = (1.0 - np.abs(wo[rows, 2])) ** 5
        if rows.sum() < 4 or np.ptp(x) < 2e-4 or not np.all(eta[rows] < 1.0):  # only from the denser side
            continue
        r0 = float(np.sum((reflected[rows] - x) * (1.0 - x)) / np.sum((1.0 - x) ** 2))  # fit of r0 + (1 - r0) x
        if np.abs(r0 + (1.0 - r0) * x - reflected[rows]).max() < 1e-5:
            return f"from {where}, Schlick's approximation is used at the angle of wo instead of the transmitted angle"
    return ""


def fresnel(probe: Probe) -> Misses:
    """Check that a material with a stated index reflects by Fresnel's equations, or by Schlick's curve, up to a
    constant factor."""
    subject, wo, power = probe.subject, probe.wo, probe.power
    index = _named_index(subject)
    through = power.through(wo)
    refracted = through & (np.abs(power.eta - 1.0) > FLAT)
    if index is None or abs(index - 1.0) < FLAT or (subject.transmits and not refracted.any()):
        return  # a thin slab transmits without refraction (or nothing, if it is black), and follows another curve
    if "delta" in subject.breaches:
        return  # declared, as for a film: its reflectance does not depend on this index alone
    cosine, ratio = np.abs(wo[:, 2]), np.where(wo[:, 2] > 0.0, index, 1.0 / index)
    carried = {
        "reflects": np.sum(power.carried * (power.valid & ~through)[..., None], axis=1),
        "transmits": np.sum(power.carried * through[..., None], axis=1),
    }

    def against(curve: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        return {verb: _of_curve(carried[verb], c) for verb, c in (("reflects", curve), ("transmits", 1.0 - curve))}

    exact, schlick = against(dielectric(cosine, ratio)), against(schlick_curve(cosine, ratio))
    least = 1e-4 if subject.best == "float64" else 5e-3
    for curve, share in ((exact, dielectric(cosine, ratio)), (schlick, schlick_curve(cosine, ratio))):
        if curve["reflects"][0].max() < least and _absorbs(carried["transmits"], share, cosine, ratio, least):
            return
    if any(max(off.max() for off, _ in curve.values()) < least for curve in (exact, schlick)):
        return
    verb = max(exact, key=lambda verb: float(exact[verb][0].max()))
    off, expected = exact[verb]
    row = int(np.argmax(off))
    channel = int(np.argmax(np.abs(carried[verb][row] - expected[row])))
    cause = ""
    for other, words in ((ratio**-1.0, "for the index of the other side"), (ratio**2.0, "for the square of the index")):
        if max(off.max() for off, _ in against(dielectric(cosine, other)).values()) < 1e-4:
            cause = f"the reflectance follows Fresnel's equations {words}"
    value, right = distinct(float(carried[verb][row, channel]), float(expected[row, channel]))
    text = f"{verb} {value} of the light, but Fresnel's equations for eta = {index:.4g} give {right}"
    worst = np.maximum(exact["reflects"][0], exact["transmits"][0])
    yield _miss(worst, text, wo, wo * [-1.0, -1.0, 1.0], cause)


def _absorbs(value: np.ndarray, share: np.ndarray, cosine: np.ndarray, ratio: np.ndarray, least: float) -> bool:
    """Whether the transmitted light `value` (N, channels) is 1 - F times a constant times exp(-depth / cos), as with an
    absorbing layer on the denser side of the surface (Beer's law)."""
    dense = np.where(ratio > 1.0, np.sqrt(np.maximum(1.0 - (1.0 - cosine**2) / ratio**2, 0.0)), cosine)
    rows = (share < 0.99) & (dense > 0.1)
    if rows.sum() < 4:
        return False
    columns = np.stack([np.ones(rows.sum()), 1.0 / dense[rows]], axis=1)
    for passed in (value[rows] / (1.0 - share[rows, None])).T:
        if passed.max() < 1e-6:
            continue
        lit = passed > 1e-9
        depth = np.linalg.lstsq(columns[lit], -np.log(passed[lit]), rcond=None)[0]
        if np.min(depth) < -least or np.abs(np.exp(-columns @ depth) - passed).max() > least:
            return False
    return True


def _of_curve(value: np.ndarray, curve: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The difference of values (N, channels) from the best-fitting multiple of a curve (N,), relative to the largest
    value, (N,); and this multiple."""
    size = float(np.sum(curve**2))
    scale = value.T @ curve / size if size > 0.0 else np.zeros(value.shape[1])
    most = np.maximum(np.abs(value).max(0), 1e-6)
    expected = curve[:, None] * scale
    return (np.abs(value - expected) / most).max(1), expected


KEPT = (("y", np.array([-1.0, 1.0, 1.0])), ("x", np.array([1.0, -1.0, 1.0])), ("x and y", np.array([1.0, 1.0, -1.0])))


def rotation(probe: Probe) -> Misses:
    """Check that isotropic lobes rotate with wo."""
    if not probe.subject.isotropic:
        return
    angle = np.random.default_rng([probe.seed, 92]).uniform(0.0, 2.0 * np.pi, len(probe.wo))
    rotated = lobes.of(probe.subject, directions.rotated(probe.wo, angle), probe.seed)
    for rows, _, o, i in probe.lobes(probe.radiance):
        carried, _ = lobes.along(lobes.rows_of(probe.radiance, rows), i)
        other, exists = lobes.along(lobes.rows_of(rotated, rows), directions.rotated(i, angle[rows]))
        lost = np.where(exists | (carried.max(1) < FORWARD), 0.0, np.inf)
        cause = next(
            (
                f"the sampled direction has the same {k} as wo; possible mistake: a wrong sign"
                for k, m in KEPT
                if np.abs(i - o * m).max() < 1e-4
            ),
            "",
        )
        yield _miss(lost, "declared isotropic, but the lobe does not rotate with wo", o, i, cause)
        off = _relative(carried, other) * exists
        yield _miss(off, "declared isotropic, but the light of the lobe changes when wo rotates", o, i)


def tint(probe: Probe) -> Misses:
    """Check that the light of a lobe is affine in each albedo, unless the material declares otherwise."""
    if "linearity" in probe.subject.breaches:
        return
    for name, parameter in probe.subject.parameters.items():
        if parameter.kind != "spectrum" or parameter.high != 1.0:
            continue
        low, high, middle = (
            lobes.of(probe.subject.replace(**{name: v}), probe.wo, probe.seed) for v in (0.125, 0.875, 0.3125)
        )
        for rows, _, o, i in probe.lobes(middle):
            (a, dim), (b, _), (c, _) = (lobes.along(lobes.rows_of(part, rows), i) for part in (low, high, middle))
            # a lobe that carries almost nothing may be missed at the lower albedo
            off = _relative(c, 0.75 * a + 0.25 * b) * (dim | (c.max(1) > FORWARD))
            if off.max(initial=0.0) > BOUNCED and _bounces(probe, name, rows, i):
                continue
            yield _miss(off, f"the light of the lobe is not linear in {name}", o, i)


def _bounces(probe: Probe, name: str, rows: np.ndarray, i: np.ndarray) -> bool:
    """Whether a lobe's light is a power series in an albedo, as for light that is reflected or transmitted once, twice,
    and so on, as between two panes.

    name  path of the albedo
    """
    values = []
    for albedo in statistics.STEPS:
        changed = lobes.of(probe.subject.replace(**{name: float(albedo)}), probe.wo, probe.seed)
        values.append(lobes.along(lobes.rows_of(changed, rows), i)[0].mean(1))
    return statistics.is_power_series(np.stack(values), BOUNCED, first_power=False)


def float32(probe: Probe) -> Misses:
    """Check that the lobes in float32 are the same, with the same light, except within 3 degrees of the horizon, where
    an edge may be near."""
    rounded = lobes.of(probe.subject, probe.wo, probe.seed, precision="float32")
    for rows, _, o, i in probe.lobes(probe.radiance):
        exact, _ = lobes.along(lobes.rows_of(probe.radiance, rows), i)
        single, exists = lobes.along(lobes.rows_of(rounded, rows), i)
        matters = (np.abs(i[:, 2]) > 0.05) & (exact.max(1) > FORWARD)
        yield _miss(np.where(exists | ~matters, 0.0, np.inf), "the lobe is missing in float32", o, i)
        off = _relative(single, exact) * (exists & matters)
        yield _miss(
            np.where(off > SINGLE, off, 0.0),
            "in float32, the lobe carries a different fraction of the light than in float64",
            o,
            i,
        )


# --------------------------------------------------------------------------- derivatives


def derivatives(probe: Probe) -> Misses:
    """Check that d (weight x pdf) / d parameter by automatic differentiation equals finite differences, for fixed
    random numbers."""
    model = probe.subject.model
    if not isinstance(model, BSDF) or probe.subject.stochastic:
        return
    dr, kind = backend.drjit(), backend.types("float64")
    views = probe.wo[::3]
    views = views[np.abs(views[:, 2]) > 0.1]
    u = lobes.chosen(16, probe.seed)
    many, numbers = np.repeat(views, len(u), axis=0), np.tile(u, (len(views), 1))
    a, b = (backend.vector_of(w, 3, kind) for w in (many, numbers))
    numeric = [
        leaf
        for leaf in tree.leaves(model)
        if leaf.parameter.numeric and leaf.parameter.kind not in ("angle", "alpha") and np.ndim(leaf.value) <= 1
    ]

    def carried(own: dict[str, Any], shift: Any) -> tuple[Any, Any]:
        """weight x pdf with each parameter moved by its own multiple of a shift, and whether the sample is a delta
        sample."""
        bound = model.bind(kind)
        for path, much in own.items():
            bound = binding.shift(bound, path, functools.partial(operator.add, much * shift))
        s = guarded(model, "sample", lambda: bound.sample(a, b, "radiance"))
        return kind.vec3(s[1]) * s[2], kind.bool(s[3]) & (s[2] > 0.0)

    for leaf in numeric:
        # all parameters are moved, the others by 0, so that one kernel serves them all
        own = {one.path: dr.opaque(kind.float, float(one is leaf)) for one in numeric}
        exact, lit = _autodiff(functools.partial(carried, own), len(many))
        if not np.isfinite(exact).all():  # another parameter has no derivative, and 0 times NaN is NaN
            exact, lit = _autodiff(functools.partial(carried, {leaf.path: own[leaf.path]}), len(many))
        size = float(np.max(np.abs(np.asarray(leaf.value, float)))) or 1.0
        off = _slope_error(exact, lit, functools.partial(carried, own), size)
        text = f"the derivative of the lobe's light with respect to {leaf.path} differs from finite differences"
        yield _miss(np.where(off > SLOPES, off, 0.0), text, many, many * [-1.0, -1.0, 1.0])


Carried: TypeAlias = Callable[[Any], tuple[Any, Any]]  # maps a shift to values, and whether they exist


def _autodiff(carried: Carried, count: int) -> tuple[np.ndarray, Any]:
    """The derivatives with respect to the shift at 0, (N, 3), and whether the values exist."""
    dr = backend.drjit()
    delta = dr.opaque(backend.types("float64").float, 0.0)
    dr.enable_grad(delta)
    value, lit = carried(delta)
    if not dr.grad_enabled(value):
        return np.zeros((count, 3)), lit
    dr.forward(delta)
    return np.asarray(backend.to_numpy(dr.grad(value), count)), lit


def _slope_error(exact: np.ndarray, lit: Any, carried: Carried, size: float) -> np.ndarray:
    """The relative difference of derivatives (N, 3) from finite differences, (N,); 0 where the values have an edge."""
    dr, kind, count = backend.drjit(), backend.types("float64"), len(exact)
    step = 1e-4 * size
    ends = [carried(dr.opaque(kind.float, s * step)) for s in (-1.0, -0.5, 0.5, 1.0, 0.0)]
    values = [np.broadcast_to(backend.to_numpy(v, count), (count, 3)) for v, _ in ends]
    exists = [np.broadcast_to(backend.to_numpy(m, count), (count,)) for m in [lit, *(m for _, m in ends)]]
    wide, narrow = ((values[3] - values[0]) / (2.0 * step), (values[2] - values[1]) / step)
    before, after = (values[4] - values[1]) / (0.5 * step), (values[2] - values[4]) / (0.5 * step)
    smooth = np.all(exists, axis=0) & np.all(np.abs(wide - narrow) <= 1e-3 * np.abs(narrow) + 1e-7 / size, axis=1)
    differences = narrow + (narrow - wide) / 3.0
    # a kink exactly at the value, as where black is clamped above 0: any slope between the one-sided ones is correct
    kink = np.abs(after - before) > 0.01 * (np.abs(after) + np.abs(before))
    between = np.clip(exact, np.minimum(before, after), np.maximum(before, after))
    differences = np.where(kink, between, differences)
    floor = max(1e-3 * float(np.max(np.abs(differences[smooth]), initial=0.0)), 1e-6 / size)
    return np.asarray((np.abs(exact - differences) / np.maximum(np.abs(differences), floor)).max(1) * smooth)
