"""The page's file, controls, links and drops, in a browser: an exported file, opened from disk, floats read back."""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import re
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.viewer import page as page_file
from gonio.viewer import stage
from web_page import COARSE, PHONE, WIDE, Page, rows_of_balls

# --------------------------------------------------------------------------- the file


@pytest.mark.slow
def test_one_file_is_all_it_needs(chrome: Any, homework_file: Path) -> None:
    assert homework_file.stat().st_size <= 1_500_000
    context = chrome.new_context(viewport=WIDE, device_scale_factor=COARSE, offline=True)
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


# --------------------------------------------------------------------------- controls


@pytest.mark.slow
def test_roughness_slider_moves_the_selected_ball_in_both_rows(page: Page) -> None:
    before = page.picture(4)
    page.control("roughness").locator("input[type=number]").fill("0.2")
    page.tab.keyboard.press("Enter")
    assert page.state("slots[0].balls[2].set['base.alpha']") == pytest.approx([0.04, 0.04])
    assert page.state("slots[1].balls[2].set.alpha") == pytest.approx([0.04, 0.04])
    assert page.state("slots[1].balls[2].label") == "roughness 0.2"
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


@pytest.mark.slow
def test_preset_goes_to_both_rows(page: Page) -> None:
    page.control("Preset").locator("select").select_option(label="gold")
    means = rows_of_balls(page.picture(16))
    assert np.all(means[..., 0] > 1.2 * means[..., 2])
    assert page.state("slots[0].values['base.eta']") == page.state("slots[1].values.eta")


@pytest.mark.slow
def test_every_light_is_listed_and_can_be_added_and_removed(page: Page) -> None:
    lights = page.tab.locator(".lil-gui.light")
    assert lights.count() == len(page.state("lights")) == 1
    for name, kind in (("point", "point"), ("area", "area"), ("environment", "environment")):
        page.tab.get_by_title(f"Add a light: {name}").click()
        assert page.state("lights.at(-1).type") == kind
    assert page.state("lights.at(-1).image.width") == 256  # of the studio
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


@pytest.mark.slow
def test_keys_act_after_a_control_was_used(page: Page) -> None:
    """The furnace is one key away, also where a slider, a tick or a list was the last thing touched."""
    page.control("roughness").locator("input[type=range]").click()
    page.tab.keyboard.press("f")
    assert page.state("furnace")
    page.control("Labels").locator("input").click()
    page.tab.keyboard.press("f")
    assert not page.state("furnace")
    azimuth = page.state("camera.azimuth")
    page.control("roughness").locator("input[type=range]").focus()
    page.tab.keyboard.press("ArrowRight")
    assert page.state("camera.azimuth") == azimuth  # an arrow is the slider's


def test_preset_shows_its_linear_reflectance(page: Page) -> None:
    page.control("Preset").locator("select").select_option("gold")
    gold = go.Conductor.preset("Au")
    eta, k = np.array(gold.eta), np.array(gold.k)
    f0 = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)  # course sheet, eq. 11 and 12
    shown = page.control("Preset").locator(".hint").text_content()
    assert shown == "F0 " + " ".join(f"{100.0 * v:.0f}" for v in f0) + " %"


@pytest.mark.slow
def test_dragging_turns_the_camera(page: Page) -> None:
    box = page.tab.locator("canvas.picture").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.tab.mouse.move(x, y)
    page.tab.mouse.down()
    page.tab.mouse.move(x + 80, y + 30, steps=4)
    page.tab.mouse.up()
    assert page.state("camera.azimuth") < -0.1 and page.state("camera.elevation") > 0.05


@pytest.mark.slow
def test_solo_shows_one_row(page: Page) -> None:
    page.tab.get_by_title("Show row B alone").click()
    assert page.state("solo") == 1
    covered = page.picture(4)[..., 3].sum()
    page.tab.keyboard.press("Escape")
    assert page.state("solo") is None
    assert page.picture(4)[..., 3].sum() == pytest.approx(2 * covered, rel=0.05)


def test_a_row_alone_is_the_one_that_is_edited(page: Page) -> None:
    page.tab.keyboard.press("2")
    assert page.state("solo") == 1
    assert page.state("selection") == {"slot": 1, "ball": 2}
    assert page.tab.evaluate("() => [gonio.app.picked.slot, gonio.app.picked.ball]") == [1, 2]


# --------------------------------------------------------------------------- link, theme, files


