"""Listings of the pages: every command has its verb and its options, every program its names and its arguments."""

from __future__ import annotations

import ast
import difflib
import functools
import importlib
import importlib.util
import inspect
import re
import shlex
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import click
import pytest
import typer.main
from gonio.cli.app import app
from gonio.cli.renamed import FORMER

import pages
from pages import PAGES, ROOT

HAND = [page for page in PAGES if page.stem != "CHANGELOG"]
PROGRAMS = ("gonio", "make", "python", "pytest", "pip")
FOREIGN = {"--requeue"}  # options of other programs: Slurm's
OPTIONAL = {"torch", "jax"}  # packages of the reader's own, which no extra of ours installs
# what every listing may use: the modules as CONTRIBUTING.md calls them, the symbols of docs/conventions.md
USUAL = "import gonio as go\nimport numpy as np\nwo = wi = u = eta = None\n"


def commands(page: Path) -> Iterator[list[str]]:
    """The words of each command that stands in a listing, with its program."""
    for listing in pages.listings(page.read_text(encoding="utf-8")):
        start = r"\$ " if listing.language == "console" else "    "
        if listing.language in ("", "console"):
            for line in re.findall(rf"^{start}(\S.*)$", listing.text, re.MULTILINE):
                for command in line.split("; "):  # a second one in a line
                    if re.match(r"[a-z]{3,} (?!=)", command):
                        yield _words(command)


def _words(command: str) -> list[str]:
    try:
        return shlex.split(command, comments=True)
    except ValueError:  # a line of a program, or of a grammar
        return []


@functools.cache
def _group() -> click.Command:
    return typer.main.get_command(app)


@functools.cache
def _verbs() -> dict[str, set[str]]:
    """The options of every verb, and under "" those of the command itself."""
    group = _group()
    with click.Context(group) as context:
        verbs = {name: group.get_command(context, name) for name in group.list_commands(context)}  # type: ignore[attr-defined]
    options = {name: {o for p in one.params for o in (*p.opts, *p.secondary_opts)} for name, one in verbs.items()}
    for former in FORMER:
        options[former.verb].add(former.old)
    return options | {"": {o for p in group.params for o in p.opts} | {"--help"}}


@functools.cache
def _scripts() -> set[str]:
    """Options of the programs beside the command: benchmarks, writers of pages, the plugin of pytest."""
    files = [path for folder in ("benchmarks", "docs", "tools") for path in (ROOT / folder).rglob("*.py")]
    files.append(ROOT / "src/gonio/pytest_plugin.py")
    return {option for file in files for option in re.findall(r'"(--[a-z-]+)"', file.read_text(encoding="utf-8"))}


@pytest.mark.sample(25)
@pytest.mark.parametrize("page", HAND, ids=pages.name)
def test_every_command_has_its_verb_and_its_options(page: Path) -> None:
    group = _group()
    for program, *words in filter(None, commands(page)):
        if program != "gonio" or not words or "--help" in words or words[0].startswith("-"):
            continue
        with group.make_context("gonio", list(words), resilient_parsing=True) as context:  # type: ignore[attr-defined]
            try:
                name, command, rest = group.resolve_command(context, words)  # type: ignore[attr-defined]
                command.make_context(name, rest, parent=context)
            except click.ClickException as error:
                pytest.fail(f"{page.name}: gonio {' '.join(words)}: {error.format_message()}")


@pytest.mark.parametrize("page", HAND, ids=pages.name)
def test_every_other_command_has_its_program_its_target_and_its_file(page: Path) -> None:
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    written = {one.file for one in pages.listings(page.read_text(encoding="utf-8"))}
    for program, *words in filter(None, commands(page)):
        near = difflib.get_close_matches(program, PROGRAMS, n=1, cutoff=0.75)
        assert not near or program in PROGRAMS, f"{program}: not {near}"
        if program == "make" and re.fullmatch(r"[a-z-]+", "".join(words[:1])):
            assert words[0] in targets, f"make {words[0]}"
        if program == "python" and words and words[0].endswith(".py"):
            assert words[0] in written or (ROOT / words[0]).is_file(), f"python {words[0]}"
        named = [word for word in words if re.match(r"(?:benchmarks|docs|examples)/[\w/.-]+$", word)]
        assert [word for word in named if not (ROOT / word).exists()] == []


