"""Files that appear whole or not at all, and what a full disk costs."""

from __future__ import annotations

import errno
import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from gonio import files
from gonio.errors import GonioError, InputError, MachineError


@pytest.fixture
def full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on a disk that is full; the temporary folder is on another."""
    folder = tmp_path / "full"
    folder.mkdir()
    rename = os.replace

    def replace(source: str | Path, target: str | Path) -> None:
        if Path(target).parent == folder:
            raise OSError(errno.ENOSPC, "No space left on device")
        rename(source, target)

    monkeypatch.setattr(files.os, "replace", replace)
    write = Path.write_bytes

    def write_bytes(file: Path, content: bytes) -> int:
        if file.parent != folder and folder in file.parents:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, content)

    monkeypatch.setattr(Path, "write_bytes", write_bytes)
    monkeypatch.chdir(folder)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    return folder


def test_what_does_not_fit_the_disk_is_kept_in_the_temporary_folder(full: Path) -> None:
    with pytest.raises(MachineError, match="the disk is full") as caught:
        files.write_whole(full / "a.exr", b"hours of work")
    kept = list(Path(tempfile.gettempdir()).rglob("a.exr"))
    assert [file.read_bytes() for file in kept] == [b"hours of work"]
    assert str(kept[0]) in caught.value.hint
    assert not list(full.iterdir())


def test_what_is_drawn_into_a_file_is_kept_too(full: Path) -> None:
    with pytest.raises(MachineError, match="it is kept as"):
        files.write_whole(full / "a.svg", lambda part: part.write_bytes(b"a sheet") and None)
    assert [file.read_text() for file in Path(tempfile.gettempdir()).rglob("a.svg")] == ["a sheet"]


def test_no_room_anywhere_is_told_without_a_promise(full: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(full / "nowhere"))
    with pytest.raises(MachineError, match="nothing was written"):
        files.write_whole(full / "a.exr", b"x")


def test_a_loop_of_links_is_no_output(tmp_path: Path) -> None:
    (tmp_path / "a.exr").symlink_to("b.exr")
    (tmp_path / "b.exr").symlink_to("a.exr")
    with pytest.raises(InputError, match="symbolic link points to itself"):
        files.check_file(tmp_path / "a.exr")


def _kept(error: GonioError) -> bytes:
    """What lies where the error says."""
    match = re.search(r"it is kept as (.*): move it from there", error.hint)
    assert match is not None, error.hint
    return Path(match[1]).read_bytes()


def _removed(folder: Path) -> Path:
    return folder / "removed" / "a.exr"


def _a_folder(folder: Path) -> Path:
    (folder / "a.exr").mkdir()
    return folder / "a.exr"


def _below_a_file(folder: Path) -> Path:
    (folder / "file").write_text("")
    return folder / "file" / "a.exr"


def _too_long(folder: Path) -> Path:
    return folder / ("a" * 300 + ".exr")


def _read_only(folder: Path) -> Path:
    (folder / "closed").mkdir(mode=0o500)
    return folder / "closed" / "a.exr"


def _a_loop(folder: Path) -> Path:
    (folder / "a.exr").symlink_to("b.exr")
    (folder / "b.exr").symlink_to("a.exr")
    return folder / "a.exr"


def _refused_by_the_kernel(folder: Path) -> Path:
    return Path("/proc/a.exr")


def _of_nobody(folder: Path) -> Path:
    return Path("~no-such-user-here/a.exr")


WRONG = [_removed, _a_folder, _below_a_file, _too_long, _read_only, _a_loop, _refused_by_the_kernel, _of_nobody]


@pytest.mark.parametrize("make", WRONG)
def test_what_cannot_be_written_lies_where_the_error_says(
    make: Callable[[Path], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "current").mkdir()
    monkeypatch.chdir(tmp_path / "current")
    path = make(tmp_path)
    if make is _read_only and os.access(path.parent, os.W_OK):
        pytest.skip("this user may write everywhere")
    with pytest.raises(GonioError) as caught:
        files.write_whole(path, b"hours of work")
    assert _kept(caught.value) == b"hours of work"


@pytest.mark.parametrize("make", WRONG)
def test_what_is_cheap_to_make_again_is_not_kept(
    make: Callable[[Path], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "current").mkdir()
    monkeypatch.chdir(tmp_path / "current")
    path = make(tmp_path)
    if make is _read_only and os.access(path.parent, os.W_OK):
        pytest.skip("this user may write everywhere")
    with pytest.raises(GonioError):
        files.write_whole(path, b"a schema", rescue=False)
    assert not list((tmp_path / "current").iterdir())


def test_a_current_folder_that_was_deleted_costs_no_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    with pytest.raises(MachineError) as caught:
        files.write_whole("a.exr", b"hours of work")
    assert _kept(caught.value) == b"hours of work"
    with pytest.raises(MachineError, match="it is kept as"):
        files.write_all(Path("tables"), {"a.json": b"{}"})


def test_a_name_as_long_as_the_disk_allows_is_written(tmp_path: Path) -> None:
    for name in ("a" * 251 + ".exr", "é" * 125 + ".exr"):
        assert files.write_whole(tmp_path / name, b"x").read_bytes() == b"x"
        assert len(os.fsencode(files.with_ending(tmp_path / name, ".checkpoint").name)) == files.MAX_NAME
    assert len(list(tmp_path.iterdir())) == 2


def test_a_folder_of_files_is_kept_too(tmp_path: Path) -> None:
    (tmp_path / "tables").write_text("a file now")
    with pytest.raises(MachineError, match="it is kept as") as caught:
        files.write_all(tmp_path / "tables", {"a.json": b"{}", "b.bin": b"12"})
    kept = Path(caught.value.hint.removeprefix("it is kept as ").removesuffix(": move it from there"))
    assert {file.name: file.read_bytes() for file in kept.iterdir()} == {"a.json": b"{}", "b.bin": b"12"}
