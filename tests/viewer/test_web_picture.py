"""The page's picture: judged by rays through the pixels of the same camera and `eval` of the same models in float64."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from gonio.viewer import stage
from web_page import Page, rows_of_balls


def python_picture(what: stage.Stage, lights: list[dict[str, Any]], size: tuple[int, int], side: int) -> np.ndarray:
    """Box-filtered radiance of the balls under directional and point lights, (height, width, 4), in float64."""
    width, height = size
    camera = what.framed()
    half = math.tan(math.radians(camera["fov"]) / 2) * max(1.0, 16 / 9 * height / width)
    eye = np.array([0.0, 0.0, camera["distance"]])
    offsets = (np.arange(side) + 0.5) / side
    x = (np.arange(width)[:, None] + offsets).ravel()
    y = (np.arange(height)[:, None] + offsets).ravel()
    rays = np.stack(
        np.broadcast_arrays(*np.meshgrid((2 * x - width) / height * half, (height - 2 * y) / height * half), -1.0), -1
    )
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    picture = np.zeros((*rays.shape[:2], 4))
    for i, row in enumerate(what.rows):
        for j, ball in enumerate(row.balls):
            centre = np.array([(j - (len(row.balls) - 1) / 2), ((len(what.rows) - 1) / 2 - i), 0.0]) * stage.SPACING
            towards = eye - centre
            b = rays @ towards
            inside = b * b - towards @ towards + 1
            hit = inside > 0
            w = rays[hit]
            n = towards + (-b[hit] - np.sqrt(inside[hit]))[:, None] * w
            t = np.stack([n[:, 2], np.zeros(len(n)), -n[:, 0]], -1)
            t /= np.linalg.norm(t, axis=-1, keepdims=True)
            frame = np.stack([t, np.cross(n, t), n], 1)
            model = stage.replaced(what.materials[row.material].bsdf, ball.values)
            total = np.zeros((len(n), 3))
            for d, power in (part for light in lights for part in light_parts(light, centre + n)):
                local = [np.einsum("nij,nj->ni", frame, v) for v in (-w, d)]
                total += power * np.asarray(model.eval(*local, precision="float64"))
            picture[hit] = np.concatenate([total, np.ones((len(n), 1))], -1)
    return picture.reshape(height, side, width, side, 4).mean((1, 3))


def light_parts(light: dict[str, Any], surface: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Directions from surface points to a light, and irradiance across them; an area light in 8 x 8 cells."""
    if light["type"] == "directional":
        d = np.array(light["direction"]) / np.linalg.norm(light["direction"])
        yield np.broadcast_to(d, surface.shape), np.broadcast_to(light["irradiance"], surface.shape)
        return
    if light["type"] == "point":
        places, power, across = [np.array(light["position"])], np.array(light["intensity"]), None
    else:
        cells = (np.arange(8) + 0.5) / 4 - 1
        u, v = np.array(light["u"]), np.array(light["v"])
        places = [light["center"] + a * u + b * v for a in cells for b in cells]
        power, across = np.array(light["radiance"]) * 4 / 64, np.cross(u, v)
    for place in places:
        to = place - surface
        distance = np.linalg.norm(to, axis=-1, keepdims=True)
        d = to / distance
        yield d, power / distance**2 * (1.0 if across is None else abs(d @ across)[:, None])


POINT = {"type": "point", "position": [3.0, 4.0, 5.0], "intensity": [120.0, 90.0, 60.0]}


@pytest.mark.slow
@pytest.mark.parametrize(
    "light",
    [pytest.param(stage.SUN, id="directional"), pytest.param(POINT, id="point", marks=pytest.mark.slow)],
)
def test_converged_picture_is_what_python_computes(page: Page, light: dict[str, Any]) -> None:
    page.set(f"s.lights = [{{ ...{json.dumps(light)}, on: true, name: 'only' }}]")
    raster = page.picture(256)
    height, width = raster.shape[:2]
    truth = python_picture(stage.homework(), [light], (width, height), 8)
    inner = (raster[..., 3] > 1 - 1e-4) & (truth[..., 3] > 1 - 1e-4)
    assert inner.sum() > 0.15 * inner.size
    difference = (raster - truth)[inner][:, :3]
    error = np.mean(difference**2 / (truth[inner][:, :3] ** 2 + 0.01))
    print(f"relMSE {error:.2e}")
    assert error < 1e-4
    assert abs(raster[..., 3] - truth[..., 3]).max() < 0.1  # a rim along one of the 8 lines of rays: 1/16


