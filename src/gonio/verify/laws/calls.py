"""Calls: the answers do not depend on how a renderer asks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ...bridge.answers import Answer
from ...errors import InputError
from ...material import BSDF, tree
from ...ops import Mode, Precision, backend
from .. import box, directions, severity
from ..effort import Effort
from ..forensics.ratio import Cause, Ratio
from ..subject import Subject, guarded
from ..verdict import Finding
from .base import Law, pair_in_words, pairs

SAME = {"float64": 1e-10, "float32": 1e-4}
LARGE = 1 << 20
SMALL = 1e-6  # of the largest value: less than that is as good as nothing


class Calls(Law):
    """One row says what a million say; rows that a renderer has switched off change no others; the same question has
    the same answer; only transmission knows of `mode`. Of a plugin: eval_pdf, eval_pdf_sample, masks of lanes, of
    components and of types, and its flags, say what eval, pdf and sample say."""

    number = 11
    name = "calls"
    title = "the same answers however a renderer asks"
    everywhere = False  # what it is about does not depend on the values
    meaning = "Right in a test, wrong in a picture: integrators use calls, batches and masks that nothing else tries."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        finding = Finding(0.0, 0.0, "one wrong answer is one too many", shown="agree")
        asked = []
        others: Iterable[Answer] = subject.model.renderer_calls(seed) if isinstance(subject.model, BSDF) else ()
        wrong: list[Answer] = []
        finding.details = wrong
        for answer in (*_checks(subject, effort, seed), *others):
            asked.append(answer.what)
            if answer.wrong:
                wrong.append(answer)
                finding.problems.append(f"{answer.what}: {answer.wrong}")
        finding.notes.append(f"asked: {', '.join(dict.fromkeys(asked))}")
        finding.figure = float(len(finding.problems))
        if finding.problems:
            finding.shown = f"{len(finding.problems)} differ"
        return finding

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias:
        """What the call that path tracers make returns too much or too little; nothing for the others."""
        wrong: list[Answer] = finding.details  # type: ignore[assignment]
        worst = max(wrong, key=lambda answer: answer.share)
        if worst.share > 0.0:
            return severity.Bias(min(worst.worst, 1.0), min(worst.share, 1.0), 0.0, f"of {worst.what}", "bias")
        names = ", ".join(dict.fromkeys(answer.what for answer in wrong))
        return severity.Bias(0.0, 0.0, 0.0, f"only who asks for {names}", "interface")

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Ratio | Cause]:
        wrong: list[Answer] = finding.details  # type: ignore[assignment]
        for answer in wrong:
            if answer.rows is not None:
                name, other, wo, wi, got, whole = answer.rows
                yield Ratio(name, other, wo, wi, got, whole, subject)
        for answer in wrong:
            words = SUSPECTS.get(answer.what, f"not the formula, but {answer.what}: {answer.wrong}")
            yield Cause(words, f"calls {answer.what}")


# what an answer that depends on how it was asked for comes from
_ROWS = "the answer depends on how many rows there are: an index or a buffer of fixed size?"
_NEIGHBOURS = "a row's answer depends on the other rows: a sum, a mean or a branch over all of them?"
SUSPECTS = {
    "a million rows": _ROWS,
    "one row at a time": _ROWS,
    "rows in another order": _NEIGHBOURS,
    "half the rows dead": _NEIGHBOURS,
    "textured parameters": "a value of one ray serves others: derived once for all of them?",
    "of one that nobody has used": "a call changes what later ones answer: state that is kept in the object?",
}


def _checks(subject: Subject, effort: Effort, seed: int) -> Iterator[Answer]:
    """What holds of any BSDF."""
    wo, wi = pairs(subject, min(effort.pairs // 8, 4096), seed)
    u = directions.numbers(np.random.default_rng([seed, 101]), len(wo))
    for precision in subject.precisions:
        yield from _batches(subject, wo, wi, u, precision)
    if not subject.stochastic:
        yield Answer("mode", _mode(subject, wo, wi) if subject.transmits else _one_mode(subject, wo, wi, u))
    yield from _textured(subject, wo, wi, u)
    yield Answer("declared facts", _facts(subject, wo, wi, u))


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
    """eval, pdf and all of sample, rows (N, ...), asked as a renderer does: of Dr.Jit vectors, rows may be anything.

    times  that each is asked, one time straight after the other: an answer for each
    lanes  a multiple of N: the rows again and again; the answer is that of the last N
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
    for found in values:
        found["eval"] = guarded(subject.model, "eval", lambda: model.eval(a, b, mode))
    for found in values:
        found["pdf"] = guarded(subject.model, "pdf", lambda: model.pdf(a, b))
    for found in values:
        s = guarded(subject.model, "sample", lambda: model.sample(a, c, mode))
        found |= {"sample's weight": s[1], "sample's pdf": s[2], "sample's wi": s[0], "sample's eta": s[4]}
    dr.eval([list(found.values()) for found in values])
    if lanes:
        last = dr.arange(types.module.UInt32, count) + (lanes - count)
        values = [{name: _lanes(value, last, lanes) for name, value in found.items()} for found in values]
    return [{name: _rows(value, count) for name, value in found.items()} for found in values]


