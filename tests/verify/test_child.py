"""BSDFs that loop, crash, print and eat memory: each ends in a report, in which the other laws are judged."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import gonio as go
import psutil
import pytest
from gonio import cli
from gonio.verify import Report, verify
from gonio.verify.isolation import process

HOSTILE = '''
import ctypes, os, sys, threading
import gonio as go
from gonio.ops import where, inv_pi

class Good(go.BSDF):
    """Diffuse, half of the light."""
    def eval(self, wo, wi, mode="radiance"):
        return go.ops.vec3(*[where((wo.z > 0) & (wi.z > 0), wi.z * inv_pi * 0.5, 0.0)] * 3)
    def pdf(self, wo, wi):
        return where((wo.z > 0) & (wi.z > 0), wi.z * inv_pi, 0.0)
    def sample(self, wo, u, mode="radiance"):
        return self.sample_cosine(wo, u, mode)

class LoopsInPython(Good):
    """Never returns, and hears the alarm."""
    def sample(self, wo, u, mode="radiance"):
        while True: pass

class IsDeaf(Good):
    """Never returns, and does not hear the alarm."""
    def sample(self, wo, u, mode="radiance"):
        while True:
            try:
                while True: pass
            except TimeoutError: pass

class LoopsInAKernel(Good):
    """Never returns from compiled code."""
    def sample(self, wo, u, mode="radiance"):
        import drjit as dr
        x, = dr.while_loop((u.x,), lambda x: x < 2.0, lambda x: (x * 0.5,))
        s = super().sample(wo, u, mode)
        return s._replace(pdf=s.pdf + x)

class Allocates(Good):
    """Takes all memory."""
    def sample(self, wo, u, mode="radiance"):
        kept = []
        while True:
            kept.append(bytearray(os.urandom(1 << 10)) * (8 << 10))

class Aborts(Good):
    """Crashes the process."""
    def sample(self, wo, u, mode="radiance"):
        print("these are my last words")
        os.abort()

class Leaves(Good):
    """Ends the process as if all were well."""
    def sample(self, wo, u, mode="radiance"):
        os._exit(0)

class Exits(Good):
    """Raises what is no Exception."""
    def sample(self, wo, u, mode="radiance"):
        raise SystemExit(0)

class KillsItsThread(Good):
    """Interrupts the thread that calls it."""
    def sample(self, wo, u, mode="radiance"):
        me = ctypes.c_ulong(threading.get_ident())
        ctypes.pythonapi.PyThreadState_SetAsyncExc(me, ctypes.py_object(KeyboardInterrupt))
        for _ in range(10_000): pass
        return super().sample(wo, u, mode)

class RaisesAside(Good):
    """Fails where no method is called."""
    @property
    def transmits(self):
        raise ValueError("which side?")

class Prints(Good):
    """Has much to say."""
    def sample(self, wo, u, mode="radiance"):
        for line in range(10_000): print(line)
        print("and in red", file=sys.stderr)
        return super().sample(wo, u, mode)

class Changes(Good):
    """Another answer each time."""
    calls = 0
    def eval(self, wo, wi, mode="radiance"):
        Changes.calls += 1
        return super().eval(wo, wi, mode) * (1.0 + 0.01 * (Changes.calls % 2))
'''


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("hostile") / "hostile.py"
    path.write_text(HOSTILE)
    return path


def judged(file: Path, name: str, **more: object) -> Report:
    return verify(f"{file}:{name}", quick=True, law=["reciprocity", "weight", "isotropy"], **more)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("LoopsInPython", "not finished after 6 s"),
        pytest.param("IsDeaf", "not finished after 6 s", marks=pytest.mark.slow),
        ("LoopsInAKernel", "not finished after 6 s"),
        ("Allocates", "more than 1 GB of memory"),
        ("Aborts", "the process crashed: SIGABRT"),
        ("Leaves", "the process exited with code 0"),
        ("Exits", "SystemExit in sample"),
        ("KillsItsThread", "KeyboardInterrupt in sample"),
    ],
)
def test_what_brings_the_process_down_fails_the_laws_that_need_it(
    file: Path, name: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)  # or words are never lost
    # the laws that hold must be done by then on a slow machine, and so must what takes memory before it takes time
    report = judged(file, name, limit=6.0 if "not finished" in words else 60.0, memory=1.0)
    statuses = {verdict.law: verdict.status for verdict in report.cards[0].verdicts}
    assert statuses == {"reciprocity": "pass", "weight": "fail", "isotropy": "pass"}
    assert words in report["weight"].why[0]
    assert name != "Aborts" or "these are my last words" in report.cards[0].notes[0]


def test_what_is_printed_is_counted_and_does_not_disturb_json(file: Path) -> None:
    command = [sys.executable, "-m", "gonio.cli", "verify", f"{file}:Prints", "--quick", "--law", "weight", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    (card,) = json.loads(done.stdout)["cards"]
    assert card["passed"] and done.stderr == ""
    assert "it printed" in card["notes"][0] and int(card["notes"][0].split()[2]) > 10_000


@pytest.mark.slow
def test_an_answer_that_changes_is_a_failure_that_says_so(file: Path) -> None:
    report = verify(f"{file}:Changes", quick=True, law="calls")
    assert "a repeated call: " in report["calls"].why[0] and "stochastic = True" in report["calls"].why[0]


@pytest.mark.slow
def test_a_fact_that_raises_fails_the_laws_that_ask_for_it(file: Path) -> None:
    report = judged(file, "RaisesAside")
    assert "ValueError: which side? (hostile.py:" in report["reciprocity"].why[0]


@pytest.mark.sample(1)
@pytest.mark.parametrize(("line", "words"), [("os._exit(3)", "exited with code 3"), ("raise SystemExit", "SystemExit")])
def test_a_file_that_cannot_even_be_loaded_is_bad_input(tmp_path: Path, line: str, words: str) -> None:
    (tmp_path / "bad.py").write_text(f"import os\n{line}\n")
    with pytest.raises(go.InputError, match=words):
        verify(f"{tmp_path}/bad.py:Good", quick=True, law="weight")


def plain(report: Report) -> dict[str, object]:
    """The report without what time it took."""

    def without(value: object) -> object:
        if isinstance(value, dict):
            return {name: without(inner) for name, inner in value.items() if name != "seconds"}
        return [without(inner) for inner in value] if isinstance(value, list) else value

    found = without(report.as_dict())
    assert isinstance(found, dict)
    return found


@pytest.mark.slow
def test_the_report_is_the_same_in_one_process_in_another_and_in_several(file: Path) -> None:
    names = ["phong", "lambert", f"{file}:Good"]
    laws = ["energy", "weight", "isotropy"]
    here = plain(verify(names, quick=True, law=laws, isolated=False))
    assert here == plain(verify(names, quick=True, law=laws))
    assert here == plain(verify(names, quick=True, law=laws, workers=3))


@pytest.mark.slow
def test_a_crash_in_one_setting_leaves_the_others_as_they_are(file: Path) -> None:
    report = verify([f"{file}:Good", f"{file}:Aborts", "lambert"], quick=True, law=["weight", "shader"], workers=2)
    assert [card.passed for card in report.cards] == [True, False, True]


@pytest.mark.slow
def test_a_material_that_python_holds_can_be_judged_apart() -> None:
    gold = go.Conductor.preset("Au", alpha=0.3)
    assert plain(verify(gold, quick=True, law="weight", isolated=True)) == plain(verify(gold, quick=True, law="weight"))

    class Local(go.Lambert):
        """Of this function alone."""

    with pytest.raises(go.InputError, match="cannot be sent to another process"):
        verify(Local(0.5), quick=True, law="weight", isolated=True)


@pytest.mark.slow
def test_the_order_of_sets_does_not_matter(file: Path) -> None:
    command = [sys.executable, "-m", "gonio.cli", "verify", f"{file}:Good", "--quick", "--law", "pdf", "--json"]
    found = []
    for seed in ("1", "2"):
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONHASHSEED": seed})
        found.append(
            [line for line in json.dumps(json.loads(done.stdout), indent=1).split("\n") if "seconds" not in line]
        )
    assert found[0] == found[1]


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's")
def test_ctrl_c_ends_both_processes(file: Path) -> None:
    command = [sys.executable, "-m", "gonio.cli", "verify", f"{file}:IsDeaf", "--quick", "--law", "weight"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    end = time.monotonic() + 60.0
    while children.exists() and not children.read_text().split() and time.monotonic() < end:
        time.sleep(0.05)
    child = children.read_text().split() if children.exists() else []
    assert child or not children.exists()  # elsewhere than on Linux nothing tells of children
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130 and "ended by Ctrl-C" in err
    end = time.monotonic() + 20.0
    while any(Path(f"/proc/{one}").exists() for one in child):
        assert time.monotonic() < end, "the child is still there"
        time.sleep(0.05)


def test_the_parent_starts_the_child_before_it_loads_anything() -> None:
    heavy = "{'numpy', 'drjit', 'mitsuba', 'gonio.material', 'rich'}"
    code = f"import sys, gonio.verify.isolation.child; print(*{heavy} & {{*sys.modules}})"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == ""


STUCK = """
import threading, time
from gonio.verify.isolation import watch
watch.GRACE = 0.2
def stuck(limit):
    with watch.limited(f"law of {limit} s", limit):
        time.sleep(60)
with watch.limited("law that ends", 0.4):
    threading.Thread(target=stuck, args=[9.0]).start()  # the later deadline is set first
threading.Thread(target=stuck, args=[0.6]).start()
"""


def test_a_process_without_a_parent_ends_when_a_kernel_does_not() -> None:
    """No signal reaches a loop in a kernel, as none reaches a thread that sleeps."""
    done = subprocess.run([sys.executable, "-c", STUCK], capture_output=True, text=True, timeout=30)
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("error: law of 0.6 s: not finished after 0.6 s")


def test_no_target_is_an_empty_report() -> None:
    assert verify([], quick=True).passed


def test_a_process_that_got_no_task_ends_with_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    """Otherwise the next command of this program would run in the folder of the first."""
    before = set(psutil.Process().children())
    with pytest.raises(SystemExit) as ended:
        cli.main(["verify"])
    assert ended.value.code == 2 and "Missing argument" in capsys.readouterr().err
    assert set(psutil.Process().children()) == before and not process._ahead
