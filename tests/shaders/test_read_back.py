"""Emit, read back, compare: the text of every model has its values in 64 bits, and a changed text has not."""

import dataclasses

import gonio as go
import numpy as np
import pytest
import variants
from gonio.errors import GonioError
from gonio.shaders import Bundle, bundle
from gonio.shaders.read_back import LANGUAGES, Original, parameters
from gonio.spirv.compiler import compiler
from gonio.verify.laws.shader import PAIRS, TOLERANCE, inputs

from mutations import Mutation, mutations


def difference(material: go.BSDF, language: str, count: int = 512) -> float:
    made = bundle(material, language)
    return max(one.figure for one in Original(material, made, *inputs(material, count, 5)).difference(made))


@pytest.mark.sample(1)
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", variants.SHAPES)
def test_text_read_back_has_the_values_of_its_material(name: str, language: str) -> None:
    if language != "wgsl":
        try:
            compiler()
        except GonioError as error:
            pytest.skip(f"NOT TRIED: {error}")
    assert difference(variants.SHAPES[name], language) <= TOLERANCE


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "name",
    [
        "turquin",  # what its `derive` returns holds names beside numbers
        "mix-of-mixes",  # two functions of one name, of different structs
        "metal-beckmann-one",  # powers of two from bits, in the logarithm
    ],
)
def test_what_once_differed_or_was_not_read(name: str) -> None:
    assert difference(variants.EVERY[name], "wgsl") <= TOLERANCE


@pytest.mark.slow
def test_constants_that_the_writer_folds_are_folded_in_the_reference() -> None:
    assert difference(variants.EVERY["disney2015-thin"], "wgsl") <= TOLERANCE


def test_half_of_the_rows_have_other_parameters_within_their_ranges() -> None:
    material = go.Conductor.preset("Au", alpha=(0.3, 0.1), rotation=0.4)
    values = parameters(bundle(material, "wgsl").manifest, 400, 1)
    np.testing.assert_allclose(values["alpha"][:, ::2], np.repeat([[0.3], [0.1]], 200, axis=1), rtol=1e-6)
    other = values["alpha"][:, 1::2]
    assert other.min() == 0.0 and other.max() == 1.0 and np.mean(other < 1e-4) > 0.1
    np.testing.assert_allclose(np.hypot(*values["rotation"]), 1.0, rtol=1e-6)
    assert np.all(values["eta"] >= 0.0)


# ---------------------------------------------------------------------- changed text, as in benchmarks/mutations.py


def caught(original: Original, made: Bundle, changed: Mutation) -> bool:
    try:
        figures = original.difference(dataclasses.replace(made, text=changed.text))
    except GonioError:  # it is not valid
        return True
    return max(one.figure for one in figures) > TOLERANCE


def test_changed_text_is_caught_if_any_value_changes() -> None:
    material = go.Conductor.preset("Au", alpha=(0.3, 0.1))
    made = bundle(material, "wgsl")
    original = Original(material, made, *inputs(material, PAIRS, 1))
    assert max(one.figure for one in original.difference(made)) <= TOLERANCE
    accepted = [one for one in mutations(made.text, 24, 1) if not caught(original, made, one)]
    assert len(accepted) < 6
    dense = Original(material, made, *inputs(material, 20 * PAIRS, 2))
    missed = [(one.line, one.before, one.after) for one in accepted if caught(dense, made, one)]
    assert not missed
