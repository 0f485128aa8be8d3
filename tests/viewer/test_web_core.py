"""The page's picture, controls and link, in a browser: an exported file, opened from disk, floats read back.

The picture is judged by Python: rays through the pixels of the same camera, `eval` of the same models in float64.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.viewer import page as page_file
from gonio.viewer import stage

import browser

WIDE = {"width": 800, "height": 420}  # of the window: the picture's part of it is about 480 x 350
PHONE = {"width": 360, "height": 740}

PIXELS = """async (samples) => {
  const picture = await gonio.converge(samples);
  const bytes = new Uint8Array(picture.data.buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return [picture.width, picture.height, btoa(text), picture.samples];
}"""


class Page:
    """A tab with the page, what it wrote on its console, and what it asked the network for."""

    def __init__(self, tab: Any, path: Path) -> None:
        self.tab, self.path = tab, path
        self.problems: list[str] = []
        self.requests: list[str] = []
        tab.on("console", lambda m: self.problems.append(m.text) if m.type in ("error", "warning") else None)
        tab.on("pageerror", lambda error: self.problems.append(str(error)))
        tab.on("request", lambda request: self.requests.append(request.url))
        self.load()

    def load(self, fragment: str = "") -> None:
        self.tab.goto("about:blank")
        self.tab.goto(self.path.as_uri() + fragment)
        self.tab.evaluate("() => gonio.ready")

    def reset(self) -> None:
        self.tab.evaluate("() => { gonio.app.store.reset(); }")

    def set(self, body: str) -> None:
        self.tab.evaluate("() => { gonio.setState((s) => {" + body + "}); }")

    def state(self, path: str) -> Any:
        return self.tab.evaluate(f"() => gonio.state.{path}")

    def picture(self, samples: int = 64) -> np.ndarray:
        """Mean radiance, (height, width, 4): RGB times coverage, coverage."""
        width, height, text, _ = self.tab.evaluate(PIXELS, samples)
        return np.frombuffer(base64.b64decode(text), "<f4").reshape(height, width, 4)

    def control(self, label: str) -> Any:
        return self.tab.locator(".lil-controller", has=self.tab.locator(".lil-name", has_text=re.compile(f"^{label}")))


@pytest.fixture(scope="module")
def chrome() -> Iterator[Any]:
    with browser.chromium() as started:
        yield started


@pytest.fixture(scope="module")
def homework_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return page_file.export(stage.homework(), tmp_path_factory.mktemp("page") / "page.html")


@pytest.fixture(scope="module")
def homework_page(chrome: Any, homework_file: Path) -> Iterator[Page]:
    tab = chrome.new_page(viewport=WIDE)
    yield Page(tab, homework_file)
    tab.close()


@pytest.fixture
def page(homework_page: Page) -> Iterator[Page]:
    homework_page.reset()
    homework_page.problems.clear()
    yield homework_page
    assert homework_page.problems == []


def rows_of_balls(picture: np.ndarray) -> np.ndarray:
    """Mean radiance of each ball of two rows of five, seen from the front."""
    height, width = picture.shape[:2]
    # ball centres in pixels; the camera is the homework's, framed for 16:9
    camera = stage.homework().framed()
    half = math.tan(math.radians(camera["fov"]) / 2) * max(1.0, 16 / 9 * height / width)
    focal = height / 2 / half / camera["distance"]
    means = np.zeros((2, 5, 3))
    rows, columns = np.mgrid[:height, :width] + 0.5
    for i, y in enumerate((0.5, -0.5)):
        for j in range(5):
            x = (j - 2) * stage.SPACING
            near = (
                np.hypot(columns - width / 2 - x * focal, rows - height / 2 + y * stage.SPACING * focal) < 0.9 * focal
            )
            means[i, j] = picture[near][:, :3].mean(axis=0)
    return means


# --------------------------------------------------------------------------- the file


def test_one_file_is_all_it_needs(chrome: Any, homework_file: Path) -> None:
    assert homework_file.stat().st_size <= 1_500_000
    context = chrome.new_context(viewport=WIDE, offline=True)
    page = Page(context.new_page(), homework_file)
    page.picture(4)
    asked = [url for url in page.requests if not url.startswith(("file:", "blob:", "data:", "about:"))]
    assert asked == [] and page.problems == []
    context.close()


def test_no_formula_of_a_material_is_typed_in_the_page() -> None:
    """All shading comes from `emit`: the page's own text calls functions by the manifest's names."""
    source = Path(__file__).parents[2] / "web" / "src"
    files = sorted(source.rglob("*.ts"))
    assert len(files) > 20
    words = re.compile(r"schlick|fresnel\s*\(|smith|lambda\s*\(|beckmann|trowbridge|masking\s*\(", re.IGNORECASE)
    for file in files:
        code = re.sub(r"//[^\n]*|/\*.*?\*/", "", file.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert not words.search(code), f"{file.name}: {words.search(code)}"


# --------------------------------------------------------------------------- the picture against Python


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


@pytest.mark.parametrize("light", [stage.SUN, POINT], ids=["directional", "point"])
def test_converged_picture_is_what_python_computes(page: Page, light: dict[str, Any]) -> None:
    page.set(f"s.lights = [{{ ...{json.dumps(light)}, on: true, name: 'only' }}]")
    raster = page.picture(256)
    height, width = raster.shape[:2]
    truth = python_picture(stage.homework(), [light], (width, height), 6)
    inner = (raster[..., 3] > 1 - 1e-4) & (truth[..., 3] > 1 - 1e-4)
    assert inner.sum() > 0.15 * inner.size
    difference = (raster - truth)[inner][:, :3]
    error = np.mean(difference**2 / (truth[inner][:, :3] ** 2 + 0.01))
    print(f"relMSE {error:.2e}")
    assert error < 1e-4
    assert abs(raster[..., 3] - truth[..., 3]).max() < 0.1  # a rim along one of the 6 lines of rays: 1/12


AREA = {
    "type": "area",
    "center": [-3.0, 4.0, 6.0],
    "u": [1.5, 0, 0],
    "v": [0, 1.0, -0.7],
    "radiance": [12.0, 12.0, 12.0],
}


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


def test_masking_toggle_takes_the_other_shader(page: Page) -> None:
    before = rows_of_balls(page.picture(16))
    page.control("masking").locator("select").select_option("schlick-direct")
    assert page.state("slots[0].choices") == {"base.masking": "schlick-direct"}
    assert page.state("slots[1].choices") == {"masking": "schlick-direct"}  # rows are linked
    after = rows_of_balls(page.picture(16))
    assert abs(after / before - 1).max() > 0.05


# --------------------------------------------------------------------------- controls


def test_roughness_slider_moves_the_selected_ball_in_both_rows(page: Page) -> None:
    before = page.picture(4)
    page.control("roughness").locator("input[type=number]").fill("0.2")
    page.tab.keyboard.press("Enter")
    assert page.state("slots[0].balls[2].set['base.alpha']") == pytest.approx([0.04, 0.04])
    assert page.state("slots[1].balls[2].set.alpha") == pytest.approx([0.04, 0.04])
    assert page.state("slots[1].balls[2].label") == "roughness .2"
    assert abs(page.picture(4) - before).max() > 0.5
    page.control("roughness").locator(".lil-name").dblclick()
    assert page.state("slots[0].balls[2].set['base.alpha']") == pytest.approx([0.3025, 0.3025])
    slider = page.control("roughness").locator("input[type=range]")
    slider.focus()
    page.tab.keyboard.press("ArrowRight")
    assert page.state("slots[0].balls[2].set['base.alpha'][0]") > 0.3025


def test_a_click_selects_the_ball_and_its_point(page: Page) -> None:
    box = page.tab.locator("canvas.picture").bounding_box()
    page.tab.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2 - 0.12 * box["width"])
    assert page.state("selection") == {"slot": 0, "ball": 2}
    wo = page.tab.evaluate("() => gonio.app.picked.wo")
    assert np.linalg.norm(wo) == pytest.approx(1) and wo[2] > 0.7


def test_preset_goes_to_both_rows(page: Page) -> None:
    page.control("Preset").locator("select").select_option(label="gold")
    means = rows_of_balls(page.picture(16))
    assert np.all(means[..., 0] > 1.2 * means[..., 2])
    assert page.state("slots[0].values['base.eta']") == page.state("slots[1].values.eta")


def test_every_light_is_listed_and_can_be_added_and_removed(page: Page) -> None:
    lights = page.tab.locator(".lil-gui.light")
    assert lights.count() == len(page.state("lights")) == 1
    for name, kind in (("point", "point"), ("area", "area"), ("environment", "environment")):
        page.tab.get_by_title(f"Add a light: {name}").click()
        assert page.state("lights.at(-1).type") == kind
    assert lights.count() == 4
    bright = page.picture(16)[..., 1].sum()
    page.set("for (const light of s.lights) light.on = false")
    assert page.picture(4)[..., :3].max() == 0  # no light that is not in the list
    page.set("for (const light of s.lights) light.on = true")
    assert page.picture(16)[..., 1].sum() == pytest.approx(bright, rel=0.1)


def test_keys_turn_the_camera_and_reset_it(page: Page) -> None:
    page.tab.locator("canvas.picture").focus()
    for key in ("ArrowLeft", "ArrowUp", "+"):
        page.tab.keyboard.press(key)
    camera, first = page.state("camera"), page.tab.evaluate("() => gonio.app.store.initial.camera")
    assert camera["azimuth"] != first["azimuth"] and camera["elevation"] > 0 and camera["distance"] < first["distance"]
    page.tab.keyboard.press("0")
    assert page.state("camera") == first


def test_dragging_turns_the_camera(page: Page) -> None:
    box = page.tab.locator("canvas.picture").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.tab.mouse.move(x, y)
    page.tab.mouse.down()
    page.tab.mouse.move(x + 80, y + 30, steps=4)
    page.tab.mouse.up()
    assert page.state("camera.azimuth") < -0.1 and page.state("camera.elevation") > 0.05


def test_solo_shows_one_row(page: Page) -> None:
    page.tab.get_by_title("Show row B alone").click()
    assert page.state("solo") == 1
    covered = page.picture(4)[..., 3].sum()
    page.tab.keyboard.press("Escape")
    assert page.state("solo") is None
    assert page.picture(4)[..., 3].sum() == pytest.approx(2 * covered, rel=0.05)


# --------------------------------------------------------------------------- link, theme, files


def test_the_link_holds_the_whole_state(page: Page, chrome: Any) -> None:
    page.set(
        "s.camera.azimuth = 0.5; s.slots[0].values = { 'base.albedo': [1, .5, .2] }; s.view.term = 'single';"
        "s.lights[0].irradiance = [1, 2, 3]; s.display.exposure = 1.5; s.view.mesh = 'torus'; s.solo = 0;"
        "s.panels.lobe = { channel: 'red' }"
    )
    link = page.tab.evaluate("() => gonio.app.link()")
    assert "#s=" in link
    state = page.state("valueOf()")
    picture = page.picture(4)
    tab = chrome.new_page(viewport=WIDE)
    tab.goto(link)
    tab.evaluate("() => gonio.ready")
    other = Page.__new__(Page)
    other.tab = tab
    assert other.state("valueOf()") == state
    assert np.array_equal(other.picture(4), picture)
    tab.close()


@pytest.mark.parametrize(
    "patch",
    [
        "garbage",
        {
            "camera": {"azimuth": "x", "distance": None, "target": "here"},
            "slots": 3,
            "lights": {"0": {"irradiance": "bright"}},
        },
        {"__proto__": {"polluted": True}, "view": {"constructor": 1}, "unknown": 1},
    ],
    ids=["no base64", "wrong types", "prototype"],
)
def test_a_link_from_a_stranger_does_no_harm(page: Page, patch: Any) -> None:
    text = (
        patch if isinstance(patch, str) else base64.urlsafe_b64encode(json.dumps(patch).encode()).decode().rstrip("=")
    )
    page.load(f"#s={text}")
    assert page.tab.evaluate("() => ({}).polluted") is None
    assert page.picture(4)[..., 1].max() > 0.5
    assert page.state("camera.distance") == stage.homework().framed()["distance"]
    page.load()


def test_screenshot_is_the_picture(page: Page) -> None:
    page.picture(8)
    with page.tab.expect_download() as download:
        page.tab.keyboard.press("s")
    png = Path(download.value.path()).read_bytes()
    assert png[:8] == b"\x89PNG\r\n\x1a\n" and len(png) > 10_000


def test_themes_differ_and_the_balls_do_not(page: Page) -> None:
    colors = {}
    for theme in ("dark", "light"):
        page.set(f"s.display.theme = '{theme}'")
        page.picture(1)
        colors[theme] = page.tab.evaluate("() => getComputedStyle(document.body).backgroundColor")
    assert colors["dark"] != colors["light"]
    assert page.tab.evaluate("() => document.documentElement.dataset.theme") == "light"


def radiance_file(value: float, width: int = 32, height: int = 16) -> str:
    mantissa, exponent = math.frexp(value)
    pixel = bytes([round(mantissa * 256)] * 3 + [exponent + 128])
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()
    return base64.b64encode(header + pixel * (width * height)).decode()


DROP = """async ([text, name]) => {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const files = new DataTransfer();
  files.items.add(new File([bytes], name));
  window.dispatchEvent(new DragEvent("drop", { dataTransfer: files, cancelable: true }));
  for (let i = 0; i < 100 && !document.querySelector(".toast"); i++) await new Promise((r) => setTimeout(r, 50));
  const found = document.querySelector(".toast").textContent;
  document.querySelector(".toast").remove();
  return found;
}"""


def test_dropped_picture_lights_the_balls_as_its_radiance_says(page: Page) -> None:
    """A picture of one value is a furnace: brute force, split sum and the albedo curve must agree on it."""
    page.set("s.lights = []; s.furnace = true")
    furnace = rows_of_balls(page.picture(32))
    page.reset()
    page.set("s.lights = []")
    assert "in use" in page.tab.evaluate(DROP, [radiance_file(0.5), "room.hdr"])
    assert page.state("lights.length") == 1
    # two numbers stand for Fresnel's curve by Schlick's: silver errs by a few parts in a hundred
    for method, error in (("sampled", 0.01), ("split-sum", 0.01), ("dfg", 0.04)):
        page.set(f"s.environment = '{method}'; s.lights[0].rotation = 1")
        means = rows_of_balls(page.picture(96))
        assert abs(means / (0.5 * furnace) - 1).max() < error, method


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("cut.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4000 +X 8000\nxx", "cut off"),
        ("huge.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999 +X 99999\n", "largest"),
        ("other.hdr", b"\x89PNG", "not a Radiance picture"),
        ("empty.obj", b"# nothing\n", "no mesh"),
        ("what.exe", b"MZ", "drop a Radiance picture"),
    ],
)
def test_a_bad_file_gets_one_clear_line(page: Page, name: str, content: bytes, says: str) -> None:
    assert says in page.tab.evaluate(DROP, [base64.b64encode(content).decode(), name])
    assert page.picture(2)[..., 1].max() > 0.5


QUAD = b"v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn 0 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"


def gltf() -> bytes:
    points = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "<f4")
    data = "data:application/octet-stream;base64," + base64.b64encode(points.tobytes()).decode()
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [
                {
                    "bufferView": 0,
                    "componentType": 5126,
                    "count": 3,
                    "type": "VEC3",
                    "min": [-1, -1, 0],
                    "max": [1, 1, 0],
                }
            ],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": data}],
        }
    ).encode()


@pytest.mark.parametrize(("name", "content"), [("quad.obj", QUAD), ("triangle.gltf", gltf())])
def test_dropped_mesh_takes_the_place_of_the_balls(page: Page, name: str, content: bytes) -> None:
    before = page.picture(2)[..., 3].sum()
    assert "in use" in page.tab.evaluate(DROP, [base64.b64encode(content).decode(), name])
    assert page.state("view.mesh") == "file"
    picture = page.picture(4)
    assert 0.2 * before < picture[..., 3].sum() < before
    # flat, facing the camera, under a light at one angle: far and near rows differ little, and nothing is black
    assert picture[..., 1][picture[..., 3] > 0.99].min() > 0


@pytest.mark.parametrize("mesh", ["torus", "shaderball"])
def test_built_in_shapes_are_shaded(page: Page, mesh: str) -> None:
    page.set(f"s.view.mesh = '{mesh}'")
    picture = page.picture(8)
    assert picture[..., 3].max() <= 1 + 1e-5  # what is in front hides what is behind
    covered = picture[..., 3] > 0.99
    assert covered.mean() > 0.03 and picture[..., 1][covered].mean() > 0.1
    # within the unit sphere: clicks look for it there, labels stand below it
    assert page.tab.evaluate(
        "() => { const p = gonio.app.scene().mesh.mesh.positions; let r = 0;"
        " for (let i = 0; i < p.length; i += 3) r = Math.max(r, Math.hypot(p[i], p[i + 1], p[i + 2])); return r; }"
    ) == pytest.approx(1, abs=0.03)


# --------------------------------------------------------------------------- other sizes


def test_usable_on_a_phone(chrome: Any, homework_file: Path) -> None:
    context = chrome.new_context(viewport=PHONE, has_touch=True, is_mobile=True)
    page = Page(context.new_page(), homework_file)
    assert page.tab.evaluate("() => document.documentElement.scrollWidth") <= PHONE["width"]
    box = page.tab.locator("canvas.picture").bounding_box()
    assert box["width"] == PHONE["width"] and box["height"] > 180
    picture = page.picture(4)
    edge = picture[:, [0, -1], 3]
    assert edge.max() == 0 and picture[..., 3].max() > 0.99  # no ball is cut off
    page.control("roughness").locator("input[type=range]").scroll_into_view_if_needed()
    assert page.tab.locator("canvas.picture").bounding_box()["y"] >= 0  # the picture stays while controls scroll
    assert page.problems == []
    context.close()


def test_every_panel_opens_without_a_complaint(page: Page) -> None:
    tabs = page.tab.get_by_role("tab")
    assert tabs.count() >= 5
    for i in range(tabs.count()):
        tabs.nth(i).click()
        page.tab.wait_for_timeout(150)
        assert tabs.nth(i).get_attribute("aria-selected") == "true"
    assert page.tab.locator(".toast.error").count() == 0


def test_one_model_without_terms_or_choices(chrome: Any, tmp_path: Path) -> None:
    what = stage.of_models([go.Lambert(albedo=(0.8, 0.4, 0.2))])
    path = page_file.export(what, tmp_path / "lambert.html")
    tab = chrome.new_page(viewport=WIDE)
    page = Page(tab, path)
    assert tab.locator(".terms [data-value=D]").is_disabled()
    brightest = max(np.max(ball.values["albedo"]) for ball in what.rows[0].balls)
    assert page.picture(8)[..., 0].max() == pytest.approx(brightest, rel=0.01)  # where it faces a light of pi
    assert page.problems == []
    tab.close()
