"""`gonio capture` from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.instruments.capture import rehearsal

CENTER = [0.0, 0.0, 500.0]
LAMPS = {"a": [100.0, -100.0, 150.0], "b": [-300.0, 0.0, 250.0]}
RIG = {
    "camera": {"size": [48, 48], "focal": 190.0},
    "ball": {"radius": 50.0, "center": CENTER},
    "lights": {name: {"position": place, "intensity": 1.6e5} for name, place in LAMPS.items()},
    "photographs": [{"file": f"{name}.npz", "seconds": 1.0, "light": name} for name in LAMPS],
}


def gonio(*words: object) -> int:
    with pytest.raises(SystemExit) as ended:
        cli.main([str(word) for word in words])
    return int(ended.value.code or 0)


@pytest.mark.slow
def test_several_models_are_ranked_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = rehearsal.take(RIG, go.Lambert((0.5, 0.4, 0.3)), tmp_path / "photographs", noise=0.01)
    output = tmp_path / "chalk.json"
    assert gonio("capture", folder, "-m", "mirror-phong", "-m", "lambert") == 2
    assert gonio("capture", folder, "-m", "oren-nayar(albedo=.2,.2,.2)", "-m", "lambert", "-o", output) == 0
    assert "2. " in capsys.readouterr().out
    fits = json.loads(output.read_text())["fits"]
    assert len(fits) == 2 and fits[0]["criterion"] <= fits[1]["criterion"]
    assert {type(go.material(f"{output}:{rank}")) for rank in (1, 2)} == {go.Lambert, go.OrenNayar}


def test_photographs_become_a_table_a_figure_and_a_plan(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = rehearsal.take(RIG, go.Lambert((0.5, 0.4, 0.3)), tmp_path / "photographs", noise=0.01)
    output = tmp_path / "chalk.gonio"
    assert gonio("capture", folder, "-m", "lambert", "-o", output, "--next", 1, "--json") == 0
    about = json.loads(capsys.readouterr().out)
    assert about["fit"]["parameters"]["albedo.r"]["value"] == pytest.approx(0.5, rel=0.01)
    assert len(about["next"][0]["position"]) == 3
    wi = np.array([[0.5, 0.0, np.sqrt(0.75)]])
    value = go.Measured(str(output)).eval([[-0.3, 0.0, np.sqrt(0.91)]], wi)
    np.testing.assert_allclose(value, np.array([[0.5, 0.4, 0.3]]) / np.pi * wi[0, 2], rtol=0.03)
    assert output.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


def test_photographs_are_planned_before_there_are_any(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rig.json"
    path.write_text(json.dumps(RIG | {"photographs": []}))
    assert gonio("capture", path, "-m", "lambert", "--next", 2) == 0
    assert capsys.readouterr().out.count("lamp at (") == 2


def test_a_bad_photograph_is_three_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "calibration.json").write_text(json.dumps(RIG))
    assert gonio("capture", tmp_path) == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert told[0].startswith("error: ") and "a.npz" in "".join(told) and len(told) <= 3
