"""Shader code: what is written as text and read again has the values of the material."""

from __future__ import annotations

import numpy as np

from ...errors import GonioError, InputError
from ...material import BSDF
from ...shaders import bundle, read_back
from ...shaders.program import FUNCTIONS, check
from ...spirv.compiler import compiler
from .. import directions
from ..effort import Effort
from ..subject import Subject, guarded
from ..verdict import DoesNotApply, Finding
from .base import Law, pair_in_words, pairs

PAIRS = 256
TOLERANCE = 1e-8


class Shader(Law):
    """The shader code of a material, read again, gives the material's values in 64 bits: GLSL, HLSL and WGSL."""

    number = 13
    on_request = True
    everywhere = False
    at_ends = False
    name = "shader"
    title = "shader code gives the same values"
    meaning = "The picture of a real-time engine differs from the offline reference."

    def judge(self, subject: Subject, effort: Effort, seed: int) -> Finding:
        model = subject.model
        if not isinstance(model, BSDF):
            raise DoesNotApply("it is no material of Gonio's, and no shader code is written from it")
        try:
            check(model, FUNCTIONS, "shader")
        except InputError as error:
            raise DoesNotApply(f"no shader code: {error.what}") from error
        wo, wi = pairs(subject, PAIRS, seed)
        u = directions.numbers(np.random.default_rng([seed, 12]), len(wo))
        finding = Finding(0.0, TOLERANCE, "both are computed in 64 bits; only the order of sums may differ")
        for language in languages(finding):
            self._language(model, language, (wo, wi, u), finding)
        finding.shown = f"{finding.figure:.1e}"
        return finding

    def _language(self, model: BSDF, language: str, inputs: tuple[np.ndarray, ...], finding: Finding) -> None:
        """Add one language's differences to the finding."""
        try:
            made = guarded(model, "sample", lambda: bundle(model, language))
        except InputError as error:
            raise DoesNotApply(f"no shader code: {error.what}") from error
        try:
            figures = read_back.difference(model, made, *inputs)
        except GonioError as error:
            finding.problems.append(f"{language} cannot be read back: {error.what} ({error.where})")
            return
        worst = max(figures, key=lambda one: one.figure)
        if worst.figure > finding.figure or not finding.worst:
            finding.figure = max(finding.figure, worst.figure)
            wo, wi, u = (rows[worst.row] for rows in inputs)
            place = f"u = {np.round(u, 4)}" if worst.function == "sample" else pair_in_words(wo, wi)
            finding.worst = f"{language}, {worst.function}: {worst.read:.9g}, {worst.written:.9g} expected; {place}"
            finding.at = wo, wi


def languages(finding: Finding) -> list[str]:
    """The languages that can be read here; without a compiler WGSL alone, which the finding then says."""
    try:
        compiler()
    except GonioError as error:
        finding.notes.append(f"GLSL and HLSL were not read back: {error.what}")
        return ["wgsl"]
    return list(read_back.LANGUAGES)
