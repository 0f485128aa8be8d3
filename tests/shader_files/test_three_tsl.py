"""three.js's TSL build, whose JavaScript writes WGSL: a short package of our own, and three.js if installed."""

from __future__ import annotations

import functools
import http.server
import json
import shutil
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.catalog import shaders
from gonio.catalog.shaders.engines.three import tsl
from gonio.errors import InputError, MachineError
from gonio.spirv.compiler import compiler

import browser

THREE = Path(__file__).parents[2] / "web" / "node_modules" / "three"
NAMES = ("standard", "physical", "anisotropic", "iridescent")
# three.js in short: a renderer that writes the formula color (1 + table) rough cos / pi, with the names that it gives
PACKAGE = """
const node = (type) => ({ type, setName(name) { this.name = name; return this; } });
export const TSL = {
  float: () => node(), vec2: (x) => x, vec3: () => node(),
  uniform: (value) => node(value instanceof Color ? 'vec3<f32>' : 'f32'),
  varyingProperty: (type, name) => node(`vec3<f32>`).setName(name),
};
export class Color {}
export class Light { static registerNode(made) { Light.node = made; } }
export class AnalyticLightNode {}
export class MaterialNode { getCache() { throw new Error('no properties'); } }
export class MeshStandardNodeMaterial {
  properties = ['color', 'roughness', 'metalness', 'opacity'];
}
export class MeshPhysicalNodeMaterial extends MeshStandardNodeMaterial {
  constructor(given = {}) {
    super();
    if (given.clearcoat) this.properties.push('clearcoat', 'clearcoatRoughness');
    if (given.sheen) this.properties.push('sheen', 'sheenColor', 'sheenRoughness');
    if (given.iridescence) this.properties.push('iridescence', 'iridescenceIOR');
    this.properties.push('ior', 'specularColor', 'specularIntensity');
  }
}
class Holder { add(...parts) { this.parts = parts; } setAttribute() {} position = {}; }
export class PlaneGeometry extends Holder {}
export class PerspectiveCamera extends Holder {}
export class Scene extends Holder {}
export class Float32BufferAttribute {}
export class RenderTarget {}
export class Mesh { constructor(geometry, material) { this.material = material; } }
export const FloatType = 1;
export class WebGPURenderer {
  constructor({ device }) { this.device = device; }
  async init() { console.log('three'); }
  setRenderTarget() {}
  render(scene) {
    const [{ material }] = scene.parts;
    const read = material.properties.map((name) => new MaterialNode().getCache(name));
    const all = [...read, material.anisotropyNode, material.iridescenceThicknessNode];
    const members = all.filter((one) => one?.name).map((one) => `\\t${one.name} : ${one.type}`);
    const { lightDirection } = new Light.node().setupDirect();
    this.device.createShaderModule({ code: '@vertex fn main() {}' });
    this.device.createShaderModule({ code: `
diagnostic( off, derivative_uniformity );
struct OutputStruct { @location( 0 ) color: vec4<f32> };
var<private> output : OutputStruct;
@binding( 1 ) @group( 1 ) var nodeUniform5_sampler : sampler;
@binding( 2 ) @group( 1 ) var nodeUniform5 : texture_2d<f32>;
struct objectStruct {
${members.join(',\\n')}
};
@binding( 0 ) @group( 1 )
var<uniform> object : objectStruct;
@fragment
fn main( @location( 0 ) v_normalViewGeometry : vec3<f32>,
	@location( 1 ) v_positionViewDirection : vec3<f32>,
	@location( 2 ) ${lightDirection.name} : vec3<f32> ) -> OutputStruct {
	let slope = abs( dpdx( v_normalViewGeometry ) ) + abs( - dpdy( v_normalViewGeometry ) );
	let cosine = v_positionViewDirection.z;
	let table = textureSample( nodeUniform5, nodeUniform5_sampler, vec2<f32>( object.rough, cosine ) ).y;
	let f = object.color * ( 1.0 + table ) * object.rough / 3.14159265 + slope;
	output.color = vec4<f32>( f * dot( v_normalViewGeometry, lampDirection ), 1.0 );
	return output;
}` });
  }
}
"""
TABLE = "const DATA = new Uint16Array( [ 0, 0x3c00, 0, 0x3c00, 0, 0x3800, 0, 0x3800 ] );\n"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    if shutil.which("node") is None:
        pytest.skip("TSL was NOT TRIED: no node here")
    folder = tmp_path / "node_modules" / "three"
    for name, text in {
        "src/renderers/shaders/DFGLUTData.js": TABLE,
        "build/three.webgpu.js": PACKAGE,
        "package.json": json.dumps({"name": "three", "version": "0.999.0", "type": "module"}),
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def test_program_that_javascript_writes_is_the_material(package: Path, tmp_path: Path) -> None:
    written = shaders.adopt_package(package, tmp_path / "out", tsl=True)
    assert {one.name for one in written} >= {f"three-tsl-{name}.wgsl" for name in NAMES}
    material = go.Shader(tmp_path / "out" / "three-tsl-standard.wgsl", color=(0.2, 0.4, 0.6), rough=0.3)
    assert list(material.parameters()) == ["color", "rough", "metal"]
    assert "coatRoughness" in go.Shader(tmp_path / "out" / "three-tsl-physical.wgsl").parameters()
    wo, wi = np.array([[0.0, 0.6, 0.8], [0.6, 0.0, 0.8]]), np.array([[0.0, 0.0, 1.0], [0.8, 0.0, 0.6]])
    expected = np.array([[0.2, 0.4, 0.6]]) * 1.5 * 0.3 * wi[:, 2:] / np.pi  # the table is 0.5 for n.v above 3/4
    np.testing.assert_allclose(material.eval(wo, wi, precision="float64"), expected, rtol=1e-6)


def test_javascript_runs_only_if_asked_for(package: Path, tmp_path: Path) -> None:
    (package / "build" / "three.webgpu.js").write_text("throw new Error('run');")
    written = shaders.adopt_package(package, tmp_path / "out")
    assert len(written) == len(NAMES) and not any("tsl" in one.name for one in written)


WRITES = "import { writeFileSync } from 'node:fs';\nwriteFileSync(new URL('../made', import.meta.url), '');\n"


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("const node =", "throw new TypeError('broken');\nconst node =", "fails with 'TypeError: broken'"),
        ("const node =", "for (;;);\nconst node =", "took over 1 s"),
        ("const node =", "await new Promise(() => {});\nconst node =", "fails with"),
        ("const node =", f"{WRITES}const node =", "fails with 'Error: Access to this API has been restricted"),
        ("const node =", "process.stdout.write('{}');\nconst node =", "printed more than the programs"),
        ("export class Scene", "class Scene", "THREE.Scene is not a constructor"),
        ("this.device.", "console.error('TSL: no method');\nthis.device.", "fails with 'Error: TSL: no method"),
        ("@fragment", "@compute", "fails with 'Error: no fragment program"),
        ("fn main( @loc", "fn other( @loc", "no fragment program in the output of three.js"),
        ("v_positionViewDirection : vec3", "v_uv : vec3", "unknown input v_uv : vec3<f32>"),
        (",\n\t@location( 2 ) ${lightDirection.name} : vec3<f32>", "", "no direction of the light"),
        ("'metalness', ", "", "other inputs in the program of this release of three.js: metal"),
        ("texture_2d<f32>", "texture_3d<f32>", "three.js: 0 textures"),
    ],
)  # fmt: skip
def test_unusable_packages_get_one_error(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, message: str
) -> None:
    monkeypatch.setattr(tsl, "SECONDS", 1 if "for (;;)" in new else 60)
    build = package / "build" / "three.webgpu.js"
    assert old in build.read_text()
    build.write_text(build.read_text().replace(old, new))
    with pytest.raises(InputError) as error:
        shaders.adopt_package(package, tmp_path / "out", tsl=True)
    assert message in error.value.what and "without --tsl" in error.value.hint
    assert not (tmp_path / "out").exists() and not (package / "made").exists()


