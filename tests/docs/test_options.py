"""docs/options.md: the table of all options is that of the code, and a name means the same in every verb."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


def test_the_table_of_options_is_up_to_date() -> None:
    done = subprocess.run([sys.executable, ROOT / "docs/make_options.py", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def _rows() -> dict[str, list[Any]]:
    """The rows of the table by verb."""
    spec = importlib.util.spec_from_file_location("make_options", ROOT / "docs/make_options.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return {name: list(module.rows(command)) for name, command in module.commands()}


def test_an_option_takes_the_same_in_every_verb() -> None:
    takes: dict[str, set[tuple[str, str]]] = {}
    for rows in _rows().values():
        for row in rows:
            if row.is_option and "--output" not in row.name:  # FILE or DIR, and each verb's own default
                own = row.name in ("--samples", "--spp", "--sampler") or row.default == "required"
                takes.setdefault(row.name, set()).add((row.value, "" if own else row.default))
    assert {name: found for name, found in takes.items() if len(found) > 1} == {}


def test_output_is_one_option_and_every_verb_has_json() -> None:
    for verb, rows in _rows().items():
        options = [row for row in rows if row.is_option]
        writes = [row.name for row in options if row.name.startswith("-o") or "output" in row.name]
        assert all(name.startswith("-o, --") and "--output" in name for name in writes), verb
        assert verb == "schema" or "--json" in {row.name for row in options}  # a schema is JSON


def test_presets_go_with_parameters() -> None:
    for verb, rows in _rows().items():
        names = {row.name for row in rows}
        assert ("-p, --param" in names) == ("--preset" in names), verb
