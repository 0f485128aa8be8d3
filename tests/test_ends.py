"""What is finished is never lost: however the last step fails, the result lies where the error says.

Each verb computes once. Where it is about to write its result, its folder is spoilt in every way, one after the other,
and the file is looked for at the place that the error names.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import files
from gonio.cli import app
from gonio.errors import GonioError
from gonio.fitting import batch
from gonio.instruments.capture import rehearsal
from gonio.pictures import images

from ball_scene import SCENE

RIG = {
    "camera": {"size": [24, 24], "focal": 95.0},
    "ball": {"radius": 50.0, "center": [0.0, 0.0, 500.0]},
    "lights": {
        "a": {"position": [100.0, -100.0, 150.0], "intensity": 1.6e5},
        "b": {"position": [-300.0, 0.0, 250.0], "intensity": 1.6e5},
    },
    "photographs": [{"file": f"{name}.npz", "seconds": 1.0, "light": name} for name in "ab"],
}

COMMANDS = {
    "render": "render scene.json --spp 1 -o out/a.exr",
    "render a screen's picture": "render scene.json --spp 1 --exposure auto -o out/a.png",
    "render until an error": "render scene.json --until-error 0.5 --spp 64 -o out/a.npz",
    "resume": "resume kept.checkpoint --spp 3 -o out/a.hdr",
    "study": "study lambert --vary albedo=.2,.8 --spp 1 --size 8x8 -o out/a.png",
    "convert": "convert a.npz out/a.exr",
    "convert measurements": "convert table.gonio out/a.astm",
    "fit": "fit table.gonio -m lambert -o out/a.json",
    "capture": "capture photographs -m lambert -o out/a.gonio",
}


def _removed(target: Path) -> None:
    shutil.rmtree(target.parent)


def _renamed(target: Path) -> None:
    target.parent.rename(target.parent.with_name("elsewhere"))


def _below_a_file(target: Path) -> None:
    shutil.rmtree(target.parent)
    target.parent.write_text("")


def _a_folder(target: Path) -> None:
    target.mkdir()


def _a_loop(target: Path) -> None:
    target.symlink_to(target)


def _a_dead_link(target: Path) -> None:
    target.symlink_to(target.parent / "nowhere" / "a")


def _failing(name: str, code: int) -> Callable[[Path], Any]:
    """A step of writing fails inside the target's folder: what the system says when the disk is full, and so on."""

    @contextlib.contextmanager
    def failing(target: Path) -> Iterator[None]:
        step = getattr(os, name)

        def fail(what: Any, *rest: Any) -> Any:
            path = Path(f"/proc/self/fd/{what}").resolve() if isinstance(what, int) else Path(what).absolute()
            if path.parent == target.parent:
                raise OSError(code, os.strerror(code))
            return step(what, *rest)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(os, name, fail)
            yield

    return failing


WAYS: dict[str, Callable[[Path], Any]] = {
    "the folder is removed": _removed,
    "the folder is renamed": _renamed,
    "the folder is a file": _below_a_file,
    "the file is a folder": _a_folder,
    "the file is a link to itself": _a_loop,
    "the file is a link to no folder": _a_dead_link,
} | {
    f"{name}: {os.strerror(code)}": _failing(name, code)
    for name, codes in {
        "fsync": (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.ESTALE),
        "replace": (errno.EACCES, errno.EPERM, errno.EROFS, errno.EBUSY, errno.EXDEV, errno.ENAMETOOLONG),
    }.items()
    for code in codes
}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with what the verbs are given."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    for name in ("out", "temporary"):
        (tmp_path / name).mkdir()
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    images.write(tmp_path / "a.npz", np.full((4, 6, 3), 0.5, np.float32))
    return tmp_path


def given(command: str) -> None:
    """What one verb needs besides."""
    if "table.gonio" in command:
        go.measure("lambert", output="table.gonio")
    if "kept.checkpoint" in command:
        go.render("scene.json", spp=2, checkpoint="kept.checkpoint")
    if "photographs" in command:
        rehearsal.take(RIG, go.Lambert((0.5, 0.4, 0.3)), Path("photographs"), noise=0.01)


def spoilt(way: Callable[[Path], Any], target: Path, write: Callable[[], object]) -> tuple[GonioError, bytes | None]:
    """The error of writing into a spoilt folder, and what lies where it says; the folder is as before afterwards."""
    context = way(target)
    try:
        with context if context is not None else contextlib.nullcontext(), pytest.raises(GonioError) as caught:
            write()
        kept = place_in(caught.value.hint)
        return caught.value, kept.read_bytes() if kept is not None and kept.name == target.name else None
    finally:
        for made in (target.parent, target.parent.with_name("elsewhere")):
            if made.is_dir():
                shutil.rmtree(made)
            elif made.exists():
                made.unlink()
        target.parent.mkdir()


def place_in(text: str) -> Path | None:
    """The file that a message names."""
    found = re.search(r"it is kept as (.*): move it from there", text)
    return None if found is None else Path(found[1])


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", COMMANDS)
def test_what_is_computed_lies_where_the_error_says(
    name: str, place: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    given(COMMANDS[name])
    original, wrong, tried = files.write_whole, list[str](), list[str]()

    def write_whole(path: str | Path, content: Any, *rest: Any, **options: Any) -> Path:
        target = place / path
        if target.parent.name != "out" or target.stem != "a" or options.get("rescue") is False:
            return original(path, content, *rest, **options)
        whole = original(target.with_name("whole" + target.suffix), content).read_bytes()
        for way, spoil in WAYS.items():
            error, kept = spoilt(spoil, target, lambda: original(path, content, *rest, **options))
            tried.append(way)
            if kept is None or len(kept) != len(whole):
                wrong.append(f"{way}: {error}")
        _removed(target)
        return original(path, content, *rest, **options)

    monkeypatch.setattr(files, "write_whole", write_whole)
    monkeypatch.setattr(batch, "write_whole", write_whole)
    code = app.run(COMMANDS[name].split())
    told = capfd.readouterr().err
    assert wrong == []
    assert len(tried) >= len(WAYS) and code in (2, 3) and "Gonio failed" not in told
    kept = place_in(" ".join(told.split()))
    assert kept is not None and kept.stat().st_size > 0, told


@pytest.mark.slow
@pytest.mark.parametrize("stream", ["/dev/full", "&-"])
def test_a_stream_that_takes_nothing_costs_no_picture(stream: str, place: Path) -> None:
    command = f"{sys.executable} -m gonio.cli render scene.json --spp 1 -o out/a.npz >{stream}"
    done = subprocess.run(command, shell=True, check=False, stdin=subprocess.DEVNULL)
    assert done.returncode in (0, 3)
    assert images.read(place / "out" / "a.npz").pixels.shape == (16, 24, 3)
