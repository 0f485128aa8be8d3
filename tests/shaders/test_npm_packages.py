"""The packages for npm, as they are packed: what they draw in three.js, and bind in WebGPU, is what Python says."""

from __future__ import annotations

import base64
import functools
import http.server
import io
import shutil
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.shaders import Placement, bundle
from PIL import Image

import browser
from npm import npm

ROOT = Path(__file__).parents[2]
THREE = ROOT / "web/node_modules/three"
SIDE = 128  # vertices are snapped to 1/256 of a pixel, which may not matter
GOLD = go.Conductor.preset("Au", alpha=(0.2, 0.5), rotation=0.4)
METALS = {"gold": GOLD, "tables": go.KullaConty(go.Conductor.preset("Au", alpha=0.4))}
PAGE = """<!doctype html><title>packages</title><link rel="icon" href="data:,"><script type="importmap">{"imports": {
  "three": "./node_modules/three/build/three.module.js",
  "gonio-three": "./gonio-three/package/index.js", "gonio-wgpu": "./gonio-wgpu/package/index.js"}}</script>"""


class _Folder(http.server.SimpleHTTPRequestHandler):
    extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".mjs": "text/javascript"}  # noqa: RUF012

    def log_message(self, *args: Any) -> None:
        pass


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A site: a page, the packages as a user of npm has them, three.js where it is installed, bundles."""
    place = tmp_path_factory.mktemp("site")
    shutil.copytree(ROOT / "web/packages", place / "web/packages")
    shutil.copy(ROOT / "LICENSE", place)
    for name in ("three", "wgpu"):
        npm("pack", "--pack-destination", str(place), folder=place / "web/packages" / name)
        with tarfile.open(place / f"gonio-{name}-{go.__version__}.tgz") as packed:
            packed.extraction_filter = getattr(tarfile, "data_filter", None)  # not in Python 3.11.3 and older
            packed.extractall(place / f"gonio-{name}")
    (place / "index.html").write_text(PAGE)
    shutil.copy(Path(__file__).parent / "drop_in.mjs", place)
    (place / "node_modules").mkdir()
    (place / "node_modules/three").symlink_to(THREE)
    for name, metal in METALS.items():
        bundle(metal, "glsl", ["eval"], placement=Placement("g_")).write(place / name)
        bundle(metal, "wgsl", ["eval"], placement=Placement("", 2, 3)).write(place / f"{name}-wgsl")
    bundle(GOLD, "glsl", ["eval"]).write(place / "unprefixed")
    for name, form in {"half": Placement("g_", half=True), "ktx2": Placement("g_", tables="ktx2")}.items():
        bundle(METALS["tables"], "glsl", ["eval"], placement=form).write(place / name)
    bundle([*METALS.values()], "glsl", ["eval"], placement=Placement("g_")).write(place / "both")
    return place


@pytest.fixture(scope="module")
def page(folder: Path) -> Iterator[Any]:
    handler = functools.partial(_Folder, directory=str(folder))
    with browser.chromium() as chrome, browser.serving(handler) as root:
        tab = chrome.new_page()
        tab.set_default_timeout(60_000)
        tab.on("console", lambda message: print(f"console: {message.text}"))
        tab.goto(root)
        yield tab


def test_packages_hold_their_files(folder: Path) -> None:
    for name in ("three", "wgpu"):
        packed = sorted(file.name for file in (folder / f"gonio-{name}/package").iterdir())
        assert packed == ["LICENSE", "README.md", "bundle.js", "index.js", "package.json"]


# ------------------------------------------------------------------ three.js


def drawn(page: Any, **given: Any) -> np.ndarray:
    """(SIDE, SIDE, 3) pixels, from the bottom."""
    if not THREE.exists():
        pytest.skip("NOT TRIED in three.js: `npm ci` in web/ installs it")
    pixels = page.evaluate("async (given) => (await import('./drop_in.mjs')).draw(given)", given)
    return np.array(pixels).reshape(SIDE, SIDE, 4)[..., :3]


def plane() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(points of the plane that pixels show, directions to the camera, rows tangent, bitangent, normal)."""
    (cx, cy, cz), (sx, sy, sz) = np.cos([-0.5, 0.3, 0.2]), np.sin([-0.5, 0.3, 0.2])
    turn_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    turn_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    turn_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    frame = (turn_x @ turn_y @ turn_z).T
    at = ((np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0) * np.tan(np.radians(20.0))
    x, y = np.meshgrid(at, at)
    ray = np.stack([x, y, -np.ones_like(x)], -1)
    eye = np.array([0.0, 0.0, 4.0])
    points = eye - ray * (frame[2] @ eye / (ray @ frame[2]))[..., None]
    toward = eye - points
    return points, toward / np.linalg.norm(toward, axis=-1, keepdims=True), frame


def expected(metal: go.BSDF, lamp: str) -> np.ndarray:
    """Radiance of the plane: irradiance on a plane that faces the lamp, times eval."""
    points, view, frame = plane()
    lamp_at = np.array([1.0, 2.0, 3.0])
    toward = lamp_at - points if lamp != "directional" else np.broadcast_to(lamp_at, points.shape)
    distance = np.linalg.norm(toward, axis=-1, keepdims=True)
    toward = toward / distance
    irradiance = {"directional": 3.0, "point": 40.0 / distance**2}.get(lamp)
    if lamp == "spot":  # smoothstep from the cone's rim to its axis
        axis = lamp_at / np.linalg.norm(lamp_at)
        x = np.clip((toward @ axis - np.cos(1.2)) / (1.0 - np.cos(1.2)), 0.0, 1.0)[..., None]
        irradiance = 40.0 / distance**2 * x * x * (3.0 - 2.0 * x)
    wo, wi = (v.reshape(-1, 3) @ frame.T for v in (view, toward))
    values = np.asarray(metal.eval(wo, wi, precision="float64")).reshape(points.shape)
    return np.array([1.0, 0.8, 0.6]) * irradiance * values


@pytest.mark.sample(4)
@pytest.mark.parametrize("lamp", ["directional", "point", "spot"])
@pytest.mark.parametrize("name", METALS)
@pytest.mark.parametrize("how", ["material", "patch"])
def test_a_lamp_of_three_js_lights_the_material(page: Any, how: str, name: str, lamp: str) -> None:
    pixels = drawn(page, how=how, url=name, lamp=lamp)
    right = expected(METALS[name], lamp)
    assert right.max() > 0.3
    assert np.allclose(pixels, right, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("how", ["material", "patch"])
def test_values_are_given_at_first_and_later(page: Any, how: str) -> None:
    given = {"alpha": [0.3, 0.15], "albedo": 0.5, "rotation": -0.7}
    right = expected(go.Conductor.preset("Au", alpha=(0.3, 0.15), albedo=0.5, rotation=-0.7), "point")
    for values in ({"values": given}, {"later": given}, {"later": given, "options": {"tangents": True}}):
        assert np.allclose(drawn(page, how=how, url="gold", lamp="point", **values), right, rtol=1e-3, atol=1e-6)


@pytest.mark.slow
def test_a_table_may_have_three_dimensions(page: Any, folder: Path) -> None:
    metal = go.KullaConty(GOLD)
    made = bundle(metal, "glsl", ["eval"], placement=Placement("g_"))
    assert {texture["dimension"] for texture in made.manifest["textures"]} == {2, 3}
    made.write(folder / "turned")
    pixels = drawn(page, how="patch", url="turned", lamp="point")
    assert np.allclose(pixels, expected(metal, "point"), rtol=1e-3, atol=1e-6)


def test_a_folder_may_hold_several_materials(page: Any) -> None:
    pixels = drawn(page, how="material", url="both", model="kulla-conty", lamp="point")
    assert np.allclose(pixels, expected(METALS["tables"], "point"), rtol=1e-3, atol=1e-6)


def test_a_field_may_be_a_map_of_three_js(page: Any) -> None:
    halved = {"physical": {"color": 0x808080}, "options": {"fields": {"albedo": "diffuseColor.rgb"}}}
    gray = ((0x80 / 255.0 + 0.055) / 1.055) ** 2.4
    right = expected(GOLD, "point") * gray
    assert np.allclose(drawn(page, how="patch", url="gold", lamp="point", **halved), right, rtol=1e-3, atol=1e-6)


@pytest.mark.slow
def test_a_patched_material_keeps_the_environment(page: Any) -> None:
    sky = {"lamp": "none", "sky": True}
    plain = drawn(page, how="three", **sky)
    assert plain.min() > 0.3 and np.array_equal(drawn(page, how="patch", url="gold", **sky), plain)


@pytest.mark.parametrize("how", ["material", "patch"])
def test_shadows_fall(page: Any, how: str) -> None:
    pixels = drawn(page, how=how, url="gold", lamp="directional", blocked=True)
    dark, right = pixels.max(axis=-1) == 0.0, expected(GOLD, "directional")
    assert 0.01 < dark.mean() < 0.3
    assert np.all(pixels < 1.001 * right + 1e-6)  # less at the shadow's edge
    assert np.isclose(pixels, right, rtol=1e-3).all(axis=-1).mean() > 0.7


def test_the_example_of_the_documentation_draws(page: Any, folder: Path) -> None:
    if not THREE.exists():
        pytest.skip("NOT TRIED in three.js: `npm ci` in web/ installs it")
    section = (ROOT / "docs/emit.md").read_text(encoding="utf-8").partition("## three.js and WebGPU")[2]
    program = section.partition("```js\n")[2].partition("```")[0]
    (folder / "example.html").write_text(f'{PAGE}<body><script type="module">{program}\nwindow.drawn = true</script>')
    page.goto(page.url + "example.html")
    page.wait_for_function("window.drawn")
    shown = np.asarray(Image.open(io.BytesIO(page.locator("canvas").screenshot())).convert("RGB"), float)
    page.goto(page.url.removesuffix("example.html"))
    for x, y in ((212, 112), (382, 112)):  # toward the lamp on each ball
        red, green, blue = shown[y - 8 : y + 8, x - 8 : x + 8].mean(axis=(0, 1))
        assert red > 60 and red > green > blue


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"values": {"roughness": 0.5}}, "roughness: no parameter that varies in this shader of Conductor"),
        ({"values": {"alpha": 1.5}}, "alpha: 1.5 given, from 0 to 1 expected"),
        ({"values": {"eta": [1.0, 2.0]}}, "eta: 1,2 given, 1 or 3 numbers expected"),
        ({"url": "both", "model": "gold"}, "name one of conductor, kulla-conty, not gold"),
        ({"url": "unprefixed"}, "gonio emit --prefix g_"),
        ({"url": "gold-wgsl"}, "gonio emit --lang glsl"),
        ({"url": "half"}, "f16 is no table of 32-bit numbers: write it without --half"),
        ({"url": "ktx2"}, "is no table of 32-bit numbers"),
        ({"url": "nowhere"}, "404"),
    ],
)
def test_mistakes_are_named(page: Any, given: dict[str, Any], message: str) -> None:
    with pytest.raises(Exception, match=message):
        drawn(page, **{"how": "material", "url": "gold", "lamp": "point", **given})


