"""WGSL, the language of WebGPU."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from .base import Language

# keywords, and words that the specification reserves
_RESERVED = """
    alias break case const const_assert continue continuing default diagnostic discard else enable false fn for
    if let loop override requires return struct switch true var while NULL Self abstract active alignas alignof
    as asm asm_fragment async attribute auto await become cast catch class co_await co_return co_yield coherent
    column_major common compile compile_fragment concept const_cast consteval constexpr constinit crate debugger
    decltype delete demote demote_to_helper do dynamic_cast enum explicit export extends extern external
    fallthrough filter final finally friend from fxgroup get goto groupshared highp impl implements import
    inline instanceof interface layout lowp macro macro_rules match mediump meta mod module move mut mutable
    namespace new nil noexcept noinline nointerpolation noperspective null nullptr of operator package
    packoffset partition pass patch pixelfragment precise precision premerge priv protected pub public readonly
    ref regardless register reinterpret_cast require resource restrict self set shared sizeof smooth snorm
    static static_assert static_cast std subroutine super target template this thread_local throw trait try type
    typedef typeid typename typeof union unless unorm unsafe unsized use using varying virtual volatile wgsl
    where with writeonly yield f16 f32 i32 u32 bool vec2 vec3 vec4 array atomic mat2x2 mat3x3 mat4x4 ptr sampler
    texture_2d texture_3d bitcast all any select abs acos acosh asin asinh atan atanh atan2 ceil clamp cos cosh
    cross degrees determinant distance dot exp exp2 floor fma fract frexp inverseSqrt ldexp length log log2 max
    min mix modf normalize pow radians reflect refract round saturate sign sin sinh smoothstep sqrt step tan
    tanh transpose trunc main
"""


class WGSL(Language):
    """WGSL, the language of WebGPU."""

    name = "wgsl"
    title = "WGSL (WebGPU)"
    suffix = ".wgsl"
    precision = "All numbers must be f32; f16 is not sufficient."
    types: ClassVar[Mapping[str, str]] = {
        "float": "f32",
        "int": "i32",
        "vec2": "vec2f",
        "vec3": "vec3f",
        "vec4": "vec4f",
        "bvec2": "vec2<bool>",
        "bvec3": "vec3<bool>",
    }
    words: ClassVar[Mapping[str, str]] = {
        **Language.words,
        "exponent": "f32((bitcast<i32>({0}) >> 23) - 127)",
        "scaled": "{0} * bitcast<f32>((i32({1}) + 127) << 23)",
    }
    choice = ("select({2}, {1}, {0})", "select({2}, {1}, {0})")
    reserved = frozenset(_RESERVED.split())
    overloads = False
    parameters_change = False
    templates = True
    groups = True

    def array_declaration(self, type_: str, name: str, count: int) -> tuple[str, str]:
        return f"array<{type_}, {count}>", name

    def array(self, type_: str, parts: list[str]) -> str:
        return f"array<{type_}, {len(parts)}>({', '.join(parts)})"

    def signature(self, result: str, name: str, parameters: list[tuple[str, str]]) -> str:
        return f"fn {name}({', '.join(f'{p}: {type_}' for type_, p in parameters)}) -> {result} {{"

    def local(self, type_: str, name: str, text: str) -> str:
        return f"let {name} = {text};"

    def changeable(self, line: str) -> str:
        return line.replace("let ", "var ", 1)

    def constant(self, name: str, text: str) -> str:
        return f"const {name} = {text}f;" if "e" in text else f"const {name}: f32 = {text};"

    def values(self, type_: str, name: str, parts: list[str]) -> str:
        return f"const {name} = {type_}({', '.join(parts)});"

    def struct(self, name: str, fields: list[tuple[str, str]]) -> list[str]:
        return [f"struct {name} {{", *(f"    {field}: {type_}," for type_, field in fields), "}"]

    def binding(self, name: str, dimension: int, place: int, group: int = 0) -> list[str]:
        return [f"@group({group}) @binding({place}) var {name}: texture_{dimension}d<f32>;"]

    def fetch(self, table: str, places: list[str]) -> str:
        return f"textureLoad({table}, vec{len(places)}i({', '.join(places)}), 0)"
