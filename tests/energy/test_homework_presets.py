"""gonio bake --preset: the homework's tables by its text and by its figures."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.energy.albedo import monte_carlo
from gonio.energy.albedo.quadrature import Points
from gonio.pictures import images


def _gray(path: Path) -> np.ndarray:
    return np.round(images.read(path, "linear").pixels[..., 0] * 255.0)


def test_the_two_presets_have_their_own_k(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, k in (("text", "k = (roughness + 1)^2 / 8"), ("figure", "k = alpha / 2")):
        folder = tmp_path / name
        assert cli.run(["bake", "--preset", f"homework-{name}", "--resolution", "32", "-o", str(folder)]) == 0
        finding = go.check(folder / "E.png")
        assert finding.passed and k in finding.facts[0], finding.lines()
        average = go.check(folder / "E_avg.png")
        assert average.passed and k in average.facts[0], average.lines()
    noisy = go.check(tmp_path / "figure/E.png").figures
    assert noisy["floor"] == 1e-4 and noisy["wrap"] == 1.0


@pytest.mark.shared
def test_the_figure_has_the_means_of_the_homeworks(shared: Path, tmp_path: Path) -> None:
    go.bake(preset="homework-figure", output=tmp_path)
    own, theirs = _gray(tmp_path / "E.png"), _gray(shared / "reference/kulla-conty/homework_E_cosine_sampled.png")
    converged = slice(0, 40)  # roughness above 0.7
    assert np.sqrt(np.mean((own - theirs)[converged] ** 2)) < 5.0
    means = np.abs(own.mean(axis=1) - theirs.mean(axis=1))
    assert means.mean() < 5.0 and means.max() < 25.0


def test_stratified_points_have_less_noise_than_independent_ones() -> None:
    at = Points(np.full(256, 0.5), np.full(256, 0.6))
    spread = {
        points: float(
            np.std(monte_carlo.estimate("ggx", "schlick-ibl", at, monte_carlo.Sampling("cosine", 256, points)).value)
        )
        for points in ("stratified", "independent")
    }
    assert spread["stratified"] < 0.4 * spread["independent"]
    with pytest.raises(go.InputError, match="250 stratified samples"):
        monte_carlo.estimate("ggx", "schlick-ibl", at, monte_carlo.Sampling("cosine", 250, "stratified"))


def test_what_a_preset_sets_cannot_be_given(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["bake", "--preset", "homework-text", "-o", str(tmp_path / "t")]
    assert cli.run([*words, "--masking", "schlick-ibl"]) == 2
    assert "--masking" in capsys.readouterr().err
    assert cli.run(["bake", "-o", str(tmp_path / "t")]) == 2
    assert "no target" in capsys.readouterr().err
    assert cli.run(["bake", "ggx", "--floor", "0.1", "-o", str(tmp_path / "t")]) == 2
    assert "--method cosine" in capsys.readouterr().err