AREA = {
    "type": "area",
    "center": [-3.0, 4.0, 6.0],
    "u": [1.5, 0, 0],
    "v": [0, 1.0, -0.7],
    "radiance": [12.0, 12.0, 12.0],
}


@pytest.mark.slow
def test_area_light_is_summed_over_its_surface(page: Page) -> None:
    """Means over the balls, rough ones, since cells stand for the light in Python."""
    lower = dataclasses.replace(stage.homework(), rows=stage.homework().rows[1:])
    camera = {k: v for k, v in stage.homework().framed().items() if k in ("distance", "fov")}
    page.set(f"s.lights = [{{ ...{json.dumps(AREA)}, on: true, name: 'only' }}]; s.solo = 1")
    raster = page.picture(256)
    truth = python_picture(dataclasses.replace(lower, camera=camera), [AREA], raster.shape[1::-1], 2)
    inner = (raster[..., 3] > 1 - 1e-4) & (truth[..., 3] > 1 - 1e-4)
    columns = np.arange(raster.shape[1])
    for ball in (2, 3, 4):
        here = inner & (abs(columns - raster.shape[1] * (ball + 0.6) / 6.2) < raster.shape[1] / 13)
        assert raster[here][:, 1].mean() == pytest.approx(truth[here][:, 1].mean(), rel=2e-3)
        difference = (raster - truth)[here][:, 1]
        assert np.mean(difference**2 / (truth[here][:, 1] ** 2 + 0.01)) < 1e-3


def test_upper_row_is_brighter_the_more_so_the_rougher(page: Page) -> None:
    means = rows_of_balls(page.picture(32))
    gain = means[0, :, 1] / means[1, :, 1]
    assert np.all(np.diff(gain) > 0)
    assert gain[0] < 1.05 and 1.5 < gain[4] < 3.5


@pytest.mark.slow
def test_white_furnace_hides_the_compensated_row(page: Page) -> None:
    """At F = 1 the upper row may differ from the radiance around it by one step of a screen; the lower is darker."""
    page.tab.keyboard.press("f")
    assert page.state("furnace") is True
    page.set(
        "for (const [slot, stem] of [[0, 'base.'], [1, '']])"
        " s.slots[slot].values = { [stem + 'eta']: [0, 0, 0], [stem + 'k']: [1, 1, 1] };"
    )
    picture = page.picture(64)
    half = picture.shape[0] // 2
    covered = picture[..., 3] > 1 - 1e-4
    upper = picture[:half][covered[:half]][:, :3]
    assert abs(upper - 1).max() < 1 / 255
    means = rows_of_balls(picture)
    assert np.all(means[1, :, 1] < 1 + 1e-3) and means[1, 4, 1] < 0.7
    page.tab.keyboard.press("f")
    assert page.state("furnace") is False


@pytest.mark.slow
def test_single_and_multi_make_the_whole(page: Page) -> None:
    pictures = {}
    for term in ("full", "single", "multi", "compensated", "difference"):
        page.set(f"s.view.term = '{term}'")
        picture = page.picture(16)
        pictures[term] = picture[: len(picture) // 2, :, :3]  # the compensated row
    scale = pictures["full"].max()
    assert abs(pictures["single"] + pictures["multi"] - pictures["full"]).max() < 1e-5 * scale
    assert abs(pictures["difference"] - pictures["multi"]).max() < 1e-5 * scale
    assert np.array_equal(pictures["compensated"], pictures["full"])
    assert pictures["multi"].max() > 0.1


@pytest.mark.slow
def test_rows_are_subtracted_in_place(page: Page) -> None:
    alone = []
    for row in (0, 1):
        page.set(f"s.solo = {row}")
        alone.append(page.picture(16))
    page.set("s.solo = null; s.view.term = 'rows'")
    picture = page.picture(16)
    assert np.array_equal(picture[..., 3], alone[1][..., 3])
    assert abs(picture - (alone[0] - alone[1]))[..., :3].max() < 1e-5 * alone[0].max()
    assert picture[..., 1].max() > 0.1


@pytest.mark.slow
def test_masking_toggle_takes_the_other_shader(page: Page) -> None:
    before = rows_of_balls(page.picture(16))
    page.control("masking").locator("select").select_option("schlick-direct")
    assert page.state("slots[0].choices") == {"base.masking": "schlick-direct"}
    assert page.state("slots[1].choices") == {"masking": "schlick-direct"}  # rows are linked
    after = rows_of_balls(page.picture(16))
    assert abs(after / before - 1).max() > 0.05
