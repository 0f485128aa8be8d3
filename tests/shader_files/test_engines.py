"""Packages of engines as materials. The packages here are short ones of our own, in the layout of the engine's."""

import base64
import io
import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.catalog import shaders
from gonio.catalog.shaders import engines
from gonio.cli.app import app
from gonio.errors import InputError
from gonio.spirv.compiler import compiler
from PIL import Image
from typer.testing import CliRunner

# a program with the names that ours assigns and includes, and a formula of our own: color (1 + table) cos / pi
PROGRAM = """
uniform vec3 diffuse;
uniform float roughness;
uniform float metalness;
uniform float opacity;
varying vec3 vNormal;
varying vec3 vViewPosition;
#include <lights>
#include <lights_physical_pars_fragment>
void main() {
    float view = normalize(vViewPosition).z + dFdx(vNormal.x);
    float table = texture2D(dfgLUT, vec2(roughness, view)).y;
    float light = dot(directionalLights[0].direction, vNormal);
    vec3 color = diffuse * (1.0 + table) * light / 3.14159265;
    gl_FragColor = linearToOutputTexel(vec4(color * directionalLights[0].color, opacity));
}
"""
LIGHTS = """
struct DirectionalLight { vec3 direction; vec3 color; };
uniform DirectionalLight directionalLights[ NUM_DIR_LIGHTS ];
"""


