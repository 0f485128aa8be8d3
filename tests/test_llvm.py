"""Finding LLVM: versions are read from files, never by loading; what is too old is refused before Dr.Jit sees it."""

from __future__ import annotations

import functools
import itertools
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from gonio import llvm
from gonio.errors import GonioWarning, MachineError


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

    def choose(environment: Path | None = None, wheel: Sequence[Path] = (), system: Sequence[Path] = ()) -> None:
        monkeypatch.delenv(llvm.VARIABLE, raising=False)
        if environment:
            monkeypatch.setenv(llvm.VARIABLE, str(environment))
        monkeypatch.setattr(llvm, "_wheel", lambda: list(wheel))
        monkeypatch.setattr(llvm, "_system", lambda: list(system))
        monkeypatch.delitem(sys.modules, "drjit", raising=False)

    return choose


@pytest.mark.parametrize("version", ["14", "17", "19.1", "23.1"])
def test_version_is_read_from_the_symbol_versions(library: Callable[..., Path], version: str) -> None:
    assert llvm.read_version(library(version, "some.so")) == version


def test_a_symbol_that_only_begins_like_a_version_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "some.so").write_bytes(b"\0LLVM_C_API\0" + bytes(50) + b"\0LLVM_19.1\0")
    assert llvm.read_version(tmp_path / "some.so") == "19.1"


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
    only(system=[old, middle, new])
    assert llvm.use().path == new.resolve()
    assert [(x.version, x.source) for x in llvm.libraries()] == [(v, "system") for v in ("19.1", "17", "14")]


def test_wheel_goes_before_the_system(library: Callable[..., Path], only: Callable[..., None]) -> None:
    wheel, system = library("19.1"), library("20.1")
    only(wheel=[wheel], system=[system])
    assert llvm.use().path == wheel.resolve()
    assert [x.source for x in llvm.libraries()] == ["wheel", "system"], "what `use` wrote is still the wheel's"


def test_too_old_library_of_the_system_is_passed_over(library: Callable[..., Path], only: Callable[..., None]) -> None:
    old = library("15")
    only(system=[old])
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
    only(old, [good])
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
    inherited = {name: value for name, value in os.environ.items() if name != llvm.VARIABLE}
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**inherited, **environment}, timeout=120
    )


@pytest.mark.slow
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


# What a program does that has imported everything: an array operation that aborts under LLVM 15, a material by itself
# and as a plugin, and a ray.
_WORK = """
if mi.variant() is None:
    mi.set_variant("llvm_ad_rgb")
assert dr.maximum(dr.llvm.Float(1, 2, 3), 2)[0] == 2
assert go.Conductor().eval([0, 0, 1.0], [0, 0, 1.0])[0, 0] > 0
scene = mi.load_dict({"type": "scene", "ball": {"type": "sphere", "bsdf": {"type": "gonio_lambert"}}})
si = scene.ray_intersect(mi.Ray3f([0, 0, 5], [0, 0, -1]))
assert abs(si.bsdf().eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1))[0][0] - 0.5 / dr.pi) < 1e-6
print("works")
"""
_IMPORTS = {
    "gonio": "import gonio as go",
    "drjit": "import drjit as dr",
    "mitsuba": "import mitsuba as mi",
    "gonio.mitsuba": "import gonio.mitsuba",
}


@functools.cache
def _finds_llvm_alone() -> bool:
    """Whether Dr.Jit finds some libLLVM of this machine by itself, be it too old."""
    return _python("import drjit as dr; assert dr.has_backend(dr.JitBackend.LLVM)").returncode == 0


# whichever comes first, and whichever follows it
_QUICK = {(first, *order) for first in _IMPORTS for others in [[n for n in _IMPORTS if n != first]]
          for order in (others, others[::-1])}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "order",
    [
        pytest.param(order, marks=() if order in _QUICK else pytest.mark.slow)
        for order in itertools.permutations(_IMPORTS)
    ],
    ids=" ".join,
)
def test_every_order_of_imports_works(order: tuple[str, ...]) -> None:
    got = _python("; ".join(_IMPORTS[name] for name in order) + _WORK)
    if order[0] in ("gonio", "gonio.mitsuba") or _finds_llvm_alone():
        assert got.stdout.strip() == "works" and not got.stderr, got.stderr
    else:  # Dr.Jit looks for an LLVM once; whoever imports it first must have one
        assert "MachineError: LLVM: Dr.Jit was imported before Gonio and found no LLVM" in got.stderr


def test_a_variant_set_before_gonio_stays() -> None:
    code = "import mitsuba as mi; mi.set_variant('llvm_ad_rgb'); import gonio.mitsuba, drjit as dr, gonio as go"
    got = _python(code + _WORK)
    assert got.stdout.strip() == "works" if _finds_llvm_alone() else "ImportError" in got.stderr, got.stderr


@pytest.mark.slow
def test_dr_jit_without_any_llvm_is_one_error_whose_hint_is_true() -> None:
    """DRJIT_LIBLLVM_PATH, taken back after Dr.Jit has looked, is as on a machine whose system has none."""
    code = "import os, drjit, warnings; del os.environ['DRJIT_LIBLLVM_PATH']; import gonio.mitsuba"
    got = _python(code, DRJIT_LIBLLVM_PATH="/nowhere/libLLVM.so")
    assert got.returncode == 1
    assert "Dr.Jit was imported before Gonio and found no LLVM" in got.stderr
    hint = got.stderr.rsplit("or set ", 1)[1].split(" before Python starts")[0]
    name, _, path = hint.partition("=")
    assert _python("import drjit; import gonio.mitsuba", **{name: path}).returncode == 0
    assert _python("import gonio.mitsuba, drjit").returncode == 0


@pytest.mark.sample(1)
@pytest.mark.parametrize("begun", [
    "x = dr.llvm.Float(1, 2, 3) + 1; dr.eval(x)",
    "import mitsuba as mi; mi.set_variant('llvm_ad_rgb'); bsdf = mi.load_dict({'type': 'null'})",
])  # fmt: skip
def test_work_begun_with_an_old_llvm_is_never_lost(begun: str) -> None:
    """Restarting Dr.Jit would lose it: that is an error where something is computed, never an abort."""
    version = _python("import drjit as dr; print(dr.detail.llvm_version()[0])").stdout.strip()
    if not 0 < int(version) < llvm.OLDEST_USABLE:
        pytest.skip(f"Dr.Jit finds LLVM {version} by itself: no old one to begin with")
    got = _python(f"import drjit as dr; {begun}; import gonio; print('imported'); import gonio.mitsuba")
    assert got.stdout.strip() == "imported" and got.returncode == 1
    assert f"Dr.Jit was imported before Gonio and loaded LLVM {version}" in got.stderr and "hint: import" in got.stderr
