"""Positivity: values are non-negative and finite, everywhere and at the ends of every range."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...errors import InputError
from ...material import BSDF, binding, guide_search
from ...ops import Precision, backend
from .. import directions, estimators, ranges, severity
from ..effort import Effort
from ..forensics import extremes, origin
from ..forensics.causes import place_of, within
from ..forensics.ratio import Cause
from ..subject import Fault, Subject, guarded
from ..verdict import Finding
from .base import Law, pair_in_words, pairs, where_found

THETA = (0.0, 1e-3, 1.0, 30.0, 60.0, 89.0, 89.9, 89.99, 89.9999, 90.0)
PHI = (0.0, 90.0, 137.0, 180.0)
CORNERS = (0.0, 1e-7, 0.5, 0.99999994)  # of random numbers; the last is the largest float32 below 1
NEGATIVE = 1e-6  # fraction of the largest value by which float32 sums with cancellation may fall below 0


class Positivity(Law):
    """`eval`, `pdf` and the weight are finite and >= 0, and gradients are finite, up to 89.9999 degrees and at extreme
    parameter values."""

    number = 1
    name = "positivity"
    title = "values are finite and non-negative, and gradients are finite"
    meaning = "A NaN blackens its pixel permanently and spreads with every filter; negative light darkens other pixels."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        wo, wi, u = _grid(subject, effort, seed)
        variants = [({}, subject), *(_extremes(subject) if effort.full else ()), *_corners(subject)]
        finding = Finding(
            figure=0.0,
            tolerance=0.0,
            reason="no value may be negative, infinite or NaN",
            notes=[
                f"tested at the given parameter values and at the ends of each range ({len(variants)} settings)"
                if len(variants) > 1
                else "tested at the given parameter values only"
            ],
        )
        declared = "positivity" in subject.breaches  # measured noise around 0: relative to the largest value
        checked = 0

        def fails(text: str, suffix: str, a: np.ndarray, b: np.ndarray, changed: dict[str, Any]) -> None:
            place = pair_in_words(a, b)
            finding.problems.append(f"{text}{_words(changed)}: {suffix}{place}")
            if finding.at is None:
                finding.at, finding.settings, finding.worst = (a, b), changed, place

        for changes, together in _batches(subject, variants, len(wo)):
            many_o, many_i, many_u = (np.tile(part, (len(changes), 1)) for part in (wo, wi, u))
            for precision in together.precisions:
                for what, values, a, b, rows in _values(together, many_o, many_i, many_u, precision):
                    largest = np.max(np.abs(values), initial=0.0, where=np.isfinite(values))
                    wrong = ~np.isfinite(values) | (values < (-NEGATIVE * largest if what != "wi" else -np.inf))
                    checked += values.size
                    noise = declared and what in ("eval", "weight") and np.isfinite(values).all()
                    if not (noise or wrong.any()):
                        continue
                    finding.figure += int(wrong.sum())
                    deepest = -float(np.min(values, initial=0.0, where=np.isfinite(values))) / float(largest or 1.0)
                    finding.breach = max(finding.breach or 0.0, deepest)
                    if not noise:
                        row = int(np.flatnonzero(wrong.any(1))[0])
                        text = f"{what} is {values[row][wrong[row]][0]:.3g} in {precision}"
                        fails(
                            text,
                            f"{int(wrong.sum())} values, the first for ",
                            a[row],
                            b[row],
                            changes[rows[row] // len(wo)],
                        )
            if isinstance(together.model, BSDF) and not together.stochastic:
                for name, row in _bad_gradients(together, many_o, many_i):
                    finding.figure += 1
                    text = f"the gradient of eval with respect to {name} is not finite"
                    fails(text, "", many_o[row], many_i[row], changes[row // len(wo)])
        finding.shown = f"{finding.figure:g} of {checked:,.0f} values are invalid"
        del finding.problems[6:], finding.notes[7:]
        return finding

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias | None:
        if all("gradient" in problem for problem in finding.problems):
            return severity.Bias(0.0, 0.0, 0.0, finding.worst, "derivatives")
        there = where_found(subject, finding)
        undefined = estimators.undefined_bias(there, seed)
        if undefined.average or any("is nan" in problem or "is inf" in problem for problem in finding.problems):
            where = undefined.where if undefined.average else finding.worst
            return dataclasses.replace(undefined, where=where)

        def cut(o: np.ndarray, i: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            value = there.eval(o, i)
            return value, np.maximum(value, 0.0)

        return severity.between(there, cut, ", where values are negative")

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Cause]:
        there = where_found(subject, finding)
        wo, wi, _ = _grid(there, effort, seed)
        for fault, wrong in _FAULTS.items():
            bad = np.any([wrong(there.eval(wo, wi, precision=p)).any(1) for p in there.precisions], axis=0)
            if bad.any():
                place = origin.of(there.model, wo[bad][0], wi[bad][0]) if isinstance(there.model, BSDF) else ""
                words = f"first caused by {place}" if place and fault == "not finite" else ""
                for one in self._of_eval(subject, finding, effort, seed, fault, bad):
                    yield dataclasses.replace(one, words="; ".join(filter(None, [one.words, words])))
                if words:
                    yield Cause(f"eval is {fault}: {words}", fault)
                return
            rows = [
                (what, wrong(values).any(1), u)
                for precision in there.precisions
                for what, values, u in _drawn(there, effort, seed, precision)
            ]
            if what := next((what for what, many, _ in rows if many.any()), ""):
                cause = extremes.of_numbers(rows, CORNERS, fault)
                if cause is not None:
                    yield cause
                yield from self._of_settings(subject, finding, effort, seed, fault, what)
                many = next(many for name, many, _ in rows if name == what)
                drawn = len(many) == len(wo) and extremes.of_views(what, wo, many, fault, there.transmits)
                if drawn:
                    yield drawn
                return

    def _of_eval(
        self, subject: Subject, finding: Finding, effort: Effort, seed: int, fault: str, bad: np.ndarray
    ) -> Iterator[Cause]:
        wo, wi, _ = _grid(where_found(subject, finding), effort, seed)
        for words, rows in _exact_places(wo, wi):
            if bad.any() and not np.any(bad & ~rows) and (rows & bad).sum() > 0.2 * rows.sum():
                guess = "a division by 0" if fault == "not finite" else "a term that is not clamped"
                text = f"eval is {fault}, but only where {words}; possible mistake: {guess}"
                yield Cause(text, f"{fault} where {words}")
                return
        yield from self._of_settings(subject, finding, effort, seed, fault, "eval")
        if place := place_of(wo, wi, bad) or within(wo, wi, bad):
            guess = "; possible mistake: a term that is not clamped" if fault == "negative" else ""
            yield Cause(f"eval is {fault}, but only {place}{guess}", f"{fault} {place}")

    def _of_settings(
        self, subject: Subject, finding: Finding, effort: Effort, seed: int, fault: str, what: str
    ) -> Iterator[Cause]:
        wo, wi, _ = _grid(subject, effort, seed)

        def fails(one: Subject) -> bool:
            for precision in one.precisions:
                values = [one.eval(wo, wi, precision=precision)]
                if what != "eval":
                    values += [drawn for name, drawn, _ in _drawn(one, effort, seed, precision) if name == what]
                if any(_FAULTS[fault](part).any() for part in values):
                    return True
            return False

        if words := extremes.of_parameters(subject, finding.settings, fault, fails):
            yield Cause(f"{what} is {fault}, but {words}", f"{fault} for settings")


_FAULTS = {"not finite": lambda values: ~np.isfinite(values), "negative": lambda values: values < 0.0}


def _drawn(
    subject: Subject, effort: Effort, seed: int, precision: Precision
) -> Iterator[tuple[str, np.ndarray, np.ndarray | None]]:
    """The checked quantities except `eval`: for each, its name, its values (n, channels), and the random numbers if it
    belongs to samples."""
    wo, wi, u = _grid(subject, effort, seed)
    for what, values, _, _, rows in _values(subject, wo, wi, u, precision):
        if what not in ("eval", "wi"):
            yield what, values, None if what == "pdf" else u[rows]
        elif what == "wi":
            yield what, np.where(np.isfinite(values), 1.0, np.nan), u[rows]


def _exact_places(wo: np.ndarray, wi: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Special directions at which formulas may divide by 0: for each, its name and a mask of the pairs."""
    normal = [np.hypot(w[:, 0], w[:, 1]) == 0.0 for w in (wo, wi)]
    level = [w[:, 2] == 0.0 for w in (wo, wi)]
    equal, opposite = np.all(wo == wi, axis=1), np.all(wo == -wi, axis=1)
    yield "wo is the normal", normal[0]
    yield "wi is the normal", normal[1]
    yield "wo lies in the surface", level[0]
    yield "wi lies in the surface", level[1]
    yield "wi = wo", equal
    yield "wi = -wo", opposite
    yield "wo or wi is the normal", normal[0] | normal[1]
    yield "wo or wi lies in the surface", level[0] | level[1]


