"""gonio bake, info and plot: what they print and write, and how they refuse."""

from __future__ import annotations

import json

import pytest
from gonio import cli


@pytest.mark.long
def test_bake_info_and_plot_work_together(tmp_path, capsys):
    folder = tmp_path / "t"
    assert cli.run(["bake", "ggx", "--resolution", "8", "-o", str(folder), "--json"]) == 0
    baked = json.loads(capsys.readouterr().out)
    assert cli.run(["info", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["hash"] == baked["hash"]
    assert cli.run(["plot", str(folder), "-o", str(tmp_path / "t.png")]) == 0
    assert (tmp_path / "t.png").stat().st_size > 1000


@pytest.mark.long
@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "words",
    [
        ["ggx", "--aspect", "0.5", "--azimuths", "3"],
        ["ggx", "--lut", "glass"],
        ["conductor", "--preset", "Au", "-p", "alpha=[0.1,0.3]"],
        ["lambert"],
    ],
    ids=["two-widths", "glass", "metal", "lambert"],
)
def test_every_kind_of_table_is_printed_and_drawn(tmp_path, capsys, words):
    folder = tmp_path / "t"
    assert cli.run(["bake", *words, "--resolution", "4", "-o", str(folder)]) == 0
    text = capsys.readouterr().out
    assert "max error" in text and "mu  " in text
    assert cli.run(["info", str(folder)]) == 0
    assert capsys.readouterr().out == text
    assert cli.run(["plot", str(folder), "-o", str(tmp_path / "t.png")]) == 0
    assert (tmp_path / "t.png").stat().st_size > 1000


def test_a_model_with_parameters_is_baked(tmp_path, capsys):
    words = ["bake", "conductor", "--preset", "Au", "-p", "masking=smith-separable", "--lut", "E", "--resolution", "4"]
    assert cli.run([*words, "-o", str(tmp_path / "t"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["masking"] == "smith-separable"


OWN = """
import gonio as go

class Half(go.KullaConty):
    "Half of what is missing."

class Worn(go.Conductor):
    "A metal of one's own."
"""


@pytest.mark.slow
def test_materials_of_ones_own_are_compared(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(OWN)
    words = ["compensation", "mine.py:Half", "mine.py:Worn(preset=Cu)", "--samples", "1000"]
    assert cli.run([*words, "--json", "-o", "figures"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["albedo"]["gold"]["half"] == found["albedo"]["gold"]["kulla-conty bounce"]
    assert found["albedo"]["worn"]["plain"] == found["albedo"]["copper"]["plain"]
    assert found["reciprocity"]["half"] < 1e-6 and (tmp_path / "figures/compensation.png").is_file()
    assert cli.run(["compensation", "mirror"]) == 2
    assert "Mirror has a perfectly specular part" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        ["bake", "ggx", "--resolution", "0"],
        ["bake", "gold"],
        ["bake", "ggx", "--masking", "x"],
        ["bake", "ggx", "-p", "alpha=.3"],
        ["bake", "ggx", "--aspect", "-1"],
        ["bake", "ggx", "-o", "no/folder"],
        ["compensation", "-o", "no/folder"],
        ["info", "missing"],
    ],
)
def test_bad_input_exits_with_2_and_writes_nothing(tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    assert cli.run(words) == 2
    assert "error:" in capsys.readouterr().err
    assert not any(tmp_path.iterdir())
