"""GLSL ES 3.00, the language of WebGL2."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from .base import Language

_RESERVED = """
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


class GLSL(Language):
    """GLSL ES 3.00."""

    name = "glsl"
    title = "GLSL ES 3.00 (WebGL2)"
    suffix = ".glsl"
    precision = "Declare `precision highp float;` above: 16-bit floats are not sufficient."
    words: ClassVar[Mapping[str, str]] = {
        **Language.words,
        "atan2": "atan({0}, {1})",
        "exponent": "float((floatBitsToInt({0}) >> 23) - 127)",
        "scaled": "{0} * intBitsToFloat((int({1}) + 127) << 23)",
    }
    compare: ClassVar[Mapping[str, str]] = {
        "lt": "lessThan({0}, {1})",
        "le": "lessThanEqual({0}, {1})",
        "gt": "greaterThan({0}, {1})",
        "ge": "greaterThanEqual({0}, {1})",
        "eq": "equal({0}, {1})",
        "ne": "notEqual({0}, {1})",
        "not": "not({0})",
    }
    choice = ("{0} ? {1} : {2}", "mix({2}, {1}, {0})")
    reserved = frozenset(_RESERVED.split())

    def binding(self, name: str, dimension: int, place: int) -> list[str]:
        return [f"uniform highp sampler{dimension}D {name};"]

    def fetch(self, table: str, places: list[str]) -> str:
        return f"texelFetch({table}, ivec{len(places)}({', '.join(places)}), 0)"