@pytest.mark.slow
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
    tab = chrome.new_page(viewport=WIDE, device_scale_factor=COARSE)
    tab.goto(link)
    tab.evaluate("() => gonio.ready")
    other = Page.__new__(Page)
    other.tab = tab
    assert other.state("valueOf()") == state
    assert np.array_equal(other.picture(4), picture)
    tab.close()


@pytest.mark.sample(1)
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


@pytest.mark.slow
def test_a_link_sets_nothing_out_of_range(page: Page) -> None:
    """As a slider would not: widths over 1, fewer numbers than a colour has, masking by no known name."""
    first = page.state("valueOf()")
    slot = {
        "values": {"base.alpha": 5, "base.eta": [1, 2], "base.k": "x", "base.albedo": [2, -1, 0.5]},
        "choices": {"base.masking": "none"},
    }
    lights = [{"type": "directional", "direction": [0, 0, 0]}, {"type": "environment", "scale": -5}]
    panels = {"tables": {"layer": -4, "channel": 99}}
    patch = {"slots": {"0": slot}, "lights": lights, "compare": {"wipe": 9e9}, "panels": panels}
    page.load("#s=" + base64.urlsafe_b64encode(json.dumps(patch).encode()).decode().rstrip("="))
    values = page.state("slots[0].values")
    assert max(np.atleast_1d(values["base.alpha"])) <= 1 and values["base.albedo"] == [1, 0, 0.5]
    assert "base.eta" not in values and "base.k" not in values
    assert page.state("slots[0].choices") == first["slots"][0]["choices"]
    assert np.linalg.norm(page.state("lights[0].direction")) == pytest.approx(1)
    assert page.state("lights[1].scale") == 0 and page.state("compare.wipe") == 1
    page.tab.evaluate("() => gonio.app.store.set('dock.open', 'tables')")
    note = page.tab.locator(".panel-body[data-panel=tables] .p-note")
    note.wait_for(state="visible")
    assert "NaN" not in note.text_content()
    page.load()


def test_screenshot_is_the_picture(page: Page) -> None:
    page.picture(8)
    with page.tab.expect_download() as download:
        page.tab.keyboard.press("s")
    png = Path(download.value.path()).read_bytes()
    assert png[:8] == b"\x89PNG\r\n\x1a\n" and len(png) > 10_000


@pytest.mark.slow
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


@pytest.mark.slow
def test_dropped_picture_lights_the_balls_as_its_radiance_says(page: Page) -> None:
    """A picture of one value is a furnace: brute force, split sum and the albedo curve must agree on it."""
    page.set("s.lights = []; s.furnace = true")
    furnace = rows_of_balls(page.picture(32))
    page.reset()
    page.set("s.lights = []")
    assert "in use" in page.tab.evaluate(DROP, [radiance_file(0.5), "room.hdr"])
    assert page.state("lights.length") == 1
    # two numbers stand for Fresnel's curve by Schlick's: silver errs by a few parts in a hundred
    for method, error, samples in (("sampled", 0.01, 96), ("split-sum", 0.01, 16), ("dfg", 0.04, 16)):
        page.set(f"s.environment = '{method}'; s.lights[0].rotation = 1")
        means = rows_of_balls(page.picture(samples))
        assert abs(means / (0.5 * furnace) - 1).max() < error, method


POINTS = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "<f4").tobytes()


