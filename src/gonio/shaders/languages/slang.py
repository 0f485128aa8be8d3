"""Slang, which compiles to HLSL, GLSL, Metal, WGSL, CUDA and C++."""

from __future__ import annotations

from .hlsl import HLSL

_MORE = """
    This extension associatedtype property init get set where import module implementing func let var is as none
    nullptr no_diff Differential Differentiable __init __subscript each expand optional some String Array Ptr List
    Tuple Optional DifferentialPair uint64_t half2 half3 half4 fwd_diff bwd_diff detach
"""


class Slang(HLSL):
    """Slang: HLSL with more reserved names."""

    name = "slang"
    title = "Slang"
    suffix = ".slang"
    precision = "32-bit floats are required; half is not sufficient."
    reserved = HLSL.reserved | frozenset(_MORE.split())
