"""Measured values in .csv files: rows of directions or angles, and f."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.errors import InputError
from gonio.measure import read
from gonio.measure.tables.samples import Samples

PAINT = go.ModifiedPhong(kd=(0.3, 0.2, 0.1), ks=0.3, p=8.0)


def angular(count: int = 60) -> np.ndarray:
    """theta_i, phi_i, theta_r and phi_r in degrees, (N, 4)."""
    return np.random.default_rng(4).uniform((5, -180, 5, -180), (80, 180, 80, 180), (count, 4))


def measured(degrees: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """wo, wi and f of `PAINT`."""
    wo, wi = Samples(np.radians(degrees), np.zeros((len(degrees), 3))).pairs()
    return wo, wi, np.asarray(PAINT.f(wo, wi))


def write(path: Path, columns: np.ndarray, heading: str = "", separator: str = ",") -> Path:
    np.savetxt(path, columns, delimiter=separator, header=heading, comments="", fmt="%.9g")
    return path


def check_values(path: Path, f: np.ndarray) -> None:
    degrees = angular()
    table = read(path)
    assert isinstance(table, Samples)
    for one, other in zip(table.pairs(), measured(degrees)[:2], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-7)
    np.testing.assert_allclose(table.values, f, rtol=1e-7)


def test_directions_and_angles_are_read_in_any_order(tmp_path: Path) -> None:
    degrees = angular()
    wo, wi, f = measured(degrees)
    path = tmp_path / "paint.csv"
    check_values(write(path, np.c_[wo, wi, f]), f)
    check_values(write(path, np.c_[wo, wi, f], "wo.x;wo.y;wo.z;wi.x;wi.y;wi.z;r;g;b", ";"), f)
    check_values(write(path, np.c_[degrees, f], "theta_i phi_i theta_r phi_r r g b", " "), f)
    swapped = degrees[:, [2, 1, 0, 3]]
    check_values(write(path, np.c_[swapped, f], '"Theta_s","phi_i","theta_i","phi_s","r","g","b"'), f)
    check_values(write(path, np.c_[degrees[:, [2, 3, 0, 1]], f[:, 1]], "", "\t"), f[:, 1:2])  # theta_o first
    y_up = [1, 2, 0]
    check_values(write(path, np.c_[wo[:, y_up], wi[:, y_up], f], "# up: y\n# title: a paint"), f)
    assert read(path).title == "a paint"


def test_rows_are_written_and_fitted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    degrees = angular(400)
    wo, wi, f = measured(degrees)
    path = write(tmp_path / "paint.csv", np.c_[wo, wi, f])
    go.convert(path, tmp_path / "again.csv")
    np.testing.assert_allclose(read(tmp_path / "again.csv").values, read(path).values, rtol=1e-15)
    found = go.fit(path, "modified-phong")
    assert dict(zip(found.names, found.values, strict=True))["p"] == pytest.approx(8.0, rel=1e-3)
    assert go.check(path, PAINT).passed
    (tmp_path / "folder").mkdir()
    write(tmp_path / "folder/results.csv", np.c_[wo, wi, f])
    assert cli.run(["fit", str(tmp_path / "folder"), "-m", "lambert"]) == 2  # any program writes .csv files
    assert "no measurement file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: rows.__setitem__((3, 5), -0.5), "a unit vector expected"),
        (lambda rows: rows.__setitem__((3, slice(3, 6)), (0.0, 0.6, -0.8)), "a direction below the surface"),
        (lambda rows: rows.__setitem__((3, 7), np.nan), "'nan' given, a finite number expected"),
        (lambda rows: rows.__setitem__((3, 2), np.inf), "'inf' given, a finite number expected"),
    ],
)
def test_a_bad_row_is_one_error_with_its_line(change, words: str, tmp_path: Path) -> None:
    rows = np.column_stack(measured(angular()))
    change(rows)
    with pytest.raises(InputError, match=words) as error:
        read(write(tmp_path / "bad.csv", rows))
    assert str(error.value.where).endswith("bad.csv:4")


@pytest.mark.parametrize(
    ("columns", "heading", "words"),
    [
        (np.c_[np.radians(angular()[:, [2, 3, 0, 1]]), np.ones(60)], "", "angles of at most 1.* degrees"),
        (np.ones((60, 8)), "", "8 columns given"),
        (np.ones((60, 5)), "theta,phi,theta_i,phi_i,f", "columns theta, phi, theta_i, phi_i given"),
        (np.c_[measured(angular())[0], measured(angular())[1], np.ones(60)], "# up: w", "unknown axis 'w'"),
        (np.ones((0, 7)), "wo,wi,f", "no rows of numbers"),
    ],
)
def test_a_bad_file_is_one_error(columns: np.ndarray, heading: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        read(write(tmp_path / "bad.csv", columns, heading))
