"""Calls: results do not depend on how a renderer calls a BSDF."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ...bridge.answers import Answer
from ...errors import InputError
from ...material import BSDF
from ...ops import Mode, Precision, backend
from .. import box, directions, ranges, severity
from ..effort import Effort
from ..forensics.ratio import Cause, Ratio
from ..subject import Subject, guarded
from ..verdict import Finding
from .base import Law, pair_in_words, pairs

SAME = {"float64": 1e-10, "float32": 1e-4}
LARGE = 1 << 20
SMALL = 1e-6  # fraction of the largest value below which values are negligible
DARK = 1e-30  # smallest size to which differences are relative: a kernel may flush denormal numbers to 0


class Calls(Law):
    """The result for a ray does not depend on the other rays of a call, on their number or on earlier calls; only
    transmission depends on `mode`. For a plugin, eval_pdf, eval_pdf_sample, masks of lanes, components and types, and
    the flags agree with eval, pdf and sample."""

    number = 11
    name = "calls"
    title = "results do not depend on how a renderer calls the BSDF"
    everywhere = False  # it does not depend on the parameter values
    meaning = "Unit tests pass, but pictures are wrong, because only integrators call a BSDF in these ways."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        finding = Finding(0.0, 0.0, "no difference is allowed", shown="no differences")
        checked = []
        others: Iterable[Answer] = subject.model.renderer_calls(seed) if isinstance(subject.model, BSDF) else ()
        wrong: list[Answer] = []
        finding.details = wrong
        for answer in (*_checks(subject, effort, seed), *others):
            checked.append(answer.what)
            if answer.wrong:
                wrong.append(answer)
                finding.problems.append(f"{answer.what}: {answer.wrong}")
        finding.notes.append(f"checked: {', '.join(dict.fromkeys(checked))}")
        finding.figure = float(len(finding.problems))
        if finding.problems:
            finding.shown = f"{len(finding.problems)} difference{'' if len(finding.problems) == 1 else 's'}"
        return finding

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias:
        """The error of a call that path tracers make; 0 for other calls."""
        wrong: list[Answer] = finding.details  # type: ignore[assignment]
        worst = max(wrong, key=lambda answer: answer.share)
        if worst.share > 0.0:
            return severity.Bias(min(worst.worst, 1.0), min(worst.share, 1.0), 0.0, f"check: {worst.what}", "bias")
        names = ", ".join(dict.fromkeys(answer.what for answer in wrong))
        return severity.Bias(0.0, 0.0, 0.0, f"only renderers that use {names} are affected", "interface")

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Ratio | Cause]:
        wrong: list[Answer] = finding.details  # type: ignore[assignment]
        for answer in wrong:
            if answer.rows is not None:
                name, other, wo, wi, got, all_rows = answer.rows
                yield Ratio(name, other, wo, wi, got, all_rows, subject)
        for answer in wrong:
            text = f"an interface error ({answer.what}), not an error in the formula: {answer.wrong}"
            words = SUSPECTS.get(answer.what, text)
            if answer.what == "declared properties":
                guess = next((guess for start, guess in FACTS.items() if answer.wrong.startswith(start)), "")
                words = f"{answer.wrong}; possible mistake: {guess}" if guess else answer.wrong
            yield Cause(words, f"calls {answer.what}")


# the probable mistake if a result depends on the call
_RAYS = "the result depends on the number of rays; possible mistake: an index or a buffer of fixed size"
_OTHER_RAYS = (
    "the result for a ray depends on the other rays; possible mistake: a sum, a mean or a branch over all of them"
)
SUSPECTS = {
    "a million rays per call": _RAYS,
    "one ray per call": _RAYS,
    "rays in another order": _OTHER_RAYS,
    "half of the rays disabled": _OTHER_RAYS,
    "textured parameters": "the value of one ray is used for other rays: is it derived only once for all of them?",
    "a new object": "a call changes the results of later calls; possible mistake: state stored in the object",
}
# the mistake of the formula or of the declaration, by the first words of the difference from the declared properties
FACTS = {
    "light is transmitted": "a missing test of the side, or an absolute value; if intended, declare it",
    "light is reflected from below": "a missing test of the side, or an absolute value; if intended, declare it",
    "eta of a reflected sample": "total internal reflection with the eta of refraction, or a refracted sample kept",
}


def _checks(subject: Subject, effort: Effort, seed: int) -> Iterator[Answer]:
    """The checks that apply to any BSDF."""
    wo, wi = pairs(subject, min(effort.pairs // 8, 4096), seed)
    u = directions.numbers(np.random.default_rng([seed, 101]), len(wo))
    for precision in subject.precisions:
        yield from _batches(subject, wo, wi, u, precision)
    if not subject.stochastic:
        yield Answer("transport mode", _mode(subject, wo, wi) if subject.transmits else _one_mode(subject, wo, wi, u))
    yield from _textured(subject, wo, wi, u)
    yield Answer("declared properties", _facts(subject, wo, wi, u))


def _answers(
    subject: Subject,
    wo: np.ndarray,
    wi: np.ndarray,
    u: np.ndarray,
    precision: Precision,
    times: int = 1,
    mode: Mode = "radiance",
    lanes: int = 0,
) -> list[dict[str, np.ndarray]]:
    """Results (N, ...) of `eval`, `pdf` and `sample`, called with Dr.Jit vectors as by a renderer.

    times  number of consecutive calls of each method, with one result per call
    lanes  number of lanes, a multiple of N, to which the arguments are repeated; the results are those of the last N
    """
    dr = backend.drjit()
    types = backend.types(precision)
    model = subject.bound(precision)
    count = len(wo)
    given = [backend.vector_of(w, 3, types) for w in (wo, wi, u)]
    if lanes:
        index = dr.arange(types.module.UInt32, lanes) % count
        given = [types.vec3(*[dr.gather(types.float, part, index) for part in w]) for w in given]
        dr.eval(given)
    a, b, c = given
    values: list[dict[str, Any]] = [{} for _ in range(times)]
    for value in values:
        value["eval"] = guarded(subject.model, "eval", lambda: model.eval(a, b, mode))
    for value in values:
        value["pdf"] = guarded(subject.model, "pdf", lambda: model.pdf(a, b))
    for value in values:
        s = guarded(subject.model, "sample", lambda: model.sample(a, c, mode))
        value |= {"sample's weight": s[1], "sample's pdf": s[2], "sample's wi": s[0], "sample's eta": s[4]}
    dr.eval([list(value.values()) for value in values])
    if lanes:
        last = dr.arange(types.module.UInt32, count) + (lanes - count)
        values = [{name: _lanes(part, last, lanes) for name, part in value.items()} for value in values]
    return [{name: _rows(part, count) for name, part in value.items()} for value in values]


def _lanes(value: Any, last: Any, lanes: int) -> Any:
    """The last lanes of a value; a value that is the same for all lanes is returned unchanged."""
    dr = backend.drjit()
    if not dr.is_array_v(value) or dr.width(value) != lanes:
        return value
    if dr.is_vector_v(value):
        return type(value)(*[_lanes(part, last, lanes) for part in value])
    return dr.gather(type(value), value, last)


def _rows(value: Any, count: int) -> np.ndarray:
    array = np.asarray(backend.to_numpy(value, count), float)
    return array[:count].reshape(count, -1)


def _batches(subject: Subject, wo: np.ndarray, wi: np.ndarray, u: np.ndarray, precision: Precision) -> Iterator[Answer]:
    first, second = _answers(subject, wo, wi, u, precision, 2)
    if subject.stochastic:
        return
    same = SAME[precision]

    def some(rows: Any, answers: dict[str, np.ndarray] = first) -> dict[str, np.ndarray]:
        return {name: value[rows] for name, value in answers.items()}

    twice = _unlike("a repeated call", first, second, wo, wi, 0.0)
    if twice.wrong:
        yield twice._replace(wrong=f"{twice.wrong}: declare `stochastic = True` if its values are random")
        return
    yield twice
    fresh = subject.rebuilt()
    if fresh is not None:
        (new,) = _answers(fresh, wo, wi, u, precision)
        yield _unlike("a new object", first, new, wo, wi, same)
    for row in range(5):
        one = slice(row, row + 1)
        (single,) = _answers(subject, wo[one], wi[one], u[one], precision)
        answer = _unlike("one ray per call", some(one), single, wo[one], wi[one], same)
        if answer.wrong:
            break
    yield answer
    if precision == "float32":
        (many,) = _answers(subject, wo, wi, u, precision, lanes=LARGE // len(wo) * len(wo))
        yield _unlike("a million rays per call", first, many, wo, wi, same)
    order = np.random.default_rng(5).permutation(len(wo))
    (mixed,) = _answers(subject, wo[order], wi[order], u[order], precision)
    yield _unlike("rays in another order", some(order), mixed, wo[order], wi[order], same)
    live = np.arange(len(wo)) % 2 == 0
    a, b, c = (np.where(live[:, None], w, np.nan) for w in (wo, wi, u))
    (enabled,) = _answers(subject, a, b, c, precision)
    yield _unlike("half of the rays disabled", some(live), some(live, enabled), wo[live], wi[live], same)


def _unlike(
    what: str, first: dict[str, np.ndarray], second: dict[str, np.ndarray], wo: np.ndarray, wi: np.ndarray, same: float
) -> Answer:
    """The largest difference above `same`, relative to the larger of the two values, as text; "" if there is none."""
    lit = first["sample's pdf"][:, 0] > 0.0 if "sample's pdf" in first else np.ones(len(wo), bool)
    for name, a in first.items():
        b = second[name]
        if a.shape != b.shape:
            return Answer(what, f"{name} has shape {b.shape} instead of {a.shape}")
        keep = np.isfinite(a).all(1)
        if name in ("sample's wi", "sample's eta"):
            keep &= lit
        largest = float(np.max(np.abs(a[keep]), initial=0.0))
        size = np.maximum(np.maximum(np.abs(a), np.abs(b)), SMALL * largest)
        difference = np.where(keep[:, None], np.abs(a - b), 0.0)  # positivity reports values that are not finite
        off = difference / np.where(keep[:, None], np.maximum(size, DARK), 1.0)
        off = np.where(np.isnan(off), np.inf, off).max(1)
        # rounding differs between kernels; a lobe of width 1e-4 magnifies it, in a few rows
        wrong = off > same
        if wrong.sum() > (0 if same == 0.0 else 0.002 * len(off)) or np.any(off > 0.1):
            row = int(np.argmax(off))
            text = f"{name} is {_short(b[row])} instead of {_short(a[row])}; {pair_in_words(wo[row], wi[row])}"
            total = float(np.sum(np.abs(a[keep])))
            share = float(np.sum(np.nan_to_num(difference, nan=0.0))) / total if total > 0.0 else 0.0
            return Answer(what, text, share, min(float(off[row]), 1.0))
    return Answer(what, "")


def _short(values: np.ndarray) -> str:
    return ", ".join(f"{v:.4g}" for v in values)


def _mode(subject: Subject, wo: np.ndarray, wi: np.ndarray) -> str:
    """Check that reflection does not depend on the mode, and that transmission differs by one factor per side."""
    radiance, power = (subject.eval(wo, wi, mode) for mode in ("radiance", "importance"))
    through = wo[:, 2] * wi[:, 2] < 0.0
    same = SAME[subject.best]
    size = np.maximum(np.abs(radiance), np.abs(power)).max(1)
    lit = size > SMALL * float(size.max(initial=0.0))
    off = np.abs(radiance - power).max(1) / np.where(lit, size, 1.0) * (lit & ~through)
    if off.max(initial=0.0) > same:
        row = int(np.argmax(off))
        return f"reflection depends on the mode, by {off[row]:.2g}; {pair_in_words(wo[row], wi[row])}"
    for side in (1.0, -1.0):
        rows = lit & through & (wo[:, 2] * side > 0.0) & (power.min(1) > 0.0)
        if rows.sum() < 8:
            continue
        ratio = radiance[rows].sum(1) / power[rows].sum(1)
        if np.ptp(ratio) > max(10.0 * same, 1e-3) * np.median(ratio):
            ends = f"from {ratio.min():.4g} to {ratio.max():.4g}"
            return f"in transmission, the ratio of radiance to power varies {ends}, but an index gives a constant"
    return ""


def _textured(subject: Subject, wo: np.ndarray, wi: np.ndarray, u: np.ndarray) -> Iterator[Answer]:
    """Check that the result for each ray follows from its own values if parameters vary from ray to ray, as with
    textures."""
    if not isinstance(subject.model, BSDF) or subject.stochastic or subject.model.needs_uniform:
        return
    along = [axis for axis in ranges.axes(subject) if axis.path not in subject.model.fixed]
    if not along:
        return
    odd = np.arange(len(wo)) % 2 == 1
    # some values increase and others decrease, so that their ratios change too
    shares = [(0.3, 0.6), (0.7, 0.25)]
    ends = [{axis.path: float(axis.at(shares[k % 2][end])) for k, axis in enumerate(along)} for end in (0, 1)]
    together = box.per_ray(subject, {path: np.where(odd, ends[1][path], ends[0][path]) for path in ends[0]})
    if together is None:
        return

    def results(one: Subject) -> dict[str, np.ndarray]:
        # a guide depends on all values together: its density and samples differ from those for a single value
        return {"eval": one.eval(wo, wi)} if one.guided else _answers(one, wo, wi, u, one.best)[0]

    try:
        separate = [results(subject.replace(**values)) for values in ends]
    except InputError:
        return  # the material rejects this combination of values
    mixed = results(together)
    each = {name: np.where(odd[:, None], separate[1][name], first) for name, first in separate[0].items()}
    names = " and ".join(list(ends[0])[:3])
    answer = _unlike("textured parameters", each, mixed, wo, wi, SAME[subject.best])
    yield answer._replace(wrong=f"{answer.wrong}; {names} varying from ray to ray") if answer.wrong else answer


def _one_mode(subject: Subject, wo: np.ndarray, wi: np.ndarray, u: np.ndarray) -> str:
    """Check that reflection does not depend on the mode."""
    radiance, power = (_answers(subject, wo, wi, u, subject.best, mode=mode)[0] for mode in ("radiance", "importance"))
    for name in ("eval", "sample's weight"):
        a, b = radiance[name], power[name]
        off = np.abs(a - b) / np.maximum(np.maximum(np.abs(a), np.abs(b)), SMALL * np.abs(a).max(initial=1e-3))
        row = int(np.argmax(off.max(1)))
        if off[row].max() > SAME[subject.best]:
            return f"{name} depends on the mode, by {off[row].max():.2g}; {pair_in_words(wo[row], wi[row])}"
    return ""


def _facts(subject: Subject, wo: np.ndarray, wi: np.ndarray, u: np.ndarray) -> str:
    """Check whether results have the declared properties: `transmits`, `two_sided`, `back_differs`, `delta`, and eta of
    samples."""
    model = subject.model
    # all pairs of sides, even those without declared values
    sides = np.resize([[1, 1], [1, -1], [-1, 1], [-1, -1]], (len(wo), 2))
    o, i = (np.concatenate([w[:, :2], np.abs(w[:, 2:]) * sides[:, k, None]], 1) for k, w in enumerate((wo, wi)))
    value = subject.eval(o, i).max(1)
    drawn = subject.sample(o, u)
    lit = (drawn.pdf > 0.0) & np.any(drawn.weight > 0.0, axis=1) & np.all(np.isfinite(drawn.wi), axis=1)
    bright = value > SMALL * max(float(np.max(value, initial=0.0)), 1e-3)
    across, sampled_across = o[:, 2] * i[:, 2] < 0.0, o[:, 2] * drawn.wi[:, 2] < 0.0
    if not subject.transmits:
        if np.any(bright & across) or np.any(lit & sampled_across):
            return "light is transmitted, but `transmits` is False"
        below = np.any(bright & (o[:, 2] < 0.0)) or np.any(lit & (o[:, 2] < 0.0))
        same, other = bool(getattr(model, "two_sided", True)), bool(getattr(model, "back_differs", False))
        if below and not (same or other) and subject.best == "float64":
            return "light is reflected from below, but none of `transmits`, `two_sided` and `back_differs` declares it"
        if same and not other and subject.best == "float64" and 1 in subject.sides:
            flip = np.array([1.0, 1.0, -1.0])
            up = [np.concatenate([w[:, :2], np.abs(w[:, 2:])], 1) for w in (wo, wi)]
            over, under = subject.eval(up[0], up[1]), subject.eval(up[0] * flip, up[1] * flip)
            off = np.abs(over - under).max(1)
            if np.any(off > 1e-3 * np.maximum(over.max(1), SMALL * max(float(over.max(initial=0.0)), 1e-3))):
                return "`two_sided` declares both sides equal, but their values differ: declare `back_differs`?"
    fact = getattr(model, "delta", "maybe")
    if fact == "never" and np.any(lit & drawn.delta):
        return 'some samples are delta samples, but `delta` is "never"'
    if fact == "always" and (np.any(lit & ~drawn.delta) or bright.any()):
        return 'light leaves outside of delta lobes, but `delta` is "always"'
    if np.any(lit & ~(np.isfinite(drawn.eta) & (drawn.eta > 0.0))):
        row = int(np.argmax(lit & ~(np.isfinite(drawn.eta) & (drawn.eta > 0.0))))
        return (
            f"eta of a sample is {drawn.eta[row]:.4g}, but the index on wi's side divided by that on wo's is expected"
        )
    wrong = lit & ~sampled_across & (np.abs(drawn.eta - 1.0) > 1e-6)
    if wrong.any():
        return f"eta of a reflected sample is {drawn.eta[int(np.argmax(wrong))]:.4g} instead of 1"
    return ""


__all__ = ["Calls"]
