"""The programs of the gallery draw their pictures, into the current folder, and these show what their pages say."""

from __future__ import annotations

import functools
import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType

import gonio as go
import matplotlib.image
import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
PROGRAMS = {  # folder -> arguments of main that make it quick
    "broken-laws": {"size": 12, "spp": 1},
    "facets": {"size": 24},
    "homework-rows": {"size": 24},
    "noisy-energy": {"resolution": 8},
    "phong-failures": {"size": 24},
    "photographs": {},
}


def program(folder: str, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    file = EXAMPLES / folder / f"{folder.replace('-', '_')}.py"
    monkeypatch.setattr(sys, "path", list(sys.path))  # programs extend it
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
@pytest.mark.parametrize("folder", PROGRAMS)
def test_a_program_writes_its_picture_here(folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = program(folder, monkeypatch)
    monkeypatch.chdir(tmp_path)
    module.main(**PROGRAMS[folder])
    assert [path.name for path in tmp_path.iterdir()] == [module.PICTURE]
    assert matplotlib.image.imread(tmp_path / module.PICTURE).shape[1] == 1280
    assert (EXAMPLES / folder / module.PICTURE).exists()


def test_every_model_has_its_ball(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = program("all-models", monkeypatch)
    shown = {name: module.material(name) for name in go.models()}
    assert {name: material.name for name, material in shown.items()} == {name: name for name in go.models()}
    assert set(module.LOOKS) <= set(go.models())
    assert module.ball("measured", size=16, spp=1).mean() > 0.01


def test_every_law_with_a_broken_material_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    module = program("broken-laws", monkeypatch)
    from broken import facets, surfaces

    laws = {one.caught_by for one in (*facets.FACETS, *surfaces.SURFACES) if one.caught_by}
    assert {one.caught_by for one in module.SHOWN} == laws
    assert len(module.SHOWN) == len(laws)


def test_phong_s_failures_show(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each wrong ball differs from the one below it where the page says."""
    module = program("phong-failures", monkeypatch)
    shaded = functools.partial(module.sheets.shaded, size=48, backdrop=0.0, oversampling=1)
    wrong, right = zip(
        *[[shaded(ball, case[0]) for ball in (case[2], case[4])] for case in module.cases()],
        strict=True,
    )
    lit = [(picture > 0.0).any(-1) for picture in right]
    assert wrong[0][~lit[0]].max() < 0.01 and (wrong[0] - right[0]).max() > 0.15  # a rim
    assert (wrong[1][~lit[1]]).max() > 0.05 and wrong[1].min() < -0.1  # through the surface, and negative
    assert wrong[2].max() > 1.0 > right[2].max()
    assert np.abs(np.diff(wrong[3], axis=1)).max() > 2.0 * np.abs(np.diff(right[3], axis=1)).max()


def test_facets_in_shadow_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wall between two plains hides as much of one as its shadow is long."""
    module = program("facets", monkeypatch)
    x = np.linspace(0.0, 10.0, 101)
    wall = np.where(np.abs(x - 5.0) < 0.05, 1.0, 0.0)
    hidden = module.hidden(x, wall, -0.5)  # light from the left, rising 0.5 per unit: the shadow is 2 long
    assert x[hidden].min() > 5.0 and abs(x[hidden].max() - 7.0) < 0.11


def test_the_noise_of_the_tables_falls_as_their_titles_say(monkeypatch: pytest.MonkeyPatch) -> None:
    module = program("noisy-energy", monkeypatch)
    exact = module.table(16)
    few, many = (
        np.sqrt(np.mean((module.table(16, method="ggx", sampler="independent", samples=n) - exact) ** 2))
        for n in (64, 1024)
    )
    assert 3.0 < few / many < 5.3  # sqrt(16) = 4


def test_pairs_that_look_alike_are_named_so(monkeypatch: pytest.MonkeyPatch) -> None:
    module = program("broken-laws", monkeypatch)
    gray = np.full((8, 8, 3), 0.2, np.float32)
    assert not module.visible(gray, gray * 1.01)
    assert module.visible(gray, gray * 1.2)


def test_arrows_point_from_the_lamps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Angles and sides as examples/make_assets.py places the lamps; the ball is as large as its pixels say."""
    module = program("photographs", monkeypatch)
    calibration = json.loads((EXAMPLES / "photographs" / "calibration.json").read_text())
    lamps = module.lamp_angles(calibration)
    assert {name: round(angle) for name, (angle, _) in lamps.items()} == {
        "right": 20,
        "below": 50,
        "left": 80,
        "above": 35,
    }
    assert (
        lamps["right"][1][0] > 0.9
        and lamps["below"][1][1] > 0.9
        and lamps["left"][1][0] < -0.5
        and lamps["above"][1][1] < -0.5
    )
    sides = [module.side_of(toward) for _, toward in lamps.values()]
    assert sides == ["right", "below", "upper left", "upper right"]
    middle, radius = module.outline(calibration, 96)
    y, x = np.nonzero(matplotlib.image.imread(EXAMPLES / "photographs" / "right.png")[..., 0] > 0.2)
    distance = np.hypot(x - middle[0], y - middle[1])
    assert radius - 2.0 < distance.max() < radius + 1.5


def test_titles_fit_their_cells_in_one_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sheets = program("phong-failures", monkeypatch).sheets
    assert sheets.fitting(["short"], 4.0) == sheets.POINTS
    assert 0.0 < sheets.fitting(["short", "a very long title that no cell can hold"], 1.0) < 0.5 * sheets.POINTS
