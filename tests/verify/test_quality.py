"""Sampling quality against closed forms and brute force."""

from __future__ import annotations

import json

import gonio as go
import numpy as np
import pytest
from gonio.cli import main
from gonio.verify import directions, quality, verify
from gonio.verify.subject import of


def test_lambert_has_no_variance_and_mirrors_cannot_be_compared_with_the_cosine() -> None:
    lambert, mirror = (quality.of(of(model)) for model in (go.Lambert(0.4), go.Mirror(0.9)))
    assert lambert is not None and lambert.failed == 0.0 and lambert.variance < 1e-9 and lambert.cosine == 1.0
    efficiency = "the efficiency is 1.0 times that of cosine sampling and 100 % of the ideal"
    assert (
        lambert.words
        == f"sampling: 0 % of the samples fail, the relative variance of the weights is 0, and {efficiency}"
    )
    assert mirror is not None and mirror.cosine is None and mirror.ideal == pytest.approx(1.0)


def test_smooth_glass_chooses_by_power_and_a_mix_by_its_share() -> None:
    glass = quality.of(of(go.Dielectric(1.5, 0.0)))
    assert glass is not None and glass.variance < 1e-9 and glass.cosine is None
    # mirror or matte, each half of the time, with weight .9 or .1: variance .16, mean .5
    mixed = quality.of(of(go.mix(go.Mirror(0.9), go.Lambert(0.1), 0.5)))
    assert mixed is not None and mixed.variance == pytest.approx(0.16 / 0.5**2, rel=0.05)


def test_the_gain_over_cosine_sampling_is_that_of_brute_force() -> None:
    model = go.Conductor.preset("Au", alpha=0.6)
    found = quality.of(of(model))
    rng = np.random.default_rng(3)
    own, by_cosine = [], []
    for theta in quality.THETA:
        wo = np.repeat(directions.at(np.array([theta]), 20.0), 1 << 17, axis=0)
        u = rng.random((len(wo), 3))
        weight = model.sample(wo, u).weight.mean(1)
        r, phi = np.sqrt(u[:, 0]), 2.0 * np.pi * u[:, 1]
        wi = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1.0 - u[:, 0])], axis=1)
        value = model.eval(wo, wi).mean(1) * np.pi / wi[:, 2]
        own.append(weight.var() / weight.mean() ** 2)
        by_cosine.append(value.var() / value.mean() ** 2)
    assert found is not None
    assert found.variance == pytest.approx(np.mean(own), rel=0.1)
    assert found.cosine == pytest.approx(np.mean(by_cosine) / np.mean(own), rel=0.15)


def test_what_cannot_be_sampled_or_is_black_has_none() -> None:
    class Fails(go.Lambert):
        """Raises."""

        def sample(self, wo: object, u: object, mode: str = "radiance") -> object:
            raise ValueError("no")

    assert quality.of(of(Fails(0.5))) is None and quality.of(of(go.Lambert(0.0))) is None


@pytest.mark.slow
def test_cards_and_the_command_line_show_it(capsys: pytest.CaptureFixture[str]) -> None:
    report = verify(go.Phong(), quick=True, law="shader")
    assert "% of the ideal" in str(report) and report.as_dict()["cards"][0]["quality"]["ideal"] > 0.9  # type: ignore[index]
    with pytest.raises(SystemExit) as ended:
        main(["models", "--quality", "--json"])
    rows = json.loads(capsys.readouterr().out)
    assert not ended.value.code and set(rows) >= {"conductor", "mix"} and rows["lambert"]["failed"] == 0.0
