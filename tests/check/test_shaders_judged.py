"""Shaders are judged as classes are."""

from __future__ import annotations

from pathlib import Path

import pytest
from gonio import cli

BRDF = """
uniform float albedo;
vec3 BRDF(vec3 L, vec3 V, vec3 N) {
    return vec3(albedo / FACTOR);
}
"""
ADAPTER = 'function = "BRDF"\narguments = ["light", "view", "normal"]\n[parameters.albedo]\ndefault = 0.5\n'


def test_a_shader_is_judged_by_itself_or_by_its_adapter(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.glsl"
    file.write_text(BRDF.replace("FACTOR", "3.14159265"))
    assert cli.run(["check", str(file), "lambert", "-p", "albedo=0.4"]) == 0, capsys.readouterr()
    (tmp_path / "mine.glsl.toml").write_text(ADAPTER)
    assert cli.run(["check", f"{file}.toml", "--against", "lambert(albedo=0.5)"]) == 0
    file.write_text(BRDF.replace("FACTOR", "1.0"))
    assert cli.run(["check", str(file), "--against", "lambert(albedo=0.5)"]) == 1
    assert "pi" in capsys.readouterr().out
    assert cli.run(["check", str(file), "lambert", "--against", "lambert"]) == 2
    assert "name the model once" in capsys.readouterr().err


@pytest.mark.slow
def test_the_function_of_a_shader_may_be_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.glsl"
    other = BRDF.replace("BRDF(", "paint(").replace("FACTOR", "3.14159265").replace("uniform float albedo;", "")
    file.write_text(BRDF.replace("FACTOR", "1.0") + other)
    against = ["--against", "lambert(albedo=0.4)"]
    assert cli.run(["check", str(file), *against, "-p", "albedo=0.4"]) == 1
    assert cli.run(["check", f"{file}(albedo=0.4)", *against, "--function", "paint"]) == 0, capsys.readouterr()
    assert cli.run(["check", str(file), *against, "--function", "none"]) == 2
    assert "no function 'none'" in capsys.readouterr().err
    assert cli.run(["check", "lambert", "lambert", "--function", "paint"]) == 2


def test_what_the_adapter_says_of_another_function_does_not_hold(tmp_path: Path) -> None:
    file = tmp_path / "mine.glsl"
    other = BRDF.replace("BRDF(", "paint(").replace("FACTOR", "3.14159265").replace("uniform float albedo;", "")
    file.write_text(BRDF.replace("FACTOR", "1.0") + other)
    (tmp_path / "mine.glsl.toml").write_text("cosine = true\n" + ADAPTER)
    assert cli.run(["check", str(file), "--against", "lambert(albedo=0.5)", "--function", "paint"]) == 0