# ------------------------------------------------------------------ WebGPU

BOUND = """async ({url, values, pairs}) => {
  const { load, bindings } = await import('gonio-wgpu');
  const device = await (await navigator.gpu.requestAdapter()).requestDevice();
  device.pushErrorScope('validation');
  const bundle = await load(url);
  const { text, group, layout, bindGroup, bytes } = bindings(device, bundle, values);
  const { struct, derived, functions } = bundle.manifest;
  const module = device.createShaderModule({ code: `${text}
    @group(0) @binding(0) var<uniform> given: ${struct};
    @group(0) @binding(1) var<storage, read> pairs: array<vec4f>;
    @group(0) @binding(2) var<storage, read_write> found: array<vec4f>;
    @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
      ${derived ? `let derived = ${functions.derive}(given);` : ''}
      let wo = pairs[2 * id.x].xyz; let wi = pairs[2 * id.x + 1].xyz;
      found[id.x] = vec4f(${functions.eval}(given, ${derived ? 'derived, ' : ''}wo, wi), 0.0);
    }` });
  const floats = new Float32Array(Uint8Array.from(atob(pairs), (c) => c.charCodeAt(0)).buffer);
  const buffer = (size, usage) => device.createBuffer({ size, usage });
  const { COPY_DST, COPY_SRC, MAP_READ, STORAGE, UNIFORM } = GPUBufferUsage;
  const size = floats.byteLength / 2;
  const buffers = [[bytes.byteLength, UNIFORM | COPY_DST], [2 * size, STORAGE | COPY_DST], [size, STORAGE | COPY_SRC]]
    .map((each) => buffer(...each));
  device.queue.writeBuffer(buffers[0], 0, bytes);
  device.queue.writeBuffer(buffers[1], 0, floats);
  const kinds = ['uniform', 'read-only-storage', 'storage'];
  const own = device.createBindGroupLayout({ entries: kinds.map((type, binding) => {
    return { binding, visibility: GPUShaderStage.COMPUTE, buffer: { type } };
  }) });
  const empty = device.createBindGroupLayout({ entries: [] });
  const layouts = [own, empty, empty, empty].slice(0, group + 1);
  if (group) layouts[group] = layout;
  const pipeline = device.createComputePipeline({
    layout: device.createPipelineLayout({ bindGroupLayouts: layouts }), compute: { module, entryPoint: 'main' },
  });
  const back = buffer(size, MAP_READ | COPY_DST);
  const encoder = device.createCommandEncoder();
  const pass = encoder.beginComputePass();
  pass.setPipeline(pipeline);
  const none = device.createBindGroup({ layout: empty, entries: [] });
  layouts.forEach((each, i) => pass.setBindGroup(i, each === empty ? none : bindGroup));
  const entries = buffers.map((each, binding) => ({ binding, resource: { buffer: each } }));
  pass.setBindGroup(0, device.createBindGroup({ layout: own, entries }));
  pass.dispatchWorkgroups(size / 16 / 64);
  pass.end();
  encoder.copyBufferToBuffer(buffers[2], 0, back, 0, size);
  device.queue.submit([encoder.finish()]);
  const error = await device.popErrorScope();
  if (error) throw new Error(error.message);
  await back.mapAsync(MAP_READ);
  return Array.from(new Float32Array(back.getMappedRange()));
}"""


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "values", "metal"),
    [
        ("gold", {}, GOLD),
        ("tables", {}, METALS["tables"]),
        (
            "tables",
            {"base.alpha": 0.6, "base.albedo": [0.5, 0.7, 0.9]},
            go.KullaConty(go.Conductor.preset("Au", alpha=0.6, albedo=(0.5, 0.7, 0.9))),
        ),
    ],
)
def test_bindings_of_webgpu(page: Any, name: str, values: dict[str, Any], metal: go.BSDF) -> None:
    if page.evaluate("async () => !navigator.gpu || !(await navigator.gpu.requestAdapter())"):
        pytest.skip("NOT TRIED in WebGPU: this browser has no adapter")
    pairs = np.random.default_rng(4).normal(size=(1024, 2, 4)).astype(np.float32)
    pairs[..., 2] = np.abs(pairs[..., 2]) + 0.2
    pairs[..., :3] /= np.linalg.norm(pairs[..., :3], axis=-1, keepdims=True)
    given = {"url": f"{name}-wgsl", "values": values, "pairs": base64.b64encode(pairs.tobytes()).decode()}
    found = np.array(page.evaluate(BOUND, given)).reshape(-1, 4)[:, :3]
    wo, wi = pairs[:, 0, :3].astype(float), pairs[:, 1, :3].astype(float)
    right = np.asarray(metal.eval(wo, wi, precision="float64"))
    assert np.allclose(found, right, rtol=1e-5, atol=1e-7)
