"""Shaders of measured materials give what Python gives for the same table.

Half vectors near a pole and values of 1e-6 at grazing angles move more by the roundings within a formula than by those
of its inputs, which is what `parity.judge` allows for. So these are held against Python's own float32.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import parity
import pytest
from gonio.measure.formats.own import Own
from gonio.measure.tables import angles, half_difference
from gonio.shaders import bundle

import browser

PUBLISHED = [
    "rgl/aurora_white_rgb.bsdf",
    "rgl/cc_ibiza_sunset_rgb.bsdf",
    "rgl/cg_sunflower_rgb.bsdf",
    "rgl/chm_mint_rgb.bsdf",
    "rgl/ilm_solo_m_68_rgb.bsdf",
    "rgl/irid_flake_paint1_rgb.bsdf",
    "rgl/paper_white_rgb.bsdf",
    "rgl/satin_rosaline_rgb.bsdf",
    "rgl/vch_silk_blue_rgb.bsdf",
    "nbrdf/merl.npz:nickel",
]
COPPER = go.mix(go.Conductor.preset("Cu", alpha=0.35), go.Lambert((0.1, 0.16, 0.42)), 0.5)


@pytest.fixture(scope="module")
def page() -> Iterator[Any]:
    with browser.page() as opened:
        yield opened


def _check(page: Any, lang: str, material: go.BSDF) -> None:
    draws = parity.draw(material, np.random.default_rng(7), 64 * 64)
    made = bundle(material, lang)
    assert made.manifest["textures"], "a measured material reads its table"
    got = (parity.run_glsl if lang == "glsl" else parity.run_wgsl)(page, made, draws)
    for name in ("eval", "pdf"):
        right = np.reshape(getattr(material, name)(draws.wo, draws.wi, precision="float64"), (len(draws.wo), -1))
        own = np.reshape(getattr(material, name)(draws.wo, draws.wi, precision="float32"), right.shape)
        size = np.abs(right).max(axis=1)
        seen = size > parity.DIM
        assert seen.sum() > 500
        off, known = (
            np.abs(np.reshape(x, right.shape)[seen] - right[seen]).max(axis=1) / size[seen] for x in (got[name], own)
        )
        assert np.median(off) < 2e-6, name
        for share in (90, 99, 99.9):
            limit = 3.0 * np.percentile(known, share) + 1e-5
            assert np.percentile(off, share) < limit, (
                f"{name}: {np.percentile(off, share)} at {share} %, {limit} allowed"
            )


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["angles", "half-difference"])
def test_a_table_gives_its_values_in_glsl(page: Any, kind: str, tmp_path: Path) -> None:
    def value(wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
        return COPPER.eval(wo, wi, precision="float64")

    table = angles.sampled(value, 24, 37) if kind == "angles" else half_difference.sampled(value, (30, 30, 60))
    path = tmp_path / "copper.gonio"
    path.write_bytes(Own().write(table))
    _check(page, "glsl", go.Measured(str(path)))


@pytest.mark.slow
def test_a_published_file_gives_its_values_in_glsl(page: Any, shared: Path) -> None:
    _check(page, "glsl", go.Measured(f"{shared}/data/rgl/cc_ibiza_sunset_rgb.bsdf"))


@pytest.mark.slow
@pytest.mark.parametrize("lang", ["glsl", "wgsl"])
@pytest.mark.parametrize("path", PUBLISHED, ids=lambda path: path.rpartition("/")[2])
def test_every_published_file_gives_its_values(page: Any, path: str, lang: str, shared: Path) -> None:
    if lang == "wgsl" and page.evaluate("async () => !navigator.gpu || !(await navigator.gpu.requestAdapter())"):
        pytest.skip("NOT TRIED in WebGPU: this browser has no adapter")
    _check(page, lang, go.Measured(f"{shared}/data/{path}"))
