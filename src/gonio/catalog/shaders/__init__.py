"""Shaders of the user as materials: GLSL, HLSL, WGSL, SPIR-V and the .brdf files of Disney's BRDF Explorer.

    my.glsl                 read by its adapter my.glsl.toml, or by names of functions and arguments (`adapter`)
    disney.brdf             parameters and shader in one file (`explorer`)

A shader cannot run code on the machine: its instructions are carried out by `gonio.spirv`.
"""

from .adoption import adopt as adopt
from .files import SUFFIXES as SUFFIXES
from .files import Shader as Shader
from .files import class_of as class_of
from .files import names_shader as names_shader
