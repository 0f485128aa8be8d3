"""GLSL ES 3.00, the language of WebGL2."""

from __future__ import annotations

from .dialect import Dialect

TYPES = {"bvec2": "bvec2", "bvec3": "bvec3"}

WORDS = {
    "sqrt": "sqrt({0})",
    "abs": "abs({0})",
    "minimum": "min({0}, {1})",
    "maximum": "max({0}, {1})",
    "exp": "exp({0})",
    "log": "log({0})",
    "sin": "sin({0})",
    "cos": "cos({0})",
    "atan2": "atan({0}, {1})",
    "floor": "floor({0})",
    "dot": "dot({0}, {1})",
    "integer": "int({0})",
    "exponent": "float((floatBitsToInt({0}) >> 23) - 127)",
    "scaled": "{0} * intBitsToFloat((int({1}) + 127) << 23)",
}

COMPARE = {
    "lt": "lessThan({0}, {1})",
    "le": "lessThanEqual({0}, {1})",
    "gt": "greaterThan({0}, {1})",
    "ge": "greaterThanEqual({0}, {1})",
    "eq": "equal({0}, {1})",
    "ne": "notEqual({0}, {1})",
    "not": "not({0})",
}

_WORDS = """
    attribute const uniform varying layout centroid flat smooth break continue do for while switch case default
    if else in out inout float int void bool true false invariant discard return mat2 mat3 mat4 vec2 vec3 vec4
    ivec2 ivec3 ivec4 bvec2 bvec3 bvec4 uint lowp mediump highp precision sampler2D sampler3D samplerCube struct
    coherent volatile restrict readonly writeonly resource atomic_uint noperspective patch sample subroutine
    common partition active asm class union enum typedef template this goto inline noinline public static extern
    external interface long short double half fixed unsigned superp input output filter sizeof cast namespace
    using main radians degrees sin cos tan asin acos atan pow exp log exp2 log2 sqrt inversesqrt abs sign floor
    trunc round ceil fract mod modf min max clamp mix step smoothstep isnan isinf length distance dot cross
    normalize reflect refract transpose inverse outerProduct determinant texture any all not equal
"""
RESERVED = frozenset(_WORDS.split())


def _signature(result: str, name: str, parameters: list[tuple[str, str]]) -> str:
    return f"{result} {name}({', '.join(f'{type_} {p}' for type_, p in parameters)}) {{"


def _local(type_: str, name: str, text: str) -> str:
    return f"{type_} {name} = {text};"


def _constant(name: str, text: str) -> str:
    return f"const float {name} = {text};"


def _struct(name: str, fields: list[tuple[str, str]]) -> list[str]:
    return [f"struct {name} {{", *(f"    {type_} {field};" for type_, field in fields), "};"]


def _binding(name: str, dimension: int, place: int) -> list[str]:
    return [f"uniform highp sampler{dimension}D {name};"]


def _fetch(table: str, places: list[str]) -> str:
    return f"texelFetch({table}, ivec{len(places)}({', '.join(places)}), 0)"


GLSL = Dialect(
    name="glsl",
    suffix=".glsl",
    types=TYPES,
    words=WORDS,
    compare=COMPARE,
    choice=("{0} ? {1} : {2}", "mix({2}, {1}, {0})"),
    spread="{0}({1})",
    splat=True,
    overloads=True,
    floats="Declare `precision highp float;` above: 16 bits will not do.",
    parameters_change=True,
    struct_literal=True,
    reserved=RESERVED,
    signature=_signature,
    local=_local,
    constant=_constant,
    struct=_struct,
    binding=_binding,
    fetch=_fetch,
    mix="mix",
)
