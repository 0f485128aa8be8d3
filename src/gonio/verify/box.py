"""The parameter values at which a BSDF is tested in addition to the given ones.

These are corners, edges and random points of the declared ranges, and the values just past every discontinuity in a
scan along one parameter. A material that is correct at its defaults may be wrong for a coat above 0.9, for a narrow
lobe, or for a combination of two parameters.

    for place in box.places(subject, effort, seed): ...     place.values, place.why, place.subject

No range is assumed: a parameter that declares none stays at its value.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import InputError
from ..material import BSDF, tree
from . import directions
from .effort import Effort
from .ranges import MARGIN, Axis, axes
from .subject import Fault, Subject

SCAN = 64  # values along one parameter
RAYS = 96  # pairs of directions per value
JUMP = 6.0  # smallest ratio of a jump to the neighboring steps
MIN_JUMP = 0.004  # smallest jump, relative to the value: smaller ones are invisible
UNIFORM_PLACES = 1  # places for a material whose parameters must be the same for all rays
PLACES_PER_CHOICE = 9
LEAST_CHOICES = 2


@dataclasses.dataclass(frozen=True)
class Place:
    """A point in the ranges of the parameters.

    values   the parameter values that differ from those of the given material, by path
    why      why it was chosen: "given", "choice", "color", "corner", "edge", "interior", "jump" or "pair"
    subject  the BSDF with these values
    along    the axes of the parameters that vary; if empty, all axes of `subject`
    """

    values: dict[str, Any]
    why: str
    subject: Subject
    along: tuple[Axis, ...] = ()

    def inside(self) -> Place:
        """The place moved away from the ends of the ranges, where values may be clamped and have no derivatives."""
        moved = {}
        for number, axis in enumerate(self.along or axes(self.subject)):
            value = tree.value_at(self.subject.model, axis.path)
            # different margins: at eta = k the formula of a conductor has a kink
            margin = MARGIN * (1.0 + 0.1 * number) * (axis.high - axis.low)
            if axis.path in self.values:
                moved[axis.path] = _plain(np.clip(self.values[axis.path], axis.low + margin, axis.high - margin))
            elif np.ndim(value) == 0 and not isinstance(value, tuple | list) and value == axis.high:
                moved[axis.path] = axis.high - margin
        if not moved:
            return self
        values = {path: moved.get(path, value) for path, value in self.values.items()}
        try:
            return dataclasses.replace(self, values=values, subject=self.subject.replace(**moved))
        except InputError:  # at the end of its range, a parameter may restrict another
            return self

    @property
    def words(self) -> str:
        """The values as text: "alpha = 1, coat = 0.5"."""
        return ", ".join(f"{name} = {_short(value)}" for name, value in self.values.items())


def places(subject: Subject, effort: Effort, seed: int) -> list[Place]:
    """The places at which to test a subject, apart from the given values: without duplicates, the most important first.

    effort  the effort of the run, which determines their number
    seed    seed of random places
    """
    along, others = axes(subject), _choices(subject)
    if not (along or others) or effort.places <= 0:
        return []
    # values that must be the same for all rays are derived for each place, which takes seconds
    most = min(effort.places, UNIFORM_PLACES) if subject.model.needs_uniform else effort.places
    rng = np.random.default_rng([seed, 71])
    wanted: list[tuple[str, dict[str, Any]]] = []
    if not subject.model.needs_uniform:
        for jump in jumps(subject, along, seed)[: max(2, most // 3)]:
            wanted.append(("jump", jump))
    wanted += [("choice", other) for other in others[: max(LEAST_CHOICES, most // PLACES_PER_CHOICE)]]
    corners = [{axis.path: axis.at(float(end)) for axis in along} for end in (0, 1)] if along else []
    if len(along) > 1:
        for _ in range(2):
            corners.append({axis.path: axis.at(float(rng.integers(2))) for axis in along})
    edges = [{axis.path: axis.at(end)} for axis in along for end in (1.0, 0.0)]
    rng.shuffle(edges)  # type: ignore[arg-type]
    interior = [_inside(along, rng) for _ in range(effort.places) if along]
    kinds = {"corner": corners, "color": _colors(along), "pair": _unequal(subject, along)}
    kinds |= {"edge": edges, "interior": interior}
    while any(kinds.values()):
        for why, rest in kinds.items():
            if rest:
                wanted.append((why, rest.pop(0)))
    made: list[Place] = []
    for why, values in wanted:
        if len(made) >= most:
            break
        values = {path: value if isinstance(value, str | bool) else _plain(value) for path, value in values.items()}
        if any(values == place.values for place in made):
            continue
        place = _made(subject, values, why, tuple(along))
        if place is not None:
            made.append(place)
    return made


# positions of the three channels in their range: all different, one low, or one high
COLORS = ((0.95, 0.1, 0.5), (0.0, 0.9, 0.9), (0.9, 0.0, 0.0), (0.5, 0.95, 0.1), (0.0, 0.9, 0.0), (0.9, 0.0, 0.9))
NARROW = 0.1  # position of a narrow width in its range
WIDTHS = ((0.45, 0.85), (0.8, 0.3))  # positions of the widths along the two axes in their range


def _colors(along: list[Axis]) -> list[dict[str, tuple[float, ...]]]:
    """Saturated values for all colors at once, with the channels of each color permuted differently. Every second set
    also has narrow lobes, whose loss by shadowing is too small to hide a Fresnel term above 1."""
    colors = [axis for axis in along if axis.kind == "color"]
    narrow = {axis.path: _plain(axis.at(NARROW)) for axis in along if axis.kind == "alpha"}
    return [
        {axis.path: _plain([float(axis.at(s)) for s in np.roll(shares, k)]) for k, axis in enumerate(colors)}
        | (narrow if number % 2 else {})
        for number, shares in enumerate(COLORS)
        if colors
    ]


def _unequal(subject: Subject, along: list[Axis]) -> list[dict[str, tuple[float, ...]]]:
    """Two unequal alphas for each width parameter whose value is a single number or a pair of equal numbers."""
    alphas = [axis for axis in along if axis.kind == "alpha" and _equal(tree.value_at(subject.model, axis.path))]
    return [{axis.path: _plain([float(axis.at(s)) for s in shares]) for axis in alphas} for shares in WIDTHS if alphas]


def _inside(along: list[Axis], rng: np.random.Generator) -> dict[str, Any]:
    """Random values of all parameters, with separate values of alpha for the two axes."""
    return {axis.path: axis.at(rng.uniform(size=2) if axis.kind == "alpha" else rng.uniform()) for axis in along}


def _equal(value: Any) -> bool:
    numbers = np.asarray(value, float).ravel() if isinstance(value, int | float | tuple | list) else np.arange(2.0)
    return bool(np.ptp(numbers) == 0.0)


def _plain(value: Any) -> Any:
    """The value as a float or a tuple of floats."""
    return tuple(np.asarray(value, float).tolist()) if np.ndim(value) else float(value)


def _choices(subject: Subject) -> list[dict[str, str | bool]]:
    """Each other option of every choice and each inverted flag, in rounds of one per parameter. Only the first few are
    tested, because each requires the compilation of new code."""
    if not isinstance(subject.model, BSDF) or subject.model.needs_uniform:
        return []
    turns: list[list[dict[str, str | bool]]] = []
    for leaf in tree.leaves(subject.model):
        if leaf.parameter.kind == "choice":
            turns.append([{leaf.path: name} for name in leaf.parameter.choices if name != leaf.value])
        elif leaf.parameter.kind == "flag":
            turns.append([{leaf.path: not leaf.value}])
    return [one for turn in itertools.zip_longest(*turns) for one in turn if one is not None]


def covered(subject: Subject, tried: list[Place]) -> str:
    """A description of the tested parameter values, without a capital letter at its start or a period at its end."""
    if not tried:
        reason = "" if axes(subject) else ", because no parameter declares a range"
        return f"tested at the given parameter values only{reason}"
    kinds = Counter(place.why for place in tried)
    words = {why: f"{count} {_NAMES[why]}" for why, count in kinds.items()}
    groups = [words[why] for why in _NAMES if why in words]
    others = f"{len(tried)} other setting{'s' if len(tried) > 1 else ''} ({_listed(groups)})"
    ranges = _listed([f"{axis.path} from {axis.low:g} to {axis.high:.4g}" for axis in axes(subject)])
    choices = " or ".join(place.words for place in tried if place.why == "choice")
    along = ", and with ".join(filter(None, [ranges, choices]))
    return f"tested at the given parameter values and at {others}, with {along}"


def _listed(words: list[str]) -> str:
    """ "a, b and c"."""
    return " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


# the kinds of settings, in the order of the sentence
_NAMES = {"choice": "with a non-default option", "color": "with saturated colors"}
_NAMES |= {"pair": "with unequal widths along the two axes"}
_NAMES |= {"corner": "with every parameter at an end of its range", "edge": "with one parameter at an end of its range"}
_NAMES |= {"interior": "with random values", "jump": "just past a discontinuity"}


def _made(subject: Subject, values: dict[str, Any], why: str, along: tuple[Axis, ...]) -> Place | None:
    try:
        changed = subject.replace(**values)
        if subject.guided:  # computing a guide for each place would take most of the time
            changed = dataclasses.replace(changed, drawn_by=subject)
        return Place(values, why, changed, along)
    except InputError:
        return None  # the material rejects the values


# --------------------------------------------------------------------------- jumps


def jumps(subject: Subject, along: list[Axis], seed: int) -> list[dict[str, Any]]:
    """Parameter values just past a jump, by path, in decreasing order of the jump.

    Each parameter is swept through its range, with the others as given. A jump is a step of `eval`, `pdf` or the mean
    weight, from one value to the next, that is many times as large as the neighboring steps.

    along  axes of the parameters to sweep
    seed   seed of the directions and random numbers
    """
    sized: list[tuple[float, dict[str, Any]]] = []
    for axis in along:
        if axis.path in subject.model.fixed:  # each value would need new tables
            continue
        # a range in equal ratios does not start at 0: the first step would differ from all others
        first = 1.0 / SCAN if axis.ratio and axis.low <= 0.0 else 0.0
        values = np.asarray(axis.at(np.linspace(first, 1.0, SCAN)), float)
        try:
            curves = _curves(subject, axis.path, values, [one.path for one in along], seed)
        except (Fault, InputError):
            continue
        for curve in curves:
            for size, at in _steps(curve):
                # both the value just past the step and the one after it: the new values may end soon
                sized.append((size, {axis.path: float(values[at])}))
    sized.sort(key=lambda one: -one[0])
    values_: list[dict[str, Any]] = []
    for _, one in sized:
        if one not in values_:
            values_.append(one)
    return values_


def _steps(curve: np.ndarray) -> list[tuple[float, int]]:
    """Sizes of the jumps in N curves (SCAN, N) along the first axis, and the index just past each jump.

    The bend is the second difference divided by the value, which is 0 for linear curves. Its median over the N curves
    reveals a small factor for all directions, its 90th percentile a change for a few.
    """
    least = 1e-6 * float(np.max(np.abs(curve), initial=0.0, where=np.isfinite(curve)))
    if least <= 0.0:
        return []
    size_of = np.maximum(np.maximum(np.abs(curve[:-2]), np.abs(curve[2:])), np.abs(curve[1:-1]))
    lit = np.minimum(np.abs(curve[:-2]), np.abs(curve[2:])) > least
    bend = np.where(lit, np.abs(curve[2:] - 2.0 * curve[1:-1] + curve[:-2]) / np.maximum(size_of, least), 0.0)
    sized = []
    for share in (50.0, 90.0):
        size = np.percentile(bend, share, axis=1)
        for i in np.flatnonzero(size > MIN_JUMP).tolist():
            near = np.concatenate([size[max(i - 5, 0) : max(i - 1, 0)], size[i + 2 : i + 6]])
            usual = float(np.median(near)) if len(near) else 0.0
            if size[i] > JUMP * usual:
                sized.append((float(size[i]) / (1.0 if share == 50.0 else 2.0), i + 1))
                sized.append((float(size[i]) / (1.01 if share == 50.0 else 2.02), i + 2))
    return [(size, min(at, SCAN - 1)) for size, at in sized]


def _curves(subject: Subject, path: str, values: np.ndarray, along: list[str], seed: int) -> list[np.ndarray]:
    """`eval`, `pdf` and weights, (SCAN, N) each, at the same directions and random numbers for every value of the
    parameter at `path`.

    along  paths of all parameters that are swept in turn; each is passed as an array, so that one kernel serves all
    """
    rng = np.random.default_rng([seed, 72])
    sides = np.array(subject.sides or (1,))
    wo = directions.uniform(rng, RAYS)
    wo[:, 2] = np.abs(wo[:, 2]) * rng.choice(sides, RAYS)
    wi = directions.uniform(rng, RAYS)
    if not subject.transmits:
        wi[:, 2] = np.copysign(wi[:, 2], wo[:, 2])
    third = RAYS // 3  # near the mirror direction, where narrow lobes are
    wi[:third] = wo[:third] * [-1.0, -1.0, 1.0] + 0.15 * rng.normal(size=(third, 3))
    wi[:third] /= np.linalg.norm(wi[:third], axis=1, keepdims=True)
    wo, wi, u = (directions.single(wo), directions.single(wi), directions.numbers(rng, RAYS))
    count = len(values)
    many = [np.tile(part, (count, 1)) for part in (wo, wi, u)]
    others = {one: _repeated(subject, one, len(many[0])) for one in along if one not in subject.model.fixed}
    moved = {path: np.repeat(values, RAYS)}
    together = per_ray(subject, {**others, **moved}) or per_ray(subject, moved)
    shape = (count, RAYS)
    # a guide has no jumps of its own, and computing one for every value would take seconds
    if together is not None:
        value = together.eval(many[0], many[1], precision="float32")
    else:
        one = [subject.replace(**{path: float(v)}) for v in values]
        value = np.concatenate([s.eval(wo, wi, precision="float32") for s in one])
    channels = [value[:, c].reshape(shape) for c in range(value.shape[1])]
    same = all(np.array_equal(channels[0], other) for other in channels[1:])
    channels = channels[:1] if same else channels
    if subject.guided:
        return channels
    if together is not None:
        density = together.pdf(many[0], many[1], "float32")
        weight = together.sample(many[0], many[2], precision="float32").weight
    else:
        density = np.concatenate([s.pdf(wo, wi, "float32") for s in one])
        weight = np.concatenate([s.sample(wo, u, precision="float32").weight for s in one])
    return [*channels, density.reshape(shape), weight.mean(1).reshape(shape)]


def _repeated(subject: Subject, path: str, count: int) -> np.ndarray:
    """The value of a parameter, repeated `count` times in the form that `per_ray` accepts."""
    value = np.asarray(tree.value_at(subject.model, path), float)
    return np.full(count, float(value)) if value.ndim == 0 else np.tile(value, (count, 1))


def per_ray(subject: Subject, values: Mapping[str, np.ndarray]) -> Subject | None:
    """The result of `per_ray_of`, or None if the subject does not accept arrays."""
    try:
        together = per_ray_of(subject, values)
        probe = directions.at(np.full(len(next(iter(values.values()))), 30.0), 10.0)
        together.eval(probe, probe)
    except (Fault, InputError):
        return None
    return together


def per_ray_of(subject: Subject, values: Mapping[str, np.ndarray]) -> Subject:
    """The subject with one value per ray for some parameters.

    values  path -> (N,); also (N, 3) for a color, and (N, 2) for a pair of alphas
    Raises InputError for values that the subject rejects.
    """
    kinds = {leaf.path: leaf.parameter.kind for leaf in tree.leaves(subject.model)}
    arrays: dict[str, Any] = {}
    for path, column in values.items():
        if kinds[path] == "alpha":
            arrays[path] = (column, column) if column.ndim == 1 else tuple(column.T)
        else:
            arrays[path] = (
                np.repeat(column[:, None], 3, 1) if kinds[path] == "spectrum" and column.ndim == 1 else column
            )
    return subject.replace(**arrays)


def _short(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_short, value))})"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


__all__ = ["Axis", "Place", "axes", "jumps", "per_ray", "per_ray_of", "places"]
