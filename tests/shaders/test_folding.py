"""`gonio emit --fold`: a material's own values in the code, which computes less and has the same values."""

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import GonioError, InputError
from gonio.shaders import bundle
from gonio.spirv.compiler import compiler

MATERIALS = {
    "preset": go.Conductor.preset("Au", alpha=(0.3, 0.1), rotation=0.4),
    "compensated": go.material("kulla-conty(base=conductor(preset=Au,alpha=0.35))"),
    "one function twice": go.material("mix(a=conductor(alpha=0.1),b=conductor(alpha=0.4),weight=0.3)"),
    "glass": go.material("dielectric(alpha=0.3)"),
    "smooth": go.material("conductor(alpha=0)"),
}


def directions(seed: int, count: int = 200) -> np.ndarray:
    w = np.random.default_rng(seed).normal(size=(count, 3))
    w[:, 2] = np.abs(w[:, 2]) + 0.01
    return w / np.linalg.norm(w, axis=1, keepdims=True)


def total(made: go.shaders.Bundle, function: str) -> int:
    return int(sum(made.manifest["operations"][function].values()))


COMPILED = [pytest.param(one, marks=pytest.mark.slow) for one in ("glsl", "hlsl")]


@pytest.mark.sample(2)
@pytest.mark.parametrize("language", ["wgsl", *COMPILED])
@pytest.mark.parametrize("name", MATERIALS)
def test_folded_code_has_the_values_of_its_material_by_fewer_operations(
    name: str, language: str, tmp_path: Path
) -> None:
    if language != "wgsl":
        try:
            compiler()
        except GonioError as error:
            pytest.skip(f"NOT TRIED: {error}")
    material = MATERIALS[name]
    functions = ("eval", "pdf", "sample")
    made, plain = (bundle(material, language, functions, fold=fold) for fold in (True, False))
    assert total(made, "eval") < total(plain, "eval")
    assert "derive" not in made.manifest["functions"]
    made.write(tmp_path)
    shader = go.Shader(tmp_path / made.manifest["shader"])
    assert not shader.parameters()
    wo, wi, u = directions(1), directions(2), np.random.default_rng(3).random((200, 3))
    for one, other in (
        (shader.eval(wo, wi, precision="float64"), material.eval(wo, wi, precision="float64")),
        (shader.pdf(wo, wi, precision="float64"), material.pdf(wo, wi, precision="float64")),
        (shader.sample(wo, u, precision="float64").wi, material.sample(wo, u, precision="float64").wi),
        (shader.sample(wo, u, precision="float64").weight, material.sample(wo, u, precision="float64").weight),
    ):
        np.testing.assert_allclose(one, other, rtol=3e-5, atol=1e-6)


def test_gold_takes_the_operations_that_the_docs_state() -> None:
    gold = go.Conductor.preset("Au")
    assert total(bundle(gold, "glsl", ("eval",), fold=True), "eval") == 174
    assert total(bundle(gold, "glsl", ("eval",)), "eval") == 224


def test_constants_remain_beside_folded_code() -> None:
    text = go.emit("conductor(preset=Au)", "glsl", ("eval",), constants=True, fold=True)
    assert "const Conductor Conductor_values" in text
    assert "self." not in text


def test_folded_python_file_has_the_values(tmp_path: Path) -> None:
    names: dict[str, object] = {}
    exec(go.emit(MATERIALS["preset"], "numpy", ("eval",), fold=True), names)
    wo, wi = directions(1), directions(2)
    expected = MATERIALS["preset"].eval(wo, wi, precision="float64")
    np.testing.assert_allclose(names["eval"](wo, wi), expected, rtol=1e-12)  # type: ignore[operator]


def test_folding_goes_with_whole_materials() -> None:
    with pytest.raises(InputError, match="--fold given with --fit"):
        go.emit("conductor", "glsl", fold=True, fit="3")
