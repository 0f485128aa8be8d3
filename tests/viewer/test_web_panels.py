"""The page's panels: what they plot is what the models say, read back as floats from the browser.

The page is the one that `gonio view --export` writes, opened from disk. Its evaluator runs the emitted shaders; here
their numbers meet the float64 of Python, and the page's metrics those of `gonio.pictures.metrics`.
"""

from __future__ import annotations

import base64
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.pictures import metrics
from gonio.viewer import page as page_file
from gonio.viewer import stage
from web_page import COARSE

sys.path.insert(0, str(Path(__file__).parents[1]))
import browser

MODELS = (
    go.KullaConty(go.Conductor.preset("Au", alpha=0.4)),
    go.Conductor.preset("Ag", alpha=(0.1, 0.4)),
    go.Dielectric(eta=1.5, alpha=0.3),
    go.OrenNayar(albedo=(0.7, 0.5, 0.2), sigma=0.4),
)
TIGHT = 1e-5  # relative error that is always allowed
SMALLER = {"width": 960, "height": 540}  # where a whole picture is awaited, or carried over to Python
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
        tab = chrome.new_page(viewport={"width": 1280, "height": 720}, device_scale_factor=COARSE)
        result = Opened(tab, what)
        tab.on("console", lambda m: result.messages.append(m.text) if m.type == "error" else None)
        tab.on("pageerror", lambda error: result.messages.append(str(error)))
        tab.goto(path.as_uri())
        tab.wait_for_function("() => window.gonio !== undefined")
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


@pytest.mark.sample(1)
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


@pytest.mark.slow
def test_one_direction_stands_for_all(opened: Opened) -> None:
    wi = directions(np.random.default_rng(2), 1500, False)  # more than one row of the target
    wo = wi[7]
    one = opened.ask("evaluate", 0, 0, wo, wi.ravel())
    many = opened.ask("evaluate", 0, 0, np.tile(wo, (len(wi), 1)).ravel(), wi.ravel())
    assert one["value"] == many["value"]


@pytest.mark.slow
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


def test_terms_multiply_to_eval(opened: Opened) -> None:
    rng = np.random.default_rng(6)
    wo, wi = directions(rng, 500, False), directions(rng, 500, False)
    assert isinstance(opened.model(1, 0), go.Conductor)
    terms = opened.ask("terms", 1, 0, wo.ravel(), wi.ravel())
    value = np.reshape(opened.ask("evaluate", 1, 0, wo.ravel(), wi.ravel())["value"], (-1, 3))
    d, g = np.asarray(terms["D"])[:, None], np.asarray(terms["G"])[:, None]
    # eval holds |cos theta_i|: F D G / (4 (n.o)) is left (course sheet, eq. 4)
    expected = np.reshape(terms["F"], (-1, 3)) * d * g / (4 * wo[:, 2:])
    assert np.allclose(value, expected, rtol=2e-5, atol=1e-9)


def test_too_few_numbers_are_refused(opened: Opened) -> None:
    with pytest.raises(Exception, match="three per direction"):
        opened.ask("evaluate", 0, 0, [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 1.0])


@pytest.mark.sample(1)
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


@pytest.mark.slow
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


@pytest.mark.slow
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


# --------------------------------------------------------------------------- panels


@pytest.fixture
def fresh(opened: Opened) -> Iterator[Opened]:
    """The page as it was written: no tab open, no reference, no comparison."""
    opened.tab.set_viewport_size({"width": 1280, "height": 720})
    opened.tab.evaluate("gonio.app.setReference(null), gonio.app.store.reset()")
    yield opened
    opened.tab.evaluate("gonio.app.setReference(null), gonio.app.store.reset()")


def open_panel(opened: Opened, panel: str) -> Any:
    opened.tab.evaluate("panel => gonio.app.store.set('dock.open', panel)", panel)
    body = opened.tab.locator(f".panel-body[data-panel='{panel}']")
    body.wait_for(state="visible")
    return body


def ink(image: bytes) -> np.ndarray:
    """A screenshot as numbers, (H, W, 3)."""
    import io

    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(image)).convert("RGB"), dtype=float)


