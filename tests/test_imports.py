"""The import graph: no two files import each other, not even for types or inside a function; old paths still work."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

SRC = Path(__file__).parents[1] / "src"


def modules() -> dict[str, Path]:
    """Every module of the package by its dotted name."""
    names = {}
    for path in SRC.rglob("*.py"):
        parts = path.relative_to(SRC).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def imported(name: str, path: Path, known: dict[str, Path]) -> set[str]:
    """The modules that one imports, wherever in the file the import stands."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    targets = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*start, *([node.module] if node.module else [])])
            targets |= {full if (full := f"{module}.{alias.name}") in known else module for alias in node.names}
        elif isinstance(node, ast.Import):
            targets |= {alias.name for alias in node.names}
    return (targets & known.keys()) - {name, "gonio"}  # the public list imports everything, for type checkers


@pytest.mark.slow
def test_no_two_files_import_each_other() -> None:
    known = modules()
    graph = {name: imported(name, path, known) for name, path in known.items() if name != "gonio"}
    while True:  # what imports none of the rest, or is imported by none of it, is in no cycle
        needed = set().union(*graph.values())
        outside = [name for name, targets in graph.items() if not targets & graph.keys() or name not in needed]
        if not outside:
            break
        for name in outside:
            del graph[name]
    assert not graph, f"cycles among {sorted(graph)}"


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("from gonio.models import BSDF", "gonio.material"),
        ("from gonio.models.conductor import Conductor", "gonio.materials.microfacet.conductor"),
        ("from gonio.emit.languages import languages", "gonio.shaders.languages"),
        ("from gonio.render.integrators import Integrator", "gonio.transport.integrators"),
        ("import gonio.energy.materials.kulla_conty", "gonio.materials.compensated.kulla_conty"),
    ],
)
def test_an_import_path_of_the_former_layout_works_and_names_the_new_one(old: str, new: str) -> None:
    code = f"import gonio as go; {old}; assert callable(go.models) and callable(go.render)"
    ran = subprocess.run([sys.executable, "-W", "always", "-c", code], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert f"is now {new}" in ran.stderr


@pytest.mark.slow
def test_a_package_does_not_hide_the_function_of_its_name() -> None:
    code = "import gonio as go, gonio.render.finish, gonio.measure; print(callable(go.render), callable(go.measure))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ran.stdout.split() == ["True", "True"], ran.stderr
