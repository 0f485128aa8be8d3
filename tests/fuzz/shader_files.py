"""Shaders as materials: WGSL, SPIR-V, and the adapters beside them."""

from __future__ import annotations

import functools
import re
import zlib
from array import array
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random

from .targets import saved, target

MAGIC = 0x07230203  # of SPIR-V


def _material(path: Path) -> object:
    """A shader, recorded. Its errors are those of the file or of the machine, none of Gonio's own code."""
    from gonio.catalog.shaders import Shader
    from gonio.errors import InputError, MachineError

    try:
        return Shader(path)
    except (InputError, MachineError) as error:
        if ".py:" in error.where:
            raise AssertionError(f"an error that names a file of Gonio: {error}") from error
        raise
    except Exception as error:
        raise RuntimeError(f"{type(error).__name__}: {error}") from error


_WGSL = (
    b"""struct M { base: vec3<f32>, rough: f32, }
@group(0) @binding(0) var<uniform> m: M;
const PI = 3.14159;
const t = array<f32, 4>(1.0, 2, 3.5, 0x1p2);
fn sq(p: ptr<function, f32>) { *p = *p * *p; }
fn brdf(L: vec3f, V: vec3f, N: vec3f) -> vec3f {
    var s = 0.0;
    for (var i = 0u; i < 4; i++) { s += t[i]; if s > 5 { break; } }
    sq(&s);
    let h = normalize(L + V);
    let q = mat3x3f(L, V, N) * h.zyx;
    switch i32(h.z) { case 0, 1 { s *= 2; } default { return m.base; } }
    return select(m.base / PI, q, h.z < m.rough && s >= 1) * pow(s, 0.5);
}""",
    b"""#define_import_path a::b
#import a::{c as d, e}
#ifdef X
fn
#else if Y == 2
}
#else
alias R = f32;
#endif
override k: R = 2.0;
const_assert true;
fn brdf(L: vec3<f32>, V: vec3<f32>) -> R {
    var x: R;
    loop { x += 1; continuing { break if x > 9; } }
    while x > 0 { x -= 1; }
    return x + k;
}""",
)


def _retold(seeds: Callable[[], Sequence[bytes]], tokens: Sequence[bytes]) -> Callable[[bytes], bytes]:
    """What makes a text of another seed whose words are exchanged, left out or repeated, or are tokens."""

    def retold(data: bytes) -> bytes:
        random = Random(zlib.crc32(data))
        words = re.findall(rb"\w+|\s+|[^\w\s]", random.choice(seeds()))
        for _ in range(random.choice((1, 1, 1, 2, 4))):
            at, other = (random.randrange(len(words)) for _ in range(2))
            words[at] = random.choice((words[other], words[other], b"", words[at] * 2, random.choice(tokens)))
        return b"".join(words)

    return retold


_TOKENS = (
    b"array<f32, 65536>", b"array<vec4f, 9999999>", b"loop { }", b"brdf(L, V)", b"(((((((((", b"f16", b"/*",
    b"const a = a;", b"<", b">>", b"atomicAdd", b"discard;", b"1e999", b"0x", b"-2147483648", b"#import a::b",
    b"#endif", b"vec4f", b"mat2x2f", b"&", b"*", b"-", b"%", b"ptr<function, f32>", b"i32", b"0", b"-1", b"break;",
)  # fmt: skip


@target("wgsl", lambda: _WGSL, _TOKENS, _retold(lambda: _WGSL, _TOKENS))
def wgsl(data: bytes, folder: Path) -> object:
    """A WGSL shader as a material, recorded."""
    return _material(saved(folder / "a.wgsl", data))


# ---------------------------------------------------------------------- SPIR-V

_GLSL = (
    """uniform float roughness = 0.4; uniform vec3 base = vec3(0.5, 0.3, 0.1); uniform sampler2D lut;
struct S { float a[4]; vec3 b; };
float D(float nh, float a) { float t = nh * nh * (a * a - 1.0) + 1.0; return a * a / (3.14159 * t * t); }
void scaled(inout S s, float by) { for (int i = 0; i < 4; ++i) { s.a[i] *= by; if (s.a[i] > 3.0) break; } s.b *= by; }
vec3 brdf(vec3 L, vec3 V, vec3 N) {
    S s; s.b = base; s.a = float[4](1.0, dot(N, L), dot(N, V), roughness);
    scaled(s, pow(max(L.z, 0.0), 5.0));
    mat3 m = mat3(L, V, normalize(L + V));
    switch (int(roughness * 3.0)) { case 0: s.b.x = 1.0; break; case 1: s.b = m * s.b; default: s.b.zy += V.xy; }
    if (L.z * V.z < 0.1) return s.b;
    return mix(s.b * D(m[2].z, roughness), clamp(vec3(s.a[2]), 0.0, 1.0), bvec3(L.x > 0.0, true, s.a[1] < 0.5));
}""",
    """layout(std140, binding = 0) uniform Block { vec4 tint; float w[3]; mat2 turn; int kind; };
vec3 total = vec3(0.0);
vec3 lobe_eval(vec3 wo, vec3 wi) {
    vec2 p = turn * wi.xy;
    int i = 0;
    do { total += w[i] * tint.rgb * smoothstep(0.0, 1.0, p.x); i++; } while (i < 3);
    return kind == 2 && wo.z > 0.0 ? reflect(total, wo) : cross(total, inverse(mat3(2.0)) * wi);
}""",
)
_HLSL = """cbuffer Block { float4 tint; float roughness; bool rough; };
struct Lobe { float3 color; float alpha; };
static const float table[3] = { 0.1, 0.2, 0.4 };
Lobe lobe(float3 c) { Lobe l; l.color = c; l.alpha = roughness * roughness; return l; }
float3 BRDF(float3 L, float3 V, float3 N) {
    Lobe l = lobe(tint.rgb);
    [unroll] for (int i = 0; i < 3; i++) l.color += table[i] * saturate(dot(N, L));
    return rough ? l.color / l.alpha : lerp(l.color, frac(V), 0.25);
}"""


