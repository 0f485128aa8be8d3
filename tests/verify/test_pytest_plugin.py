"""The plugin in a foreign project: a fixture, `--gonio`, and nothing that costs others their time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from gonio.pytest_plugin import check

MATTE = '''import os
import gonio as go
from gonio.ops import where, inv_pi

class Matte(go.BSDF):
    """Diffuse, a third of the light."""
    def eval(self, wo, wi, mode="radiance"):
        return go.ops.vec3(*[where((wo.z > 0) & (wi.z > 0), wi.z * inv_pi * 0.3, 0.0)] * 3)
    def pdf(self, wo, wi):
        return where((wo.z > 0) & (wi.z > 0), wi.z * inv_pi, 0.0)
    def sample(self, wo, u, mode="radiance"):
        return self.sample_cosine(wo, u, mode)

class Crash(Matte):
    """Ends the process."""
    def sample(self, wo, u, mode="radiance"):
        os.abort()
'''
TESTS = '''import gonio as go
import pytest

class Own(go.Lambert):
    """Of this file."""

def test_a_name(gonio_verify):
    assert gonio_verify("matte.py:Matte", law=["weight", "isotropy"]).passed

def test_an_object(gonio_verify):
    gonio_verify(Own(0.5), law="isotropy")

def test_a_crash(gonio_verify):
    gonio_verify("matte.py:Crash", law=["weight", "isotropy"])

def test_breaks(gonio_verify):
    gonio_verify("phong", law="reciprocity")
    gonio_verify("matte.py:Crash", law="weight", breaks=["weight"])
    with pytest.raises(pytest.fail.Exception, match="isotropy is declared as violated, but holds"):
        gonio_verify("matte.py:Matte", law="isotropy", breaks=["isotropy"])
'''


def foreign(folder: Path, *arguments: str) -> tuple[int, str]:
    """pytest's exit code and output in a folder of somebody else's."""
    (folder / "matte.py").write_text(MATTE)
    (folder / "test_mine.py").write_text(TESTS)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-rA", "-v", *arguments]
    if not installed():
        command += ["-p", "gonio.pytest_plugin"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env={**os.environ, "COLUMNS": "200"})
    return done.returncode, done.stdout + done.stderr


def installed() -> bool:
    from importlib.metadata import entry_points

    return any(point.value == "gonio.pytest_plugin" for point in entry_points(group="pytest11"))


@pytest.mark.slow
def test_the_fixture_fails_a_test_with_the_report(tmp_path: Path) -> None:
    code, out = foreign(tmp_path)
    assert code == 1 and "3 passed" in out and "1 failed" in out
    assert "FAILED test_mine.py::test_a_crash" in out and "the process crashed: SIGABRT (in sample)" in out


def test_each_target_and_law_is_a_test(tmp_path: Path) -> None:
    code, out = foreign(
        tmp_path, "--gonio", "matte.py:Matte", "--gonio", "matte.py:Crash", "--gonio-quick", "-k", "weight or shader"
    )
    assert code == 1 and "2 failed" in out and "2 passed" in out
    assert "gonio matte.py:Matte::weight PASSED" in out and "gonio matte.py:Crash::weight FAILED" in out


@pytest.mark.slow
def test_a_target_that_does_not_exist_is_an_error_without_a_traceback(tmp_path: Path) -> None:
    code, out = foreign(tmp_path, "--gonio", "matte.py:Mate", "-k", "weight")
    assert code == 1 and "did you mean 'Matte'" in out and "Traceback" not in out


def test_loading_the_plugin_loads_nothing_heavy() -> None:
    code = (
        "import sys, gonio.pytest_plugin; heavy = {'numpy', 'drjit', 'gonio.verify', 'gonio.materials'}; "
        "print(*heavy & {*sys.modules})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_a_breach_that_is_larger_than_said_fails() -> None:
    with pytest.raises(pytest.fail.Exception, match=r"weight is violated \(no figure; at most 1 is allowed\)"):
        check(Fails(), law="weight", breaks={"weight": 1.0}, isolated=False)


def Fails() -> object:
    """A material whose sample raises."""
    import gonio as go

    class Failing(go.Lambert):
        """Raises."""

        def sample(self, wo: object, u: object, mode: str = "radiance") -> object:
            raise ValueError("no")

    return Failing(0.5)
