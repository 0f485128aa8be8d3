"""Reading and running shaders.

GLSL and HLSL are compiled to SPIR-V by glslang (`compiler`), and Slang by its own compiler (`slang`). SPIR-V is parsed
into a checked module (`module`); WGSL is translated to a module (`wgsl`). The instructions of a module are executed
with the operations of `gonio.ops` (`machine`), on Dr.Jit values or on symbols of a recording.

    module = parse(compile_text("float sqr(float x) { return x * x; }", "sqr.glsl"))
    Machine(module).call("sqr", [x])
"""

from .compiler import compile_text as compile_text
from .machine import Machine as Machine
from .module import Module as Module
from .module import parse as parse
from .wgsl import translated as translated
