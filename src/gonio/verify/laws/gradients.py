"""Gradients: autodiff equals finite differences."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from ...bridge.faults import wide_vectors
from ...errors import InputError
from ...material import BSDF, Parameter, binding, tree
from ...ops import backend
from ..effort import Effort
from ..forensics.ratio import Ratio
from ..severity import Bias
from ..subject import Subject, guarded
from ..verdict import DoesNotApply, Finding
from .base import Law, pair_in_words, pairs, relative, worst_of

TOLERANCE = 1e-4
ROWS = 1 << 17  # rays in flight
# Relative to the parameter: with five points, the truncation error is its fourth power, and the rounding error is
# 1e-16 / 1e-4.
STEP = 1e-4
ALL = 0.9  # fraction of the pairs with light that a rounded parameter changes at once
PARTS = 8  # equal parts of the way to another value
LEVELS = 3  # subdivisions into ever smaller parts


class Gradients(Law):
    """d eval / d parameter by forward-mode automatic differentiation equals five-point differences, for every
    differentiable parameter, including those of inner materials."""

    number = 8
    name = "gradients"
    at_ends = False
    title = "autodiff equals finite differences for every parameter"
    meaning = "Fitting and inverse rendering follow wrong gradients, or stop before they converge."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        if "float64" not in subject.precisions:
            raise DoesNotApply("finite differences need double precision, which this variant of Mitsuba lacks")
        if subject.stochastic:
            raise DoesNotApply("the material is stochastic: individual values are random")
        if not subject.has_density:
            raise DoesNotApply("all lobes are delta lobes, which have no values to differentiate")
        wo, wi = pairs(subject, effort.pairs // 8, seed)
        worst, place, name, tried, untested = -1.0, 0, "", [], []
        skipped = 0.0
        problems: list[str] = []
        labels = dict(_numeric(subject.model))
        for label, (exact, differences, smooth, least) in _derivatives(subject.model, list(labels), wo, wi).items():
            parameter = labels[label]
            if max(np.max(np.abs(differences)), np.max(np.abs(exact))) < least:
                if _steps(subject, label, parameter, wo, wi):
                    problems.append(f"the derivative with respect to {label} is 0, but eval changes with it in steps")
                continue
            if not smooth.any():
                untested.append(label)
                continue
            tried.append(label)
            skipped = max(skipped, 1.0 - float(smooth.mean()))
            # kinks, such as those of a table, are detected down to 1e-7 of the usual slope (`_derivatives`), so slopes
            # of 1 % of it are accurate to four digits
            usual = float(np.percentile(np.abs(differences), 90.0))
            floor = max(1e-6 * float(np.max(np.abs(differences[smooth]), initial=0.0)), 1e-2 * usual, least)
            off = relative(exact, differences, 0.0, floor) * smooth[:, None]
            if np.max(off, initial=0.0) > TOLERANCE:
                # a kink within the widest step may look smooth; a wrong derivative is wrong for small steps too
                near = _derivatives(subject.model, [label], wo, wi, 0.1 * STEP)[label]
                off = np.minimum(off, relative(exact, near.differences, 0.0, floor))
            row, size = worst_of(off)
            if size > worst:
                worst, place, name = size, row, label
        kinks = f"eval has a kink at the value of {', '.join(untested)} for every direction pair"
        if not tried and not problems:
            raise DoesNotApply(kinks if untested else "no parameter affects the values")
        return Finding(
            figure=worst,
            tolerance=TOLERANCE,
            reason="finite differences are accurate to about 1e-6; pairs where two step sizes disagree are excluded",
            worst=f"{name}: {pair_in_words(wo[place], wi[place])}",
            at=(wo[place], wi[place]),
            problems=problems,
            notes=[
                f"tested: {', '.join(tried)}; {100.0 * skipped:.2f} % of direction pairs are excluded because eval has "
                f"a kink there{f'; not tested: {kinks}' if untested else ''}"
            ],
        )

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Bias:
        name, _, _, exact, differences = self._worst(subject, finding, seed)
        size = float(np.sum(np.abs(exact - differences)) / max(float(np.sum(np.abs(differences))), 1e-30))
        return Bias(finding.figure, size, 1.0, f"with respect to {name}", "derivatives")

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Ratio]:
        name, wo, wi, exact, differences = self._worst(subject, finding, seed)
        size = _size(tree.value_at(subject.model, name))
        yield Ratio(
            f"autodiff with respect to {name}",
            "finite differences",
            wo,
            wi,
            exact,
            differences,
            subject,
            numbers={f"2 {name}": 2.0 * size, f"1 / (2 {name})": 0.5 / size},
            zero="a value that is detached, rounded or compared in a branch, so that autodiff stops there",
        )

    def _worst(
        self, subject: Subject, finding: Finding, seed: int
    ) -> tuple[str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The worst parameter, pairs away from edges, and the derivatives for these pairs by both methods."""
        name = finding.worst.partition(":")[0]
        wo, wi = pairs(subject, 4096, seed)
        exact, differences, smooth, _ = _derivatives(subject.model, [name], wo, wi)[name]
        return name, wo[smooth], wi[smooth], exact[smooth], differences[smooth]


