"""The values of a module's global variables before its functions run: given values, initial values in the text, and
otherwise undefined scalars, which are rejected if a result depends on them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from .images import Texture
from .module import UNIFORM, UNIFORMS, Instruction, Module
from .values import Undefined, Value

INPUT = 1  # the storage class of varyings and built-in inputs
_ZERO = "or add `unset_is_zero = true` to the adapter"


def initial(
    module: Module, one: Instruction, given: Mapping[str, Value], textures: Mapping[str, Texture], zero: bool
) -> Value:
    """The value of a global, as given or from its declaration.

    given     values of uniforms, and of members of a uniform block, by name
    textures  textures by the names of samplers
    zero      whether all other values are 0
    """
    inside = module.type(one.type).parts[0]
    name, kind = module.names.get(one.result, ""), module.type(inside)
    if len(one.operands) > 1 and not (one.operands[0] == UNIFORM and name in given):
        return module.constants[one.operands[1]]
    if kind.kind in ("sampled image", "image", "sampler"):
        return _texture(module, inside, textures.get(name, Texture(name, None)))
    if kind.kind == "array" and module.type(kind.parts[0]).kind in ("sampled image", "image"):
        return module.undefined(inside, Undefined(f"'{name}' is an array of textures", "one sampler per table", True))
    if name in given:
        return given[name]
    if kind.kind == "struct" and one.operands[0] in UNIFORMS:
        names = [module.members.get((inside, place), "") for place in range(len(kind.parts))]
        return tuple(
            given[member] if member in given else _unset(module, part, one.operands[0], member, zero)
            for member, part in zip(names, kind.parts, strict=True)
        )
    return _unset(module, inside, one.operands[0], name, zero)


def _texture(module: Module, type: int, texture: Texture) -> Texture:
    """A texture with the kind that the shader declares."""
    kind = module.type(type)
    image = kind.parts[0] if kind.kind == "sampled image" else type
    dimensions = module.type(image).length if module.type(image).kind == "image" else 0
    return replace(texture, dimensions=dimensions, declared=module.images.get(image, ""))


def _unset(module: Module, type: int, space: int, name: str, zero: bool) -> Value:
    if zero:
        return module.zero(type)
    if space == INPUT:
        what = f"the {'built-in' if name.startswith('gl_') else 'varying'} '{name}' has no value"
        return module.undefined(type, Undefined(what, f"make it an argument of the BRDF; {_ZERO}", True))
    if space in UNIFORMS:
        what = f"the uniform '{name}' of {module.type(type).size} numbers ({module.shape(type)}) is not a parameter"
        return module.undefined(type, Undefined(what, f"use at most 64 numbers; {_ZERO}", True))
    hint = f"give it an initial value{', or assign it in `main` from uniforms' if module.entered else ''}; {_ZERO}"
    # where lanes are merged, lanes that wrote no value may have any value, unless an entry point may have written one
    firm = not module.entered
    return module.undefined(type, Undefined(f"the global '{name}' is read and was never assigned", hint, firm))
