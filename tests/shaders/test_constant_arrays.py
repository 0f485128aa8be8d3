"""Numbered constants are arrays of the language, with the values that they had one by one."""

from __future__ import annotations

import re
from collections.abc import Sequence

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.errors import GonioError
from gonio.ops import maximum
from gonio.shaders import bundle
from gonio.shaders.read_back import LANGUAGES, Original
from gonio.shaders.values import Member, members
from gonio.spirv.compiler import compiler
from variants import GOLD

DECLARED = {
    "glsl": "float missing_c[11];",
    "wgsl": "missing_c: array<f32, 11>,",
    "hlsl": "float missing_c[11];",
    "slang": "float missing_c[11];",
    "msl": "array<float, 11> missing_c;",
    "godot": "float missing_c[11];",
    "osl": "float missing_c[11];",
    "tsl": "    missing_c,",
    "numpy": "    missing_c: object",
}


@ops.function
def cubic(c: Sequence[float], x: float) -> float:
    """c_0 + c_1 x + c_2 x^2 + c_3 x^3."""
    return c[0] + x * (c[1] + x * (c[2] + x * c[3]))


class Striped(go.BSDF):
    """A polynomial of the light's height, whose numbers follow from the view and a color."""

    albedo: go.Colour = go.spectrum(0.5, "factor", high=1.0)
    rise: go.Number = go.number(0.5, "of the polynomial", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        value = cubic((wo.z, wo.z * wo.z, self.rise, self.rise * wo.z), wi.z)
        return self.albedo * (value * maximum(wi.z, 0.0))


@pytest.mark.sample(3)
@pytest.mark.parametrize("language", DECLARED)
def test_numbered_constants_are_an_array(language: str) -> None:
    text = go.emit(go.KullaConty(GOLD), language)
    assert DECLARED[language] in text and "derived.missing_c, " in text
    code = re.sub(r'(//|#|""").*|"[^"]*"', "", text)  # without comments, and tables as text, which hold any letters
    assert not re.search(r"\b(missing_)?c_\d+\b", code)


def test_the_page_may_have_them_one_by_one() -> None:
    made = bundle(go.KullaConty(GOLD), "glsl", arrays=False)
    names = {field["name"]: field["type"] for field in made.manifest["derived"]["fields"]}
    assert names["missing_c_10"] == "float" and "[" not in "".join(names.values())
    fields = bundle(go.KullaConty(GOLD), "glsl").manifest["derived"]["fields"]
    assert {"name": "missing_c", "type": "float[11]"} in fields


@pytest.mark.sample(2)
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("arrays", [True, False])
def test_both_forms_have_the_values_of_the_material(language: str, arrays: bool) -> None:
    if language != "wgsl":
        try:
            compiler()
        except GonioError as error:
            pytest.skip(f"NOT TRIED: {error}")
    random = np.random.default_rng(4)
    wo, wi = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in np.abs(random.normal(size=(2, 200, 3))))
    for material in (go.KullaConty(GOLD), Striped()):
        made = bundle(material, language, ("eval", "pdf"), arrays=arrays)
        assert ("c[1]" in made.text) == arrays
        found = Original(material, made, wo, wi, random.random((200, 3))).difference(made)
        assert max(one.figure for one in found) < 1e-12


def test_runs_from_0_of_one_type_are_members() -> None:
    fields = [("a", "float"), *((f"c_{i}", "float") for i in range(5)), ("d_0", "vec3"), ("d_1", "vec3")]
    assert members(fields, True) == [
        Member("a", "float", 0),
        Member("c", "float", 1, 5),
        Member("d_0", "vec3", 6),
        Member("d_1", "vec3", 7),
    ]
    assert all(member.length == 0 for member in members(fields, False))
    assert all(member.length == 0 for member in members([*fields, ("c", "float")], True))  # the name is taken
    gap = [(f"c_{i}", "float") for i in (0, 1, 2, 3, 5)]
    assert all(member.length == 0 for member in members(gap, True))
