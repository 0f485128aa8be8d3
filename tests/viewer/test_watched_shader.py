"""A shader on the page is read again when it, its adapter, an include or a texture is saved."""

import sys
import time
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import GonioError
from gonio.viewer import stage
from gonio.viewer.watch import Code, Watch

SHADER = """#include <common>
uniform float rough;
uniform sampler2D table;
vec3 brdf(vec3 light, vec3 view, vec3 normal) {
    return vec3(texture(table, vec2(rough)).r * SCALE);
}
"""
ADAPTER = 'includes = ["."]\n[textures.table]\nfile = "table.npy"\n[parameters.rough]\ndefault = {default}\n'
CHANGES = {
    "my.glsl": SHADER.replace("* SCALE", "* 3.0"),
    "common.glsl": "#define SCALE 3.0\n",
    "table.npy": np.full((2, 2, 1), 0.75),
}
UP = np.array([[0.0, 0.0, 1.0]])


def save(path: Path, content: str | np.ndarray) -> None:
    if isinstance(content, str):
        path.write_text(content)
    else:
        np.save(path, content)


@pytest.fixture
def shader(tmp_path: Path) -> Path:
    save(tmp_path / "my.glsl", SHADER)
    save(tmp_path / "common.glsl", "#define SCALE 1.0\n")
    save(tmp_path / "table.npy", np.full((2, 2, 1), 0.25))
    save(tmp_path / "my.glsl.toml", ADAPTER.format(default=0.5))
    return tmp_path / "my.glsl"


@pytest.mark.parametrize("name", CHANGES)
def test_material_is_made_again_from_what_was_saved(shader: Path, name: str) -> None:
    assert go.Shader(shader).eval(UP, UP)[0, 0] == pytest.approx(0.25)
    save(shader.parent / name, CHANGES[name])
    assert go.Shader(shader).eval(UP, UP)[0, 0] == pytest.approx(0.75)


def test_page_shows_the_saved_include_and_the_compilers_message(shader: Path) -> None:
    what = stage.of_targets([f"{shader}"])
    assert what.code is not None
    shown: list[float | str] = []

    def value(made: stage.Stage) -> None:
        shown.append(float(made.materials["m0"].bsdf.eval(UP, UP)[0, 0]))

    def complain(error: GonioError) -> None:
        shown.append(f"{error.where}: {error.what}")

    watch = Watch(what.code, value, complain)
    watch.start()
    try:
        for content in (CHANGES["common.glsl"], "#define SCALE )\n", "#define SCALE 2.0\n"):
            before = len(shown)
            save(shader.parent / "common.glsl", content)
            end = time.monotonic() + 30.0
            while len(shown) == before and time.monotonic() < end:
                time.sleep(0.02)
    finally:
        watch.stop()
    assert shown[0] == pytest.approx(0.75) and shown[2] == pytest.approx(0.5)
    assert str(shown[1]).startswith("my.glsl:5: ") and "syntax error" in str(shown[1])


def test_folder_of_a_shader_is_no_place_to_import_from(shader: Path) -> None:
    folder = str(shader.parent.resolve())
    assert folder not in Code([], lambda: list(sys.path), [shader]).run()
    assert folder in Code([shader.with_suffix(".py")], lambda: list(sys.path)).run()
