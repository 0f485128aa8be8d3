"""Half precision: tables of 16 bits, and the error that the manifest and the text state."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.shaders import Bundle, Placement, bundle
from gonio.shaders.emission import Choice, shader
from gonio.shaders.own_values import OwnValues
from gonio.shaders.textures import pixels
from gonio.shaders.vectors import pairs
from variants import GLASS, GOLD

from varnished import Varnished


def half(material: Any, lang: str = "glsl", **more: Any) -> Bundle:
    return shader(material, lang, Choice(("eval", "pdf"), **more), Placement(half=True))[0]


def test_tables_are_those_of_32_bits_rounded(tmp_path: Path) -> None:
    material = go.KullaConty(GOLD)
    made = bundle(material, "wgsl", ("eval",), placement=Placement(half=True))
    whole = bundle(material, "wgsl", ("eval",))
    made.write(tmp_path)
    for texture, before in zip(made.manifest["textures"], whole.manifest["textures"], strict=True):
        texels = whole.tables[texture["uniform"]]
        assert texture["format"] == before["format"].replace("32", "16") and texture["file"].endswith(".f16")
        read = np.fromfile(tmp_path / texture["file"], "<f2").reshape(texels.shape)
        assert np.array_equal(read, texels.astype(np.float16)) and texture["file"] in made.text


def test_the_stated_error_is_that_of_rounded_parameters() -> None:
    """For the material's own values, the even rows, whose error can be computed from `eval` itself."""
    material = go.Conductor(eta=(0.143, 0.375, 1.442), k=(3.983, 2.386, 1.603), alpha=0.3)
    coarse = go.Conductor(eta=material.eta, k=material.k, alpha=float(np.float16(0.3)))
    stated = half(material).manifest["half"]
    wo, wi = (v[::2] for v in pairs(np.random.default_rng(0), stated["pairs"], False))
    exact, other = (np.asarray(one.eval(wo, wi), float) for one in (material, coarse))
    error = np.abs(other - exact).max(-1) / np.maximum(exact.max(-1), 1e-6)
    assert 1e-4 < error.max() <= 1.01 * stated["parameters"]["alpha"]["eval"]["max"]
    assert stated["tables"] is None and set(stated["parameters"]) == {"eta", "k", "alpha", "albedo"}


@pytest.mark.slow
def test_header_and_manifest_state_the_same(tmp_path: Path) -> None:
    made = half([go.KullaConty(GOLD), go.Lambert()])
    head = re.sub(r"\s*\n// ", " ", made.text.partition("\n\n")[0])
    for manifest in json.loads(json.dumps(made.manifest))["materials"]:
        stated = manifest["half"]
        for path, errors in [("tables (as here)", stated["tables"]), *stated["parameters"].items()]:
            if errors is not None:
                assert f"{path} eval {errors['eval']['max']:.1e} (mean {errors['eval']['mean']:.1e})" in head
    tables = made.manifest["materials"][0]["half"]["tables"]
    assert 1e-5 < tables["eval"]["max"] < 1e-2 and tables["eval"]["mean"] < 1e-3


def test_layers_that_are_off_are_left_out() -> None:
    assert set(half(Varnished(), own=OwnValues(lean=True)).manifest["half"]["parameters"]) == {"albedo", "power"}


def test_numbers_that_overflow_are_refused() -> None:
    table = go.ops.Table("bright", np.array([[1.0], [7e4]]))
    assert pixels(table).max() == 7e4
    with pytest.raises(go.InputError, match="table bright contains 70000, which 16 bits cannot represent"):
        pixels(table, 16)


@pytest.mark.parametrize(("lang", "more"), [("glsl", {"fit": "2"}), ("glsl", {"ibl": True}), ("numpy", {})])
def test_it_goes_with_whole_materials_in_a_shader_language(lang: str, more: dict[str, Any]) -> None:
    with pytest.raises(go.InputError, match="half precision requested"):
        half(GLASS, lang, **more)