def _steps(subject: Subject, path: str, parameter: Parameter, wo: np.ndarray, wi: np.ndarray) -> bool:
    """Whether changing a parameter with zero derivative by 30 % changes nearly all values at once, and its derivative
    is zero after this change too. If that derivative is not zero, the parameter is only clamped at the given value; if
    the values of pairs change one by one, the parameter is the threshold of a step in space."""
    value = tree.value_at(subject.model, path)
    if parameter.kind not in ("float", "alpha", "spectrum") or (parameter.kind != "spectrum" and np.ndim(value)):
        return False
    given = np.asarray(value, float)
    moved: Any = given * (1.3 if given.max() * 1.3 <= parameter.high else 0.7)
    moved = tuple(map(float, moved)) if np.ndim(moved) else float(moved)
    try:
        before, after = (subject.eval(wo, wi), subject.replace(**{path: moved}).eval(wo, wi))
    except InputError:
        return False
    lit = before.max(1) > 0.0
    changed = np.abs(after - before).max(1) > 1e-3 * before.max(1)
    if not (lit.any() and np.mean(changed[lit]) > ALL):
        return False
    if not _at_once(subject, path, (value, moved), (wo[lit], wi[lit])):
        return False
    exact, _, _, least = _derivatives(subject.replace(**{path: moved}).model, [path], wo, wi)[path]
    return bool(np.max(np.abs(exact)) < least)


def _at_once(subject: Subject, path: str, ends: tuple[Any, Any], pair: tuple[np.ndarray, np.ndarray]) -> bool:
    """Whether nearly all values change at the same value of the parameter. The search continues in the step with
    the most changes, then in the part of this step with the most changes, and so on."""
    low, high = 0.0, 1.0
    for _ in range(LEVELS):
        at = np.linspace(low, high, PARTS + 1)
        values = [subject.replace(**{path: _between(*ends, share)}).eval(*pair) for share in at]
        shares = [float(np.mean(np.any(a != b, axis=1))) for a, b in itertools.pairwise(values)]
        if max(shares) < ALL:
            return False
        k = int(np.argmax(shares))
        low, high = at[k], at[k + 1]
    return True


def _between(first: Any, last: Any, share: float) -> Any:
    """The linear interpolation between two values, a number or a tuple."""
    at = (1.0 - share) * np.asarray(first, float) + share * np.asarray(last, float)
    return tuple(map(float, at)) if at.ndim else float(at)


def _numeric(model: BSDF) -> list[tuple[str, Parameter]]:
    """Every numeric parameter by its path: "alpha", "base.alpha"."""
    return [(leaf.path, leaf.parameter) for leaf in tree.leaves(model) if leaf.parameter.numeric]


def _size(value: Any) -> float:
    try:
        size = float(np.max(np.abs(np.asarray(value, float))))
    except (TypeError, ValueError):
        return 1.0
    return size if size > 0.0 else 1.0


def _shifted(parameter: Parameter, plain: Any, shift: Any) -> Callable[[Any], Any]:
    """A function that shifts the bound value of a parameter."""

    def moved(bound: Any) -> Any:
        if parameter.kind != "angle":
            return bound + shift
        # the bound value is (cos, sin), or None where the angle is 0
        kind = backend.types_like(type(shift))
        s, c = backend.drjit().sincos(backend.float_of(plain, kind) + shift)
        return kind.vec2(c, s)

    return moved


class _Derivatives(NamedTuple):
    """Derivatives by automatic differentiation and by differences, (N, channels) each; whether two different steps
    agree and no kink explains the difference, (N,); and the size below which a derivative counts as 0."""

    exact: np.ndarray
    differences: np.ndarray
    smooth: np.ndarray
    least: float


