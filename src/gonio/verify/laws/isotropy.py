"""Isotropy, or anisotropy along the declared axes."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from ...errors import InputError
from ...material import BSDF, models, tree
from .. import directions, severity
from ..effort import Effort
from ..forensics.ratio import Cause
from ..subject import Subject
from ..verdict import DoesNotApply, Finding
from .base import Law, pair_in_words, pairs, relative, rounding, worst_of

Pair: TypeAlias = "tuple[np.ndarray, np.ndarray]"  # of directions wo and wi, (N, 3) each

EXACT = 1e-6
SINGLE = 2e-3
VISIBLE = 1e-3  # smallest relative change that counts as anisotropy
ROTATION = "rotation"  # parameter that rotates the axes about the normal, counterclockwise (docs/conventions.md)
TURN = 0.7  # radians by which the axes are rotated


class Isotropy(Law):
    """An isotropic f depends on theta_o, theta_i and |phi_o - phi_i| only; the lobe of an anisotropic f is wider along
    the axis with the larger alpha."""

    number = 6
    name = "isotropy"
    title = "isotropic or, if declared anisotropic, wider along the declared axis"
    meaning = "Highlights follow the tangents of the mesh where they should not, or stretch along the wrong axis."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        if not subject.has_density:
            raise DoesNotApply("all lobes are delta lobes, which have no values to compare")
        if subject.stochastic:
            raise DoesNotApply("the material is stochastic: the law `pdf` tests its samples against its pdf instead")
        exact = subject.best == "float64"
        wo, wi = pairs(subject, effort.pairs, seed, exact)
        turn = np.random.default_rng([seed, 61]).uniform(0.0, 2.0 * np.pi, len(wo))
        rotated = directions.rotated(wo, turn), directions.rotated(wi, turn)
        mirrored = wo * np.array([1.0, -1.0, 1.0]), wi * np.array([1.0, -1.0, 1.0])
        error = np.zeros(len(wo))
        for a, b in (rotated, mirrored):
            error = np.maximum(error, self._difference(subject, (wo, wi), (a, b), exact))
        row, size = worst_of(error)
        finding = Finding(
            figure=size,
            tolerance=EXACT if exact else SINGLE,
            reason="rotation causes rounding errors of 1e-16; formulas with cancellation lose up to ten digits"
            if exact
            else "beyond the effect of changing both directions by 8 ulps, only the model's own rounding errors remain",
            worst=pair_in_words(wo[row], wi[row]),
            at=(wo[row], wi[row]),
        )
        if subject.isotropic:
            return finding
        finding.shown = f"changes by {size:.2g} under rotation"
        finding.tolerance, finding.figure = 0.0, 0.0
        finding.reason = (
            "declared anisotropic: rotation must change the values, and the wider axis must be the declared one"
        )
        if size < VISIBLE and effort.full and not self._drawn_along_axes(subject, (wo, wi), rotated):
            # at other parameter values it may be isotropic
            finding.problems.append(f"declared anisotropic, but rotation changes the values by {size:.1e} at most")
        self._axes(subject, finding)
        self._rotated_together(subject, finding, (wo, wi), exact)
        return finding

    @staticmethod
    def _drawn_along_axes(subject: Subject, first: Pair, second: Pair) -> bool:
        """Whether the density of samples changes under rotation: isotropic values may be sampled anisotropically."""
        there, back = subject.pdf(*first), subject.pdf(*second)
        return bool(np.any(np.abs(there - back) > VISIBLE * np.maximum(there, back)))

    def _rotated_together(
        self, subject: Subject, finding: Finding, pair: tuple[np.ndarray, np.ndarray], exact: bool
    ) -> None:
        """Check that the values are the same if the axes of the material and the directions are rotated together."""
        other = _with_turned_axes(subject)
        if other is None:
            return
        wo, wi = pair
        turned_o, turned_i = (directions.rotated(w, np.full(len(w), TURN)) for w in pair)
        there, back = subject.eval(wo, wi), other.eval(turned_o, turned_i)
        noise = 0.0 if exact else rounding(subject.eval, wo, wi) + rounding(other.eval, turned_o, turned_i)
        row, size = worst_of(self._error(there, back, exact, noise))
        finding.figure, finding.tolerance = size, EXACT if exact else SINGLE
        finding.at, finding.worst = (wo[row], wi[row]), pair_in_words(wo[row], wi[row])
        finding.notes.append(f"change if axes and directions rotate together: {size:.1e}")
        if size > finding.tolerance:
            finding.shown = f"changes by {size:.2g} if axes and directions rotate together"

    def bias(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> severity.Bias | None:
        swapped = _swapped(subject) if not subject.isotropic else None
        other = _with_turned_axes(subject) if finding.figure > finding.tolerance and not subject.isotropic else None
        if not subject.isotropic and swapped is None and other is None:
            return None

        def rotated(wo: np.ndarray, wi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            if other is not None:
                angle = np.full(len(wo), TURN)
                return subject.eval(wo, wi), other.eval(directions.rotated(wo, angle), directions.rotated(wi, angle))
            if swapped is not None:
                return subject.eval(wo, wi), swapped.eval(wo, wi)
            # an angle per wo, the same for all its wi
            turn = 1.0 + 40.0 * wo[:, 2] + 13.0 * wo[:, 0]
            return subject.eval(wo, wi), subject.eval(directions.rotated(wo, turn), directions.rotated(wi, turn))

        where = ", compared with exchanged axes" if swapped is not None else ", under rotation"
        where = ", with axes and directions rotated together" if other is not None else where
        return severity.between(subject, rotated, where)

    def ratios(self, subject: Subject, finding: Finding, effort: Effort, seed: int) -> Iterator[Cause]:
        if any("axes swapped" in problem for problem in finding.problems):
            yield Cause(
                "the lobe is wider along the axis of the smaller alpha: are alpha_x and alpha_y exchanged?",
                "axes exchanged",
            )
        elif not subject.isotropic and finding.figure > finding.tolerance:
            yield self._cause_of_turn(subject, seed)
        elif subject.isotropic:
            wo, wi = pairs(subject, 4096, seed)
            turn = np.random.default_rng([seed, 61]).uniform(0.0, 2.0 * np.pi, len(wo))
            there, back = subject.eval(wo, wi), subject.eval(directions.rotated(wo, turn), directions.rotated(wi, turn))
            if np.mean(np.abs(there - back) > 1e-3 * np.maximum(there, back)) < 1e-3:
                words = "values change when both directions are mirrored, but not when they rotate"
                guess = "a lobe on one side only, due to the sine of an azimuth difference or a cross product"
                yield Cause(f"{words}; possible mistake: {guess}", "handed")
                return
            off = np.mean(np.abs(there - back) > 1e-3 * np.maximum(there, back), axis=0)
            names = [name for name, share in zip(("red", "green", "blue"), off, strict=False) if share > 0.01]
            where = f" in {' and '.join(names)}" if len(off) == 3 and 0 < len(names) < 3 else ""
            words = f"values change{where} when both directions rotate about the normal: should `isotropic` be False"
            yield Cause(f"{words}, or is a tangent used by mistake?", "turns")

    def _cause_of_turn(self, subject: Subject, seed: int) -> Cause:
        """The cause if the axes rotate the wrong way, or if only parts of the formula rotate."""
        wo, wi = pairs(subject, 4096, seed)
        other = _with_turned_axes(subject)
        assert other is not None, "the law has failed for it"
        back = np.full(len(wo), -TURN)
        there, clockwise = subject.eval(wo, wi), other.eval(directions.rotated(wo, back), directions.rotated(wi, back))
        if np.mean(np.abs(there - clockwise) > 1e-3 * np.maximum(there, clockwise)) < 1e-3:
            return Cause(
                f"{ROTATION} rotates the axes clockwise, but the convention is counterclockwise", "turn reversed"
            )
        return Cause(
            f"only part of the formula rotates with {ROTATION}; a term uses directions in the unrotated frame", "turn"
        )

    def _difference(
        self, subject: Subject, first: tuple[np.ndarray, np.ndarray], second: tuple[np.ndarray, np.ndarray], exact: bool
    ) -> np.ndarray:
        there, back = subject.eval(*first), subject.eval(*second)
        noise = 0.0 if exact else rounding(subject.eval, *first) + rounding(subject.eval, *second)
        return self._error(there, back, exact, noise)

    def _error(self, there: np.ndarray, back: np.ndarray, exact: bool, noise: np.ndarray | float) -> np.ndarray:
        """The largest relative difference over the channels, (N,)."""
        if exact:
            floor = 1e-9 * float(np.max(np.abs(there), initial=0.0, where=np.isfinite(there)))
            return relative(there, back, 0.0, floor).max(1)
        floor = 1e-6 * float(np.percentile(np.abs(there[np.isfinite(there)]), 99.0))
        return relative(there, back, noise, floor).max(1)

    def _axes(self, subject: Subject, finding: Finding) -> None:
        """Check that the second moments of `eval` over wi along the two axes, for wo along the normal, have the order
        of the two widths."""
        name = next((n for n, p in subject.parameters.items() if p.kind == "alpha"), "")
        pair = getattr(subject.model, name, None)
        if not isinstance(pair, tuple | list):
            return
        if subject.inner and isinstance(subject.model, BSDF):  # their lobes may be wider, along other axes
            with contextlib.suppress(InputError):
                subject = subject.with_inside(tree.replace(models()["lambert"](), {"albedo": 0.0}))
        along, across, _ = _spread(subject)
        if not along + across > 0.0:
            return
        finding.notes.append(
            f"second moments along x and y: {along / (along + across):.3f}, {across / (along + across):.3f}"
        )
        try:
            widths = [_spread(subject.replace(**{name: (float(v), float(v))}))[2] for v in pair]
        except InputError:  # the material rejects equal values
            widths = [float(v) for v in pair]
        # a larger exponent gives a narrower lobe
        apart = abs(widths[0] - widths[1]) > 1e-3 * max(widths)
        if apart and (along - across) * (widths[0] - widths[1]) < 0.0:
            wider = "x" if along > across else "y"
            given = f"alpha is {pair[0]:g}, {pair[1]:g}"
            finding.problems.append(f"{given}, but the lobe is wider along {wider}: axes swapped")


def _spread(subject: Subject) -> tuple[float, float, float]:
    """The second moments of `eval` over wi along the two axes, for wo along the normal; and their sum divided by the
    reflected light."""
    turn = next((getattr(subject.model, n) for n, p in subject.parameters.items() if p.kind == "angle"), 0.0)
    phi0 = float(turn or 0.0)
    theta = np.geomspace(1e-4, 0.499 * np.pi, 400)
    phi = np.arange(64) * 2.0 * np.pi / 64
    t, p = (part.ravel() for part in np.meshgrid(theta, phi, indexing="ij"))
    wi = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1)
    value = subject.eval(np.tile([0.0, 0.0, 1.0], (len(wi), 1)), wi).mean(1)
    # d omega = sin theta d theta d phi, and geometric steps in theta carry a factor theta
    light = value * np.sin(t) * t
    moment = light * np.sin(t) ** 2
    along, across = (float(np.sum(moment * harmonic(p - phi0) ** 2)) for harmonic in (np.cos, np.sin))
    return along, across, (along + across) / max(float(np.sum(light)), 1e-30)


def _with_turned_axes(subject: Subject) -> Subject | None:
    """The subject with its axes rotated by TURN; None if it has no parameter for the rotation."""
    parameter = subject.parameters.get(ROTATION)
    if parameter is None or parameter.kind != "angle":
        return None
    return subject.replace(**{ROTATION: float(getattr(subject.model, ROTATION) or 0.0) + TURN})


def _swapped(subject: Subject) -> Subject | None:
    """The subject with alpha_x and alpha_y swapped; None if it does not have both."""
    for name, parameter in subject.parameters.items():
        pair = getattr(subject.model, name, None)
        if parameter.kind == "alpha" and isinstance(pair, tuple | list):
            return subject.replace(**{name: (pair[1], pair[0])})
    return None
