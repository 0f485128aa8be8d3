"""Limits: parts that are switched off have no effect."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ...material import BSDF, Limit, tree
from .. import box, ranges, severity
from ..effort import Effort
from ..subject import Fault, Subject, of
from ..verdict import DoesNotApply, Finding
from .base import Law, pair_in_words, pairs, relative, rounding, worst_of

ROUNDINGS = 8
TOLERANCE = ROUNDINGS * 2.0**-52
SINGLE, DOUBLE = 2.0**-24, 2.0**-53  # unit of the rounding errors of `base.rounding`, and the same for float64
# For a material that declares no limits: words in the names of parameters that may be 0; the values that are compared
# with 0; and the largest fraction of the change from the first of them to 0 that may remain at the last.
WORDS = ("weight", "thickness")
NEAR = (1e-2, 1e-8)
STEP = 0.5


class Limits(Law):
    """At a declared limit, the muted parameters have no effect on `eval`, and `eval` equals that of the model to which
    the material reduces.

    All limits are tested at once, each on its own rays. On a quarter of these rays, the other parameters have their
    given values; on the rest, they have random values. Parameters given as numbers must give the same result as arrays
    of these numbers, although the code of parts that are switched off is then omitted.
    """

    number = 12
    name = "limits"
    title = "layers that are switched off have no effect"
    meaning = "A layer of weight 0 tints its base; a weight texture shows a visible edge where the layer ends."
    everywhere = False

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        if not isinstance(subject.model, BSDF):
            raise DoesNotApply("plugins do not declare limits")
        if subject.stochastic:
            raise DoesNotApply("the material is stochastic: individual values are random")
        if not subject.has_density:
            raise DoesNotApply("all lobes are delta lobes, which have no values to compare")
        wo, wi = pairs(subject, effort.pairs // 8, seed, exact=True)
        if not _limits(subject):
            return _continuity(subject, wo, wi)
        return _finding(_cases(subject, wo, wi, seed), wo, wi)

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias | None:
        if not isinstance(finding.details, _Case):
            return None
        worst = finding.details
        row, _ = worst_of(worst.error)
        without, limited = worst.at(row)
        return severity.between(
            limited, lambda wo, wi: (without.eval(wo, wi), limited.eval(wo, wi)), f", {worst.words}"
        )


class _Case(NamedTuple):
    """A comparison at a limit.

    limit    the limit
    against  the violation as text, such as "coat_color changes values"
    one      the subject at the limit, with one value per pair for parameters that vary
    other    the subject to which it must be equal
    number   whether both are the same material, with the limit given by numbers instead of arrays
    error    relative difference of their values, (N, channels)
    """

    limit: Limit
    against: str
    one: Subject
    other: Subject
    number: bool
    error: np.ndarray

    @property
    def size(self) -> float:
        return worst_of(self.error)[1]

    @property
    def words(self) -> str:
        """The limit as text: "where coat_weight = 0"."""
        return "where " + ", ".join(f"{name} = {value:g}" for name, value in self.limit.values.items())

    def at(self, row: int) -> tuple[Subject, Subject]:
        """The two subjects, `other` and `one`, with the parameter values of one pair."""
        return _row(self.other, row, len(self.error)), _row(self.one, row, len(self.error))


def _limits(subject: Subject) -> list[Limit]:
    """The declared limits that the model has with its choices."""
    model = subject.model
    return [limit for limit in model.limits if limit.holds is None or limit.holds(model)]


def _finding(cases: list[_Case], wo: np.ndarray, wi: np.ndarray) -> Finding:
    if not cases:
        raise DoesNotApply("none of the declared limits can be tested at these parameter values")
    worst = max(cases, key=lambda case: case.size)
    row, figure = worst_of(worst.error)
    failed = [case for case in cases if case.size > TOLERANCE]
    limits = list(dict.fromkeys(case.words.removeprefix("where ") for case in cases))
    said = [f"{case.words}, {case.against} by {case.size:.2g}" for case in failed]
    return Finding(
        figure=figure,
        tolerance=TOLERANCE,
        reason=f"{ROUNDINGS} float64 ulps, relative to the value or to the 90th percentile of all values",
        worst=f"{worst.words.removeprefix('where ')}: {pair_in_words(wo[row], wi[row])}",
        at=(wo[row], wi[row]) if failed else None,
        settings=dict(worst.limit.values) if failed else {},
        problems=[text for text, case in zip(said, failed, strict=True) if not case.number][:6],
        notes=[
            f"{len(limits)} declared {'limits' if len(limits) > 1 else 'limit'}: {'; '.join(limits)}",
            *(text for text, case in zip(said, failed, strict=True) if case.number),
        ],
        breach=max((case.size for case in cases if case.number), default=0.0),
        details=worst,
    )


def _cases(subject: Subject, wo: np.ndarray, wi: np.ndarray, seed: int) -> list[_Case]:
    """The comparisons at all declared limits."""
    rng = np.random.default_rng([seed, 83])
    axes = {axis.path: axis for axis in ranges.axes(subject) if axis.path not in subject.model.fixed}
    limits, count = _limits(subject), len(wo)
    blocks = [_block(subject, axes, limit, rng, count) for limit in (*limits, Limit({}))]
    together = _in_blocks(subject, blocks)
    try:
        values = _values(together, blocks, wo, wi) if together is not None else None
    except (Fault, InputError):
        values = None
    if together is None or values is None:
        return [case for limit in limits for case in _at_one(subject, axes, limit, rng, wo, wi)]
    changed = [_changed(axes, limit, block, rng) for limit, block in zip(limits, blocks, strict=False)]
    muted = _values(_in_blocks(subject, [*changed, blocks[-1]]), blocks, wo, wi)
    cases: list[_Case] = []
    for n, limit in enumerate(limits):
        one = _Side(box.per_ray_of(subject, blocks[n]), values[n])
        cases += _against_model(limit, one, wo, wi)
        # every fourth pair has the given values of the other parameters
        given = np.arange(count) % 4 == 0
        limited = subject.replace(**limit.values)
        plain = np.where(given[:, None], limited.eval(wo, wi), values[n])
        text = "results for number and array parameters differ"
        cases.append(_case(limit, text, one, _Side(limited, plain), wo, wi, number=True))
        names = [path for path in changed[n] if changed[n][path] is not blocks[n][path]]
        if names:
            other = _Side(box.per_ray_of(subject, changed[n]), muted[n])
            case = _case(limit, f"{', '.join(names)} changes values", one, other, wo, wi)
            cases += _named(case, subject, blocks, n, changed[n], names, wo, wi)
    return cases


def _named(
    case: _Case,
    subject: Subject,
    blocks: list[dict[str, np.ndarray]],
    number: int,
    changed: dict[str, np.ndarray],
    names: list[str],
    wo: np.ndarray,
    wi: np.ndarray,
) -> list[_Case]:
    """The case itself, or, if it fails, one case for each parameter that changes values on its own."""
    if case.size <= TOLERANCE or len(names) == 1:
        return [case]
    cases = []
    values = _values(_in_blocks(subject, blocks), blocks, wo, wi)[number]
    for name in names:
        moved = {**blocks[number], name: changed[name]}
        all_ = [moved if n == number else block for n, block in enumerate(blocks)]
        other = _values(_in_blocks(subject, all_), blocks, wo, wi)[number]
        part = _Side(box.per_ray_of(subject, moved), other)
        cases.append(_case(case.limit, f"{name} changes values", _Side(case.one, values), part, wo, wi))
    failed = [one for one in cases if one.size > TOLERANCE]
    return failed or [case]


def _at_one(
    subject: Subject,
    axes: Mapping[str, ranges.Axis],
    limit: Limit,
    rng: np.random.Generator,
    wo: np.ndarray,
    wi: np.ndarray,
) -> list[_Case]:
    """The comparisons at a limit for a material whose parameters must not vary from ray to ray."""
    limited = subject.replace(**limit.values)
    one = _Side(limited, limited.eval(wo, wi))
    cases = _against_model(limit, one, wo, wi)
    for path, axis in axes.items():
        if path not in limit.values and any(fnmatchcase(path, pattern) for pattern in limit.mutes):
            value = _draw(axis, rng, 1)[0]
            other = limited.replace(**{path: tuple(value.tolist()) if np.ndim(value) else float(value)})
            side = _Side(other, other.eval(wo, wi))
            cases.append(_case(limit, f"{path} changes values", one, side, wo, wi))
    return cases


def _against_model(limit: Limit, one: _Side, wo: np.ndarray, wi: np.ndarray) -> list[_Case]:
    """The comparison with the model that lacks the part that is switched off."""
    if limit.equals is None:
        return []
    other = of(limit.equals(one.subject.model))
    side = _Side(other, other.eval(wo, wi))
    return [_case(limit, "eval differs from that of the model without the layer", one, side, wo, wi)]


class _Side(NamedTuple):
    """One side of a comparison: a subject, and its values of `eval`, (N, channels)."""

    subject: Subject
    values: np.ndarray


def _case(
    limit: Limit, text: str, one: _Side, other: _Side, wo: np.ndarray, wi: np.ndarray, number: bool = False
) -> _Case:
    """The comparison of two sides, except for the effect of rounding the directions, which narrow lobes magnify."""
    a, b = one.values, other.values
    floor = np.percentile(np.abs(b).max(1), 90.0)
    error = relative(a, b, 0.0, floor)
    over = np.flatnonzero(error.max(1) > TOLERANCE)
    if 0 < len(over) < len(error):

        def repeated(o: np.ndarray, i: np.ndarray) -> np.ndarray:
            return _part(one.subject, np.tile(over, len(o) // len(over)), len(error)).eval(o, i)

        noise = rounding(repeated, wo[over], wi[over])
        error[over] = relative(a[over], b[over], noise * (DOUBLE / SINGLE), floor)
    return _Case(limit, text, one.subject, other.subject, number, error)


# --------------------------------------------------------------------------- values of parameters


def _block(
    subject: Subject, axes: Mapping[str, ranges.Axis], limit: Limit, rng: np.random.Generator, count: int
) -> dict[str, np.ndarray]:
    """One value per pair for every parameter that may vary: the value at the limit if the limit sets the parameter;
    otherwise, the given value for every fourth pair and random values for the others."""
    columns = {}
    for path, axis in axes.items():
        column = _draw(axis, rng, count)
        column[::4] = np.asarray(tree.value_at(subject.model, path), float)
        if path in limit.values:
            column = np.full_like(column, limit.values[path])
        columns[path] = column
    return columns


def _changed(
    axes: Mapping[str, ranges.Axis], limit: Limit, block: dict[str, np.ndarray], rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """The block of values with different random values for the muted parameters."""
    muted = [path for path in axes if any(fnmatchcase(path, pattern) for pattern in limit.mutes)]
    drawn = {path: _draw(axes[path], rng, len(block[path])) for path in muted if path not in limit.values}
    return {**block, **drawn}


def _in_blocks(subject: Subject, blocks: list[dict[str, np.ndarray]]) -> Subject | None:
    """The subject with the values of all blocks one after the other, so that one kernel, with the code of all parts,
    serves them all; None if a parameter of a limit must not vary from ray to ray."""
    if any(path not in blocks[0] for limit in _limits(subject) for path in limit.values):
        return None
    try:
        return box.per_ray_of(subject, {path: np.concatenate([one[path] for one in blocks]) for path in blocks[0]})
    except InputError:
        return None


def _values(
    together: Subject | None, blocks: list[dict[str, np.ndarray]], wo: np.ndarray, wi: np.ndarray
) -> np.ndarray:
    """`eval` for every block, (blocks, N, channels)."""
    assert together is not None
    count = len(blocks)
    value = together.eval(np.tile(wo, (count, 1)), np.tile(wi, (count, 1)))
    return value.reshape(count, len(wo), -1)


def _draw(axis: ranges.Axis, rng: np.random.Generator, count: int) -> np.ndarray:
    """Random values of a parameter: (N,), (N, 3) for a color, (N, 2) for a pair of alphas."""
    columns = 3 if axis.kind in ("color", "spectrum") else 2 if axis.kind == "alpha" else 1
    values = np.asarray(axis.at(rng.uniform(size=(count, columns))), float)
    return values[:, 0] if columns == 1 else values


def _part(subject: Subject, rows: np.ndarray, count: int) -> Subject:
    """The subject for some of `count` rays: parameters with one value per ray are restricted to these."""

    def part(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(part, value))
        varies = isinstance(value, np.ndarray) and value.ndim > 0 and len(value) == count
        return value[rows] if varies else value

    return subject.replace(**{leaf.path: part(leaf.value) for leaf in tree.leaves(subject.model)})


def _row(subject: Subject, row: int, count: int) -> Subject:
    """The subject with the parameter values of one ray, as numbers."""

    def plain(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(plain, value))
        if not isinstance(value, np.ndarray) or value.ndim == 0:
            return value
        return float(value[0]) if value.ndim == 1 else tuple(value[0].tolist())

    one = _part(subject, np.array([row]), count)
    return one.replace(**{leaf.path: plain(leaf.value) for leaf in tree.leaves(one.model)})


# --------------------------------------------------------------------------- materials without declared limits


def _continuity(subject: Subject, wo: np.ndarray, wi: np.ndarray) -> Finding:
    """Check that the effect of a weight or thickness vanishes continuously: values near 0 are close to those at 0.
    Nothing else can be tested for a material that declares no limits."""
    names = [axis for axis in ranges.axes(subject) if axis.low == 0.0 and any(word in axis.path for word in WORDS)]
    names = [axis for axis in names if "." not in axis.path and axis.kind == "float"]
    if not names:
        raise DoesNotApply("the material declares no `limits` and has no weight or thickness that can be 0")
    figure, worst, row = 0.0, names[0].path, 0
    for axis in names:
        try:
            off = subject.replace(**{axis.path: 0.0}).eval(wo, wi)
            first, last = (subject.replace(**{axis.path: share * axis.high}).eval(wo, wi) for share in NEAR)
        except (Fault, InputError):
            continue  # other laws report it
        change, scale = np.abs(first - off), np.maximum(np.abs(off), np.abs(first)).max(1, keepdims=True)
        step = np.where(np.abs(last - off) > STEP * change, np.abs(last - off), 0.0) / np.where(scale > 0.0, scale, 1.0)
        # a few pairs may lie on an edge of the model
        size = float(np.percentile(step.max(1), 90.0))
        if size > figure:
            figure, worst, row = size, axis.path, int(np.argmax(step.max(1)))
    return Finding(
        figure=figure,
        tolerance=1e-3,
        reason="the effect of a layer must vanish continuously",
        worst=f"{worst} near 0 compared with {worst} = 0: {pair_in_words(wo[row], wi[row])}",
        at=(wo[row], wi[row]) if figure > 1e-3 else None,
        settings={worst: 0.0},
        notes=[
            "the material declares no `limits`; only continuity at 0 was tested, for "
            + ", ".join(axis.path for axis in names)
        ],
    )


__all__ = ["Limits"]