@pytest.mark.parametrize("page", HAND, ids=pages.name)
def test_every_command_and_option_in_prose_is_one(page: Path) -> None:
    verbs = _verbs()
    every = set().union(*verbs.values(), _scripts(), FOREIGN)
    for text in re.findall(r"`([^`\n]+)`", pages.without_listings(page.read_text(encoding="utf-8"))):
        words = text.split()
        verb = words[1] if len(words) > 1 and words[0] == "gonio" and re.fullmatch("[a-z]+", words[1]) else ""
        assert verb in verbs, text
        if verb or text.startswith("--"):
            for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", text):
                known = verbs[verb] | verbs[""] if verb else every
                assert option in known, f"{text}: {option}"


# ------------------------------------------------------------------------------------------------------------ Python


def programs(page: Path) -> Iterator[str]:
    """The page's listings in Python, each complete enough to be read."""
    for listing in pages.listings(page.read_text(encoding="utf-8")):
        text = textwrap.dedent(listing.text)
        if listing.language == "python" or (
            not listing.language and re.search(r"^(?:import|from) |\bgo\.\w+\(", text, re.M)
        ):
            yield text


def _parsed(text: str) -> ast.Module | None:
    try:
        return ast.parse(text)
    except SyntaxError:
        return None


@pytest.mark.parametrize("page", [page for page in HAND if any(programs(page))], ids=pages.name)
def test_names_and_arguments_of_programs_are_there(page: Path) -> None:
    fenced = [one.text for one in pages.listings(page.read_text(encoding="utf-8")) if one.language == "python"]
    assert [text for text in fenced if _parsed(textwrap.dedent(text)) is None] == []
    for node in (node for text in programs(page) if (tree := _parsed(text)) for node in ast.walk(tree)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            _imported(node, page)
        elif isinstance(node, ast.Call):
            _called(node)
        elif isinstance(node, ast.Attribute):
            _member(node)


def _imported(node: ast.Import | ast.ImportFrom, page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    here = {file.partition(".")[0] for file in re.findall(r"\b\w+\.py\b", text)}  # which the page has written before
    modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
    for module in modules:
        top = module.partition(".")[0]
        assert top in here or top in OPTIONAL or importlib.util.find_spec(top) is not None, f"import {module}"
        if top == "gonio" and isinstance(node, ast.ImportFrom):
            owner = importlib.import_module(module)
            for alias in node.names:
                assert hasattr(owner, alias.name) or importlib.util.find_spec(f"{module}.{alias.name}"), alias.name


_ABSENT = object()


def _member(node: ast.expr) -> Any:
    """The object that `go.a.b` names, as far as modules and classes tell; _ABSENT where they do not."""
    if isinstance(node, ast.Name):
        return go if node.id == "go" else _ABSENT
    if not isinstance(node, ast.Attribute):
        return _ABSENT
    owner = _member(node.value)
    if owner is go or inspect.isclass(owner):
        assert hasattr(owner, node.attr), f"{ast.unparse(node)}: no such name"
        return getattr(owner, node.attr)
    return _ABSENT


def _called(node: ast.Call) -> None:
    function = _member(node.func)
    if function is _ABSENT or not callable(function):
        return
    parameters = inspect.signature(function).parameters
    if any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
        return
    unknown = [word.arg for word in node.keywords if word.arg and word.arg not in parameters]
    assert unknown == [], f"{ast.unparse(node.func)}: no argument {unknown}"


@pytest.fixture(scope="module")
def undefined(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What ruff says of names that no listing of a page has defined by then; all pages at once."""
    folder = tmp_path_factory.mktemp("listings")
    for page in HAND:
        texts = [text for text in programs(page) if _parsed(text)]
        if texts:
            (folder / f"{pages.name(page).replace('/', '-')}.py").write_text(
                "\n".join([USUAL, *texts]), encoding="utf-8"
            )
    command = [sys.executable, "-m", "ruff", "check", "--isolated", "--select", "F821,F822,F823", "--output-format"]
    return subprocess.run([*command, "concise", folder], capture_output=True, text=True).stdout


def test_every_name_of_a_program_is_defined_on_its_page(undefined: str) -> None:
    assert "All checks passed" in undefined, undefined
