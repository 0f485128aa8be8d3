"""Listings of the pages: every command has its verb and its options."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
import typer.main
from gonio.cli.app import app

ROOT = Path(__file__).parents[2]
PAGES = [*(ROOT / "docs").glob("*.md"), *(ROOT / "docs/course").glob("*.md"), *(ROOT / "examples").glob("*/README.md")]


def commands(page: Path) -> Iterator[list[str]]:
    """The words of each command that stands in a listing, after `gonio`."""
    for line in page.read_text(encoding="utf-8").splitlines():
        if re.match(r"    gonio [a-z]", line):
            for command in line.split("; gonio "):  # a second one in a line
                yield shlex.split(command.removeprefix("    gonio "), comments=True)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}-{page.stem}")
def test_every_command_has_its_verb_and_its_options(page: Path) -> None:
    group = typer.main.get_command(app)
    for words in commands(page):
        if not words or "--help" in words:
            continue
        with group.make_context("gonio", list(words), resilient_parsing=True) as context:  # type: ignore[attr-defined]
            name, command, rest = group.resolve_command(context, words)  # type: ignore[attr-defined]
            try:
                command.make_context(name, rest, parent=context)
            except click.ClickException as error:
                pytest.fail(f"{page.name}: gonio {' '.join(words)}: {error.format_message()}")
