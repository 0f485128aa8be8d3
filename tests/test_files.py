"""Files that appear whole or not at all, and what a full disk costs."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

import pytest
from gonio import files
from gonio.errors import InputError, MachineError


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
    with pytest.raises(MachineError, match="it was saved as"):
        files.write_whole(full / "a.svg", lambda part: part.write_text("a sheet") and None)
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