def gltf(uri: str = "") -> bytes:
    """A triangle, its points inside the file or at `uri`; with a picture that is nowhere, which the page needs not."""
    data = "data:application/octet-stream;base64," + base64.b64encode(POINTS).decode()
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
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
            "buffers": [{"byteLength": 36, "uri": uri or data}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 0}],
            "images": [{"uri": "missing.png"}],
        }
    ).encode()


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("cut.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4000 +X 8000\nxx", "truncated"),
        ("huge.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999 +X 99999\n", "limit"),
        ("other.hdr", b"\x89PNG", "not a Radiance picture"),
        ("empty.obj", b"# nothing\n", "no mesh"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no mesh"),
        ("hole.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "hole.obj: a vertex"),
        ("corner.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "corner.obj: a vertex"),
        ("cut.glb", b"glTF\x02\0\0\0\x50\0\0\0junkjunk", "cut.glb cannot be read"),
        ("alone.gltf", gltf("points.bin"), "alone.gltf refers to points.bin"),
        ("what.exe", b"MZ", "drop a Radiance picture"),
    ],
)
def test_a_bad_file_gets_one_clear_line(page: Page, name: str, content: bytes, says: str) -> None:
    assert says in page.tab.evaluate(DROP, [base64.b64encode(content).decode(), name])
    assert page.picture(2)[..., 1].max() > 0.5


QUAD = b"v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn 0 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"


@pytest.mark.sample(1)
@pytest.mark.parametrize(("name", "content"), [("quad.obj", QUAD), ("triangle.gltf", gltf())])
def test_dropped_mesh_takes_the_place_of_the_balls(page: Page, name: str, content: bytes) -> None:
    before = page.picture(2)[..., 3].sum()
    assert "in use" in page.tab.evaluate(DROP, [base64.b64encode(content).decode(), name])
    assert page.state("view.mesh") == "file"
    picture = page.picture(4)
    assert 0.2 * before < picture[..., 3].sum() < before
    # flat, facing the camera, under a light at one angle: far and near rows differ little, and nothing is black
    assert picture[..., 1][picture[..., 3] > 0.99].min() > 0


def test_a_gltf_finds_the_data_that_is_dropped_with_it(page: Page) -> None:
    files = {"points.bin": POINTS, "triangle.gltf": gltf("points.bin")}
    page.tab.evaluate(
        """files => gonio.useFiles(...files.map(([name, bytes]) => new File([Uint8Array.from(bytes)], name)))""",
        [[name, list(content)] for name, content in files.items()],
    )
    assert page.state("view.mesh") == "file"
    assert page.tab.evaluate("() => gonio.app.scene().mesh.mesh.positions.length") == 9


USED = """async ([name, text]) => {
  document.querySelector(".toast")?.remove();
  await gonio.useFiles(new File([text], name));
  return document.querySelector(".toast").textContent;
}"""


@pytest.mark.slow
def test_a_dropped_gltf_dresses_the_selected_ball_by_its_numbers(page: Page) -> None:
    """The page's model is a conductor: its index without loss that reflects the base colour from above."""
    file = json.loads(gltf())
    pbr = {"baseColorFactor": [0.81, 0.36, 0.04, 1], "metallicFactor": 1, "roughnessFactor": 0.5}
    file["materials"] = [{"name": "Unworn"}, {"name": "Copper", "pbrMetallicRoughness": pbr}]
    file["meshes"][0]["primitives"][0]["material"] = 1
    before = page.state("slots[0].balls")
    said = page.tab.evaluate(USED, ["copper.gltf", json.dumps(file)])
    assert 'its material "Copper" is' in said
    slot, ball = page.state("selection.slot"), page.state("selection.ball")
    worn = page.state(f"slots[{slot}].balls[{ball}]")
    values = {path.removeprefix("base."): value for path, value in worn["set"].items()}
    assert values["eta"] == pytest.approx([19, 4, 1.5]) and values["k"] == [0, 0, 0]
    assert values["alpha"] == [0.25, 0.25] and worn["label"] == "Copper"
    others = [b for i, b in enumerate(page.state("slots[0].balls")) if i != ball]
    assert others == [b for i, b in enumerate(before) if i != ball]
    page.tab.evaluate("() => gonio.converge(16)")
    picture = page.picture(16)
    shown = picture[picture[..., 3] > 0.99][..., :3].mean(0)
    assert shown[0] > 1.05 * shown[1] > 1.1 * shown[2]  # one of ten, among grey ones


def test_a_page_without_a_fitting_model_says_so(page: Page) -> None:
    file = json.loads(gltf())
    file["materials"] = [{"name": "Chalk", "pbrMetallicRoughness": {"metallicFactor": 0}}]
    said = page.tab.evaluate(USED, ["chalk.gltf", json.dumps(file)])
    assert 'no model for its material "Chalk"' in said and page.state("view.mesh") == "file"


@pytest.mark.slow
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


@pytest.mark.slow
def test_usable_on_a_phone(chrome: Any, homework_file: Path) -> None:
    context = chrome.new_context(viewport=PHONE, device_scale_factor=COARSE, has_touch=True, is_mobile=True)
    page = Page(context.new_page(), homework_file)
    assert page.tab.evaluate("() => document.documentElement.scrollWidth") <= PHONE["width"]
    box = page.tab.locator("canvas.picture").bounding_box()
    assert box["width"] == PHONE["width"] and box["height"] > 180
    picture = page.picture(4)
    edge = picture[:, [0, -1], 3]
    assert edge.max() == 0 and picture[..., 3].max() > 0.99  # no ball is cut off
    for control in ("roughness", "Exposure"):  # the picture stays while controls scroll, to the last
        page.control(control).locator("input[type=range]").scroll_into_view_if_needed()
        assert page.tab.locator("canvas.picture").bounding_box()["y"] >= 0, control
    page.tab.evaluate("() => gonio.app.store.set('dock.open', 'slices')")
    body = page.tab.locator(".panel-body[data-panel=slices]")
    body.wait_for(state="visible")
    inner, outer = body.evaluate("b => [b.scrollHeight, b.clientHeight]")
    assert inner <= outer + 1  # all plots are there at once: the page scrolls, not a box within it
    assert page.problems == []
    context.close()


@pytest.mark.slow
def test_every_panel_opens_without_a_complaint(page: Page) -> None:
    tabs = page.tab.get_by_role("tab")
    assert tabs.count() >= 5
    for i in range(tabs.count()):
        tabs.nth(i).click()
        page.tab.wait_for_timeout(150)
        assert tabs.nth(i).get_attribute("aria-selected") == "true"
    assert page.tab.locator(".toast.error").count() == 0


@pytest.mark.slow
def test_one_model_without_terms_or_choices(chrome: Any, tmp_path: Path) -> None:
    what = stage.of_models([go.Lambert(albedo=(0.8, 0.4, 0.2))])
    path = page_file.export(what, tmp_path / "lambert.html")
    tab = chrome.new_page(viewport=WIDE, device_scale_factor=COARSE)
    page = Page(tab, path)
    assert tab.locator(".terms [data-value=D]").is_disabled()
    brightest = max(np.max(ball.values["albedo"]) for ball in what.rows[0].balls)
    assert page.picture(8)[..., 0].max() == pytest.approx(brightest, rel=0.01)  # where it faces a light of pi
    assert page.problems == []
    tab.close()


@pytest.mark.slow
def test_nothing_lies_over_three_rows(chrome: Any, tmp_path: Path) -> None:
    what = stage.of_models([go.Conductor(), go.Lambert(), go.Mirror()])
    tab = chrome.new_page(viewport={"width": 1280, "height": 720}, device_scale_factor=COARSE)
    page = Page(tab, page_file.export(what, tmp_path / "three.html"))
    tab.evaluate("() => gonio.app.store.set('dock.open', 'lobe')")
    tab.locator(".panel-body[data-panel=lobe]").wait_for(state="visible")
    bar, picture = (tab.locator(s).bounding_box() for s in (".terms", "canvas.picture"))
    assert bar["y"] + bar["height"] <= picture["y"]
    assert tab.locator(".terms").evaluate("b => b.scrollWidth <= b.clientWidth")
    page.set("s.view.term = 'D'")
    assert "1/sr" in tab.locator(".term-note").text_content()
    page.set("s.view.term = 'full'")
    assert "C: a mirror reflects an environment only" in tab.locator(".term-note").text_content()
    page.set("s.furnace = true")
    assert tab.locator(".term-note").text_content() == ""
    assert page.problems == []
    tab.close()


@pytest.mark.slow
def test_what_is_not_shown_is_told_at_once(chrome: Any, tmp_path: Path) -> None:
    what = dataclasses.replace(stage.of_models([go.Lambert()]), notes=["the texture of albedo is not shown"])
    tab = chrome.new_page(viewport=WIDE, device_scale_factor=COARSE)
    Page(tab, page_file.export(what, tmp_path / "noted.html"))
    tab.get_by_text("1 note").click()
    assert "the texture of albedo is not shown" in tab.locator("dialog[open]").text_content()
    tab.close()


@pytest.mark.slow
def test_a_figure_in_a_closed_part_of_a_document_has_its_picture_before_it_is_opened(
    chrome: Any, homework_file: Path
) -> None:
    tab = chrome.new_page(viewport=WIDE, device_scale_factor=COARSE)
    document = homework_file.with_name("document.html")
    document.write_text(f"<details><summary>open</summary><iframe src='{homework_file.name}'></iframe></details>")
    tab.goto(document.as_uri())
    figure = tab.frames[1]
    assert not tab.locator("iframe").is_visible()
    assert figure.evaluate("() => Promise.race([gonio.ready.then(() => 1), new Promise(r => setTimeout(r, 30000))])")
    drawn = figure.evaluate("() => gonio.frames")
    assert drawn > 0
    tab.locator("summary").click()
    figure.evaluate("async n => { while (gonio.frames <= n) await new Promise(requestAnimationFrame); }", drawn)
    tab.close()
