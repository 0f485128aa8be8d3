"""The split sum on the page: beside the truth, their difference, and as the first picture while samples are few."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.energy.tables import prefilter
from gonio.pictures import images
from gonio.viewer import page as page_file
from gonio.viewer import stage
from scipy.ndimage import label
from web_page import COARSE, WIDE, Page

DROP = """async ([text]) => {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  await gonio.useFiles(new File([bytes], "sky.hdr"));
}"""

# What stands on the canvas after so many samples, as a screen has it, and the line below it.
CANVAS = """async (samples) => {
  const { app } = gonio;
  app.invalidate();
  await gonio.converge(samples);
  app.renderer.present(app.scene(), null, app.canvas.width, app.canvas.height);
  const { gl } = app, [w, h] = [app.canvas.width, app.canvas.height], bytes = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  let text = "";
  for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
  app.onRefresh("picture");
  return [w, h, btoa(text), document.querySelector(".status").textContent];
}"""
EARLY = "(on) => { const r = gonio.app.renderer; if (on) delete r.drawEarly; else r.drawEarly = () => {}; }"


def sky() -> np.ndarray:
    """Bright above, dark below, and a lamp; no more than a screen shows without a tone curve."""
    theta, phi = (np.arange(128)[:, None] + 0.5) / 128 * np.pi, (np.arange(256) + 0.5) / 256 * 2 * np.pi
    x, y, z = np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi, np.sin(theta) * np.cos(phi)
    lamp = np.exp(-20.0 * (1.0 - (0.48 * x + 0.6 * y + 0.64 * z)))
    above = 1.0 / (1.0 + np.exp(-8.0 * y))
    return np.stack([0.1 + 0.8 * lamp, 0.05 + 0.8 * above, 0.15 + 0.6 * above + 0.1 * x], -1).astype(np.float32)


@pytest.fixture(scope="module")
def lit_page(chrome: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    folder = tmp_path_factory.mktemp("split")
    models = [go.Conductor(fresnel="one"), go.KullaConty(go.Conductor.preset("Au", ndf="beckmann")), go.Lambert()]
    tab = chrome.new_page(viewport=WIDE, device_scale_factor=COARSE)
    page = Page(tab, page_file.export(stage.of_models(models), folder / "page.html"))
    page.set("s.lights = []; s.solo = 0")
    images.write(folder / "sky.hdr", sky())
    tab.evaluate(DROP, [base64.b64encode((folder / "sky.hdr").read_bytes()).decode()])
    tab.evaluate("() => { window.lit = structuredClone(gonio.state); }")
    yield page
    assert page.problems == []
    tab.close()


@pytest.fixture
def lit(lit_page: Page) -> Page:
    lit_page.tab.evaluate("() => gonio.app.store.replace(structuredClone(window.lit))")
    lit_page.tab.evaluate(EARLY, True)
    return lit_page


def of_term(page: Page, term: str, samples: int) -> np.ndarray:
    page.set(f"s.view.term = '{term}'")
    return page.picture(samples).astype(float)


def balls(picture: np.ndarray) -> list[np.ndarray]:
    """Where each ball of a row is whole, from left to right."""
    found, count = label(picture[..., 3] > 0.999)
    masks = [found == i for i in range(1, count + 1)]
    return sorted((m for m in masks if m.sum() > 200), key=lambda m: float(np.mean(np.nonzero(m)[1])))


@pytest.mark.slow
def test_the_difference_is_that_of_split_sum_and_truth(lit: Page) -> None:
    full, split = of_term(lit, "full", 128), of_term(lit, "split", 32)
    difference = of_term(lit, "split-error", 128)
    shares = []
    for ball in balls(full):
        unit = np.sqrt(np.mean(full[ball][:, :3] ** 2))
        apart = split[ball][:, :3] - full[ball][:, :3]
        assert np.sqrt(np.mean((difference[ball][:, :3] - apart) ** 2)) < 0.02 * unit
        shares.append(np.sqrt(np.mean(apart**2)) / unit)
    assert len(shares) == 5
    assert shares[0] < 0.05 < shares[2] < shares[4] < 0.6, shares  # it suits smooth surfaces


@pytest.mark.slow
def test_the_split_sum_is_what_gonio_bakes(lit: Page) -> None:
    """Seen straight on: E(1) times the baked level toward the camera. The page weighs by the lobe, not by i.n."""
    split = of_term(lit, "split", 32)
    levels = prefilter.prefilter(sky(), levels=7)
    for ball, roughness in zip(balls(split), (0.15, 0.35, 0.55, 0.75, 0.95), strict=True):
        rows, columns = np.nonzero(ball)
        middle = split[int(rows.mean()) - 1 : int(rows.mean()) + 3, int(columns.mean()) - 1 : int(columns.mean()) + 3]
        toward = np.array([0.0, 0.0, lit.state("camera.distance")]) - [2.4 * (5 * roughness - 0.75 - 2), 0.0, 0.0]
        x, y, z = toward / np.linalg.norm(toward)
        level, part = divmod(6 * roughness, 1.0)
        low, high = (prefilter.read(levels[int(level) + k], np.array([z, x, y])) for k in (0, 1))
        albedo = go.albedo(go.Conductor(fresnel="one", alpha=roughness**2), mu=[1.0]).value[0, 0]
        found, expected = middle[..., :3].mean((0, 1)), albedo * ((1 - part) * low + part * high)
        np.testing.assert_allclose(found, expected, rtol=0.04, atol=0.01)


@pytest.mark.slow
def test_under_even_light_the_split_sum_is_exact(lit: Page) -> None:
    lit.set("for (const light of s.lights) Object.assign(light, { image: null, constant: [.5, .5, .5] })")
    full = of_term(lit, "full", 32)
    difference = of_term(lit, "split-error", 128)
    for ball in balls(full):
        assert abs(difference[ball][:, :3].mean()) < 0.01 * full[ball][:, :3].mean()


@pytest.mark.slow
def test_what_has_no_lobe_about_the_mirrored_direction_is_sampled(lit: Page) -> None:
    """A diffuse ball looks up where its normal points, not where it mirrors: the split sum would be wrong there."""
    lit.set("s.solo = 2")
    bar = lit.tab.locator(".terms [data-value=split]")
    assert bar.is_disabled()
    sampled = lit.picture(64)
    lit.set("s.environment = 'split-sum'")
    np.testing.assert_array_equal(lit.picture(64), sampled)
    assert abs(of_term(lit, "split-error", 8)[..., :3]).max() == 0.0


@pytest.mark.slow
def test_the_terms_ask_for_an_environment(lit: Page) -> None:
    for term in ("split", "split-error"):
        assert lit.tab.locator(f".terms [data-value={term}]").is_enabled()
    lit.set("for (const light of s.lights) light.on = false")
    lit.tab.wait_for_function("() => document.querySelector('.terms [data-value=split]').disabled")
    lit.set("s.view.term = 'split'")
    link = lit.tab.evaluate("() => gonio.app.link()")
    assert "#s=" in link


def canvas(page: Page, samples: int, early: bool) -> np.ndarray:
    page.tab.evaluate(EARLY, early)
    width, height, text, status = page.tab.evaluate(CANVAS, samples)
    assert ("spp + split sum" in status) == (early and samples < 64)  # it says what it shows; from 64 on only the truth
    values = np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width, 4)[::-1, :, :3]
    return images.from_screen(values / np.float32(255.0))


@pytest.mark.slow
def test_the_early_picture_is_nearer_the_truth_at_every_number_of_samples(lit: Page) -> None:
    """The criterion by which the split sum is exact enough to be shown first: GGX, and Beckmann with compensation."""
    lit.set("s.solo = null; s.slots[2].visible = false; s.view.labels = false")
    where = balls(lit.picture(32))
    assert len(where) == 10
    truth = canvas(lit, 128, False)
    gains = {}
    for samples in (1, 4, 24):
        without, with_it = (canvas(lit, samples, early) for early in (False, True))
        errors = [[np.sqrt(np.mean((p[m] - truth[m]) ** 2)) for m in where] for p in (without, with_it)]
        gains[samples] = np.divide(errors[1], errors[0])
        assert np.all(gains[samples] < 1.01), (samples, gains[samples])
    assert np.all(gains[1] < 0.6) and np.all(gains[4] < 0.95), gains
    canvas(lit, 64, True)


@pytest.mark.slow
def test_what_is_read_of_the_picture_is_sampled_alone(lit: Page) -> None:
    lit.picture(64)  # the tables of the split sum are there afterwards
    canvas(lit, 4, True)
    with_it = lit.picture(4)
    canvas(lit, 4, False)
    np.testing.assert_array_equal(lit.picture(4), with_it)


@pytest.mark.slow
def test_the_page_stays_small(lit_page: Page) -> None:
    assert Path(lit_page.path).stat().st_size <= 1_500_000
