"""The page's panels: what they plot is what the models say, read back as floats from the browser.

The page is the one that `gonio view --export` writes, opened from disk. Its evaluator runs the emitted shaders; here
their numbers meet the float64 of Python, and the page's metrics those of `gonio.render.metrics`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.render import metrics
from gonio.viewer import page as page_file
from gonio.viewer import stage

sys.path.insert(0, str(Path(__file__).parents[1]))
import browser

MODELS = (
    go.KullaConty(go.Conductor.preset("Au", alpha=0.4)),
    go.Conductor.preset("Ag", alpha=(0.1, 0.4)),
    go.Dielectric(eta=1.5, alpha=0.3),
    go.OrenNayar(albedo=(0.7, 0.5, 0.2), sigma=0.4),
)
TIGHT = 1e-5  # relative error that is always allowed
MOVES = 8  # times the change of the float64 value when the directions move by one float32: narrow lobes are steep


class Opened:
    """The page, the models of its slots with the values of their balls, and what it wrote on its console."""

    def __init__(self, tab: Any, what: stage.Stage) -> None:
        self.tab, self.what = tab, what
        self.messages: list[str] = []

    def model(self, slot: int, ball: int) -> go.BSDF:
        row = self.what.rows[slot]
        return stage.replaced(self.what.materials[row.material].bsdf, row.balls[ball].values)

    def ask(self, name: str, *arguments: Any) -> Any:
        plain = [x.tolist() if isinstance(x, np.ndarray) else x for x in arguments]
        return self.tab.evaluate("([name, given]) => window.gonio[name](...given)", [name, plain])


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    what = stage.of_models(MODELS)
    path = page_file.export(what, tmp_path_factory.mktemp("page") / "page.html")
    with browser.chromium() as chrome:
        tab = chrome.new_page(viewport={"width": 1280, "height": 720})
        result = Opened(tab, what)
        tab.on("console", lambda m: result.messages.append(m.text) if m.type == "error" else None)
        tab.on("pageerror", lambda error: result.messages.append(str(error)))
        tab.goto(path.as_uri())
        tab.wait_for_function("window.gonio !== undefined")
        yield result
        assert not result.messages


def directions(rng: np.random.Generator, count: int, below: bool) -> np.ndarray:
    z = rng.uniform(0.15, 1.0, count) * np.where(rng.random(count) < 0.5 * below, -1.0, 1.0)
    phi = rng.uniform(0, 2 * np.pi, count)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1).astype(np.float32).astype(np.float64)


def step(w: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Every component one float32 up or down."""
    w32 = w.astype(np.float32)
    return np.nextafter(w32, w32 + rng.choice(np.float32([-1, 1]), w.shape), dtype=np.float32).astype(float)


@pytest.mark.parametrize("slot", range(len(MODELS)))
def test_evaluator_agrees_with_python(opened: Opened, slot: int) -> None:
    rng = np.random.default_rng(1)
    ball = min(2, len(opened.what.rows[slot].balls) - 1)
    model = opened.model(slot, ball)
    wo, wi = (directions(rng, 3000, model.transmits) for _ in range(2))
    got = opened.ask("evaluate", slot, ball, wo.ravel(), wi.ravel())
    value, density = np.reshape(got["value"], (-1, 3)), np.asarray(got["pdf"])
    expected = model.eval(wo, wi, precision="float64")
    judged = expected > 1e-3
    assert judged.any(axis=1).sum() > 100
    moved = [(step(wo, rng), step(wi, rng)) for _ in range(8)]
    change = np.max([np.abs(model.eval(a, b, precision="float64") - expected) for a, b in moved], axis=0)
    assert np.all(np.abs(value - expected)[judged] <= np.maximum(TIGHT * expected, MOVES * change)[judged])
    pdf = model.pdf(wo, wi, precision="float64")
    change = np.max([np.abs(model.pdf(a, b, precision="float64") - pdf) for a, b in moved], axis=0)
    assert np.all(np.abs(density - pdf) <= np.maximum(TIGHT * np.maximum(pdf, 1e-3), MOVES * change))


def test_one_direction_stands_for_all(opened: Opened) -> None:
    wi = directions(np.random.default_rng(2), 1500, False)  # more than one row of the target
    wo = wi[7]
    one = opened.ask("evaluate", 0, 0, wo, wi.ravel())
    many = opened.ask("evaluate", 0, 0, np.tile(wo, (len(wi), 1)).ravel(), wi.ravel())
    assert one["value"] == many["value"]