def _words(changed: dict[str, Any]) -> str:
    return f" with {', '.join(f'{name} = {value}' for name, value in changed.items())}" if changed else ""


def _batches(
    subject: Subject, variants: list[tuple[dict[str, Any], Subject]], count: int
) -> list[tuple[list[dict[str, Any]], Subject]]:
    """The settings, combined in one call with one value per ray, or one by one if the subject does not accept arrays.

    All parameters that have a range are arrays, so that one kernel serves the given values and all others.
    """
    changes = [changed for changed, _ in variants]
    names = [axis.path for axis in _own_axes(subject)]
    columns: dict[str, Any] = {}
    for name in names:
        given = getattr(subject.model, name, None)
        if subject.parameters[name].kind == "alpha" and isinstance(given, tuple | list):
            pairs_ = [(c.get(name, given)) if np.ndim(c.get(name, given)) else (c[name],) * 2 for c in changes]
            columns[name] = tuple(np.repeat([float(p[k]) for p in pairs_], count) for k in (0, 1))
        else:
            values: list[Any] = list(np.broadcast_arrays(*[np.asarray(c.get(name, given), float) for c in changes]))
            if np.ndim(values[0]) == 0 and subject.parameters[name].kind == "spectrum":
                values = [np.full(3, float(v)) for v in values]
            columns[name] = np.repeat(np.array(values), count, axis=0)
    if isinstance(subject.model, BSDF) and columns:
        try:
            together = subject.replace(**columns)
            # a guide for parameters that vary takes seconds to compute; signs do not depend on it
            guide_search.lend(subject.sampler.model, together.model)
            probe = directions.at(np.full(len(changes) * count, 30.0), 10.0)
            together.eval(probe, probe)
            return [(changes, together)]
        except (Fault, InputError):
            pass
    return [([changed], variant) for changed, variant in variants]


