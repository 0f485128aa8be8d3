"""User shaders as materials: GLSL, HLSL, WGSL, SPIR-V and the .brdf files of Disney's BRDF Explorer.

    my.glsl                 interpreted by its adapter my.glsl.toml, or by names of functions and arguments (`adapter`)
    disney.brdf             parameters and shader in one file (`explorer`)

A shader cannot run native code, because `gonio.spirv` executes its instructions. The readers are loaded on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from .names import SUFFIXES as SUFFIXES
from .names import file_in as file_in
from .names import head_in as head_in
from .names import names_shader as names_shader
from .names import option as option
from .names import parted as parted
from .names import with_options as with_options

if TYPE_CHECKING:
    from .adoption import adopt as adopt
    from .engines import Package as Package
    from .engines import adopt_package as adopt_package
    from .engines import package_in as package_in
    from .files import Shader as Shader
    from .files import class_of as class_of
    from .files import files_read as files_read
else:
    _HOMES = {
        **dict.fromkeys(("Shader", "class_of", "files_read"), ".files"),
        **dict.fromkeys(("Package", "adopt_package", "package_in"), ".engines"),
        "adopt": ".adoption",
    }

    def __getattr__(name: str) -> object:
        if name in _HOMES:
            return getattr(import_module(_HOMES[name], __name__), name)
        raise AttributeError(f"module 'gonio.catalog.shaders' has no attribute '{name}'")
