"""The shading language of Godot 4, as an include file."""

from __future__ import annotations

from .glsl import GLSL

_MORE = """
    PI TAU E shader_type render_mode group_uniforms instance global hint_range source_color filter_nearest
    filter_linear repeat_enable repeat_disable fragment vertex light start process sky fog lowp TIME ALBEDO NORMAL
    UV VIEW COLOR LIGHT EMISSION ROUGHNESS METALLIC SPECULAR ALPHA
"""


class Godot(GLSL):
    """Godot's language: GLSL ES 3.00 without overloads, with its own constants and texture hints."""

    name = "godot"
    title = "Godot 4"
    suffix = ".gdshaderinc"
    precision = "32-bit floats are required; mediump is not sufficient."
    reserved = GLSL.reserved | frozenset(_MORE.split())
    overloads = False

    def binding(self, name: str, dimension: int, place: int) -> list[str]:
        return [f"uniform sampler{dimension}D {name} : filter_nearest, repeat_disable;"]
