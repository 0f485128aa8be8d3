"""Pictures are written whole or not at all, and come back with their settings."""

from __future__ import annotations

import errno
import os
import resource
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from gonio.errors import InputError, MachineError
from gonio.pictures import images

SETTINGS: images.Metadata = {"scene": 'kd "müll"', "spp": 64, "seed": 3, "time": 1.25, "integrator": "path"}


@pytest.fixture
def picture() -> np.ndarray:
    values = np.random.default_rng(0).random((30, 50, 3)).astype(np.float32) * 4
    values[0, 0] = (1, 0, 0)  # red, top left: catches swapped channels and flipped rows
    return values


# Error bounds: EXR and NPZ keep float32; RGBE keeps 8 bits under the largest channel, 4/256; 8-bit sRGB is at
# most half a step of 1/255 off, at the curve's steepest (2.27 near white).
ERRORS = [(".exr", 0), (".npz", 0), (".hdr", 4 / 256), (".png", 2.28 / 510)]


@pytest.mark.parametrize(("suffix", "error"), ERRORS)
def test_pixels_and_settings_come_back(tmp_path: Path, picture: np.ndarray, suffix: str, error: float) -> None:
    path = images.write(tmp_path / f"picture{suffix}", picture, SETTINGS)
    back = images.read(path)
    expected = picture.clip(0, 1) if suffix == ".png" else picture
    assert back.pixels.dtype == np.float32
    assert np.abs(back.pixels - expected).max() <= error
    assert back.metadata == SETTINGS
    assert back.hdr == (suffix != ".png")
    assert [entry.name for entry in tmp_path.iterdir()] == [f"picture{suffix}"]


def test_png_has_the_srgb_curve_and_exposure() -> None:
    grey = np.full((1, 1, 3), 0.18 / 2)
    assert images.to_screen(grey, exposure=1)[0, 0, 0] == 118  # 18 % grey is 46.1 % of the scale, 117.6
    assert images.to_screen(np.array([[[np.nan, np.inf, -1]]]))[0, 0].tolist() == [0, 255, 0]


def test_png_is_a_valid_file_to_another_reader(tmp_path: Path, picture: np.ndarray) -> None:
    image_module = pytest.importorskip("PIL.Image")
    path = images.write(tmp_path / "a.png", picture, SETTINGS)
    with image_module.open(path) as image:
        image.load()
        assert np.array_equal(np.array(image), images.to_screen(picture))
        assert image.info["gonio.scene"] == SETTINGS["scene"]


def test_a_failed_write_leaves_the_old_file_and_nothing_else(
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    picture: np.ndarray,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = tmp_path / "a.exr"
    path.write_bytes(b"old")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path_factory.mktemp("rescued")))
    monkeypatch.chdir(tempfile.gettempdir())

    def no_space(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(MachineError, match="disk is full") as caught:
        images.write(path, picture)
    assert caught.value.code == 3
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("suffix", images.SUFFIXES)
def test_a_scene_whose_name_is_no_text_has_its_picture(suffix: str, tmp_path: Path, picture: np.ndarray) -> None:
    path = images.write(tmp_path / f"a{suffix}", picture, {"scene": os.fsdecode(b"caf\xe9/scene.json")})
    assert images.read(path).metadata["scene"] == r"caf\udce9/scene.json"


def test_a_picture_that_no_library_can_encode_is_kept_as_an_array(
    tmp_path: Path, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*_: object) -> bytes:
        raise RuntimeError("OpenEXR says no")

    monkeypatch.setattr(images, "_bitmap_bytes", failing)
    with pytest.raises(MachineError, match="OpenEXR says no") as caught:
        images.write(tmp_path / "a.exr", picture)
    kept = caught.value.hint.removeprefix("it is kept as ").removesuffix(": `gonio convert` reads that")
    assert np.array_equal(images.read(kept).pixels, picture)


def test_a_disk_that_fills_up_while_writing_leaves_nothing(tmp_path: Path) -> None:
    program = (
        "import numpy as np, sys; from gonio.pictures import images; from gonio.errors import MachineError\n"
        "try: images.write(sys.argv[1], np.random.rand(64, 64, 3))\n"
        "except MachineError as error: print(error); sys.exit(3)"
    )

    def small_files_only() -> None:  # the kernel then refuses to grow a file, as a full disk does
        import signal

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

    done = subprocess.run(
        [sys.executable, "-B", "-c", program, str(tmp_path / "a.png")],
        capture_output=True,
        text=True,
        preexec_fn=small_files_only,
    )
    assert done.returncode == 3, done.stderr
    assert "disk is full" in done.stdout
    assert list(tmp_path.iterdir()) == []


def test_output_is_checked_before_work_starts(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist") as caught:
        images.check_writable(tmp_path / "nowhere" / "a.exr")
    assert "mkdir" in caught.value.hint
    with pytest.raises(InputError, match="unknown picture format") as caught:
        images.check_writable(tmp_path / "a.pgn")
    assert caught.value.hint == "did you mean '.png'?"
    with pytest.raises(InputError, match="folder, expected a file"):
        (tmp_path / "b.exr").mkdir()
        images.check_writable(tmp_path / "b.exr")


def test_a_link_to_itself_is_one_clear_error(tmp_path: Path, picture: np.ndarray) -> None:
    (tmp_path / "a.exr").symlink_to(tmp_path / "a.exr")
    with pytest.raises(InputError):
        images.write(tmp_path / "a.exr", picture)


def test_a_link_is_followed_and_stays_a_link(tmp_path: Path, picture: np.ndarray) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "a.npz").symlink_to(tmp_path / "real" / "b.npz")
    images.write(tmp_path / "a.npz", picture)
    assert (tmp_path / "a.npz").is_symlink() and (tmp_path / "real" / "b.npz").is_file()


@pytest.mark.parametrize("suffix", images.SUFFIXES)
@pytest.mark.parametrize("keep", [0, 7, 40, -100])
def test_damaged_files_are_one_clear_error(tmp_path: Path, picture: np.ndarray, suffix: str, keep: int) -> None:
    path = images.write(tmp_path / f"a{suffix}", picture)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(InputError) as caught:
        images.read(path)
    assert caught.value.where == str(path)


def test_a_header_that_claims_too_much_is_refused(tmp_path: Path, picture: np.ndarray) -> None:
    png = images.write(tmp_path / "a.png", picture)
    content = bytearray(png.read_bytes())
    content[16:24] = struct.pack(">II", 60000, 60000)
    png.write_bytes(content)
    with pytest.raises(InputError, match="claims 60000 x 60000"):
        images.read(png)

    exr = images.write(tmp_path / "a.exr", picture)
    content = bytearray(exr.read_bytes())
    at = content.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    content[at : at + 16] = struct.pack("<iiii", 0, 0, 2**30, 2**30)
    exr.write_bytes(content)
    with pytest.raises(InputError, match="claims"):
        images.read(exr)


def test_a_pickle_in_an_npz_is_never_run(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", radiance=np.array([{"a": 1}], dtype=object))
    with pytest.raises(InputError, match="cannot be read"):
        images.read(tmp_path / "a.npz")


def test_a_missing_picture_names_its_neighbour(tmp_path: Path, picture: np.ndarray) -> None:
    images.write(tmp_path / "phong.exr", picture)
    with pytest.raises(InputError) as caught:
        images.read(tmp_path / "phnog.exr")
    assert caught.value.hint == "did you mean 'phong.exr'?"
