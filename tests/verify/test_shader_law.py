"""The law `shader`: judged without a browser, for users' materials too, and it fails where the text differs."""

import dataclasses
from typing import Any

import gonio as go
import pytest
from gonio.errors import MachineError
from gonio.shaders import bundle
from gonio.verify import page, verify
from gonio.verify.ci import github, junit


class Own(go.BSDF):
    """A user's material."""

    albedo: go.Spectrum = go.spectrum(0.5, "reflectance", high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return go.ops.where((wo.z > 0) & (wi.z > 0), self.albedo * wi.z * go.ops.sqrt(wo.z) / 3.0, 0.0)


@pytest.mark.slow
def test_a_users_material_is_judged_without_a_browser() -> None:
    found = verify(Own(), quick=True, law="shader")["shader"]
    assert found.status == "pass"


def test_text_that_differs_fails_with_language_function_and_values(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(material: go.BSDF, language: str) -> Any:
        made = bundle(material, language)
        return dataclasses.replace(made, text=made.text.replace("0.31830987", "0.3183"))

    monkeypatch.setattr("gonio.shaders.bundle", wrong)
    found = verify(go.Lambert(0.5), quick=True, law="shader", isolated=False)["shader"]
    assert found.status == "fail" and "sl, " in found.worst and " instead of " in found.worst


def test_a_material_without_shader_code_is_not_judged() -> None:
    found = verify(go.RandomWalk(go.Conductor(alpha=0.3)), quick=True, law="shader")["shader"]
    assert found.status == "does not apply" and "random walks" in found.why[0]


def test_without_a_compiler_the_law_is_not_tried_and_does_not_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> str:
        raise MachineError("the shader compiler glslang is not installed", "shader", "install it")

    monkeypatch.setattr("gonio.spirv.compiler.compiler", missing)
    report = verify(go.Lambert(0.5), quick=True, law="shader", isolated=False)
    found = report["shader"]
    assert found.status == "not tried" and "not installed" in found.why[0] and found.figure is not None
    assert "NOT TRIED" in str(report) and "shader holds" not in str(report)
    assert report.untried == ["shader"]
    assert 'skipped="1"' in junit.text(report) and "::notice" in github.text(report)
    assert "All laws hold" not in page.page(report)


def test_text_that_differs_fails_without_a_compiler_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> str:
        raise MachineError("the shader compiler glslang is not installed", "shader", "install it")

    def wrong(material: go.BSDF, language: str) -> Any:
        made = bundle(material, language)
        return dataclasses.replace(made, text=made.text.replace("0.31830987", "0.3183"))

    monkeypatch.setattr("gonio.spirv.compiler.compiler", missing)
    monkeypatch.setattr("gonio.shaders.bundle", wrong)
    found = verify(go.Lambert(0.5), quick=True, law="shader", isolated=False)["shader"]
    assert found.status == "fail" and found.worst.startswith("wgsl")
