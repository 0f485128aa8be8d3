"""The error map shows the metric it names, where it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gonio.pictures import metrics
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
