"""The page about shaders in CI: its shader, its commands, and the steps of its workflow, run as they are printed."""

import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/shaders-in-ci.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"^```\w+ (\S+)\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE))
STEPS = re.findall(r"^\s*- run: (.*)$", FILES[".github/workflows/brdf.yml"], re.MULTILINE)
INSTALL, CHECK = STEPS


def run(command: str, folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([sysconfig.get_path("scripts"), str(Path(sys.executable).parent), os.environ["PATH"]])
    plain = {name: value for name, value in os.environ.items() if not name.startswith("GITHUB_")}
    return subprocess.run(
        ["bash", "-ec", command], cwd=folder, capture_output=True, text=True, env={**plain, "PATH": path, **variables}
    )


def test_workflow_installs_an_extra_that_exists() -> None:
    (extra,) = re.fullmatch(r'pip install "gonio\[(\w+)\]"', INSTALL).groups()
    assert re.search(rf"^{extra} = \[", (ROOT / "pyproject.toml").read_text(), re.MULTILINE)


@pytest.mark.slow
def test_workflow_passes_what_is_known_and_fails_on_a_new_mistake(tmp_path: Path) -> None:
    shader = tmp_path / "shaders/pbr.wgsl"
    shader.parent.mkdir()
    shader.write_text(FILES["shaders/pbr.wgsl"])
    (stored,) = re.findall(r"^    (gonio .*--write-baseline.*)$", PAGE, re.MULTILINE)
    assert run(stored, tmp_path).returncode == 0

    passed = run(CHECK, tmp_path, GITHUB_ACTIONS="true", GITHUB_WORKSPACE=str(tmp_path))
    assert passed.returncode == 0, passed.stdout + passed.stderr
    assert "::error" not in passed.stdout and (tmp_path / "report/report.html").is_file()

    shader.write_text(FILES["shaders/pbr.wgsl"].replace("dot(N, L), dot(N, V));", "dot(N, L), 1.0);"))
    failed = run(CHECK, tmp_path, GITHUB_ACTIONS="true", GITHUB_WORKSPACE=str(tmp_path))
    assert failed.returncode == 1, failed.stdout + failed.stderr
    line = (
        shader.read_text().splitlines().index(next(one for one in shader.read_text().splitlines() if "fn brdf" in one))
    )
    assert f"::error file=shaders/pbr.wgsl,line={line + 1},title=shaders/pbr.wgsl%3A reciprocity" in failed.stdout
    cases = {one.get("name"): one for one in ElementTree.parse(tmp_path / "laws.xml").iter("testcase")}
    assert cases["reciprocity"].find("failure") is not None and cases["linearity"].find("failure") is None

    shader.write_text("fn brdf(L: vec3f, V: vec3f) -> vec3f { return missing; }")
    assert run(CHECK, tmp_path).returncode == 2
