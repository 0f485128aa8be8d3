"""HLSL, shader model 6."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from .base import Language

_RESERVED = """
    AppendStructuredBuffer asm asm_fragment BlendState bool break Buffer ByteAddressBuffer case cbuffer centroid
    class column_major compile compile_fragment CompileShader const continue ComputeShader
    ConsumeStructuredBuffer default DepthStencilState DepthStencilView discard do double DomainShader dword else
    export extern false float for fxgroup GeometryShader groupshared half Hullshader if in inline inout
    InputPatch int interface line lineadj linear LineStream matrix min16float min10float min16int min12int
    min16uint namespace nointerpolation noperspective NULL out OutputPatch packoffset pass pixelfragment
    PixelShader point PointStream precise RasterizerState RenderTargetView return register row_major RWBuffer
    RWByteAddressBuffer RWStructuredBuffer RWTexture1D RWTexture2D RWTexture3D sample sampler SamplerState
    SamplerComparisonState shared snorm stateblock stateblock_state static string struct switch StructuredBuffer
    tbuffer technique texture Texture1D Texture2D Texture3D TextureCube this true typedef triangle triangleadj
    TriangleStream uint uniform unorm unsigned vector vertexfragment VertexShader void volatile while auto catch
    char const_cast delete dynamic_cast enum explicit friend goto long mutable new operator private protected
    public reinterpret_cast short signed sizeof static_cast template throw try typename union using virtual abs
    acos all any asfloat asin asint asuint atan atan2 ceil clamp clip cos cosh cross ddx ddy degrees determinant
    distance dot exp exp2 floor fma fmod frac frexp isfinite isinf isnan ldexp length lerp lit log log10 log2
    mad max min modf mul noise normalize pow radians rcp reflect refract round rsqrt saturate select sign sin
    sincos sinh smoothstep sqrt step tan tanh transpose trunc main choose
"""


class HLSL(Language):
    """HLSL of any version, the language of Direct3D."""

    name = "hlsl"
    title = "HLSL (shader model 6)"
    suffix = ".hlsl"
    precision = "32-bit floats are required; min16float is not sufficient."
    types: ClassVar[Mapping[str, str]] = {
        "vec2": "float2",
        "vec3": "float3",
        "vec4": "float4",
        "bvec2": "bool2",
        "bvec3": "bool3",
    }
    words: ClassVar[Mapping[str, str]] = {
        **Language.words,
        "exponent": "float((asint({0}) >> 23) - 127)",
        "scaled": "{0} * asfloat((int({1}) + 127) << 23)",
    }
    choice = ("{0} ? {1} : {2}", "{prefix}choose({0}, {1}, {2})")
    # `select` was introduced in HLSL 2021, in which ?: no longer selects by component
    helpers: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "choose": (
            "float3 {name}(bool3 mask, float3 a, float3 b) {{",
            "    return float3(mask.x ? a.x : b.x, mask.y ? a.y : b.y, mask.z ? a.z : b.z);",
            "}}",
            "",
            "float2 {name}(bool2 mask, float2 a, float2 b) {{",
            "    return float2(mask.x ? a.x : b.x, mask.y ? a.y : b.y);",
            "}}",
        )
    }
    spread = "({0}){1}"
    mix = "lerp"
    reserved = frozenset(_RESERVED.split())
    struct_literal = False
    array_literal = False
    groups = True

    def array(self, type_: str, parts: list[str]) -> str:
        return f"{{ {', '.join(parts)} }}"

    def constant(self, name: str, text: str) -> str:
        return f"static const float {name} = {text};"

    def values(self, type_: str, name: str, parts: list[str]) -> str:
        return f"static const {type_} {name} = {{ {', '.join(parts)} }};"

    def binding(self, name: str, dimension: int, place: int, group: int = 0) -> list[str]:
        space = f", space{group}" if group else ""
        return [f"Texture{dimension}D<float4> {name} : register(t{place}{space});"]

    def fetch(self, table: str, places: list[str]) -> str:
        return f"{table}.Load(int{len(places) + 1}({', '.join(places)}, 0))"

    def offset(self, end: int, size: int) -> int:
        """Fields are packed, but no vector crosses a 16-byte boundary."""
        return end if end % 16 + size <= 16 else end + -end % 16