def test_verb_says_what_is_missing(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def gonio(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ended:
            cli.main([*arguments, "--tsl"])
        return int(ended.value.code or 0), capsys.readouterr().err

    monkeypatch.chdir(tmp_path)
    assert gonio("adopt", "node_modules/three") == (0, "")
    code, said = gonio("adopt", "three/three-tsl-standard.wgsl")
    assert code == 2 and "is not the folder of three.js" in said
    monkeypatch.setattr(tsl.shutil, "which", lambda name: None)
    code, said = gonio("adopt", "node_modules/three", "--force")
    assert code == 3 and "install Node 20 or later, or adopt without --tsl" in said
    (package / "build" / "three.webgpu.js").unlink()
    code, said = gonio("adopt", "node_modules/three", "--force")
    assert code == 2 and "no build/three.webgpu.js" in said


def test_old_node_is_named(package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    node = tmp_path / "node"
    node.write_text("#!/bin/sh\necho 'node: bad option: --permission' >&2\nexit 9\n")
    node.chmod(0o755)
    monkeypatch.setattr(tsl.shutil, "which", lambda name: str(node))
    with pytest.raises(MachineError, match="TSL needs Node 20 or later"):
        shaders.adopt_package(package, tmp_path / "out", tsl=True)


def test_other_engines_have_no_tsl(tmp_path: Path) -> None:
    (tmp_path / "package.json").write_text('{"name": "playcanvas"}')
    with pytest.raises(InputError, match="'playcanvas' has no TSL build"):
        shaders.adopt_package(tmp_path, tmp_path / "out", tsl=True)


# --------------------------------------------------------------------------- three.js itself


@pytest.fixture(scope="module")
def adopted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the materials of both builds."""
    if not THREE.is_dir():
        pytest.skip("TSL was NOT TRIED with three.js: no web/node_modules (npm ci)")
    if shutil.which("node") is None:
        pytest.skip("TSL was NOT TRIED with three.js: no node here")
    folder = tmp_path_factory.mktemp("three")
    shaders.adopt_package(THREE, folder, tsl=True)
    return folder


def _directions(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    z, phi = random.uniform(0.05, 1.0, (2, count)), random.uniform(0.0, 2.0 * np.pi, (2, count))
    both = np.stack([np.sqrt(1.0 - z * z) * np.cos(phi), np.sqrt(1.0 - z * z) * np.sin(phi), z], -1)
    return both[0], both[1]


PHYSICAL = {"index": 1.4, "specularTint": (0.9, 0.6, 0.3), "specularWeight": 0.8}
BASE = {"color": (0.8, 0.5, 0.2), "rough": 0.35, "metal": 0.4}
SAME: dict[str, tuple[str, dict[str, Any]]] = {
    "standard": ("standard", BASE),
    "specular": ("physical", {**BASE, **PHYSICAL}),
    "clear coat": ("physical", {**BASE, **PHYSICAL, "coat": 0.7, "coatRoughness": 0.2}),
    "sheen": ("physical", {**BASE, **PHYSICAL, "sheen": (0.3, 0.6, 0.9), "sheenWidth": 0.4}),
    "anisotropy": ("anisotropic", {**BASE, "strength": 0.6}),
    "film": ("iridescent", {**BASE, "strength": 0.9, "filmIndex": 1.4, "filmThickness": 500.0}),
}


@pytest.mark.parametrize("name", SAME)
def test_both_builds_have_the_same_values(adopted: Path, name: str) -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")
    material, values = SAME[name]
    wo, wi = _directions(500, 1)
    webgl, webgpu = (
        np.asarray(go.Shader(adopted / file, **values).eval(wo, wi, precision="float64"))
        for file in (f"three-{material}.glsl", f"three-tsl-{material}.wgsl")
    )
    np.testing.assert_allclose(webgpu, webgl, rtol=1e-5)


# A plain material under a light, as a user of three.js draws it; WebGPU where the browser has it, and WebGL
PAGE = """<!doctype html><link rel="icon" href="data:,">
<script type="importmap">{ "imports": { "three": "./three/build/three.webgpu.js" } }</script>
<script type="module">
import * as THREE from 'three';
window.draw = async (name, values, pairs, forceWebGL) => {
  const renderer = new THREE.WebGPURenderer({ forceWebGL });
  await renderer.init();
  const target = new THREE.RenderTarget(1, 1, { type: THREE.FloatType });
  renderer.setRenderTarget(target);
  const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
  camera.position.z = 5;
  const geometry = new THREE.PlaneGeometry(100, 100);
  geometry.setAttribute('tangent', new THREE.Float32BufferAttribute(Array(4).fill([1, 0, 0, 1]).flat(), 4));
  const plane = new THREE.Mesh(geometry, new THREE[name](values));
  const light = new THREE.DirectionalLight(0xffffff, 1);
  const scene = new THREE.Scene();
  scene.add(plane, light);
  const colors = [];
  for (const [view, direction] of pairs) {
    plane.quaternion.setFromUnitVectors(new THREE.Vector3(...view), new THREE.Vector3(0, 0, 1));
    light.position.set(...direction).applyQuaternion(plane.quaternion);
    renderer.render(scene, camera);
    colors.push([...await renderer.readRenderTargetPixelsAsync(target, 0, 0, 1, 1)].slice(0, 3));
  }
  return colors;
};
window.ready = true;
</script>"""
PLAIN = {"roughness": 0.4, "metalness": 0.3, "color": 0xFFFFFF}
OURS = {"rough": 0.4, "metal": 0.3}
DRAWN: dict[str, tuple[str, dict[str, float], dict[str, float]]] = {
    "standard": ("MeshStandardNodeMaterial", PLAIN, OURS),
    "physical": (
        "MeshPhysicalNodeMaterial",
        {**PLAIN, "ior": 1.4, "specularIntensity": 0.8, "clearcoat": 0.7, "clearcoatRoughness": 0.3,
         "sheen": 0.6, "sheenColor": 0xFFFFFF, "sheenRoughness": 0.4},
        {**OURS, "index": 1.4, "specularWeight": 0.8, "coat": 0.7, "coatRoughness": 0.3, "sheen": 0.6,
         "sheenWidth": 0.4},
    ),
    "anisotropic": ("MeshPhysicalNodeMaterial", {**PLAIN, "anisotropy": 0.6}, {**OURS, "strength": 0.6}),
    "iridescent": (
        "MeshPhysicalNodeMaterial",
        {**PLAIN, "iridescence": 0.9, "iridescenceIOR": 1.4},
        {**OURS, "strength": 0.9, "filmIndex": 1.4, "filmThickness": 400.0},
    ),
}  # fmt: skip


class _Files(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_args: Any) -> None:
        """Nothing: a page asks for several modules."""


def test_adopted_text_is_what_three_draws(adopted: Path, tmp_path: Path) -> None:
    (tmp_path / "three").symlink_to(THREE.resolve())
    (tmp_path / "page.html").write_text(PAGE)
    wo, wi = _directions(6, 2)
    pairs = np.stack([wo, wi], 1).tolist()
    handler = functools.partial(_Files, directory=str(tmp_path))
    with browser.serving(handler) as address, browser.chromium() as chromium:
        page = chromium.new_page()
        page.on("pageerror", lambda error: print(f"page error: {error}"))
        page.goto(f"{address}page.html")
        page.wait_for_function("window.ready")
        for name, (cls, plain, ours) in DRAWN.items():
            own = go.Shader(adopted / f"three-tsl-{name}.wgsl", **ours).eval(wo, wi, precision="float64")
            for webgl in (False, True):
                drawn = page.evaluate("(given) => window.draw(...given)", [cls, plain, pairs, webgl])
                np.testing.assert_allclose(drawn, own, rtol=1e-4, err_msg=f"{name}, WebGL {webgl}")
