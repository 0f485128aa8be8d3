"""The Metal shading language."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from .base import Language

_RESERVED = """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char class compl const constexpr const_cast
    continue decltype default delete do double dynamic_cast else enum explicit export extern false float for friend
    goto if inline int long mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected
    public register reinterpret_cast return short signed sizeof static static_assert static_cast struct switch template
    this thread_local throw true try typedef typeid typename union unsigned using virtual void volatile wchar_t while
    xor xor_eq half uint ushort uchar size_t device constant thread threadgroup kernel vertex fragment texture1d
    texture2d texture3d sampler metal abs acos all any asin as_type atan atan2 ceil clamp copysign cos cosh cross
    distance dot exp exp2 fabs floor fma fmax fmin fmod fract frexp isfinite isinf isnan ldexp length log log2 max min
    mix modf normalize pow powr reflect refract rint round rsqrt saturate select sign sin sincos sinh smoothstep sqrt
    step tan tanh trunc main float2 float3 float4 bool2 bool3 int2 int3
"""


class MSL(Language):
    """The Metal shading language: a struct whose members are the textures and the functions.

    Metal has no global textures. Write `Shader shader = {table_a, table_b};` and then `shader.Conductor_eval(...)`.
    """

    name = "msl"
    title = "Metal shading language 2.3"
    suffix = ".metal"
    precision = "32-bit floats are required; half is not sufficient. Write `using namespace metal;` above."
    types: ClassVar[Mapping[str, str]] = {
        "vec2": "float2",
        "vec3": "float3",
        "vec4": "float4",
        "bvec2": "bool2",
        "bvec3": "bool3",
    }
    words: ClassVar[Mapping[str, str]] = {
        **Language.words,
        "exponent": "float((as_type<int>({0}) >> 23) - 127)",
        "scaled": "{0} * as_type<float>((int({1}) + 127) << 23)",
    }
    choice = ("{0} ? {1} : {2}", "select({2}, {1}, {0})")
    reserved = frozenset(_RESERVED.split())
    struct_literal = False

    def array_declaration(self, type_: str, name: str, count: int) -> tuple[str, str]:
        return f"array<{type_}, {count}>", name

    def array(self, type_: str, parts: list[str]) -> str:
        return f"array<{type_}, {len(parts)}>{{{', '.join(parts)}}}"

    def constant(self, name: str, text: str) -> str:
        return f"static constexpr constant float {name} = {text};"

    def values(self, type_: str, name: str, parts: list[str]) -> str:
        return f"{type_} {name} = {{ {', '.join(parts)} }};"

    def binding(self, name: str, dimension: int, place: int) -> list[str]:
        return [f"texture{dimension}d<float> {name};"]

    def fetch(self, table: str, places: list[str]) -> str:
        return f"{table}.read(uint{len(places)}({', '.join(places)}), 0)"

    def finished(self, lines: Sequence[str], prefix: str) -> list[str]:
        """All declarations, inside a struct."""
        inside = [f"    {line}" if line else "" for line in lines]
        return [f"struct {prefix}Shader {{", *inside, "};"]