def _derivatives(
    model: BSDF, paths: list[str], wo: np.ndarray, wi: np.ndarray, step: float = STEP
) -> dict[str, _Derivatives]:
    """The derivatives with respect to the parameters at some paths, with steps relative to their sizes. All are
    computed at once by one kernel, each on its own rays, for which the others are moved by 0. If a result is not
    finite, its parameter is moved alone, because 0 times the NaN of another derivative is NaN."""
    derivatives: dict[str, _Derivatives] = {}
    most = max(1, ROWS // len(wo))
    for first in range(0, len(paths), most):
        some = paths[first : first + most]
        with wide_vectors.narrow():
            for path, one in zip(some, _together(model, some, wo, wi, step), strict=True):
                derivatives[path] = one if np.isfinite(one.exact).all() else _together(model, [path], wo, wi, step)[0]
    return derivatives


def _together(model: BSDF, paths: list[str], wo: np.ndarray, wi: np.ndarray, step: float) -> list[_Derivatives]:
    dr = backend.drjit()
    kind = backend.types("float64")
    rays, count = len(wo), len(paths)
    a, b = (backend.vector_of(np.tile(w, (count, 1)), 3, kind) for w in (wo, wi))
    given = {leaf.path: leaf for leaf in tree.leaves(model) if leaf.path in paths}
    sizes = [_size(given[path].value) for path in paths]
    own = {path: backend.float_of(np.repeat(np.eye(count)[n], rays), kind) for n, path in enumerate(paths)}
    steps = backend.float_of(np.repeat(step * np.array(sizes), rays), kind)

    def value(shift: Any) -> Any:
        bound = model.bind(kind)
        for path, leaf in given.items():
            bound = binding.shift(bound, path, _shifted(leaf.parameter, leaf.value, own[path] * shift))
        return guarded(model, "eval", lambda: bound.eval(a, b, "radiance"))

    def rows(values: Any) -> np.ndarray:
        array = np.array(backend.to_numpy(values, rays * count), float)
        return array.reshape(count, rays, -1)

    def number(times: float) -> np.ndarray:
        return rows(value(dr.opaque(kind.float, times) * steps))

    delta = dr.opaque(kind.float, 0.0)
    dr.enable_grad(delta)
    result = value(delta)
    slopes = np.zeros((count, rays, 3))
    if dr.grad_enabled(result):
        dr.forward(delta)
        slopes = rows(dr.grad(result))
    plain = number(0.0)
    shifted = {s: number(s) for s in (-2.0, -1.0, -0.5, 0.5, 1.0, 2.0)}
    return [
        _judged(slopes[n], {s: v[n] for s, v in shifted.items()}, plain[n], size, step) for n, size in enumerate(sizes)
    ]


def _judged(
    exact: np.ndarray, shifted: dict[float, np.ndarray], plain: np.ndarray, size: float, share: float
) -> _Derivatives:
    step = share * size
    one, two, half = (shifted[s] - shifted[-s] for s in (1.0, 2.0, 0.5))
    lit = np.array([np.any(v != 0.0, axis=1) for v in shifted.values()])
    wide = (8.0 * one - two) / (12.0 * step)
    narrow = (8.0 * half - one) / (6.0 * step)
    # a parameter has no effect if increasing it by 1 % changes values by less than 1e-8 of the largest
    least = 1e-6 * float(np.max(np.abs(plain), initial=0.0)) / size
    noise = 1e-5 * np.abs(narrow) + max(1e-7 * float(np.percentile(np.abs(narrow), 90.0)), 1e-2 * least)
    smooth = np.all(np.abs(wide - narrow) <= noise, axis=1) & (lit.all(0) == lit.any(0))
    # A kink exactly at the parameter's value, such as a node of a table: the central difference is the mean of its
    # two slopes, and any value between them is a derivative.
    sides = (-1.0, 1.0)
    second = [(4.0 * shifted[0.5 * s] - shifted[s] - 3.0 * plain) / (s * step) for s in sides]  # order of accuracy
    third = [
        (16.0 / 3.0 * shifted[0.5 * s] - 2.0 * shifted[s] + shifted[2.0 * s] / 6.0 - 3.5 * plain) / (s * step)
        for s in sides
    ]
    left, right = third
    steep = np.maximum(np.abs(left), np.abs(right))
    slack = 1e-6 * steep + 1e-8 * float(np.percentile(steep, 90.0))
    slack += np.maximum(*[np.abs(a - b) for a, b in zip(second, third, strict=True)])
    kink = np.any(np.abs(right - left) > 2.0 * slack, axis=1)
    between = (exact >= np.minimum(left, right) - slack) & (exact <= np.maximum(left, right) + slack)
    return _Derivatives(exact, narrow, smooth & ~(kink & np.all(between, axis=1)), least)