def _grid(subject: Subject, effort: Effort, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of directions, at extreme angles on both sides of the surface (even on a side where `eval` is 0) and at
    random; and random numbers."""
    theta = np.array([*THETA, *(180.0 - t for t in THETA[:-1])])
    pair = np.array(list(itertools.product(theta, theta, PHI)))
    random_o, random_i = pairs(subject, max(effort.pairs // 16, 2048), seed)
    wo, wi = directions.at(pair[:, 0], 20.0), directions.at(pair[:, 1], 20.0 + pair[:, 2])
    for w, theta in ((wo, pair[:, 0]), (wi, pair[:, 1])):
        w[theta == 90.0, 2] = 0.0  # the horizon itself, where cosines divide by 0
    wo, wi = np.concatenate([wo, random_o]), np.concatenate([wi, random_i])
    corners = np.array(list(itertools.product(CORNERS, repeat=3)))
    u = directions.numbers(np.random.default_rng([seed, 9]), len(wo))
    u[: len(pair)] = np.resize(corners, (len(pair), 3))
    return directions.single(wo), directions.single(wi), u


def _values(
    subject: Subject, wo: np.ndarray, wi: np.ndarray, u: np.ndarray, precision: Precision
) -> Iterator[tuple[str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """The checked quantities: for each, its name, its values (n, channels), the directions, and their indices."""
    rows = np.arange(len(wo))
    yield "eval", subject.eval(wo, wi, precision=precision), wo, wi, rows
    if subject.drawn_by is not None:
        return  # pdf and samples are those of a guide, whose weights are eval divided by its own density
    yield "pdf", subject.pdf(wo, wi, precision)[:, None], wo, wi, rows
    s = subject.sample(wo, u, precision=precision)
    shown = np.where(np.isfinite(s.wi), s.wi, 0.0)
    yield "weight", s.weight, wo, shown, rows
    yield "a sample's pdf", s.pdf[:, None], wo, shown, rows
    yield "wi", s.wi, wo, shown, rows  # also of failed samples: a renderer derives rays and derivatives from them


def _own_axes(subject: Subject) -> list[ranges.Axis]:
    """The ranges of the subject's own parameters, except angles."""
    return [axis for axis in ranges.axes(subject) if axis.path in subject.parameters and axis.kind != "angle"]


def _corners(subject: Subject) -> list[tuple[dict[str, Any], Subject]]:
    """The subject with all parameters at the low ends of their ranges, and with all at the high ends. Arrays that
    contain both need the code of all parts; kernels compiled for them serve all other values too."""
    corners = []
    for end in ("low", "high"):
        values = {axis.path: getattr(axis, end) for axis in _own_axes(subject)}
        try:
            corners.append((values, subject.replace(**values)))
        except InputError:
            continue  # the model rejects the values together
    return corners if len(_own_axes(subject)) > 1 else []


def _extremes(subject: Subject) -> list[tuple[dict[str, Any], Subject]]:
    """The subject with one parameter at an end of its declared range, for each of its own parameters and ends."""
    variants = []
    for axis in _own_axes(subject):
        ends = [axis.low, axis.high]
        if axis.kind == "alpha" or axis.path.startswith("alpha"):
            ends.insert(1, max(axis.low, 1e-4))
        for end in ends:
            try:
                variants.append(({axis.path: end}, subject.replace(**{axis.path: end})))
            except InputError:
                continue  # the model rejects the value
    return variants


def _bad_gradients(subject: Subject, wo: np.ndarray, wi: np.ndarray) -> list[tuple[str, int]]:
    """The parameters for which the gradient of the summed values is not finite, each with the index of a pair that
    causes it."""
    dr = backend.drjit()
    kind = backend.types("float32")
    leaves: dict[str, list[Any]] = {}

    def watched(parameter: Any, value: Any) -> Any:
        bound = parameter.bind(value, kind)
        if bound is not None and backend.is_drjit(bound):
            # one entry per ray, so that the gradient identifies the ray
            bound = bound + dr.zeros(kind.float, len(wo))
            dr.enable_grad(bound)
            leaves.setdefault(parameter.name, []).append(bound)
        return bound

    model = binding.bind(subject.model, watched)
    # values are checked to the horizon itself; their slopes, higher powers of 1 / cos, to 89.9999 degrees
    shallow = np.minimum(np.abs(wo[:, 2]), np.abs(wi[:, 2])) < 1.5e-6
    wo, wi = (np.where(shallow[:, None], [0.6, 0.0, 0.8], wo), np.where(shallow[:, None], [0.0, 0.6, 0.8], wi))
    a, b = (backend.vector_of(w, 3, kind) for w in (wo, wi))
    value = guarded(subject.model, "eval", lambda: model.eval(a, b, "radiance"))
    if not dr.grad_enabled(value):
        return []
    dr.backward(dr.sum(dr.sum(value, axis=0)))
    bad = []
    gradients = {name: [dr.grad(bound) for bound in bounds] for name, bounds in leaves.items()}
    dr.eval(gradients)  # together: separate kernels would be nearly the same
    for name, each in gradients.items():
        for one in each:
            gradient = np.asarray(one.numpy())
            wrong = ~np.isfinite(gradient.reshape(-1, gradient.shape[-1])).all(0)
            if wrong.any():
                bad.append((name, int(np.argmax(wrong)) if len(wrong) == len(wo) else 0))
    return bad
