"""The error map shows the metric it names, where it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gonio.errors import InputError
from gonio.pictures import images, metrics
from gonio.pictures.images import Picture
from gonio.viewer import error_map


@pytest.fixture
def pictures() -> tuple[Picture, Picture]:
    reference = np.full((20, 30, 3), 0.5, np.float32)
    test = reference.copy()
    test[5:10, 20:25] = 0.9
    return Picture(test, Path("a.exr")), Picture(reference, Path("b.exr"))


def test_the_mean_of_the_map_is_the_metric(pictures: tuple[Picture, Picture]) -> None:
    test, reference = (picture.pixels for picture in pictures)
    assert error_map.error_of(*pictures, "relmse").mean() == pytest.approx(metrics.relmse(test, reference))
    assert error_map.error_of(*pictures, "flip").mean() == pytest.approx(metrics.flip_map(test, reference).mean())
    squares = error_map.error_of(*pictures, "rmse") ** 2
    assert np.sqrt(squares.mean()) == pytest.approx(metrics.rmse(test, reference))


@pytest.mark.parametrize("metric", list(metrics.METRICS))
def test_the_map_is_bright_where_the_error_is(pictures: tuple[Picture, Picture], tmp_path: Path, metric: str) -> None:
    from PIL import Image

    path = error_map.draw(*pictures, metric).save(tmp_path / "map.png").path
    assert path is not None
    pixels = np.array(Image.open(path).convert("L")).astype(float)
    drawn = pixels[58:-62, 16:-16]
    rows, columns = drawn.shape[0] / 20, drawn.shape[1] / 30
    inside = drawn[int(6 * rows) : int(9 * rows), int(21 * columns) : int(24 * columns)]
    outside = drawn[int(14 * rows) :, : int(10 * columns)]
    assert inside.mean() > outside.mean() + 30


def test_equal_pictures_have_a_map_too(tmp_path: Path, pictures: tuple[Picture, Picture]) -> None:
    error_map.draw(pictures[1], pictures[1], "relmse").save(tmp_path / "map.png")
    assert (tmp_path / "map.png").is_file()


def test_a_png_is_read_as_it_is_said(tmp_path: Path) -> None:
    """Grey levels 100 and 110 of 255: 0.0392 apart as data, such as a table's, and 0.0285 where sRGB is decoded."""
    for name, level in (("a.png", 110), ("b.png", 100)):
        (tmp_path / name).write_bytes(images.png_bytes(np.full((4, 4, 3), level, np.uint8)))
    shown = error_map.compare(tmp_path / "a.png", tmp_path / "b.png")
    data = error_map.compare(tmp_path / "a.png", tmp_path / "b.png", encoding="linear")
    assert data.rmse == pytest.approx(10 / 255, rel=1e-6) and shown.rmse == pytest.approx(0.0285, abs=1e-4)
    assert "sRGB" in shown.rows()["read as"] and "--encoding linear" in shown.rows()["read as"]
    assert "as stored" in data.rows()["read as"] and data.as_dict()["encoding"] == "linear"
    pixels = np.ones((4, 4, 3), np.float32)
    assert (
        error_map.compare(pixels, pixels).encoding is None and "read as" not in error_map.compare(pixels, pixels).rows()
    )
    with pytest.raises(InputError, match="unknown encoding 'raw'"):
        error_map.compare(tmp_path / "a.png", tmp_path / "b.png", encoding="raw")
