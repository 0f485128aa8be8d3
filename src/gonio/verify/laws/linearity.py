"""Linearity: light adds up."""

from __future__ import annotations

import numpy as np

from ...models import BSDF, models
from ..effort import Effort
from ..subject import Subject
from ..verdict import DoesNotApply, Finding
from .base import Law, pair_in_words, pairs, relative, worst_of

EXACT, SINGLE = 1e-9, 1e-4


class Linearity(Law):
    """eval is affine in each albedo, eval(c a + (1-c) b) = c eval(a) + (1-c) eval(b), and a mix is the mix of values.

    An albedo is a spectrum that is declared to lie in [0, 1].
    """

    number = 7
    name = "linearity"
    title = "linear in albedos; a mix is the mix of the values"
    meaning = "Textures that are filtered or blended before shading look different from the average of what they show."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        if not subject.has_density:
            raise DoesNotApply("all lobes are deltas, which have no value to compare")
        if subject.stochastic:
            raise DoesNotApply("the model is stochastic: single values are random")
        names = [n for n, p in subject.parameters.items() if p.kind == "spectrum" and p.high == 1.0]
        wo, wi = pairs(subject, effort.pairs // 4, seed)
        cases = []
        for name in names:
            low, high, middle = (subject.replace(**{name: v}).eval(wo, wi) for v in (0.125, 0.875, 0.3125))
            cases.append((name, middle, 0.75 * low + 0.25 * high))
        if isinstance(subject.model, BSDF):
            other = models()["lambert"]((0.2, 0.5, 0.8))  # type: ignore[call-arg]
            mixed = Subject(models()["mix"](subject.model, other, 0.25), "mix")  # type: ignore[call-arg]
            cases.append(
                ("mix", mixed.eval(wo, wi), 0.75 * subject.eval(wo, wi) + 0.25 * Subject(other, "lambert").eval(wo, wi))
            )
        if not cases:
            raise DoesNotApply("it has no albedo that could be changed, and is no Gonio material that could be mixed")
        exact = subject.best == "float64"
        worst, place, name = -1.0, 0, ""
        for label, a, b in cases:
            row, size = worst_of(relative(a, b, 0.0, 1e-9 * float(np.max(np.abs(b), initial=0.0))))
            if size > worst:
                worst, place, name = size, row, label
        return Finding(
            figure=worst,
            tolerance=EXACT if exact else SINGLE,
            reason="a few roundings" if exact else "a few roundings of float32, some of them cancelling",
            worst=f"{name}: {pair_in_words(wo[place], wi[place])}",
            at=(wo[place], wi[place]),
            notes=[f"tried: {', '.join(label for label, _, _ in cases)}"],
        )
