"""Two materials are compared where both are known: closed forms, symmetry, and what the command says."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.energy.difference import difference
from gonio.errors import InputError
from gonio.viewer import difference_map


def test_two_lamberts_differ_by_their_albedos() -> None:
    found = difference(go.Lambert(0.25), go.Lambert(0.5))
    assert found.mean == pytest.approx(0.5) and found.largest == pytest.approx(0.5)
    assert found.albedo == pytest.approx(0.25)
    assert found.largest_at.f == pytest.approx((0.25 / np.pi, 0.5 / np.pi))
    same = difference(go.Lambert(0.25), go.Lambert(0.25))
    assert (same.mean, same.largest, same.albedo) == (0.0, 0.0, 0.0)


def test_narrow_lobes_are_found() -> None:
    """Of two lobes that hardly overlap the mean is near 2, and the largest near the narrow one's peak."""
    narrow, wide = go.Conductor.preset("Au", alpha=0.01), go.Conductor.preset("Au", alpha=0.3)
    found = difference(narrow, wide)
    assert 1.6 < found.views[0].mean < 2.0 and found.views[0].largest > 0.98
    assert found.views[0].f[0] > 100.0 * found.views[0].f[1]


def test_the_largest_is_where_the_formulas_say() -> None:
    """Oren-Nayar exceeds Lambert most at grazing retro-reflection."""
    found = difference(go.OrenNayar(sigma=0.5), go.Lambert())
    at = found.largest_at
    assert at.theta == 85.0 and at.wi[0] > 80.0 and min(at.wi[1], 360.0 - at.wi[1]) < 10.0
    wo = np.array([[np.sin(np.radians(85)), 0.0, np.cos(np.radians(85))]])
    theta, phi = np.radians(at.wi)
    wi = np.array([[np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]])
    assert at.f[0] == pytest.approx(float(go.OrenNayar(sigma=0.5).f(wo, wi).mean()), rel=1e-6)
    assert np.nanmin(difference_map.relative(go.OrenNayar(sigma=0.5), go.Lambert(), found, 30)) < 0.0


def test_glass_mirrors_and_black() -> None:
    assert difference(go.Dielectric(1.5, 0.2), go.Dielectric(1.5, 0.2)).mean == 0.0
    mirror = difference(go.Mirror(), go.Lambert())
    assert mirror.has_specular and mirror.albedo == pytest.approx(0.5)
    black = difference(go.Lambert(0.5), go.Lambert(0.0))
    assert black.mean == np.inf and black.largest == 1.0 and black.as_dict()["mean"] is None


@pytest.mark.slow
def test_tables_are_compared_where_they_are_known(tmp_path: Path) -> None:
    angles = [0, 10, 20, 30, 40, 50, 60]
    go.measure(go.Lambert(0.5), tmp_path / "a.gonio", theta_i=angles, theta_r=angles)
    found = difference(go.Measured(str(tmp_path / "a.gonio")), go.Lambert(0.5))
    assert found.known.view == (0.0, 60.0) and found.largest < 1e-4
    assert [view.theta for view in found.views] == [0.0, 15.0, 30.0, 45.0, 60.0]


@pytest.mark.slow
def test_the_verb_says_where_and_by_how_much(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["compare", "lambert", "oren-nayar", "-p", "sigma=.5", "-o", "map.png"]
    assert cli.run([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["reference"] == "oren-nayar(sigma=.5)" and 0.1 < found["mean"] < 0.4
    assert len(found["views"]) == 7 and (tmp_path / "map.png").stat().st_size > 10_000
    assert cli.run([*words, "--tolerance", ".01"]) == 1
    out = capsys.readouterr().out
    assert "of the larger f: A " in out and "fails" in out and "albedo of B" in out
    assert cli.run(["compare", "lambert", "lambert", "--metric", "albedo", "--tolerance", "0"]) == 0
    assert cli.run(["compare", "lambert", "map.png"]) == 2
    assert "a picture and a material" in capsys.readouterr().err
    assert cli.run(["compare", "lambert", "lambert", "--metric", "flip"]) == 2
    assert "unknown metric 'flip' for materials" in capsys.readouterr().err


def test_python_compares_objects_and_texts() -> None:
    assert go.compare(go.Lambert(0.25), "lambert(albedo=.5)").mean == pytest.approx(0.5)
    with pytest.raises(InputError, match="unknown metric"):
        go.compare(go.Lambert(), go.Lambert(), metric="rmse")
