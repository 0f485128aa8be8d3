"""Shader code: when it is read back, it gives the values of the material."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...errors import GonioError, InputError
from ...material import BSDF
from .. import directions
from .. import subject as subjects
from ..effort import Effort
from ..subject import Subject, guarded
from ..verdict import DoesNotApply, Finding
from .base import Law, pair_in_words, pairs

if TYPE_CHECKING:
    from ...shaders import read_back

SHOWN = 8  # parameters shown for the worst case
PAIRS = 2048  # enough to reach both sides of thresholds such as alpha < 1e-4
TOLERANCE = 1e-12  # most values are bit-identical


class Shader(Law):
    """The GLSL, HLSL and WGSL code of a material, read back and evaluated in float64, gives the material's values."""

    number = 13
    on_request = True
    everywhere = False
    at_ends = False
    name = "shader"
    title = "generated shader code gives the same values"
    meaning = "The picture of a real-time engine differs from the offline reference."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        model = subject.model
        if not isinstance(model, BSDF):
            raise DoesNotApply("shader code is generated for Gonio materials only")
        from ...shaders.program import FUNCTIONS, check  # imported late: 0.1 s, and this law is tested on request only

        try:
            check(model, FUNCTIONS, "shader")
        except InputError as error:
            raise DoesNotApply(f"no shader code: {error.what}") from error
        given = inputs(model, PAIRS, seed)
        finding = Finding(0.0, TOLERANCE, "both are computed in float64; only the order of additions may differ")
        self._compare(model, given, seed, finding)
        finding.shown = f"{finding.figure:.1e}"
        return finding

    def _compare(self, model: BSDF, inputs: tuple[np.ndarray, ...], seed: int, finding: Finding) -> None:
        """Add the differences in all languages to the finding."""
        from ...shaders import bundle, read_back

        original: read_back.Original | None = None
        wo, wi, u = inputs
        for language in languages(finding):
            try:
                made = guarded(model, "sample", lambda language=language: bundle(model, language))
            except InputError as error:
                raise DoesNotApply(f"no shader code: {error.what}") from error
            original = original or read_back.Original(model, made, wo, wi, u, seed)
            try:
                figures = original.difference(made)
            except GonioError as error:
                finding.problems.append(f"{language} cannot be read back: {error.what} ({error.where})")
                continue
            worst = max(figures, key=lambda one: one.figure)
            if worst.figure > finding.figure or not finding.worst:
                _add(finding, language, worst, inputs, original.fields)


def inputs(model: BSDF, count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions wo and wi and random numbers u for a material, (count, 3) each."""
    wo, wi = pairs(subjects.of(model), count, seed)
    return wo, wi, directions.numbers(np.random.default_rng([seed, 12]), count)


def _add(
    finding: Finding,
    language: str,
    worst: read_back.Difference,
    inputs: tuple[np.ndarray, ...],
    fields: dict[str, np.ndarray],
) -> None:
    """Record a difference as the largest of a finding."""
    finding.figure = max(finding.figure, worst.figure)
    wo, wi, u = (rows[worst.row] for rows in inputs)
    place = f"u = {np.round(u, 4)}" if worst.function == "sample" else pair_in_words(wo, wi)
    values = f"{worst.read:.9g} instead of {worst.written:.9g}"
    shown = [f"{path} = {np.round(rows[..., worst.row], 4)}" for path, rows in fields.items()]
    at = ", ".join(shown[:SHOWN]) + (", ..." if len(shown) > SHOWN else "")
    finding.worst = f"{language}, {worst.function}: {values}; {place}{'; ' if at else ''}{at}"


def languages(finding: Finding) -> list[str]:
    """The languages that can be read back on this machine. Without a compiler, this is only WGSL, and the law cannot
    pass."""
    from ...shaders import read_back
    from ...spirv.compiler import compiler

    try:
        compiler()
    except GonioError as error:
        finding.untried = f"GLSL and HLSL: {error.what}; {error.hint}. The law holds for WGSL"
        return ["wgsl"]
    return list(read_back.LANGUAGES)
