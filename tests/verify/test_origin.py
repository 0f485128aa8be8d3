"""Where a NaN or an infinity begins: the operation, its function and its line."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.verify.forensics import origin

WO, WI = np.array([0.0, 0.6, 0.8]), np.array([0.6, 0.0, 0.8])
TEXT = """float inner(float x) {{
    float unused = x > 0.0 ? 1.0 : 1.0 / (x - x);
    return {formula};
}}
vec3 brdf(vec3 light, vec3 view, vec3 normal, float k) {{ return vec3(0.5 + inner(light.z), k, 0.1); }}
"""
CASES = {
    "1.0 / (x - x)": "a division by 0",
    "(x - x) / (x - x)": "0 / 0",
    "sqrt(-x)": "the square root of a negative number",
    "pow(-x, 2.0)": "a power of a negative number",
    "log(x - x)": "the logarithm of 0",
    "exp(2000.0 * x)": "an overflow",
    "1e30 * exp(40.0 * x)": "an overflow",
}


@pytest.mark.sample(3)
@pytest.mark.parametrize("formula", CASES)
def test_operation_function_and_line_of_a_shader(tmp_path: Path, formula: str) -> None:
    (tmp_path / "mine.glsl").write_text(TEXT.format(formula=formula))
    words = origin.of(go.Shader(tmp_path / "mine.glsl"), WO, WI)
    suffix = " in float32" if formula.startswith("1e30") else ""
    assert words == f"{CASES[formula]} in `inner` (mine.glsl:3){suffix}"


@pytest.mark.slow
def test_finite_values_have_none(tmp_path: Path) -> None:
    (tmp_path / "mine.glsl").write_text(TEXT.format(formula="x * x"))
    assert origin.of(go.Shader(tmp_path / "mine.glsl"), WO, WI) == ""
    assert origin.of(go.OpenPBR(), WO, WI) == "" and origin.of(go.KullaConty(go.Conductor(alpha=0.3)), WO, WI) == ""


def test_report_names_it(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "import gonio as go\n"
        "from gonio.ops import sqrt\n\n\n"
        "class Bad(go.BSDF):\n"
        '    k: go.Colour = go.spectrum(0.5, "albedo")\n\n'
        "    def eval(self, wo, wi):\n"
        "        return self.k * sqrt(0.5 - wi.z) * wi.z\n"
    )
    (card,) = go.verify(f"{tmp_path / 'mine.py'}:Bad", quick=True, law="positivity").cards
    (verdict,) = card.verdicts
    assert verdict.cause.endswith("first caused by the square root of a negative number in `Bad_eval` (mine.py:9)")
