"""The tutorial's blocks and commands do what the page says; they run in the order in which they stand there."""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import gonio as go
import pytest
from gonio import cli

PAGE = Path(__file__).parents[2] / "docs/your-own-material.md"
BLOCK = re.compile(r"^```(\w+) ?([\w.]*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
EXIT = re.compile(r"exit code (\d)")


def _with_methods(file: str, methods: str) -> str:
    """The file, its one class having these members, in the place of those of the same name or at its end."""
    members = {_name(node): node for node in ast.parse(textwrap.dedent(methods)).body}
    lines = file.splitlines()
    (cls,) = (node for node in ast.parse(file).body if isinstance(node, ast.ClassDef))
    for node in reversed(cls.body):
        if _name(node) in members:
            del lines[
                min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", []))]) - 1 : node.end_lineno
            ]
    return "\n".join(lines) + "\n\n" + methods


def _name(node: ast.stmt) -> str:
    return str(node.targets[0].id) if isinstance(node, ast.Assign) else str(getattr(node, "name", ""))  # type: ignore[attr-defined]


def _commands(console: str) -> Iterator[tuple[str, list[str]]]:
    """Each command with the lines that stand below it."""
    for part in re.split(r"^\$ ", console, flags=re.MULTILINE)[1:]:
        command, *shown = part.strip().splitlines()
        yield command, shown


def _run(command: str, shown: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """Run a command in the current folder: `gonio` in this process, by what the command itself calls, since the loading
    of everything that it needs, twenty times, would take longer than the work."""
    program, *arguments = shlex.split(command)
    if program == "gonio":
        with pytest.raises(SystemExit) as caught:
            cli.main(arguments)
        told, code = capsys.readouterr(), int(caught.value.code or 0)
        output = told.out + told.err
    else:
        assert program == "python"
        done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True)
        output, code = done.stdout + done.stderr, done.returncode
    expected = next((int(found[1]) for line in shown if (found := EXIT.fullmatch(line))), 0)
    assert code == expected, f"{command}\n{output}"
    for line in shown:
        if not EXIT.fullmatch(line):
            assert "".join(line.split()) in "".join(output.split()), f"{command}: no '{line}' in\n{output}"


# every law once more, of another width and by pytest, which has tests of its own (tests/verify/test_pytest_plugin.py)
AGAIN = {"gonio verify ward.py:Ward --quick -p alpha=.05,.3", "python -m pytest -q test_ward.py"}


@pytest.fixture(autouse=True)
def members() -> Iterator[None]:
    """What the commands bring into this process goes with the test."""
    families = (go.BSDF.family, go.NDF.family, go.Masking.family)
    before = [set(family.all()) for family in families]
    yield
    for family, known in zip(families, before, strict=True):
        for name in set(family.all()) - known:
            family.remove(name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "left_out",
    [pytest.param(AGAIN, id="what judges once"), pytest.param(set(), id="all", marks=pytest.mark.slow)],
)
def test_the_tutorial_does_what_it_says(
    left_out: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("GONIO_CACHE", str(tmp_path / "cache"))
    found: list[str] = []
    for language, name, text in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
        if language == "console":
            for command, shown in _commands(text):
                found.append(command)
                if command not in left_out:
                    _run(command, shown, capsys)
        elif name == "Ward":
            file = tmp_path / "ward.py"
            file.write_text(_with_methods(file.read_text(encoding="utf-8"), text), encoding="utf-8")
        else:
            (tmp_path / name).write_text(text, encoding="utf-8")
    assert len(found) > 15 and left_out <= set(found)
