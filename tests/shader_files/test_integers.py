"""Integer uniforms: whole numbers that shape the code, in adapters, scenes, texts and `verify`'s box."""

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.catalog import notation
from gonio.errors import InputError
from gonio.scene.materials import Material
from gonio.spirv.compiler import compiler
from gonio.verify import box
from gonio.verify.effort import EFFORTS
from gonio.verify.subject import Subject
from pydantic import TypeAdapter, ValidationError

W = np.array([[0.0, 0.0, 1.0]])
MODES = """uniform uint mode;
vec3 brdf(vec3 L, vec3 V, vec3 N) {
    switch (mode) { case 0u: return vec3(0.1); case 1u: return vec3(0.2); }
    return vec3(0.3);
}"""
STEPS = """uniform int steps = 4;
vec3 brdf(vec3 L, vec3 V, vec3 N) { float s = 0.0; for (int i = 0; i < steps; i++) s += 0.01 * L.z; return vec3(s); }
"""


@pytest.fixture(autouse=True)
def _needs_compiler() -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")


def written(folder: Path, text: str, adapter: str = "") -> str:
    (folder / "own.glsl").write_text(text)
    (folder / "own.glsl.toml").write_text(adapter)
    return str(folder / "own.glsl")


def value(material: go.BSDF) -> float:
    return float(material.eval(W, W, precision="float64")[0, 0])


def test_integer_uniform_without_a_value_is_0_and_whole(tmp_path: Path) -> None:
    file = written(tmp_path, MODES)
    assert value(go.Shader(file)) == pytest.approx(0.1)
    assert [value(go.Shader(file, mode=mode)) for mode in (1, "1", 2)] == pytest.approx([0.2, 0.2, 0.3])
    for mode in (0.5, -1, True, "none"):
        with pytest.raises(InputError, match="a whole number >= 0"):
            go.Shader(file, mode=mode)


def test_integer_uniform_bounds_a_loop(tmp_path: Path) -> None:
    file = written(tmp_path, STEPS)
    assert value(go.Shader(file)) == pytest.approx(0.04)
    assert value(go.Shader(file, steps=100)) == pytest.approx(1.0)
    file = written(tmp_path, STEPS, "[parameters.steps]\ndefault = 2\nlow = 1\nhigh = 8\n")
    assert value(go.Shader(file)) == pytest.approx(0.02)
    with pytest.raises(InputError, match="whole number >= 1 <= 8"):
        go.Shader(file, steps=9)
    with pytest.raises(InputError, match=r"2\.5 given"):
        go.Shader(written(tmp_path, STEPS, "[parameters.steps]\ndefault = 2.5\n"))


def test_verify_tries_integers(tmp_path: Path) -> None:
    subject = Subject(go.Shader(written(tmp_path, MODES)), "own.glsl")
    tried = box.places(subject, EFFORTS["quick"], 1)
    assert {place.values["mode"] for place in tried} >= {"1", "2"}


def test_integers_survive_texts_and_scenes(tmp_path: Path) -> None:
    file = written(tmp_path, MODES)
    made = go.Shader(file, mode=1)
    assert value(notation.from_json(notation.as_json(made))) == pytest.approx(0.2)
    assert value(notation.named(f"{file}(mode=1)")[0]) == pytest.approx(0.2)
    adapter, context = TypeAdapter(Material), {"folder": tmp_path}
    for mode in (1, "1"):
        described = {"type": "shader", "file": "own.glsl", "mode": mode}
        assert value(adapter.validate_python(described, context=context).instance()) == pytest.approx(0.2)
    with pytest.raises(ValidationError, match="a whole number >= 0"):
        adapter.validate_python({"type": "shader", "file": "own.glsl", "mode": 0.5}, context=context)
