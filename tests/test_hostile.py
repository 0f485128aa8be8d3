"""No input makes Gonio fail: every verb answers hostile files and names with one clear error."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.cli import app
from gonio.cli.verbs.base import Verb

DEEP = 100_000
# What stands before and behind the hostile word; verbs that take none are asked for below.
COMMANDS = {
    "render": "render {} -o o.exr --spp 1 --size 4x4",
    "resume": "resume {}",
    "report": "report {} -o r --spp 1 --size 4x4",
    "study": "study {} --vary alpha=.1 -o s.png --spp 1 --size 4x4",
    "convert": "convert {} c.exr",
    "convert to json": "convert {} c.json",
    "convert to a table": "convert {} c.gonio",
    "info": "info {}",
    "compare": "compare {} {}",
    "measure": "measure {}",
    "fit": "fit {}",
    "fit to a picture": "fit --from {} --scene {}",
    "capture": "capture {}",
    "capture by": "capture a.png --calibration {}",
    "verify": "verify {} --quick --law positivity",
    "emit": "emit {}",
    "bake": "bake {} -o baked",
    "plot": "plot {} -o p.png",
    "compress": "compress {} -o k.gonio",
    "compensation": "compensation {}",
    "explain": "explain {}",
    "models": "models {}",
    "schema": "schema {}",
    "new": "new {} -o new",
    "check": "check {}",
    "check by": "check a.csv {}",
    "adopt": "adopt {}",
    "view": "view {} --export v.html",
    "doctor": "doctor {}",
}
WRITING = [
    "render lambert --spp 1 --size 4x4 -o {}.exr",
    "study lambert --vary albedo=.1 --spp 1 --size 4x4 -o {}.png",
    "plot lambert -o {}.png",
    "emit lambert -o {}",
    "emit lambert --bundle {}",
    "schema scene -o {}",
    "bake ggx --size 4 -o {}",
    "new material velvet -o {}",
    "view lambert --export {}.html",
    "convert a.exr {}.exr",
    "compress a.gonio -o {}.gonio",
]


def _nested(begin: str, end: str, inner: str = "", depth: int = DEEP) -> str:
    return begin * depth + inner + end * depth


def _files() -> dict[str, str | bytes]:
    return {
        "list.json": _nested("[", "]"),
        "object.json": _nested('{"a":', "}", "1"),
        "materials.json": _nested('{"type": "gonio-coat", "base":', "}", '{"type": "lambert"}', 300),
        "elements.xml": '<scene version="3.0.0">' + _nested('<bsdf type="twosided">', "</bsdf>") + "</scene>",
        "elements.mtlx": '<materialx version="1.38">'
        + _nested('<nodegraph name="a">', "</nodegraph>")
        + "</materialx>",
        "lists.gltf": '{"asset": {"version": "2.0"}, "materials": ' + _nested("[", "]") + "}",
        "empty.json": "",
        "empty.xml": "",
        "empty.exr": "",
        "empty.gonio": "",
        "empty.npz": "",
        "zeros.json": bytes(100),
        "latin\udce9.json": b'{"caf\xe9": 1}',
    }


WORDS = [
    "~no-such-user-here/a.json", "~no-such-user-here/a.py:A", "~", "a" * 240, "a" * 240 + ".json",
    "b" * 300, "b" * 5000,
    "/dev/null", ".", "..", "/", "", " ", "-", ":", "(", ")", "a:b:c", "a\nb", "a/../../b", "\udce9", "\udce9.exr",
    "mitsuba:", "mitsuba:nothing", "mitsuba:../a", ".json", ".exr", "{" * 3000, '{"type":' * 3000, "coat(" * 300,
    _nested("coat(", ")", depth=300), "conductor(alpha=" + "[" * 3000, "conductor(alpha=1e400)",
    "conductor(alpha=nan)",
    "conductor(alpha=" + "9" * 5000 + ")", "conductor(alpha=" + "[" * 500 + "]" * 500 + ")",
]  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    path = tmp_path_factory.mktemp("hostile")
    for name, content in _files().items():
        (path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    np.savez(path / "metadata.npz", radiance=np.zeros((2, 2, 3)), metadata=_nested("[", "]"))
    before = os.getcwd()
    os.chdir(path)
    yield path
    os.chdir(before)


def _answer(arguments: list[str], capfd: pytest.CaptureFixture[str]) -> tuple[int, str]:
    with engine.put_back():
        code = app.run(arguments)
    out, err = capfd.readouterr()
    return code, out + err


def test_every_verb_is_asked() -> None:
    assert {command.split()[0] for command in COMMANDS.values()} == set(Verb.family.all())


@pytest.mark.sample(1)
@pytest.mark.parametrize("command", COMMANDS)
def test_no_word_makes_a_verb_fail(command: str, folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = [*_files(), "metadata.npz", *WORDS]
    for word in words:
        code, text = _answer([part.format(word) for part in COMMANDS[command].split()], capfd)
        assert code in (0, 2) and "Gonio failed" not in text and "Traceback" not in text, (word[:80], code, text[-500:])


@pytest.mark.sample(2)
@pytest.mark.parametrize("command", WRITING)
def test_no_name_of_a_file_to_write_makes_a_verb_fail(
    command: str, folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for word in ("~no-such-user-here/a", "b" * 300, "no/such/folder", "list.json/a", "\udce9", "a" * 240):
        code, text = _answer([part.format(word) for part in command.split()], capfd)
        assert code in (0, 2, 3) and "Gonio failed" not in text, (word, code, text[-500:])
    kept = [path.name for path in folder.iterdir() if path.name.startswith("gonio-")]
    assert not kept, kept  # such names are refused before there is anything to keep


def test_a_current_folder_that_was_deleted_is_one_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    for verb in Verb.family.all():
        assert app.run([verb]) == 2
        assert "no current folder" in capsys.readouterr().err
    program = "import gonio as go\ntry: go.render('lambert')\nexcept go.InputError as error: print(error)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert "no current folder" in done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("command", ["schema", "models", "models --json", "--version", "no-such-verb --json"])
@pytest.mark.parametrize("output", ["/dev/full", "&-"])
def test_an_output_that_takes_nothing_is_one_error(command: str, output: str) -> None:
    shell = f"exec {sys.executable} -m gonio.cli {command} >{output}"
    done = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, check=False)
    reason = "No space left on device" if output == "/dev/full" else "Bad file descriptor"
    assert done.returncode == 3 and f"the output cannot be printed: {reason}" in done.stderr
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr


@pytest.mark.slow
def test_a_file_is_never_the_standard_output(tmp_path: Path) -> None:
    shell = f"exec {sys.executable} -m gonio.cli schema -o {tmp_path / 'a.json'} <&- >&- 2>&-"
    subprocess.run(["bash", "-c", shell], check=False)
    assert json.loads((tmp_path / "a.json").read_text())


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_a_name_that_is_no_text_is_printed_as_it_is(tmp_path: Path, encoding: str) -> None:
    name = os.fsencode(tmp_path) + b"/caf\xe9.json"
    command = [os.fsencode(sys.executable), b"-m", b"gonio.cli", b"schema", b"-o", name]
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    done = subprocess.run(command, capture_output=True, env=environment, check=False)
    assert (done.returncode, done.stdout) == (0, name + b"\n")


@pytest.mark.parametrize("vary", ["caf\udce9=1,2", "/scene/shapes/0/caf\udce9=1", "/output/filename=caf\udce9,b"])
def test_a_path_that_is_no_text_is_one_error(vary: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = Path(__file__).parents[1] / "examples" / "phong"
    assert app.run(["study", str(scene), "--vary", vary, "-o", str(tmp_path / "a.png")]) == 2
    assert "is not valid text" in capsys.readouterr().err
