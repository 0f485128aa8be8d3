"""docs/rgl-fits.md: its program on a file of our own, and the figures of the page against those that it stored."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from types import ModuleType

import gonio as go
import numpy as np
import pytest
from gonio.measure.formats.own import Own

import pages
from measure.test_fitting import table

DOCS = pages.ROOT / "docs"
MODELS = ("lambert", "lambert+ggx")
PAINT = go.Sum(go.Lambert((0.02, 0.2, 0.5)), go.Conductor(eta=1.5, k=0.0, alpha=0.2, fresnel="schlick"))


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(DOCS)
    return importlib.import_module("make_rgl_fits")


@pytest.fixture
def paint(tmp_path: Path) -> Path:
    """A measured file of a paint, with 2 % noise."""
    path = tmp_path / "own_paint_rgb.gonio"
    path.write_bytes(Own().write(table(PAINT, shape=(45, 30, 36), noise=0.02)))
    return path


@pytest.mark.slow
def test_errors_of_a_file_are_those_of_its_noise_and_of_the_best_start(program: ModuleType, paint: Path) -> None:
    rows = list(program.errors.rows_of(program.errors.files_in(paint.parent), MODELS, [], 500, 2))
    wrong, right = rows
    assert right["error"] < 0.03 < wrong["error"]
    assert all(row["excess"] < 0.01 and row["random"] > 0.0 for row in rows)
    again = [dict(row, error=7.0) for row in rows]  # what is known is not fitted again
    assert list(program.errors.rows_of([paint], MODELS, again, 500, 2)) == again


@pytest.mark.slow
def test_a_page_has_a_sheet_of_each_file_and_says_what_is_negative(
    program: ModuleType, paint: Path, tmp_path: Path
) -> None:
    from PIL import Image

    file = program.fitted(paint, MODELS, values=500)
    program.draw(file, tmp_path / "sheet.webp", size=80)
    with Image.open(tmp_path / "sheet.webp") as picture:
        sheet = np.asarray(picture.convert("RGB"), float) / 255.0

    def middle(row: int, column: int) -> np.ndarray:
        y, x = program.HEAD + 80 * row + 20, program.MARGIN + 80 * column + 20
        return sheet[y : y + 40, x : x + 40]

    matte, glossy = (np.abs(middle(0, column) - middle(0, 0)).mean() for column in (1, 2))
    assert glossy < 0.2 * matte
    np.testing.assert_allclose(middle(1, 2).mean((0, 1)), 0.5, atol=0.02)  # gray: no difference
    row = {"file": paint.stem, "model": "lambert", "error": 0.5, "excess": 0.001}
    text = program.page([file], [row], (DOCS / "rgl-fits/template.txt").read_text())
    assert "{" not in text and "(rgl-fits/own_paint_rgb.webp)" in text
    assert f"| own paint | {3 * len(file.data):,} | 0 | 0 / 0 / 0 |" in text


def test_no_fit_of_the_page_is_worse_than_its_random_starts(program: ModuleType) -> None:
    rows = json.loads((DOCS / "rgl-fits/fits.json").read_text())
    judged = [row for row in rows if row["model"] in program.errors.JUDGED]
    assert len(judged) == 9 * len(program.errors.JUDGED)
    assert max(row["excess"] for row in judged) < 0.01
    text = (DOCS / "rgl-fits.md").read_text()
    assert program.of_errors(rows, sorted({row["file"] for row in rows})) in text and program.of_starts(rows) in text
