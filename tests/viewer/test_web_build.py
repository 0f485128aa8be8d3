"""The script and style that are committed are what `web/` builds, byte for byte."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import pytest

from npm import npm

ROOT = Path(__file__).parents[2]
WEB, STATIC = ROOT / "web", ROOT / "src" / "gonio" / "viewer" / "static"
BUILT = ("app.js", "app.css")


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
