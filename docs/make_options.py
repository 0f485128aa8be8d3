"""Write docs/options.md: every argument and option of every verb, read from the command line itself.

python docs/make_options.py [--check]      --check writes nothing and fails if the page is out of date
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import typer
from book.generated import written
from gonio.cli.app import app

PAGE = Path(__file__).parent / "options.md"

HEAD = """# All options of all verbs

Written by `python docs/make_options.py` from the declarations in `gonio.cli`; [the command line](command-line.md)
has the rules behind the names. Every verb has `--help` too.
"""


class Row(NamedTuple):
    """One argument or option of a verb, as text."""

    name: str  # "-o, --output", or the name of an argument
    value: str  # its value; "" for a flag
    default: str
    help: str
    is_option: bool


def main() -> int:
    """Write or check the page; returns the exit code."""
    return written(PAGE, page())


def page() -> str:
    """The whole page, in Markdown."""
    verbs = {name: list(rows(command)) for name, command in commands()}
    return "\n".join([HEAD, *_by_option(verbs), *_by_verb(verbs)]) + "\n"


def commands() -> Iterator[tuple[str, Any]]:
    """The verbs in the order of `gonio --help`, each with its command."""
    group: Any = typer.main.get_command(app)
    context = typer.Context(group)
    for name in group.list_commands(context):
        yield name, group.get_command(context, name)


def rows(command: Any) -> Iterator[Row]:
    """The arguments and options of a command, without those that the help omits."""
    for parameter in command.params:
        if not getattr(parameter, "hidden", False):
            if parameter.param_type_name == "argument":
                yield Row(
                    parameter.metavar or parameter.name.upper(), "", _default(parameter), parameter.help or "", False
                )
            else:
                names = ", ".join(sorted(parameter.opts, key=len)) + "".join(
                    f" / {no}" for no in parameter.secondary_opts
                )
                value = "" if parameter.is_flag else parameter.metavar or parameter.type.name.upper()
                yield Row(names, value, _default(parameter), parameter.help or "", True)


def _default(parameter: Any) -> str:
    if parameter.required:
        return "required"
    value = parameter.default
    if value is None or value is False or value == "":
        return ""
    return "on" if value is True else str(value)


def _by_option(verbs: dict[str, list[Row]]) -> Iterator[str]:
    """Each option once, with the verbs that take it."""
    takers: dict[str, dict[tuple[str, str], list[str]]] = {}
    for verb, found in verbs.items():
        for row in found:
            if row.is_option:
                takers.setdefault(row.name, {}).setdefault((row.value, row.help), []).append(verb)
    yield "## By option\n"
    yield "| option | value | meaning | verbs |"
    yield "|---|---|---|---|"
    for name in sorted(takers, key=lambda name: name.split(", ")[-1].lstrip("-")):
        for (value, text), which in takers[name].items():
            yield f"| `{name}` | {_code(value)} | {_cell(text)} | {', '.join(which)} |"


def _by_verb(verbs: dict[str, list[Row]]) -> Iterator[str]:
    """One table per verb."""
    yield "\n## By verb"
    for verb, found in verbs.items():
        yield f"\n### gonio {verb}\n"
        yield "| | value | default | meaning |"
        yield "|---|---|---|---|"
        for row in found:
            yield f"| {_code(row.name)} | {_code(row.value)} | {_code(row.default)} | {_cell(row.help)} |"


def _code(text: str) -> str:
    return f"`{_cell(text)}`" if text and text != "required" else text


def _cell(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace("|", "\\|").strip()


if __name__ == "__main__":
    sys.exit(main())
