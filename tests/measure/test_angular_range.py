"""Nothing is drawn, fitted or listed beyond the angles that were measured."""

from __future__ import annotations

import warnings
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import GonioWarning, InputError
from gonio.fitting.data import data_of
from gonio.material.angular_range import EVERYWHERE, AngularRange
from gonio.measure import format_of, read, report
from gonio.measure.tables import angles, samples
from gonio.measure.tables.angles import Angles
from gonio.viewer import curves, image_slices, plots

GOLD = go.Conductor.preset("Au", alpha=0.2)


@pytest.fixture(scope="module")
def narrow(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Gold that was measured up to 60 degrees."""
    path = tmp_path_factory.mktemp("narrow") / "au.gonio"
    degrees = [0, 10, 20, 30, 40, 50, 60]
    go.measure(GOLD, path, theta_i=degrees, theta_r=degrees)
    return str(path)


def directions(*degrees: tuple[float, float]) -> np.ndarray:
    theta, phi = np.radians(degrees).T
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)


def test_a_table_knows_where_it_ends(narrow: str) -> None:
    found = go.Measured(narrow)
    assert found.angular_range == AngularRange((0.0, 60.0), (0.0, 60.0), (0.0, 180.0))
    assert go.two_sided(found).angular_range == found.angular_range
    assert str(found.angular_range) == "θo from 0° to 60° and θi from 0° to 60°"
    assert GOLD.angular_range is EVERYWHERE and go.Measured().angular_range == EVERYWHERE
    wo, wi = directions((60, 0), (61, 0), (0, 0)), directions((60, 180), (10, 0), (60.1, 40))
    assert found.angular_range.holds(wo, wi).tolist() == [True, False, False]


def test_azimuths_that_were_not_measured_are_not_known() -> None:
    plane = AngularRange(azimuth=(170.0, 180.0))
    wo = directions((30, 0), (30, 0), (30, 0))
    assert plane.holds(wo, directions((30, 180), (30, 90), (30, 0))).tolist() == [True, False, False]


@pytest.mark.slow
def test_a_plot_ends_where_the_data_end(narrow: str, tmp_path: Path) -> None:
    found = go.Measured(narrow)
    assert plots._views(None, [("au", found)]) == (0.0, 30.0, 60.0)
    assert plots._views(None, [("au", found), ("gold", GOLD)]) == (0.0, 30.0, 60.0, 80.0)
    curve = curves.curve(found, 30.0)
    known = np.abs(curve.angles) <= 60.0 + 1e-6
    assert np.isfinite(curve.values[known]).all() and np.isnan(curve.values[~known]).all()
    assert np.isnan(curves.curve(found, 80.0).values).all()
    assert np.isnan(image_slices.slice_of(found, 20)[0]).all()  # theta_d near 90
    for kind in plots.KINDS:
        path = go.plot(found, kind=kind, output=tmp_path / f"{kind}.svg").path
        assert path is not None and ("not measured" if kind == "image" else "from 0° to 60°") in path.read_text()
    go.plot(found, GOLD, kind="slice")
    with pytest.raises(InputError, match=r"80 degrees of view requested, but .* is known from 0 to 60"):
        go.plot(found, angles=[80])


@pytest.mark.slow
def test_a_fit_reads_what_was_measured_alone(narrow: str) -> None:
    """It read the held values beyond as well, up to 80 degrees, and came out 18 % off with an index of 61."""
    data = data_of(go.Measured(narrow).table)
    assert min(data.wo[:, 2].min(), data.wi[:, 2].min()) > np.cos(np.radians(60.001))
    found = go.fit(narrow, "conductor")
    assert found.relative < 0.05 and found.material.alpha == pytest.approx(0.2, rel=0.06)  # type: ignore[attr-defined]


def test_info_lists_what_was_measured(narrow: str) -> None:
    rows = dict(report.lines(report.describe(narrow)))
    assert rows["measured"] == "θo from 0° to 60° and θi from 0° to 60°"
    assert "albedo at 60" in rows and "albedo at 70" not in rows
    assert dict(report.lines(report.describe("sample")))["measured"] == "everywhere"


def test_a_conversion_names_the_directions_at_which_its_source_was_measured(tmp_path: Path) -> None:
    short, listed = tmp_path / "short.gonio", tmp_path / "listed.gonio"
    theta, phi = np.radians([0.0, 20.0, 40.0, 60.0]), np.radians([0.0, 90.0, 180.0])
    wo, wi = angles.pairs(theta, theta, phi)
    rough = go.Conductor.preset("Au", alpha=0.5)
    f = np.asarray(rough.eval(wo, wi)).reshape(4, 4, 3, 3) / np.cos(theta)[:, None, None, None]
    short.write_bytes(format_of(short).write(Angles((theta, theta, phi), f)))
    listed.write_bytes(format_of(listed).write(samples.sampled(rough.eval, samples.plan()[::40])))
    for source, words in ((short, "measured at θo from 0° to 60°"), (listed, "measured at 126 pairs of directions")):
        with pytest.warns(GonioWarning, match=words):
            result = go.convert(source, tmp_path / "whole.bsdf")
        assert result.facts["measured"]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert go.convert(source, tmp_path / "same.gonio").facts["measured"] == ""


def test_a_missing_file_has_a_hint(tmp_path: Path) -> None:
    (tmp_path / "gold.binary").write_bytes(b"")
    for name, hint in (
        ("gold.bsdf", "did you mean 'gold.binary'?"),
        ("wax.bsdf", "check the path"),
        ("a/b.bsdf", "no folder"),
    ):
        with pytest.raises(InputError) as error:
            read(tmp_path / name)
        assert hint in error.value.hint
