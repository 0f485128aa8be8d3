"""Emit, read back, compare: the text of every model has its values in 64 bits, and a changed text has not."""

import dataclasses
import re

import gonio as go
import numpy as np
import pytest
import variants
from gonio.errors import GonioError
from gonio.shaders import bundle
from gonio.shaders.read_back import LANGUAGES, difference
from gonio.spirv.compiler import compiler

TOLERANCE = 1e-8


def inputs(count: int, transmits: bool) -> list[np.ndarray]:
    random = np.random.default_rng(5)
    wo, wi = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in random.normal(size=(2, count, 3)))
    if not transmits:
        wo, wi = (v * np.where(v[:, 2:] < 0.0, -1.0, 1.0) for v in (wo, wi))
    return [wo, wi, random.random((count, 3))]


@pytest.mark.sample(1)
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", variants.SHAPES)
def test_text_read_back_has_the_values_of_its_material(name: str, language: str) -> None:
    if language != "wgsl":
        try:
            compiler()
        except GonioError as error:
            pytest.skip(f"NOT TRIED: {error}")
    material = variants.SHAPES[name]
    for one in difference(material, bundle(material, language), *inputs(256, material.transmits)):
        assert one.figure <= TOLERANCE, one


def test_functions_of_a_struct_with_text_inside_are_read_back() -> None:
    # what its `derive` returns holds names beside numbers
    material = variants.EVERY["turquin"]
    assert max(one.figure for one in difference(material, bundle(material, "wgsl"), *inputs(64, False))) <= TOLERANCE


MUTATIONS = [
    (r"\bmax\(", "min("), (r" \* ", " + "), (r" - ", " + "), (r"\b0\.5\b", "0.51"), (r"\b1\.0 / ", "1.01 / "),
    (r"m\.z > 0\.0", "m.z < 0.0"), (r"2\.0 \* cos_i", "2.1 * cos_i"), (r"sqrt\(", "abs("), (r"\.xy\b", ".yx"),
    (r"0\.31830987", "0.3183"),
]  # fmt: skip


@pytest.mark.slow
def test_mutated_text_is_caught() -> None:
    material = go.Conductor.preset("Au", alpha=(0.3, 0.1))
    made, given = bundle(material, "wgsl"), inputs(64, False)
    code = re.sub(r"//[^\n]*", lambda comment: " " * len(comment[0]), made.text)
    for pattern, other in MUTATIONS:
        match = re.search(pattern, code)
        assert match is not None, pattern
        text = made.text[: match.start()] + other + made.text[match.end() :]
        found = difference(material, dataclasses.replace(made, text=text), *given)
        assert max(one.figure for one in found) > TOLERANCE, pattern
