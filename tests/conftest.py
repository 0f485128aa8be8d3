"""What every test shares: the folder of helpers on the path, a scene, and precision put back after each test."""

from __future__ import annotations

import contextlib
import gc
import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))  # `book`
sys.path.insert(0, str(Path(__file__).parent))  # `sphere`, `materials`

import gonio as go
from gonio import ops
from gonio.bridge import engine

from ball_scene import SCENE

# A shell's background and nohup hand ignored signals down, and who waits for a Ctrl-C here would wait for ever.
for name, handler in (("SIGINT", signal.default_int_handler), ("SIGHUP", signal.SIG_DFL)):
    number = getattr(signal, name, None)
    if number is not None and signal.getsignal(number) == signal.SIG_IGN:
        signal.signal(number, handler)

if os.environ.get("GONIO_TEST_DEVICE") == "cuda":  # `make test-gpu`: what would take the CPU takes the GPU
    _choose = engine.variant_for
    engine.variant_for = lambda device="cpu", spectral=False: _choose("cuda" if device == "cpu" else device, spectral)

LONGEST = ("viewer", "verify", "shaders", "measure", "energy", "instruments", "render")
BROWSERS = {"chrome", "chromium", "page", "live", "homework_page"}  # fixtures that start one


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--cases N`: at most N cases of each test, evenly spaced; `make check` takes 1."""
    parser.addoption("--cases", type=int, default=0, metavar="N", help="run at most N cases of each test")


@pytest.hookimpl(tryfirst=True)  # before `-m` selects
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark tests by what they need and, of families of cases, those beyond the sample `slow`.

    shared   every test that asks for the folder of data: `-m shared` selects these and only these
    browser  every test that starts one
    slow     cases beyond `sample(n)` or `--cases n`
    """
    # workers take a file at a time: the folders with the longest ones first, lest one of these is the last
    items.sort(key=lambda item: LONGEST.index(name) if (name := item.path.parent.name) in LONGEST else len(LONGEST))
    families: dict[str, list[pytest.Item]] = {}
    for item in items:
        parameters = getattr(item, "callspec", None)  # which may be called as a fixture is: `page`
        fixtures = {*getattr(item, "fixturenames", ())} - set(parameters.params if parameters else ())
        if "shared" in fixtures:
            item.add_marker("shared")
        if fixtures & BROWSERS:
            item.add_marker("browser")
        if not item.get_closest_marker("slow"):
            families.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in families.values():
        sample = cases[0].get_closest_marker("sample")
        limits = [sample.args[0] if sample else len(cases), config.getoption("--cases") or len(cases)]
        for item in set(cases) - set(_spread(cases, min(limits))):
            item.add_marker("slow")


def pytest_collection_finish() -> None:
    """Keep the garbage collector from looking at tests and modules, which all live to the end: a tenth of the time."""
    gc.collect()
    gc.freeze()


def _spread(cases: list[pytest.Item], count: int) -> list[pytest.Item]:
    """`count` of the cases, evenly spaced, the first and the last among them."""
    if count >= len(cases):
        return cases
    return [cases[round(k * (len(cases) - 1) / max(count - 1, 1))] for k in range(count)]


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of data that GONIO_SHARED names; where it names none, tests that ask for it are skipped."""
    if not os.environ.get("GONIO_SHARED"):
        pytest.skip("GONIO_SHARED names no folder of data")
    folder = Path(os.environ["GONIO_SHARED"]).resolve()
    if not folder.is_dir():
        pytest.fail(f"GONIO_SHARED names {str(folder)!r}, which is no folder")
    return folder


CACHE = Path(__file__).parents[1] / ".cache"
DAYS_KEPT = 3


@pytest.fixture(scope="session", autouse=True)
def cache_folder() -> Iterator[Path]:
    """One folder of tables for all runs and their workers, apart from the user's.

    A table's name contains the hash of the code that made it, so a table of other code is never read.
    """
    CACHE.mkdir(exist_ok=True)
    oldest = time.time() - DAYS_KEPT * 86400
    for file in CACHE.iterdir():
        with contextlib.suppress(OSError):  # another worker was first
            if file.is_file() and file.stat().st_mtime < oldest:
                file.unlink()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("GONIO_CACHE", str(CACHE))
        yield CACHE


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scene's folder; the current folder is an empty one beside it."""
    folder = tmp_path / "ball"
    folder.mkdir()
    (folder / "scene.json").write_text(json.dumps(SCENE))
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return folder


@pytest.fixture(autouse=True)
def as_found() -> Iterator[None]:
    """No test may leave another precision behind, nor, which fails, another number of threads: with one, Mitsuba's next
    OpenEXR hangs, in any test."""
    dr = sys.modules.get("drjit")
    threads = dr and dr.thread_count()
    yield
    ops.set_precision("float32")
    if dr and dr.thread_count() != threads:
        left = dr.thread_count()
        dr.set_thread_count(threads)
        pytest.fail(f"left Dr.Jit with {left} threads, found it with {threads}")


@pytest.fixture
def own_ndfs() -> Iterator[None]:
    """Distributions that a test registers are gone after it, so that no other test meets them."""
    before = set(go.NDF.family.all())
    yield
    for name in set(go.NDF.family.all()) - before:
        go.NDF.family.remove(name)
