"""A page that has nothing but a written bundle draws with it: what docs/emit.md and the manifest tell is enough."""

from __future__ import annotations

import functools
import http.server
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gonio.shaders import bundle
from gonio.shaders.languages import languages
from gonio.shaders.manifest import layout
from variants import EVERY

import browser

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
    shutil.copy(Path(__file__).with_name("alone.html"), tmp_path)
    handler = functools.partial(_Folder, directory=str(tmp_path))
    with browser.serving(handler) as root:
        yield f"{root}alone.html"


@pytest.mark.sample(3)
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


def test_fields_lie_in_a_buffer_as_the_language_has_it() -> None:
    types = ["float", "vec3", "vec2", "vec2", "float", "float", "vec3"]
    known = languages()
    assert layout(types, known["wgsl"]) == layout(types, known["glsl"]) == ([0, 16, 32, 40, 48, 52, 64], 80)
    assert layout(types, known["hlsl"]) == ([0, 4, 16, 24, 32, 36, 48], 64)
    assert layout([], known["wgsl"]) == ([], 16)