def drawn(tab: Any, body: Any) -> bool:
    """Whether something shows on a panel's canvas, within ten seconds: values come from the GPU when they are ready."""
    for _ in range(40):
        box = body.locator("canvas >> visible=true").first.bounding_box()
        if box and ink(tab.screenshot(clip=box)).std() > 3:
            return True
        tab.wait_for_timeout(250)
    return False


PANELS = ("lobe", "slices", "half-difference", "albedo", "tables", "compare", "probe")
WIDE, NARROW = (1280, 720), (390, 844)
# each in the light and on a phone, and those of one drawing each in the dark, which is a list of colours
QUICK = {("light", WIDE, panel) for panel in PANELS if panel != "albedo"} | {("light", NARROW, p) for p in PANELS}
QUICK |= {("dark", WIDE, panel) for panel in ("lobe", "tables")}


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("theme", "size", "panel"),
    [
        pytest.param(theme, size, panel, marks=() if (theme, size, panel) in QUICK else pytest.mark.slow)
        for theme, size in (("light", WIDE), ("dark", WIDE), ("light", NARROW))
        for panel in PANELS
    ],
)
def test_panels_open_and_draw(fresh: Opened, panel: str, theme: str, size: tuple[int, int]) -> None:
    fresh.tab.set_viewport_size({"width": size[0], "height": size[1]})
    fresh.tab.evaluate("theme => gonio.app.store.set('display.theme', theme)", theme)
    body = open_panel(fresh, panel)
    fresh.tab.wait_for_function(
        "panel => document.querySelector(`.panel-body[data-panel='${panel}'] .p-note`)?.textContent.length > 10",
        arg=panel,
    )
    assert body.bounding_box()["width"] <= size[0]
    if panel in ("compare", "probe"):
        return
    body.scroll_into_view_if_needed()
    assert drawn(fresh.tab, body)


def test_table_read_out_is_the_float(fresh: Opened) -> None:
    body = open_panel(fresh, "tables")
    manifest, tables = fresh.tab.evaluate("[gonio.app.shaderOf(0).manifest, gonio.app.shaderOf(0).variant.tables]")
    assert manifest["textures"], "Kulla-Conty reads a table"
    texture = manifest["textures"][0]
    first = body.locator("select").first
    assert "albedo" in first.locator("option").first.text_content()  # E(mu) itself stands before its coefficients
    first.select_option(index=1)
    canvas = body.locator("canvas")
    canvas.wait_for(state="visible")
    box = canvas.bounding_box()
    import re

    floats = np.frombuffer(base64.b64decode(tables[texture["uniform"]]), "<f4")
    columns, channels = texture["size"][0], texture["channels"]
    seen = set()
    for across in (0.2, 0.45, 0.7):
        canvas.hover(position={"x": across * box["width"], "y": 0.2 * box["height"]})
        read = body.locator(".p-read").text_content()
        found = re.match(r"texel \((\d+), (\d+)\).*?: (.*)", read)
        assert found, read
        i, j = int(found[1]), int(found[2])
        shown = np.array(found[3].split(), np.float32)
        at = (j * columns + i) * channels
        assert np.array_equal(shown, floats[at : at + channels])  # nine digits tell all float32 apart
        seen.add(i)
    assert len(seen) == 3


# a typed array as text, which crosses to Python a hundred times faster than number by number
PACKED = """(() => {
  globalThis.packed = (array) => {
    const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
    let text = "";
    for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
    return [array.BYTES_PER_ELEMENT, btoa(text)];
  };
})()"""


def unpacked(tab: Any, script: str) -> list[Any]:
    """What a script returns, a list in which `packed(array)` stands for an array, flat."""
    tab.evaluate(PACKED)
    return [
        np.frombuffer(base64.b64decode(entry[1]), f"<f{entry[0]}") if isinstance(entry, list) else entry
        for entry in tab.evaluate(script)
    ]


SETTLED = "() => gonio.converge(16)"  # at its end the page shows the picture, as its state has it by then

REFERENCE = """([exposure]) => {
  const picture = gonio.readPixels();
  const data = picture.data.map((v, i) => i % 4 === 3 ? v : v * exposure);
  gonio.app.setReference({ width: picture.width, height: picture.height, data, samples: 16, done: true });
}"""