def _lanes(value: Any, last: Any, lanes: int) -> Any:
    """Some lanes of a value; as it is where it has one for all."""
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
    whole, second = _answers(subject, wo, wi, u, precision, 2)
    if subject.stochastic:
        return
    same = SAME[precision]

    def some(rows: Any, answers: dict[str, np.ndarray] = whole) -> dict[str, np.ndarray]:
        return {name: value[rows] for name, value in answers.items()}

    twice = _unlike("asked twice", whole, second, wo, wi, 0.0)
    if twice.wrong:
        yield twice._replace(wrong=f"{twice.wrong}: declare `stochastic = True` if its values are random")
        return
    yield twice
    fresh = subject.anew()
    if fresh is not None:
        (new,) = _answers(fresh, wo, wi, u, precision)
        yield _unlike("of one that nobody has used", whole, new, wo, wi, same)
    for row in range(5):
        one = slice(row, row + 1)
        (alone,) = _answers(subject, wo[one], wi[one], u[one], precision)
        answer = _unlike("one row at a time", some(one), alone, wo[one], wi[one], same)
        if answer.wrong:
            break
    yield answer
    if precision == "float32":
        (many,) = _answers(subject, wo, wi, u, precision, lanes=LARGE // len(wo) * len(wo))
        yield _unlike("a million rows", whole, many, wo, wi, same)
    order = np.random.default_rng(5).permutation(len(wo))
    (mixed,) = _answers(subject, wo[order], wi[order], u[order], precision)
    yield _unlike("rows in another order", some(order), mixed, wo[order], wi[order], same)
    live = np.arange(len(wo)) % 2 == 0
    a, b, c = (np.where(live[:, None], w, np.nan) for w in (wo, wi, u))
    (half,) = _answers(subject, a, b, c, precision)
    yield _unlike("half the rows dead", some(live), some(live, half), wo[live], wi[live], same)


def _unlike(
    what: str, first: dict[str, np.ndarray], second: dict[str, np.ndarray], wo: np.ndarray, wi: np.ndarray, same: float
) -> Answer:
    """The worst difference in words, where there is any beyond `same`, relative to the larger."""
    lit = first["sample's pdf"][:, 0] > 0.0
    for name, a in first.items():
        b = second[name]
        if a.shape != b.shape:
            return Answer(what, f"{name} has shape {b.shape}, and {a.shape} otherwise")
        keep = np.isfinite(a).all(1)
        if name in ("sample's wi", "sample's eta"):
            keep &= lit
        largest = float(np.max(np.abs(a[keep]), initial=0.0))
        size = np.maximum(np.maximum(np.abs(a), np.abs(b)), SMALL * largest)
        difference = np.where(keep[:, None], np.abs(a - b), 0.0)
        off = difference / np.where(size > 0.0, size, 1.0)
        off = np.where(np.isnan(off), np.inf, off).max(1)
        # rounding differs where kernels are fused otherwise; a lobe of width 1e-4 magnifies it, in few rows
        wrong = off > same
        if wrong.sum() > (0 if same == 0.0 else 0.002 * len(off)) or np.any(off > 0.1):
            row = int(np.argmax(off))
            text = f"{name} is {_short(b[row])} instead of {_short(a[row])}, {pair_in_words(wo[row], wi[row])}"
            total = float(np.sum(np.abs(a[keep])))
            share = float(np.sum(np.nan_to_num(difference, nan=0.0))) / total if total > 0.0 else 0.0
            return Answer(what, text, share, min(float(off[row]), 1.0))
    return Answer(what, "")


def _short(values: np.ndarray) -> str:
    return ", ".join(f"{v:.4g}" for v in values)


def _mode(subject: Subject, wo: np.ndarray, wi: np.ndarray) -> str:
    """Reflection does not depend on the mode; transmission by one and the same factor each way."""
    radiance, power = (subject.eval(wo, wi, mode) for mode in ("radiance", "importance"))
    through = wo[:, 2] * wi[:, 2] < 0.0
    same = SAME[subject.best]
    size = np.maximum(np.abs(radiance), np.abs(power)).max(1)
    lit = size > SMALL * float(size.max(initial=0.0))
    off = np.abs(radiance - power).max(1) / np.where(lit, size, 1.0) * (lit & ~through)
    if off.max(initial=0.0) > same:
        row = int(np.argmax(off))
        return f"reflection changes by {off[row]:.2g} with the mode, {pair_in_words(wo[row], wi[row])}"
    for side in (1.0, -1.0):
        rows = lit & through & (wo[:, 2] * side > 0.0) & (power.min(1) > 0.0)
        if rows.sum() < 8:
            continue
        ratio = radiance[rows].sum(1) / power[rows].sum(1)
        if np.ptp(ratio) > max(10.0 * same, 1e-3) * np.median(ratio):
            ends = f"from {ratio.min():.4g} to {ratio.max():.4g}"
            return f"radiance over power in transmission runs {ends}: one index, one factor"
    return ""


def _textured(subject: Subject, wo: np.ndarray, wi: np.ndarray, u: np.ndarray) -> Iterator[Answer]:
    """Parameters that differ from ray to ray, as textures make them: each ray as if all had its values."""
    if not isinstance(subject.model, BSDF) or subject.stochastic or subject.model.needs_uniform:
        return
    along = [axis for axis in box.axes(subject) if axis.path not in subject.model.fixed]
    if not along:
        return
    odd = np.arange(len(wo)) % 2 == 1
    # some up and others down, so that what depends on their ratio changes too
    shares = [(0.3, 0.6), (0.7, 0.25)]
    ends = [{axis.path: float(axis.at(shares[k % 2][end])) for k, axis in enumerate(along)} for end in (0, 1)]
    together = box.per_ray(subject, {path: np.where(odd, ends[1][path], ends[0][path]) for path in ends[0]})
    if together is None:
        return
    try:
        alone = [_answers(subject.replace(**values), wo, wi, u, subject.best)[0] for values in ends]
    except InputError:
        return  # these values do not go together
    (mixed,) = _answers(together, wo, wi, u, subject.best)
    each = {name: np.where(odd[:, None], alone[1][name], first) for name, first in alone[0].items()}
    if any(one.guided for _, one in tree.walk(subject.model)):
        # a guide follows all values together: its density is another than for one of them, and its samples are others
        mixed = {**each, "eval": mixed["eval"]}
    names = " and ".join(list(ends[0])[:3])
    answer = _unlike("textured parameters", each, mixed, wo, wi, SAME[subject.best])
    yield answer._replace(wrong=f"{answer.wrong}, {names} from ray to ray") if answer.wrong else answer


def _one_mode(subject: Subject, wo: np.ndarray, wi: np.ndarray, u: np.ndarray) -> str:
    """Reflection knows nothing of the mode."""
    radiance, power = (_answers(subject, wo, wi, u, subject.best, mode=mode)[0] for mode in ("radiance", "importance"))
    for name in ("eval", "sample's weight"):
        a, b = radiance[name], power[name]
        off = np.abs(a - b) / np.maximum(np.maximum(np.abs(a), np.abs(b)), SMALL * np.abs(a).max(initial=1e-3))
        row = int(np.argmax(off.max(1)))
        if off[row].max() > SAME[subject.best]:
            return f"{name} changes by {off[row].max():.2g} with the mode, {pair_in_words(wo[row], wi[row])}"
    return ""


def _facts(subject: Subject, wo: np.ndarray, wi: np.ndarray, u: np.ndarray) -> str:
    """What it declares about itself is what it does: `transmits`, `two_sided`, `delta`, and a sample's eta."""
    model = subject.model
    # every pair of sides, whether it declares to answer there or not
    sides = np.resize([[1, 1], [1, -1], [-1, 1], [-1, -1]], (len(wo), 2))
    o, i = (np.concatenate([w[:, :2], np.abs(w[:, 2:]) * sides[:, k, None]], 1) for k, w in enumerate((wo, wi)))
    value = subject.eval(o, i).max(1)
    drawn = subject.sample(o, u)
    lit = (drawn.pdf > 0.0) & np.any(drawn.weight > 0.0, axis=1) & np.all(np.isfinite(drawn.wi), axis=1)
    seen = value > SMALL * max(float(np.max(value, initial=0.0)), 1e-3)
    across, sampled_across = o[:, 2] * i[:, 2] < 0.0, o[:, 2] * drawn.wi[:, 2] < 0.0
    if not subject.transmits:
        if np.any(seen & across) or np.any(lit & sampled_across):
            return "light goes through, and `transmits` says that none does"
        below = np.any(seen & (o[:, 2] < 0.0)) or np.any(lit & (o[:, 2] < 0.0))
        declared = bool(getattr(model, "two_sided", True))
        if below and not declared and subject.best == "float64":
            return "it answers from below, and neither `transmits` nor `two_sided` says so"
        if declared and subject.best == "float64" and 1 in subject.sides:
            flip = np.array([1.0, 1.0, -1.0])
            up = [np.concatenate([w[:, :2], np.abs(w[:, 2:])], 1) for w in (wo, wi)]
            over, under = subject.eval(up[0], up[1]), subject.eval(up[0] * flip, up[1] * flip)
            off = np.abs(over - under).max(1)
            if np.any(off > 1e-3 * np.maximum(over.max(1), SMALL * max(float(over.max(initial=0.0)), 1e-3))):
                return "`two_sided` says that it looks from below as from above, and its values differ"
    fact = getattr(model, "delta", "maybe")
    if fact == "never" and np.any(lit & drawn.delta):
        return 'delta samples, and `delta` says "never"'
    if fact == "always" and (np.any(lit & ~drawn.delta) or seen.any()):
        return 'light that is in no delta lobe, and `delta` says "always"'
    if np.any(lit & ~(np.isfinite(drawn.eta) & (drawn.eta > 0.0))):
        row = int(np.argmax(lit & ~(np.isfinite(drawn.eta) & (drawn.eta > 0.0))))
        return f"a sample's eta is {drawn.eta[row]:.4g}: the index on wi's side over that on wo's expected"
    wrong = lit & ~sampled_across & (np.abs(drawn.eta - 1.0) > 1e-6)
    if wrong.any():
        return f"a reflected sample's eta is {drawn.eta[int(np.argmax(wrong))]:.4g}, 1 expected"
    return ""


__all__ = ["Calls"]
