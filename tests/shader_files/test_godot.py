"""The adapter to Godot's checkouts, with a short file of our own in the layout of the engine's."""

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.catalog import shaders
from gonio.catalog.shaders.engines.godot import tables
from gonio.errors import InputError

SHADERS = "servers/rendering/renderer_rd/shaders"
REST = "void shadow() { texture2D map = shadow_atlas; }\n#CODE : LIGHT\n"  # does not compile without the renderer
HELPERS = """
KIND D_GGX(KIND x) { return x; }
KIND V_GGX(KIND x) { return x; }
KIND D_GGX_anisotropic(KIND x) { return x; }
KIND V_GGX_anisotropic(KIND x) { return x; }
KIND SchlickFresnel(KIND x) { return x; }
VECTOR F0(KIND metallic, KIND specular, VECTOR albedo) { return mix(VECTOR(0.16 * specular), albedo, metallic); }
"""
OPTIONAL = """
#ifdef LIGHT_CLEARCOAT_USED
    KIND clearcoat, KIND clearcoat_roughness, VECTOR vertex_normal,
#endif
#ifdef LIGHT_ANISOTROPY_USED
    VECTOR B, VECTOR T, KIND anisotropy,
#endif
    inout VECTOR diffuse_light, inout VECTOR specular_light) {
"""
BODY = """
    diffuse_light += light_color * dot(N, L) * roughness;
    specular_light += f0 * specular_amount COMPENSATION;
#ifdef LIGHT_CLEARCOAT_USED
    specular_light += clearcoat * clearcoat_roughness;
#endif
#ifdef LIGHT_ANISOTROPY_USED
    specular_light += anisotropy * dot(T, L);
#endif
}
"""
START = "void light_compute(VECTOR N, VECTOR L, VECTOR V, KIND A, VECTOR light_color, bool is_directional, "
PACKED = f"""{START} KIND attenuation, VECTOR f0, uint orms, KIND specular_amount, VECTOR albedo, inout KIND alpha,
{OPTIONAL}
    float roughness = unpackUnorm4x8(orms).y;
{BODY}"""
LATEST = f"""{START} KIND attenuation, VECTOR f0, KIND roughness, KIND metallic, KIND specular_amount,
    VECTOR albedo, inout KIND alpha, vec2 screen_uv, VECTOR energy_compensation, {OPTIONAL} {BODY}"""
CLUSTERED = """
vec3 prefiltered_dfg(float lod, float NoV) {
    return textureLod(sampler2D(dfg, SAMPLER_LINEAR_CLAMP), vec2(NoV, 1.0 - lod), 0.0).rgb;
}
vec3 get_energy_compensation(vec3 f0, float env) { return f0 + env; }
"""


def checkout(folder: Path, latest: bool) -> Path:
    text = REST + HELPERS + (LATEST if latest else PACKED)
    words = {"KIND": "half", "VECTOR": "hvec3"} if latest else {"KIND": "float", "VECTOR": "vec3"}
    for old, new in {**words, "COMPENSATION": "* energy_compensation" if latest else ""}.items():
        text = text.replace(old, new)
    files = {"scene_forward_lights_inc.glsl": text}
    if latest:
        files["half_inc.glsl"] = "#define half float\n#define hvec3 vec3\n"
        files["forward_clustered/scene_forward_clustered_inc.glsl"] = REST + CLUSTERED
    for name, content in files.items():
        (folder / SHADERS / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / SHADERS / name).write_text(content)
    return folder


@pytest.mark.sample(1)
@pytest.mark.parametrize("latest", [False, True])
def test_light_compute_of_a_checkout_is_the_material(tmp_path: Path, latest: bool) -> None:
    written = shaders.adopt_package(checkout(tmp_path / "godot", latest), tmp_path / "out")
    files = {one.stem: one for one in written}
    assert set(files) == {"godot-standard", "godot-coat", "godot-anisotropic"}
    wo, wi = np.array([[0.0, 0.6, 0.8]]), np.array([[0.8, 0.0, 0.6]])

    def value(name: str, **more: float) -> float:
        made = go.Shader(files[f"godot-{name}"], color=0.5, rough=0.4, metal=0.25, specular=0.5, **more)
        return float(made.eval(wo, wi, precision="float64")[0, 0])

    f0 = 0.75 * 0.08 + 0.25 * 0.5
    place = np.array([0.8, 1.0 - 0.4]) * 128 - 0.5
    column, row = place.astype(int)
    x, y = place - [column, row]
    table = tables(tmp_path)["dfg"][row : row + 2, column : column + 2, 1]
    env = float(np.array([1 - y, y]) @ table @ np.array([1 - x, x]))
    base = 0.6 * 0.4 * 0.5 * 0.75 + f0 * (f0 + env if latest else 1.0)
    assert value("standard") == pytest.approx(base, rel=1e-6)
    assert value("coat", coat=0.4, coatRough=0.5) == pytest.approx(base + 0.2, rel=1e-6)
    assert value("anisotropic", strength=0.3) == pytest.approx(base + 0.24, rel=1e-6)


def test_table_is_the_integral_of_the_lobe(tmp_path: Path) -> None:
    """Beside an integral over a fine grid of half vectors (Karis 2013), k = alpha / 2."""
    table = tables(tmp_path)["dfg"]
    alpha, n_v = ((128 - 80 + 0.5) / 128) ** 2, (90 + 0.5) / 128
    height, azimuth = (np.arange(2000) + 0.5) / 2000, np.pi * (np.arange(1000) + 0.5) / 1000
    cosine = np.sqrt((1 - height) / (1 + (alpha**2 - 1) * height))[:, None]
    v_h = np.sqrt(1 - n_v**2) * np.sqrt(1 - cosine**2) * np.cos(azimuth) + n_v * cosine
    n_l = np.maximum(2 * v_h * cosine - n_v, 0)
    masking = n_l / (n_l * (1 - alpha / 2) + alpha / 2) * n_v / (n_v * (1 - alpha / 2) + alpha / 2)
    weight = np.where(n_l > 0, masking * v_h / (cosine * n_v), 0)
    expected = [np.mean(weight * (1 - v_h) ** 5), np.mean(weight), 0.0]
    np.testing.assert_allclose(table[80, 90], expected, rtol=1e-2)


def test_a_checkout_of_another_godot_is_rejected(tmp_path: Path) -> None:
    path = checkout(tmp_path / "godot", latest=False) / SHADERS / "scene_forward_lights_inc.glsl"
    path.write_text(path.read_text().replace("is_directional", "directional"))
    with pytest.raises(InputError, match="no argument is_directional") as error:
        shaders.adopt_package(tmp_path / "godot", tmp_path / "out")
    assert "4.3" in str(error.value.hint) and not (tmp_path / "out").exists()