def test_samples_carry_eval_over_pdf(opened: Opened) -> None:
    rng = np.random.default_rng(3)
    wo, u = directions(rng, 2000, False), rng.random((2000, 3)).astype(np.float32).astype(float)
    drawn = opened.ask("sample", 0, 0, wo.ravel(), u.ravel())
    wi, weight, pdf = np.reshape(drawn["wi"], (-1, 3)), np.reshape(drawn["weight"], (-1, 3)), np.asarray(drawn["pdf"])
    assert np.allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-5)
    kept = (pdf > 1e-3) & (wi[:, 2] > 0.1)
    assert kept.sum() > 1000
    expected = opened.model(0, 0).eval(wo, wi.astype(float), precision="float64")[kept] / pdf[kept, None]
    assert np.allclose(weight[kept], expected, rtol=1e-3)


def test_too_few_numbers_are_refused(opened: Opened) -> None:
    with pytest.raises(Exception, match="three a direction"):
        opened.ask("evaluate", 0, 0, [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 1.0])


@pytest.mark.parametrize("slot", range(len(MODELS)))
def test_albedo_curve_is_the_albedo(opened: Opened, slot: int) -> None:
    mu = np.array([0.1, 0.4, 0.7, 1.0])
    wo = np.stack([np.sqrt(1 - mu**2), 0 * mu, mu], axis=1)
    ball = 2 if len(opened.what.rows[slot].balls) > 2 else 0
    got = opened.ask("albedo", slot, ball, wo.ravel(), 3e-4)
    value, error = np.reshape(got["value"], (-1, 3)), np.reshape(got["error"], (-1, 3))
    assert error.max() <= 3e-4 or got["samples"] == 16 * 4096
    exact = go.albedo(opened.model(slot, ball), mu)
    # four standard errors of either, and what float32 sums of weights round to
    assert np.all(np.abs(value - exact.value) < 4 * (error + exact.error) + 2e-5)


def test_flip_is_pythons(opened: Opened) -> None:
    rng = np.random.default_rng(4)
    y, x = np.mgrid[0:40, 0:56]
    reference = np.stack([0.5 + 0.4 * np.sin(x / 5), 0.2 + 0.5 * (y > 20), x / 60], axis=2)
    test = np.clip(reference + 0.1 * (x[..., None] > 30) * rng.random((40, 56, 3)), 0, 1)
    got = np.reshape(opened.ask("flip", test.ravel(), reference.ravel(), 56, 40), (40, 56))
    expected = metrics.flip_map(test, reference, hdr=False)
    assert expected.max() > 0.05
    assert np.max(np.abs(got - expected)) < 1e-6
    assert np.max(np.abs(opened.ask("flip", test.ravel(), test.ravel(), 56, 40))) == 0


def balls(width: int, height: int, light: float, soft: float = 3.0) -> np.ndarray:
    """RGBA with two discs, premultiplied, their rims `soft` pixels wide; top row first."""
    y, x = np.mgrid[0:height, 0:width] + 0.5
    rgba = np.zeros((height, width, 4))
    for centre in (0.25, 0.75):
        distance = np.hypot(x - centre * width, y - height / 2)
        cover = np.clip((0.35 * height - distance) / soft + 0.5, 0, 1)
        shade = light * (0.2 + 0.8 * x / width)[..., None] * np.array([1.0, 0.7, 0.4])
        rgba += np.concatenate([cover[..., None] * shade, cover[..., None]], axis=2)
    return rgba.astype(np.float32)


def test_figures_are_pythons(opened: Opened) -> None:
    test, reference = balls(80, 40, 1.1), balls(80, 40, 1.0)
    rng = np.random.default_rng(5)
    test[..., :3] *= 1 + 0.05 * rng.random(test[..., :3].shape).astype(np.float32)
    for pixels in ("all", "balls", "inside"):
        got = opened.ask("measure", test.ravel(), reference.ravel(), 80, 40, pixels)
        cover = reference[..., 3]
        if pixels == "all":
            mask = np.ones_like(cover, bool)
        elif pixels == "balls":
            mask = cover > 0
        else:  # fully covered, and so are the eight neighbours
            full = np.pad(cover >= 1, 1, constant_values=True)
            mask = np.min([full[i : i + 40, j : j + 80] for i in range(3) for j in range(3)], axis=0).astype(bool)
        a, b = test[mask][None, :, :3], reference[mask][None, :, :3]
        assert got["pixels"] == mask.sum()
        assert got["rmse"] == pytest.approx(metrics.rmse(a, b), rel=1e-6)
        assert got["relmse"] == pytest.approx(metrics.relmse(a, b), rel=1e-6)
        assert got["meanRatio"] == pytest.approx(metrics.mean_ratio(a, b), rel=1e-6)
