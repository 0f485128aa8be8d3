"""A page that has nothing but a written bundle draws with it: what docs/emit.md and the manifest tell is enough."""

from __future__ import annotations

import functools
import http.server
import io
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gonio.shaders import bundle
from gonio.shaders.languages import languages
from gonio.shaders.manifest import layout
from PIL import Image
from variants import EVERY

import browser

ROOT = Path(__file__).parents[2]
THREE = ROOT / "web/node_modules/three"
SIDE = 32


class _Folder(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *args: Any) -> None:
        pass


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser.chromium() as started:
        yield started


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    shutil.copy(ROOT / "docs/guides/program.html", tmp_path)
    handler = functools.partial(_Folder, directory=str(tmp_path))
    with browser.serving(handler) as root:
        yield f"{root}program.html"


@pytest.mark.sample(1)
@pytest.mark.parametrize("lang", ["glsl", "wgsl"])
@pytest.mark.parametrize("name", ["oren-nayar", "mix", "kulla-conty-turned", "kulla-conty-glass"])
def test_a_bundle_is_enough_to_draw_with(name: str, lang: str, chromium: Any, address: str, tmp_path: Path) -> None:
    material = EVERY[name]
    bundle(material, lang).write(tmp_path / "bundle")
    page = chromium.new_page()
    page.goto(address)
    if lang == "wgsl" and page.evaluate("async () => !navigator.gpu || !(await navigator.gpu.requestAdapter())"):
        pytest.skip("NOT TRIED in WebGPU: this browser has no adapter")
    page.wait_for_function("window.drawn !== undefined")
    drawn = np.array(page.evaluate("() => window.drawn")).reshape(SIDE, SIDE, 4)
    page.close()
    x = (np.arange(SIDE) + 0.5) / SIDE * 4.0 - 2.0
    wo = np.stack([*np.meshgrid(x, x), np.ones((SIDE, SIDE))], axis=-1).reshape(-1, 3)
    wo /= np.linalg.norm(wo, axis=-1, keepdims=True)
    wi = np.broadcast_to([0.36, 0.48, 0.8], wo.shape)
    expected = np.asarray(material.eval(wo, wi)).reshape(SIDE, SIDE, 3)
    assert expected.max() > 0.01 and np.all(drawn[..., 3] == 1.0)
    assert np.allclose(drawn[..., :3], expected, rtol=1e-4, atol=1e-6)


def test_the_page_of_three_js_draws_what_gonio_says(chromium: Any, tmp_path: Path) -> None:
    """The ball of docs/guides/three.html in its ring of lamps, at pixels well inside it."""
    if not THREE.exists():
        pytest.skip("NOT TRIED in three.js: `npm ci` in web/ installs it")
    shutil.copy(ROOT / "docs/guides/three.html", tmp_path)
    (tmp_path / "node_modules").mkdir()
    (tmp_path / "node_modules/three").symlink_to(THREE)
    material = EVERY["kulla-conty"]
    bundle(material, "glsl").write(tmp_path / "gold")
    page = chromium.new_page(viewport={"width": 480, "height": 360})
    with browser.serving(functools.partial(_Folder, directory=str(tmp_path))) as root:
        page.goto(f"{root}three.html")
        page.wait_for_function("window.drawn")
        drawn = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"), float) / 255.0
    page.close()
    eye = np.array([0.0, 0.8, 4.4])
    back = eye / np.linalg.norm(eye)
    right = np.cross([0.0, 1.0, 0.0], back)
    for x, y in [(180.5, 140.5), (240.5, 180.5), (300.5, 200.5), (250.5, 110.5)]:
        right_, up = (np.array([x, 360 - y]) / 180.0 - [480 / 360, 1.0]) * np.tan(np.radians(15.0))
        ray = right_ * right + up * np.cross(back, right) - back
        ray /= np.linalg.norm(ray)
        middle = -eye @ ray
        n = eye + (middle - np.sqrt(middle**2 - eye @ eye + 1.0)) * ray
        t = np.cross([0.3, 1.0, 0.2], n)
        local = np.stack([t / np.linalg.norm(t), np.cross(n, t / np.linalg.norm(t)), n])
        phi = np.arange(24) // 2 * 2.0 * np.pi / 12
        bright = np.arange(24) % 2 == 0
        toward = np.stack([np.cos(phi), np.sin(phi) + 0.2, np.where(bright, 0.6, -0.5)], -1)
        toward /= np.linalg.norm(toward, axis=-1, keepdims=True)
        values = material.eval(np.broadcast_to(local @ -ray, toward.shape), toward @ local.T)
        linear = np.sum(np.where(bright, 0.25, 0.1)[:, None] * np.asarray(values), axis=0)
        shown = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        assert np.abs(drawn[int(y), int(x)] - np.clip(shown, 0.0, 1.0)).max() < 2.5 / 255.0


@pytest.mark.slow
def test_fields_lie_in_a_buffer_as_the_language_has_it() -> None:
    types = ["float", "vec3", "vec2", "vec2", "float", "float", "vec3"]
    known = languages()
    assert layout(types, known["wgsl"]) == layout(types, known["glsl"]) == ([0, 16, 32, 40, 48, 52, 64], 80)
    assert layout(types, known["hlsl"]) == ([0, 4, 16, 24, 32, 36, 48], 64)
    assert layout([], known["wgsl"]) == ([], 16)