@pytest.fixture
def three(tmp_path: Path) -> Path:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")
    package = tmp_path / "node_modules" / "three"
    folder = package / "src" / "renderers" / "shaders"
    for name, text in {
        "ShaderLib/meshphysical.glsl.js": f"export const vertex = ``;\nexport const fragment = `{PROGRAM}`;\n",
        "ShaderChunk/lights.glsl.js": f"export default /* glsl */`{LIGHTS}`;\n",
        "ShaderChunk/lights_physical_pars_fragment.glsl.js": "export default `uniform sampler2D dfgLUT;`;\n",
        "DFGLUTData.js": "const DATA = new Uint16Array( [ 0, 0x3c00, 0, 0x3c00, 0, 0x3800, 0, 0x3800 ] );\n",
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    (package / "package.json").write_text(json.dumps({"name": "three", "version": "0.999.0"}))
    return package


# chunks with the names and signatures that our program calls, and formulas of our own
CHUNKS = {
    "metalnessModulate": """
vec3 getSpecularModulate(vec3 s, vec3 albedo, float metal, float f0, float factor) {
    return mix(f0 * s * factor, albedo, metal);
}
vec3 getAlbedoModulate(vec3 albedo, float metal) { return (1.0 - metal) * albedo; }
""",
    "fresnelSchlick": "vec3 getFresnel(float c, float gloss, vec3 specularity) { return specularity; }",
    "lightDiffuseLambert": "float getLightDiffuse(vec3 n, vec3 v, vec3 l) { return -l.z; }",
    "lightSpecularGGX": """
float getLightSpecular(vec3 h, vec3 r, vec3 n, vec3 v, vec3 l, float gloss, mat3 tbn) { return 0.5 * gloss; }
""",
    "lightSpecularAnisoGGX": """
float getLightSpecular(vec3 h, vec3 r, vec3 n, vec3 v, vec3 l, float gloss, mat3 tbn) { return dAnisotropy; }
""",
    "lightSheen": "float getLightSpecularSheen(vec3 h, vec3 n, vec3 v, vec3 l, float gloss) { return gloss; }",
    "combine": """
vec3 combineColor(vec3 albedo, vec3 sheen, float coat) {
    return albedo * dDiffuseLight + dSpecularLight + sheen * sSpecularLight;
}
""",
}


@pytest.mark.slow
def test_playcanvas_adds_its_lobes(tmp_path: Path) -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")
    package = tmp_path / "node_modules" / "playcanvas"
    folder = package / "build/playcanvas/src/scene/shader-lib/glsl/chunks/lit/frag"
    folder.mkdir(parents=True)
    for name, text in CHUNKS.items():
        (folder / f"{name}.js").write_text(f"var {name}_default = `{text}`;\nexport {{ {name}_default as default }};\n")
    (package / "package.json").write_text(json.dumps({"name": "playcanvas", "version": "2.999.0"}))
    files = {one.stem: one for one in shaders.adopt_package(package, tmp_path / "playcanvas")}
    assert set(files) == {"playcanvas-standard", "playcanvas-anisotropic", "playcanvas-sheen"}
    wo, wi = np.array([[0.0, 0.6, 0.8]]), np.array([[0.8, 0.0, 0.6]])

    def value(name: str, **more: float) -> float:
        made = go.Shader(files[f"playcanvas-{name}"], color=0.5, rough=0.2, lamp=0.5, **more)
        return float(made.eval(wo, wi, precision="float64")[0, 0])

    lamp = 0.5 * 0.6
    assert value("standard", metal=1.0) == pytest.approx(lamp * 0.5 * 0.8 * 0.5, rel=1e-6)
    assert value("standard", metal=0.0) == pytest.approx(lamp * (0.5 + 0.5 * 0.8 * 0.04), rel=1e-6)
    assert value("anisotropic", metal=1.0, strength=0.3) == pytest.approx(lamp * 0.3 * 0.5, rel=1e-6)
    assert value("sheen", metal=1.0, sheenRough=0.7) == pytest.approx(lamp * (0.5 * 0.8 * 0.5 + 0.7), rel=1e-6)


# the uniforms that our program assigns, and a formula of our own: color (lamp's cosine) (1 + E of the table) + gloss
BABYLON = {
    "pbr.fragment": """
#include<__decl__pbrFragment>
#include<__decl__lightFragment>[0..maxSimultaneousLights]
#include<pbrFragmentSamplersDeclaration>
void main(void) {
vec3 color=vec3(0.0);
#include<lightFragment>[0..maxSimultaneousLights]
#ifdef CLEARCOAT
color+=vClearCoatParams.x*vClearCoatRefractionParams.x;
#endif
#ifdef SHEEN
color+=vSheenColor.rgb*vSheenRoughness;
#endif
#ifdef ANISOTROPIC
color+=vAnisotropy.z;
#endif
gl_FragColor=vec4(color,1.0);
}
""",
    "ShadersInclude/pbrFragmentDeclaration": """
uniform vec4 vEyePosition;uniform vec4 vAlbedoColor;uniform float baseWeight;uniform float baseDiffuseRoughness;
uniform vec4 vLightingIntensity;uniform vec4 vReflectivityColor;uniform vec4 vMetallicReflectanceFactors;
uniform vec3 vEmissiveColor;uniform vec3 vAmbientColor;uniform float visibility;varying vec3 vPositionW;
varying vec3 vNormalW;uniform vec2 vClearCoatParams;uniform vec4 vClearCoatRefractionParams;uniform vec4 vSheenColor;
uniform float vSheenRoughness;uniform vec3 vAnisotropy;varying mat3 vTBN;
""",
    "ShadersInclude/pbrFragmentSamplersDeclaration": "uniform sampler2D environmentBrdfSampler;",
    "ShadersInclude/lightFragment": """
#ifdef LIGHT{X}
float energy=texture2D(environmentBrdfSampler,vec2(vEyePosition.z,vReflectivityColor.y)).y;
#ifdef LEGACY_SPECULAR_ENERGY_CONSERVATION
energy*=2.0;
#endif
color+=vAlbedoColor.rgb*dot(-light{X}.vLightData.xyz,vNormalW)*energy*light{X}.vLightDiffuse.rgb+vReflectivityColor.a;
#endif
""",
}


def test_babylon_lights_its_program(tmp_path: Path) -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")
    package = tmp_path / "node_modules" / "@babylonjs" / "core"
    (package / "Shaders" / "ShadersInclude").mkdir(parents=True)
    for name, text in BABYLON.items():
        (package / "Shaders" / f"{name}.js").write_text(f"const shader = `{text}`;\nexport const one = {{ shader }};\n")
    (package / "package.json").write_text(json.dumps({"name": "@babylonjs/core", "version": "9.999.0"}))
    texels = np.zeros((2, 2, 4), np.uint8)
    texels[..., 1], texels[..., 3] = [[51, 51], [102, 102]], [[255, 255], [128, 255]]  # rows by roughness
    drawn = io.BytesIO()
    Image.fromarray(texels, "RGBA").save(drawn, "PNG")
    (package / "Misc").mkdir()
    table = package / "Misc" / "brdfTextureTools.js"
    table.write_text(
        f'const _environmentBRDFBase64Texture = "data:image/png;base64,{base64.b64encode(drawn.getvalue()).decode()}";'
    )
    files = {one.stem: one for one in shaders.adopt_package(package, tmp_path / "babylon")}
    wo, wi = np.array([[0.0, 0.0, 1.0]]), np.array([[0.8, 0.0, 0.6]])

    def value(name: str, **more: float) -> float:
        made = go.Shader(files[f"babylon-{name}"], color=0.5, **more)
        return float(made.eval(wo, wi, precision="float64")[0, 0])

    low, high = (number**2.2 for number in (0.2, 0.4))
    assert value("standard", rough=0.0) == pytest.approx(0.5 * 0.6 * 2.0 * low + 0.04, rel=1e-3)  # half floats
    assert value("conserving", rough=1.0, index=2.0) == pytest.approx(0.5 * 0.6 * high + 1.0 / 9.0, rel=1e-3)
    plain = value("standard", rough=1.0)
    assert value("coat", rough=1.0, coat=0.5) == pytest.approx(plain + 0.5 * 0.04, rel=1e-6)
    assert value("sheen", rough=1.0, sheen=0.5, sheenRough=0.3) == pytest.approx(plain + 0.15, rel=1e-6)
    assert value("anisotropic", rough=1.0, strength=0.3) == pytest.approx(plain + 0.3, rel=1e-6)
    assert np.load(tmp_path / "babylon" / "environmentBrdf.npy")[1, 0, 1] == pytest.approx(high * 255 / 128, rel=1e-3)
    for text, words in (("", "no PNG"), ('_environmentBRDFBase64Texture = "data:image/png;base64,AAAA"', "cannot be")):
        table.write_text(text)
        with pytest.raises(InputError, match=words):
            shaders.adopt_package(package, tmp_path / "again")


def test_gltf_viewer_mixes_its_lobes(tmp_path: Path) -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")
    package = tmp_path / "node_modules" / "@khronosgroup" / "gltf-viewer"
    (package / "dist").mkdir(parents=True)
    text = """vec3 F_Schlick(vec3 f0, vec3 f90, float c) { return f0; }
vec3 BRDF_lambertian(vec3 color) { return color / M_PI; }
vec3 BRDF_specularGGX(float alpha, float l, float v, float h) { return vec3(alpha + v); }
vec3 BRDF_specularGGXAnisotropy(float a, float s, vec3 n, vec3 v, vec3 l, vec3 h, vec3 t, vec3 b) { return vec3(s); }
"""
    bundle = f"let other = `x`;\nvar brdfShader = {json.dumps(text)};\n"
    (package / "dist" / "gltf-viewer.module.js").write_text(bundle)
    (package / "package.json").write_text(json.dumps({"name": "@khronosgroup/gltf-viewer", "version": "9.9.9"}))
    files = {one.stem: one for one in shaders.adopt_package(package, tmp_path / "gltf")}
    wo, wi = np.array([[0.0, 0.6, 0.8]]), np.array([[0.8, 0.0, 0.6]])

    def value(name: str, **more: float) -> float:
        made = go.Shader(files[f"gltf-{name}"], color=0.5, rough=0.4, **more)
        return float(made.eval(wo, wi, precision="float64")[0, 0])

    assert value("standard", metal=1.0) == pytest.approx(0.6 * 0.5 * (0.16 + 0.8), rel=1e-6)
    assert value("standard", metal=0.0) == pytest.approx(0.6 * (0.96 * 0.5 / np.pi + 0.04 * 0.96), rel=1e-6)
    assert value("anisotropic", metal=1.0, strength=0.3) == pytest.approx(0.6 * 0.5 * 0.3, rel=1e-6)


# headers with the names that our program calls, and a formula of our own: color (1 + table + ltc) + coat's roughness
OPENPBR = """
struct OpenPBR_ResolvedInputs { vec3 base_color; float base_metalness; float base_diffuse_roughness;
    float specular_roughness; float specular_ior; float coat_weight; float coat_roughness; float coat_ior;
    float fuzz_weight; float fuzz_roughness; };
struct OpenPBR_PreparedBsdf { OpenPBR_ResolvedInputs given; vec3 view; };
const vec3 OpenPBR_BaseRgbWavelengths_nm = vec3(600.0, 500.0, 400.0);
const float OpenPBR_VacuumIor = 1.0;
OpenPBR_ResolvedInputs openpbr_make_default_resolved_inputs() {
    return OpenPBR_ResolvedInputs(vec3(0.0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
}
OpenPBR_PreparedBsdf openpbr_prepare(OpenPBR_ResolvedInputs i, vec3 t, vec3 nm, float ior, vec3 view) {
    return OpenPBR_PreparedBsdf(i, view);
}
vec3 openpbr_eval(OpenPBR_PreparedBsdf p, vec3 light) {
    float table = OPENPBR_SAMPLE_3D_TEXTURE(0, vec3(0.5)).r + OPENPBR_SAMPLE_2D_TEXTURE(6, vec2(0.5)).r;
    float fuzz = p.given.fuzz_weight * OPENPBR_SAMPLE_2D_TEXTURE(7, vec2(0.5)).z;
    float coat = p.given.coat_weight * p.given.coat_roughness;
    return atan2(light.z, 1.0) * (p.given.base_color * (1.0 + table + fuzz) + coat);
}
vec3 openpbr_get_sum_of_diffuse_specular(vec3 value) { return value; }
"""
OPENPBR_TABLES = {
    "ideal_dielectric_energy_complement": 32**3,
    "ideal_dielectric_avg_energy_complement": 32**2,
    "ideal_dielectric_reflection_ratio": 32**2,
    "opaque_dielectric_energy_complement": 32**3,
    "opaque_dielectric_avg_energy_complement": 32**2,
    "ideal_metal_energy_complement": 32**2,
    "ideal_metal_avg_energy_complement": 32,
}


def test_openpbr_bsdf_reads_its_tables(tmp_path: Path) -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")
    data = tmp_path / "openpbr" / "impl" / "data"
    data.mkdir(parents=True)
    (tmp_path / "openpbr" / "openpbr.h").write_text(OPENPBR)
    (tmp_path / "openpbr" / "impl" / "openpbr_bsdf.h").write_text("")
    for name, count in OPENPBR_TABLES.items():
        text = ", ".join(["13107"] * count)  # 0.2
        (data / f"openpbr_{name}_data.h").write_text(f"/* 3 axes */\n{text} // of 32 entries\n")
    ltc = data / "openpbr_ltc_data.h"
    ltc.write_text("vec3(0.5, -1.5e-1, 0.25),\n" * 32**2)
    (file,) = shaders.adopt_package(tmp_path / "openpbr", tmp_path / "out")
    made = go.Shader(file, color=0.5, roughness=0.5, coat=0.5, coatRoughness=0.2, fuzz=1.0)
    wo, wi = np.array([[0.0, 0.6, 0.8]]), np.array([[0.8, 0.0, 0.6]])
    assert made.eval(wo, wi, precision="float64")[0, 0] == pytest.approx(np.arctan(0.6) * (0.5 * 1.65 + 0.1), rel=1e-5)
    ltc.write_text("vec3(0.5, 0.5, 0.25),\n")
    with pytest.raises(InputError, match="3 numbers, 3072 expected"):
        shaders.adopt_package(tmp_path / "openpbr", tmp_path / "again")


# modules with the names that our program imports, and formulas of our own
BEVY = {
    "bevy_pbr/src/render/pbr_lighting.wgsl": """
#define_import_path bevy_pbr::lighting
struct Layer { N: vec3f, R: vec3f, NdotV: f32, perceptual_roughness: f32, roughness: f32, }
struct LightingInput {
#ifdef STANDARD_MATERIAL_CLEARCOAT
    layers: array<Layer, 2>,
#else
    layers: array<Layer, 1>,
#endif
    V: vec3f, diffuse_color: vec3f, metallic: f32, F0_dielectric: vec3f, F0_metallic: vec3f, F_ab: vec2f,
#ifdef STANDARD_MATERIAL_ANISOTROPY
    anisotropy: f32, Ta: vec3f, Ba: vec3f,
#endif
}
struct Derived { NdotL: f32, }
fn derive_lighting_input(N: vec3f, V: vec3f, L: vec3f) -> Derived { return Derived(dot(N, L)); }
fn Fd_Burley(surface: ptr<function, LightingInput>, derived: ptr<function, Derived>) -> f32 {
    return (*surface).layers[0].NdotV;
}
fn F_AB(rough: f32, NdotV: f32) -> vec2f { return vec2f(rough, NdotV); }
fn perceptualRoughnessToRoughness(rough: f32) -> f32 { return rough * rough; }
fn specular(surface: ptr<function, LightingInput>, derived: ptr<function, Derived>, alpha: f32, k: f32) -> vec3f {
    return alpha * mix((*surface).F0_dielectric, (*surface).F0_metallic, (*surface).metallic) + (*surface).F_ab.x;
}
#ifdef STANDARD_MATERIAL_ANISOTROPY
fn specular_anisotropy(surface: ptr<function, LightingInput>, derived: ptr<function, Derived>, L: vec3f, alpha: f32,
                       k: f32) -> vec3f {
    return vec3f((*surface).anisotropy * dot((*surface).Ta, L));
}
#endif
fn specular_clearcoat(surface: ptr<function, LightingInput>, derived: ptr<function, Derived>, coat: f32, alpha: f32,
                      k: f32) -> vec2f {
    return vec2f(coat * 0.5, alpha);
}
""",
    "bevy_pbr/src/render/pbr_functions.wgsl": """
#define_import_path bevy_pbr::pbr_functions
fn calculate_diffuse_color(color: vec3f, metal: f32, s: f32, d: f32) -> vec3f { return color * (1.0 - metal); }
fn calculate_F0_dielectric(reflectance: vec3f) -> vec3f { return 0.16 * reflectance; }
""",
    "bevy_render/src/maths.wgsl": "#define_import_path bevy_render::maths\n",
}


def test_bevy_lights_its_material(tmp_path: Path) -> None:
    for name, text in BEVY.items():
        (tmp_path / "bevy" / "crates" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "bevy" / "crates" / name).write_text(text)
    files = {one.stem: one for one in shaders.adopt_package(tmp_path / "bevy", tmp_path / "out")}
    assert set(files) == {"bevy-standard", "bevy-coat", "bevy-anisotropic"}
    wo, wi = np.array([[0.0, 0.6, 0.8]]), np.array([[0.8, 0.0, 0.6]])

    def value(name: str, **more: float) -> float:
        made = go.Shader(files[f"bevy-{name}"], color=0.5, rough=0.5, metal=0.25, reflectance=0.5, **more)
        return float(made.eval(wo, wi, precision="float64")[0, 0])

    base, gloss = 0.5 * 0.75 * 0.8, 0.25 * (0.75 * 0.08 + 0.25 * 0.5) + 0.5
    assert value("standard") == pytest.approx(0.6 * (base + gloss), rel=1e-6)
    coated = (base + gloss * 0.8) * 0.8 + 0.36
    assert value("coat", coat=0.4, coatRough=0.6) == pytest.approx(0.6 * coated, rel=1e-6)
    assert value("anisotropic", strength=0.3) == pytest.approx(0.6 * (base + 0.3 * 0.8), rel=1e-6)


def test_program_of_the_package_is_the_material(three: Path, tmp_path: Path) -> None:
    written = shaders.adopt_package(three, tmp_path / "three")
    assert "three-standard.glsl" in {one.name for one in written}
    assert str(tmp_path) not in (tmp_path / "three" / "three-standard.glsl.toml").read_text()
    material = go.Shader(tmp_path / "three" / "three-standard.glsl", color=(0.2, 0.4, 0.6), rough=0.3)
    assert list(material.parameters()) == ["color", "rough", "metal"]
    wo, wi = np.array([[0.0, 0.6, 0.8], [0.6, 0.0, 0.8]]), np.array([[0.0, 0.0, 1.0], [0.8, 0.0, 0.6]])
    table = 1.0 - 0.5 * (0.8 * 2.0 - 0.5)  # linear between 1 at n.v = 1/4 and 0.5 at 3/4, and constant beyond
    expected = np.array([[0.2, 0.4, 0.6]]) * (1.0 + max(table, 0.5)) * wi[:, 2:] / np.pi
    np.testing.assert_allclose(material.eval(wo, wi, precision="float64"), expected, rtol=1e-6)


def test_changed_package_is_read_again(three: Path, tmp_path: Path) -> None:
    file = shaders.adopt_package(three, tmp_path / "three")[-1]
    program = three / "src/renderers/shaders/ShaderLib/meshphysical.glsl.js"
    program.write_text(program.read_text().replace("gl_FragColor =", "gl_FragColr ="))
    with pytest.raises(InputError, match="gl_FragColr") as error:
        go.Shader(file)
    assert str(error.value.where).endswith("meshphysical.glsl.js:16")


def test_verb_writes_the_package_and_keeps_what_is_there(
    three: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke(app, ["adopt", "node_modules/three"])
    assert run.exit_code == 0 and "three/three-standard.glsl" in run.output
    again = CliRunner().invoke(app, ["adopt", "node_modules/three"])
    assert again.exit_code != 0
    assert CliRunner().invoke(app, ["adopt", "node_modules/three", "--force"]).exit_code == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is not valid JSON"),
        (None, "its package.json cannot be read"),
        ("[]", "no adapter for the package 'None'"),
        ('{"name": "left-pad"}', "'left-pad'"),
    ],
)
def test_other_packages_are_refused(tmp_path: Path, text: str | None, message: str) -> None:
    if text is not None:
        (tmp_path / "package.json").write_text(text)
    with pytest.raises(InputError, match=message) as error:
        shaders.adopt_package(tmp_path, tmp_path / "out")
    assert "node_modules/three" in str(error.value.hint)


def test_table_of_another_size_is_refused(three: Path, tmp_path: Path) -> None:
    (three / "src/renderers/shaders/DFGLUTData.js").write_text("const DATA = new Uint16Array( [ 1, 2, 3 ] );")
    with pytest.raises(InputError, match="3 numbers"):
        shaders.adopt_package(three, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_every_adapter_names_its_program() -> None:
    for engine in engines.engines().values():
        adapters = list(engine.folder.glob("*.toml"))
        assert adapters
        for adapter in adapters:
            assert adapter.with_suffix("").is_file()
