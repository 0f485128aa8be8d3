"""WGSL files that Gonio reads have the values that Chromium's own WebGPU computes from the same text."""

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from parity import RUN_WGSL, pack

import browser

COUNT = 4096
# constructs of WGSL that a reader may get wrong, in BRDFs of L and V with the normal +z
FILES = {
    "structs, pointers and methods on them": """
struct Lobe { alpha: f32, weight: vec3f, }
const PI = 3.14159265;
fn widen(lobe: ptr<function, Lobe>, by: f32) { (*lobe).alpha = min((*lobe).alpha + by, 1.0); }
fn density(lobe: Lobe, z: f32) -> f32 {
    let a2 = lobe.alpha * lobe.alpha;
    let t = fma(a2 - 1.0, z * z, 1.0);
    return a2 / (PI * t * t);
}
fn brdf(L: vec3f, V: vec3f) -> vec3f {
    var lobe = Lobe(0.3, vec3f(0.9, 0.5, 0.1));
    widen(&lobe, 0.2);
    let h = normalize(L + V);
    return lobe.weight * density(lobe, h.z) / 4.0;
}
""",
    "loops, continue and break": """
fn brdf(L: vec3f, V: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 1u; i < 9u; i += 1u) {
        if (i % 3u == 0u) { continue; }
        let k = f32(i);
        sum += vec3f(k * L.x, sqrt(k) * V.y, 1.0) / (k * k + L.z);
    }
    var n = 0;
    loop {
        if (n >= 4) { break; }
        sum *= 0.5 + 0.1 * f32(n);
        continuing { n = n + 1; }
    }
    while (n > 0) { sum.z += 0.25 * L.z; n--; }
    return sum * sum;
}
""",
    "matrices, columns and swizzles": """
fn brdf(L: vec3f, V: vec3f) -> vec3f {
    let m = mat3x3f(0.9, 0.1, 0.0, -0.2, 0.8, 0.3, 0.1, 0.0, 1.1);
    let wide = mat2x3<f32>(L, V);
    var w = m * L + V * m;
    w = w.zxy + transpose(m)[1] * wide[1].x;
    let square = transpose(wide) * wide;
    w.x += determinant(m) * square[0][1];
    return vec3f(w.xx + w.yz, dot(w, w));
}
""",
    "switch, select and masks of vectors": """
fn lobe(kind: i32, z: f32) -> f32 {
    switch kind {
        case 0: { return z; }
        case 1, 2: { return z * z; }
        default: { return sqrt(z); }
    }
}
fn brdf(L: vec3f, V: vec3f) -> vec3f {
    let low = select(vec3f(0.2), abs(L), L < V);
    let both = all(L.xy > vec2f(-0.9)) && any(V.xy > vec2f(0.5));
    return low * (lobe(0, L.z) + lobe(2, V.z) + lobe(7, L.z)) + select(0.0, 0.5, both);
}
""",
    "arrays, abstract numbers and integers": """
const TABLE = array(0.1, 0.4, 0.2, 0.9, 0.3);
const COUNT = 5;
var<private> total: f32 = 0.0;
fn add(x: f32) -> f32 { total += x; return total; }
fn brdf(L: vec3f, V: vec3f) -> vec3f {
    var weights: array<f32, COUNT>;
    for (var i: i32 = 0; i < COUNT; i++) { weights[i] = TABLE[(i * 3) % COUNT] * f32((i << 1u) | 1); }
    let first = add(weights[2] * L.z);
    let second = add(weights[4] * V.z);
    return vec3f(first, second, f32(7 / 2) * weights[1] + f32(-7 % 3) * 0.01);
}
""",
    "functions of the library": """
fn brdf(L: vec3f, V: vec3f) -> vec3f {
    let h = normalize(L + V);
    let r = reflect(-V, h);
    let t = refract(-V, vec3f(0.0, 0.0, 1.0), 1.0 / 1.5);
    let s = smoothstep(0.1, 0.9, h.z) + step(0.5, L.z) + sign(V.x) * 0.25;
    return vec3f(pow(saturate(dot(L, h)), 5.0) + s, distance(r, L) + length(t), exp2(-L.z) + fract(3.0 * V.y));
}
""",
    "trigonometry": """
fn brdf(L: vec3f, V: vec3f) -> vec3f {
    return vec3f(cos(4.0 * L.x) + acos(V.z), sin(6.0 * V.y), atan2(L.y, V.x) + tan(0.7 * L.z) + asin(0.5 * V.y));
}
""",
}
# relative, of at least 0.1; WGSL allows sin and cos an absolute error of 2^-11, acos and asin 7e-5
TOLERANCES = {"trigonometry": 1e-2}
MAIN = """
@group(1) @binding(0) var<storage, read> gonio_inputs: array<f32>;
@group(1) @binding(1) var<storage, read_write> gonio_outputs: array<vec4f>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
    let at = id.x * 6u;
    let wo = vec3f(gonio_inputs[at], gonio_inputs[at + 1u], gonio_inputs[at + 2u]);
    let wi = vec3f(gonio_inputs[at + 3u], gonio_inputs[at + 4u], gonio_inputs[at + 5u]);
    gonio_outputs[id.x] = vec4f(brdf(wi, wo) * wi.z, 0.0);
}
"""


@pytest.fixture(scope="module")
def page() -> Iterator[Any]:
    with browser.page() as opened:
        if opened.evaluate("async () => !navigator.gpu || !(await navigator.gpu.requestAdapter())"):
            pytest.skip("NOT TRIED in WebGPU: this browser has no adapter")
        yield opened


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", FILES)
def test_file_has_the_values_of_webgpu(page: Any, name: str, tmp_path: Path) -> None:
    file = tmp_path / "shader.wgsl"
    file.write_text(FILES[name])
    random = np.random.default_rng(3)
    wo, wi = random.normal(size=(2, COUNT, 3))
    for w in (wo, wi):
        w[:, 2] = np.abs(w[:, 2])
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    wo, wi = (w.astype(np.float32).astype(float) for w in (wo, wi))
    given = {"text": FILES[name] + MAIN, "inputs": pack(np.concatenate([wo, wi], axis=1)), "count": COUNT}
    answer = page.evaluate(RUN_WGSL, {**given, "textures": []})
    theirs = np.frombuffer(base64.b64decode(answer), "<f4").reshape(6, COUNT, 4)[0, :, :3]
    ours = np.asarray(go.Shader(file).eval(wo, wi, precision="float64"))
    moved = [
        np.asarray(go.Shader(file).eval(wo * (1.0 + turn), wi * (1.0 - turn), precision="float64"))
        for turn in 2.0**-24 * random.choice((-8.0, 8.0), (3, COUNT, 3))
    ]
    rounding = np.max(np.abs(np.array(moved) - ours), axis=0)
    error = np.abs(theirs - ours) - rounding
    limit = TOLERANCES.get(name, 1e-5) * np.maximum(np.abs(ours), 0.1)
    share = np.mean(np.any(error > limit, axis=1))  # a step that rounding crosses
    assert share < 1e-3, (name, share, np.max(error / limit))
