"""Finding LLVM: versions are read from files, never by loading; what is too old is refused before Dr.Jit sees it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from gonio.errors import GonioWarning, MachineError
from gonio.ops import llvm


@pytest.fixture(autouse=True)
def environment_restored() -> Iterator[None]:
    """`use` writes its choice into the environment; the next test must not inherit a fake."""
    saved = os.environ.get(llvm.VARIABLE)
    yield
    os.environ.pop(llvm.VARIABLE, None)
    if saved is not None:
        os.environ[llvm.VARIABLE] = saved


@pytest.fixture
def library(tmp_path: Path) -> Callable[..., Path]:
    """Writes a file that looks like a libLLVM of that version to `read_version`."""

    def write(version: str, name: str = "") -> Path:
        path = tmp_path / (name or f"libLLVM-{version}.so")
        path.write_bytes(b"\x7fELF" + bytes(5000) + f"\0LLVM_{version}\0".encode() + bytes(100))
        return path

    return write


@pytest.fixture
def only(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Makes these the only libraries in reach."""

    def choose(*found: tuple[Path, str]) -> None:
        monkeypatch.delenv(llvm.VARIABLE, raising=False)
        monkeypatch.setattr(llvm, "_candidates", lambda: list(found))
        monkeypatch.delitem(sys.modules, "drjit", raising=False)

    return choose


@pytest.mark.parametrize("version", ["14", "17", "19.1", "23.1"])
def test_version_is_read_from_the_symbol_versions(library: Callable[..., Path], version: str) -> None:
    assert llvm.read_version(library(version, "some.so")) == version


@pytest.mark.parametrize("name, version", [
    ("libLLVM-18.so", "18"), ("libLLVM.so.19.1", "19.1"), ("libLLVM.dylib", ""), ("LLVM-C.dll", "")
])  # fmt: skip
def test_version_falls_back_to_the_files_name(tmp_path: Path, name: str, version: str) -> None:
    path = tmp_path / name
    path.write_bytes(bytes(100))
    assert llvm.read_version(path) == version


def test_missing_empty_and_unreadable_files_have_no_version(tmp_path: Path) -> None:
    empty = tmp_path / "libLLVM-19.so"
    empty.write_bytes(b"")
    assert llvm.read_version(empty) == ""
    assert llvm.read_version(tmp_path / "libLLVM-20.so") == ""
    assert llvm.read_version(tmp_path) == ""


@pytest.mark.parametrize("version, usable", [("14", False), ("16", False), ("17", True), ("19.1", True), ("", False)])
def test_only_17_and_newer_are_usable(version: str, usable: bool) -> None:
    assert llvm.Library(Path("x"), version, "system").usable is usable


def test_newest_library_of_the_system_is_chosen(library: Callable[..., Path], only: Callable[..., None]) -> None:
    old, new, middle = library("14"), library("19.1"), library("17")
    only((old, "system"), (middle, "system"), (new, "system"))
    assert llvm.use().path == new.resolve()
    assert [x.version for x in llvm.libraries()] == ["19.1", "17", "14"]


def test_wheel_goes_before_the_system(library: Callable[..., Path], only: Callable[..., None]) -> None:
    wheel, system = library("19.1"), library("20.1")
    only((system, "system"), (wheel, "wheel"))
    assert llvm.use().path == wheel.resolve()


def test_too_old_library_of_the_system_is_passed_over(library: Callable[..., Path], only: Callable[..., None]) -> None:
    old = library("15")
    only((old, "system"))
    with pytest.raises(
        MachineError, match=rf"(?s)no LLVM 17 or newer found \(too old: 15 at {old.resolve()}\).*hint:.*pip"
    ):
        llvm.use()


def test_no_library_at_all_is_a_fault_of_the_machine_with_a_way_out(only: Callable[..., None]) -> None:
    only()
    with pytest.raises(MachineError, match=r"(?s)no LLVM 17 or newer found\n.*pip install karellen-llvm-core") as error:
        llvm.use()
    assert error.value.code == 3


@pytest.mark.parametrize(("name", "said"), [("14", "names LLVM 14, which aborts"), ("", "names no libLLVM")])
def test_unusable_library_in_the_environment_is_replaced_with_a_warning(
    library: Callable[..., Path], only: Callable[..., None], monkeypatch: pytest.MonkeyPatch, name: str, said: str
) -> None:
    old, good = (library("14") if name else Path("/nowhere/libLLVM.so")), library("19.1")
    only((old, "environment"), (good, "wheel"))
    with pytest.warns(GonioWarning, match=said):
        chosen = llvm.use()
    assert chosen.path == good.resolve() and os.environ[llvm.VARIABLE] == str(good.resolve())


def test_environment_goes_before_everything(library: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "drjit", raising=False)
    path = library("18")
    monkeypatch.setenv(llvm.VARIABLE, str(path))
    assert llvm.use().path == path.resolve()
    assert llvm.libraries()[0].source == "environment"


def _python(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **environment}, timeout=120
    )


@pytest.mark.parametrize("code", [
    "import gonio as go; go.Lambert().eval([0, 0, 1.], [0, 0, 1.])", "import gonio.mitsuba"
])  # fmt: skip
def test_old_library_in_the_environment_never_ends_in_an_abort(library: Callable[..., Path], code: str) -> None:
    got = _python(code, DRJIT_LIBLLVM_PATH=str(library("14")))
    usable = [x for x in llvm.libraries() if x.usable]
    assert got.returncode == (0 if usable else 1), got.stderr  # an abort would be -6
    assert ("names LLVM 14" if usable else "MachineError") in got.stderr


def test_importing_gonio_loads_neither_drjit_nor_mitsuba_nor_numpy() -> None:
    got = _python("import sys, gonio; print([m for m in ('drjit', 'mitsuba', 'numpy') if m in sys.modules])")
    assert got.stdout.strip() == "[]", got.stderr
