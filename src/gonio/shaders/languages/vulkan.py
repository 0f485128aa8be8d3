"""GLSL 4.50 for Vulkan: tables are bound by set and number."""

from __future__ import annotations

from .glsl import GLSL


class VulkanGLSL(GLSL):
    """GLSL 4.50 for Vulkan."""

    name = "glsl-vulkan"
    title = "GLSL 4.50 (Vulkan)"
    precision = "All numbers are 32-bit floats."
    groups = True

    def binding(self, name: str, dimension: int, place: int, group: int = 0) -> list[str]:
        return [f"layout(set = {group}, binding = {place}) uniform sampler{dimension}D {name};"]