@functools.cache
def _modules() -> tuple[bytes, ...]:
    from gonio.spirv import compile_text

    return *(compile_text(one, "a.glsl") for one in _GLSL), compile_text(_HLSL, "a.hlsl", language="hlsl")


def _reworded(data: bytes) -> bytes:
    """Whole words under the magic number; words exchanged, ids renamed, numbers that are small or any."""
    random = Random(zlib.crc32(data))
    if random.random() < 0.8:  # bytes that were put in or left out make the rest unreadable
        data = random.choice(_modules())
    words = array("I", data[: len(data) // 4 * 4])
    if len(words) < 6:
        return data
    words[0] = MAGIC
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        at, other = (random.randrange(5, len(words)) for _ in range(2))
        match random.randrange(5):
            case 0:
                words[at] = words[other]
            case 1:
                words[at], words[other] = words[other], words[at]
            case 2:
                words[at] = random.choice((random.randrange(200), random.getrandbits(32), 0, 0xFFFFFFFF))
            case 3:
                words[at] ^= 1 << random.randrange(32)
            case _:
                a, b = words[at], words[other]
                words = array("I", [b if one == a else a if one == b else one for one in words])
    return words.tobytes()


@target("spirv", _modules, [
    MAGIC.to_bytes(4, "little"), b"\x01\x00\x00\x00", b"\xff" * 4, (0x00010000 | 253).to_bytes(4, "little"),
    (0x00020000 | 249).to_bytes(4, "little"), (0x00040000 | 61).to_bytes(4, "little"),
], _reworded)  # fmt: skip
def spirv(data: bytes, folder: Path) -> object:
    """A module as a material, recorded."""
    return _material(saved(folder / "a.spv", data))


# ---------------------------------------------------------------------- adapters

_ADAPTED = """@group(0) @binding(0) var<uniform> base: vec3f;
@group(0) @binding(1) var<uniform> rough: f32;
@group(0) @binding(2) var lut: texture_2d<f32>;
@group(0) @binding(3) var near: sampler;
struct M { sheen: f32, tint: vec3f }
fn brdf(L: vec3f, V: vec3f, N: vec3f, m: M) -> vec3f {
    return base * pow(max(dot(N, L), 0.0), rough) * textureSample(lut, near, L.xy).rgb * m.tint + m.sheen;
}
fn density(L: vec3f, V: vec3f) -> f32 { return L.z / 3.14159; }
fn draw(V: vec3f, u: vec3f) -> vec3f { return normalize(u + V); }
fn albedo(nv: f32) -> f32 { return nv * rough; }
"""
_ADAPTER = b"""function = "brdf"
arguments = ["light", "view", "normal", "parameter"]
cosine = false
transmits = false
doc = "a lobe"
language = "wgsl"
includes = ["chunks"]
lossless_tolerance = 0.02
defines = { rough = "1", USE = "2" }
%s
[parameters.rough]
default = 0.5
low = 0.0
high = 1.0
unit = "deg"
doc = "width"
[parameters.base]
default = [0.1, 0.2, 0.3]
[textures.lut]
file = "table.npy"
wrap = "clamp"
filter = "linear"
"""
_SAMPLED = b"""pdf = "density"
pdf_arguments = ["light", "view"]
sample = "draw"
sample_arguments = ["view", "u"]
albedo = "albedo"
albedo_arguments = ["n.v"]
albedo_tolerance = 0.05"""


def _adapters() -> list[bytes]:
    return [_ADAPTER % b"", _ADAPTER % _SAMPLED]


_VALUES = (
    b"nan", b"inf", b"-1", b"true", b"[]", b"{}", b"[[1]]", b"1e400", b'"../x"', b"2024-01-01", b'["light"]', b'""',
    b"\n[parameters.x]\n", b"\n[textures.y]\n", b'"parameter"', b'"u"', b"'" * 3, b"9" * 20, b'"/dev/null"',
    b'"\\u0000"', b'"isotropic"', b"9" * 400, b"1", b'"hlsl"', b"brdf", b"draw", b"albedo", b"density",
)  # fmt: skip


@target("adapter", _adapters, _VALUES, _retold(_adapters, _VALUES))
def adapter(data: bytes, folder: Path) -> object:
    """A shader with an adapter that says anything."""
    import numpy as np

    np.save(folder / "table.npy", np.full((2, 3, 3), 0.5))
    saved(folder / "a.wgsl.toml", data)
    return _material(saved(folder / "a.wgsl", _ADAPTED.encode()))