@pytest.mark.slow
def test_wipe_shows_one_picture_on_each_side(fresh: Opened) -> None:
    fresh.tab.set_viewport_size(SMALLER)
    fresh.tab.evaluate(SETTLED)
    plain = ink(fresh.tab.locator("canvas").first.screenshot())
    fresh.tab.evaluate(REFERENCE, [0.25])
    fresh.tab.evaluate("gonio.app.store.set('compare.mode', 'wipe'), gonio.app.store.set('display.tone', 'reinhard')")
    fresh.tab.evaluate("gonio.app.store.set('display.tone', 'none')")
    handle = fresh.tab.locator(".p-handle")
    handle.wait_for(state="visible")
    fresh.tab.evaluate(SETTLED)
    half = ink(fresh.tab.locator("canvas").first.screenshot())
    width = plain.shape[1]
    middle = width // 2
    left, right = slice(0, middle - 40), slice(middle + 40, None)
    assert np.abs(half[:, left] - plain[:, left]).mean() < 1
    assert plain[:, right].mean() - half[:, right].mean() > 2  # the reference is two stops darker
    box = handle.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 4
    fresh.tab.mouse.move(x, y)
    fresh.tab.mouse.down()
    fresh.tab.mouse.move(x - 0.3 * width, y, steps=3)
    fresh.tab.mouse.up()
    fresh.tab.wait_for_function("gonio.state.compare.wipe < 0.4")
    fresh.tab.evaluate(SETTLED)
    moved = ink(fresh.tab.locator("canvas").first.screenshot())
    band = slice(middle - width // 4, middle - 40)
    assert half[:, band].mean() - moved[:, band].mean() > 1


@pytest.mark.slow
def test_figures_on_the_page_are_pythons(fresh: Opened) -> None:
    fresh.tab.set_viewport_size(SMALLER)
    open_panel(fresh, "compare")
    fresh.tab.evaluate("gonio.app.store.setPanel('compare', { pixels: 'all', kind: 'relative' })")
    fresh.tab.evaluate("gonio.app.store.set('compare.mode', 'difference')")
    fresh.tab.evaluate("() => gonio.converge(16)")
    fresh.tab.evaluate(REFERENCE, [1.1])
    fresh.tab.wait_for_function("() => gonio.comparison().figures?.flip > 0", timeout=60_000)
    # Figures and pictures in one call: between two the page may have compared anew, with more samples
    figures, *pair = unpacked(
        fresh.tab,
        "{ const { figures, pair: p } = gonio.comparison();"
        " [figures, p.width, p.height, packed(p.test), packed(p.reference)] }",
    )
    test, reference = (np.reshape(x, (pair[1], pair[0], 4))[..., :3] for x in pair[2:])
    assert figures["rmse"] == pytest.approx(metrics.rmse(test, reference), rel=1e-6)
    assert figures["relmse"] == pytest.approx(metrics.relmse(test, reference), rel=1e-6)
    assert figures["meanRatio"] == pytest.approx(1 / 1.1, rel=0.02)  # the raster goes on from 16 samples
    assert 0 < figures["flip"] < 0.5
    scale = fresh.tab.locator(".p-scale")
    assert "0.01" in scale.text_content()


@pytest.mark.slow
def test_smaller_reference_is_compared_with_averages(fresh: Opened) -> None:
    fresh.tab.set_viewport_size(SMALLER)
    open_panel(fresh, "compare")
    fresh.tab.evaluate("gonio.app.store.setPanel('compare', { pixels: 'all' })")
    fresh.tab.evaluate(
        """() => gonio.converge().then(picture => {
      if (picture.width % 2 || picture.height % 2) throw new Error('an even number of pixels each way is needed');
      const [w, h] = [picture.width / 2, picture.height / 2];
      const data = new Float32Array(4 * w * h);
      for (let y = 0; y < 2 * h; y++) for (let x = 0; x < 2 * w; x++) for (let c = 0; c < 4; c++)
        data[4 * ((y >> 1) * w + (x >> 1)) + c] += picture.data[4 * (y * 2 * w + x) + c] / 4;
      gonio.app.setReference({ width: w, height: h, data, samples: 16, done: true });
    })"""
    )
    fresh.tab.wait_for_function("() => gonio.comparison().figures !== null", timeout=30_000)
    assert fresh.tab.evaluate("gonio.comparison().figures.rmse") < 1e-6


def test_probe_reads_the_pixel(fresh: Opened) -> None:
    fresh.tab.set_viewport_size(SMALLER)
    body = open_panel(fresh, "probe")
    fresh.tab.evaluate("() => gonio.converge()")
    fresh.tab.evaluate(REFERENCE, [0.5])
    picture = unpacked(fresh.tab, "{ const p = gonio.app.picture(); [p.width, p.height, packed(p.data)] }")
    data = np.reshape(picture[2], (picture[1], picture[0], 4))
    lit = np.argwhere((data[..., 3] > 0.999) & (data[..., 0] > 0.05))
    y, x = lit[len(lit) // 2]
    canvas = fresh.tab.locator("canvas").first
    box = canvas.bounding_box()
    canvas.hover(position={"x": (x + 0.5) / picture[0] * box["width"], "y": (y + 0.5) / picture[1] * box["height"]})
    fresh.tab.wait_for_function("() => document.querySelectorAll('.panel-body[data-panel=probe] tr').length === 5")
    fresh.tab.wait_for_timeout(500)  # the probe reads five times a second
    cells = [row.locator("td").all_text_contents() for row in body.locator("tr").all()[1:]]
    raster, reference, difference, ratio = np.array([[float(x) for x in row] for row in cells])
    column, row = (int(x) for x in body.locator(".p-note").text_content().split("(")[1].split(")")[0].split(","))
    assert abs(column - x) <= 1 and abs(row - y) <= 1  # the canvas may begin at a fraction of a pixel
    assert np.allclose(raster[[0, 1, 2, 4]], data[row, column], rtol=1e-6)
    assert np.allclose(reference[:3], 0.5 * raster[:3], rtol=1e-6)
    assert np.allclose(difference[:3], raster[:3] - reference[:3], rtol=1e-5)
    assert np.allclose(ratio[:3], 2, rtol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("size", [(960, 540), (390, 844)])
def test_side_by_side_shows_the_same_place_twice(fresh: Opened, size: tuple[int, int]) -> None:
    fresh.tab.set_viewport_size({"width": size[0], "height": size[1]})
    fresh.tab.evaluate("() => gonio.converge(16)")
    fresh.tab.evaluate(REFERENCE, [1.0])
    fresh.tab.evaluate("gonio.app.store.set('compare.mode', 'side')")
    fresh.tab.evaluate(SETTLED)
    for width, height in ((800, 400), (300, 500)):
        at = "([w, h, x, y]) => gonio.comparison().view.pictureAt(w, h, x, y)"
        first = (0.3, 0.4) if width > height else (0.4, 0.3)
        second = (0.8, 0.4) if width > height else (0.4, 0.8)
        a, b = (fresh.tab.evaluate(at, [width, height, *point]) for point in (first, second))
        assert a == pytest.approx(b)
        assert all(0 < v < 1 for v in a)
    stage_ = fresh.tab.locator("canvas").first.bounding_box()
    shown = ink(fresh.tab.screenshot(clip=stage_))
    h, w = shown.shape[:2]
    halves = (shown[: h // 2], shown[h - h // 2 :]) if h > w else (shown[:, : w // 2], shown[:, w - w // 2 :])
    # the words on the pictures differ: on a phone 15 per cent of the pixels, where other places would differ in 28
    assert np.mean(np.abs(halves[0] - halves[1]).max(axis=2) > 24) < 0.2
    assert halves[0].std() > 10


@pytest.mark.slow
def test_a_reference_of_what_was_shown_before_is_not_measured(fresh: Opened) -> None:
    body = open_panel(fresh, "compare")
    fresh.tab.evaluate("() => gonio.converge(2)")
    fresh.tab.evaluate(REFERENCE, [1.1])
    fresh.tab.wait_for_function("() => gonio.comparison().figures !== null", timeout=30_000)
    fresh.tab.evaluate("gonio.app.setReference({ ...gonio.app.referencePicture(), stale: true })")
    fresh.tab.wait_for_function("() => gonio.comparison().figures === null", timeout=30_000)
    assert "Waiting for the reference" in body.locator(".p-note").text_content()


@pytest.mark.slow
def test_page_without_a_server_says_so(fresh: Opened) -> None:
    body = open_panel(fresh, "compare")
    fresh.tab.wait_for_function(
        "() => document.querySelector('.panel-body[data-panel=compare] .p-note').textContent.includes('gonio view')"
    )
    assert body.locator("tr").count() == 0
