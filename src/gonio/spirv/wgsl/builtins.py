"""WGSL's built-in functions as instructions."""

from __future__ import annotations

from collections.abc import Callable

from .emitter import Emitter, Value
from .types import BOOL, FLOAT, INT, UINT, Type, vector

# functions of floats that are applied to each component: their numbers in GLSL.std.450
_FLOATS = {
    "acos": 17, "acosh": 23, "asin": 16, "asinh": 22, "atan": 18, "atanh": 24, "atan2": 25, "ceil": 9, "cos": 14,
    "cosh": 20, "degrees": 12, "exp": 27, "exp2": 29, "floor": 8, "fma": 50, "fract": 10, "inverseSqrt": 32,
    "log": 28, "log2": 30, "mix": 46, "pow": 26, "radians": 11, "round": 2, "sin": 13, "sinh": 19, "smoothstep": 49,
    "sqrt": 31, "step": 48, "tan": 15, "tanh": 21, "trunc": 3,
}  # fmt: skip
_COUNTS = {"atan2": 2, "fma": 3, "mix": 3, "pow": 2, "smoothstep": 3, "step": 2, "min": 2, "max": 2, "clamp": 3}
# functions of floats, signed integers and unsigned integers
_NUMBERS = {"abs": (4, 5, 0), "sign": (6, 7, 0), "min": (37, 39, 38), "max": (40, 42, 41), "clamp": (43, 45, 44)}
# functions of vectors: number, count of vector arguments, whether the result is a scalar
_GEOMETRIC = {
    "length": (66, 1, True), "distance": (67, 2, True), "cross": (68, 2, False), "normalize": (69, 1, False),
    "faceForward": (70, 3, False), "reflect": (71, 2, False), "refract": (72, 2, False),
}  # fmt: skip
_DERIVATIVES = {f"{kind}{end}" for kind in ("dpdx", "dpdy", "fwidth") for end in ("", "Coarse", "Fine")}
_MIPS = {"textureSample": 3, "textureSampleLevel": 4, "textureSampleBias": 4, "textureSampleGrad": 5}
_BITS = {
    "countLeadingZeros", "countTrailingZeros", "firstLeadingBit", "firstTrailingBit", "frexp", "dot4U8Packed",
    "dot4I8Packed", "quantizeToF16",
}  # fmt: skip


def refused(name: str) -> str:
    """A description of a function that has no meaning for a BSDF; "" for other names."""
    if name in _DERIVATIVES:
        return f"a screen-space derivative ({name})"
    if name.startswith("atomic"):
        return f"an atomic operation ({name})"
    if name.endswith("Barrier") or name == "workgroupUniformLoad":
        return f"a barrier ({name})"
    if name.startswith(("subgroup", "quad")):
        return f"a subgroup operation ({name})"
    if name == "textureStore":
        return "a write to an image (textureStore)"
    if name.startswith(("textureGather", "textureSampleCompare", "textureNum", "textureSampleBase")):
        return f"a shadow, gather or query function of textures ({name})"
    if name in _BITS or name.startswith(("pack", "unpack")):
        return f"a bit operation ({name})"
    return "the length of a runtime-sized array (arrayLength)" if name == "arrayLength" else ""


def called(emitter: Emitter, name: str, values: list[Value]) -> Value | None:
    """The value of a call of a built-in function; None if there is no such function."""
    if name in _FLOATS or name in _NUMBERS:
        return _elementwise(emitter, name, values)
    if name in _GEOMETRIC:
        return _geometric(emitter, name, values)
    if name in _MIPS or name in ("textureLoad", "textureDimensions"):
        return _texture(emitter, name, values)
    if (function := _OTHERS.get(name)) is not None:
        count, made = function
        _count(emitter, name, values, count)
        return made(emitter, values)
    if what := refused(name):
        raise emitter.error(f"{what} is not supported", "a BSDF is a function of directions and parameters alone")
    return None


def _count(emitter: Emitter, name: str, values: list[Value], count: int) -> None:
    if len(values) != count:
        raise emitter.error(f"{name} of {len(values)} values", f"{count} expected")


def _shape(emitter: Emitter, name: str, values: list[Value]) -> Type:
    """The type of a result, which is that of the vectors among the values; these must have the same type."""
    vectors = {value.type for value in values if value.type.kind == "vector"}
    if len(vectors) > 1 or any(value.type.kind == "matrix" for value in values):
        raise emitter.error(f"{name} of {', '.join(str(value.type) for value in values)}", "use vectors of one length")
    return vectors.pop() if vectors else values[0].type


def _elementwise(emitter: Emitter, name: str, values: list[Value]) -> Value:
    _count(emitter, name, values, _COUNTS.get(name, 1))
    values = emitter.together(values, name, floats=name in _FLOATS)
    type = _shape(emitter, name, values)
    if type.scalar == BOOL:
        raise emitter.error(f"{name} of {type}")
    if name in _FLOATS:
        number = _FLOATS[name]
    else:
        of_floats, signed, unsigned = _NUMBERS[name]
        number = of_floats if "float" in type.scalar.kind else unsigned if type.scalar == UINT else signed
        if not number:  # abs of unsigned integers has no effect
            return values[0]
    return emitter.standard(number, type, *[value.id for value in values])


def _geometric(emitter: Emitter, name: str, values: list[Value]) -> Value:
    number, count, scalar = _GEOMETRIC[name]
    _count(emitter, name, values, count + (name == "refract"))
    values = emitter.together(values, name, floats=True)
    type = _shape(emitter, name, values[:count])
    plain = type.kind != "vector" and name not in ("length", "distance")
    if plain or (name == "cross" and type.length != 3):
        raise emitter.error(f"{name} of {type}", "use vectors")
    return emitter.standard(number, type.scalar if scalar else type, *[value.id for value in values])


def _dot(emitter: Emitter, values: list[Value]) -> Value:
    values = emitter.together(values, "dot")
    type = _shape(emitter, "dot", values)
    if type.kind != "vector":
        raise emitter.error(f"dot of {type}", "use vectors")
    return emitter.emit("Dot", type.scalar, *[value.id for value in values])


def _select(emitter: Emitter, values: list[Value]) -> Value:
    no, yes = emitter.together(values[:2], "select")
    mask = values[2]
    if no.type != yes.type or mask.type.scalar != BOOL or mask.type not in (BOOL, no.type.of(BOOL)):
        raise emitter.error(f"select of {', '.join(str(value.type) for value in values)}", "use select(no, yes, mask)")
    return emitter.emit("Select", no.type, mask.id, yes.id, no.id)


def _reduced(name: str) -> Callable[[Emitter, list[Value]], Value]:
    def made(emitter: Emitter, values: list[Value]) -> Value:
        if values[0].type.scalar != BOOL:
            raise emitter.error(f"{name.lower()} of {values[0].type}", "use vectors of bool")
        return emitter.emit(name, BOOL, values[0].id) if values[0].type.kind == "vector" else values[0]

    return made


def _saturate(emitter: Emitter, values: list[Value]) -> Value:
    low, high = (emitter.constant(number, FLOAT) for number in (0.0, 1.0))
    return _elementwise(emitter, "clamp", [values[0], low, high])


def _transpose(emitter: Emitter, values: list[Value]) -> Value:
    type = values[0].type
    if type.kind != "matrix":
        raise emitter.error(f"transpose of {type}", "use a matrix")
    transposed = Type("matrix", (vector(type.scalar, type.length),), type.parts[0].length)
    return emitter.emit("Transpose", transposed, values[0].id)


def _determinant(emitter: Emitter, values: list[Value]) -> Value:
    type = values[0].type
    if type.kind != "matrix" or type.length != type.parts[0].length:
        raise emitter.error(f"determinant of {type}", "use a square matrix")
    return emitter.standard(33, type.scalar, values[0].id)


def _ldexp(emitter: Emitter, values: list[Value]) -> Value:
    number = emitter.together(values[:1], "ldexp", floats=True)[0]
    return emitter.standard(53, number.type, number.id, values[1].id)


def _modf(emitter: Emitter, values: list[Value]) -> Value:
    number = emitter.with_concrete_type(emitter.together(values, "modf", floats=True)[0])
    type = Type("struct", name=f"modf of {number.type}")
    emitter.structs[type.name] = ("fract", "whole"), (number.type, number.type)
    return emitter.standard(36, type, number.id)


def _bits(name: str) -> Callable[[Emitter, list[Value]], Value]:
    """An operation on the bits of the first value, which has the type of the result; the other values are offset and
    count, which the inserted bits may precede."""

    def made(emitter: Emitter, values: list[Value]) -> Value:
        value = emitter.with_concrete_type(values[0])
        if value.type.scalar not in (INT, UINT):
            raise emitter.error(f"bits of {value.type}", "use integers")
        kind = name.replace("Extract", "SExtract" if value.type.scalar == INT else "UExtract")
        return emitter.emit(kind, value.type, value.id, *[one.id for one in values[1:]])

    return made


def bitcast(emitter: Emitter, type: Type, value: Value) -> Value:
    """bitcast<type>(value)."""
    value = emitter.with_concrete_type(value)
    if not value.type.numbers or value.type.of(FLOAT) != type.of(FLOAT) or BOOL in (value.type.scalar, type.scalar):
        raise emitter.error(f"bitcast<{type}> of {value.type}", "use 32-bit numbers of one shape")
    if {value.type.scalar, type.scalar} <= {INT, UINT}:
        return emitter.cast(value, type.scalar)
    return value if value.type == type else emitter.emit("Bitcast", type, value.id)


def _texture(emitter: Emitter, name: str, values: list[Value]) -> Value:
    if not values or values[0].type.kind != "texture":
        raise emitter.error(f"{name} without a texture")
    texture, color = values[0], vector(FLOAT, 4)
    if name == "textureDimensions":
        shape = UINT if texture.type.length == 1 else vector(UINT, texture.type.length)
        return emitter.emit("ImageQuerySize", shape, texture.id)
    if name == "textureLoad":
        _count(emitter, name, values, 3)
        return emitter.emit("ImageFetch", color, texture.id, emitter.with_concrete_type(values[1]).id)
    if len(values) not in (_MIPS[name], _MIPS[name] + 1):  # an additional value is an offset in texels
        raise emitter.error(f"{name} of {len(values)} values", f"{_MIPS[name]} expected")
    if len(values) > _MIPS[name]:
        raise emitter.error(f"{name} with an offset, or of an array of textures", "add it to the coordinates")
    return emitter.emit("ImageSample", color, texture.id, emitter.together([values[2]], name, floats=True)[0].id)


_OTHERS: dict[str, tuple[int, Callable[[Emitter, list[Value]], Value]]] = {
    "dot": (2, _dot), "select": (3, _select), "any": (1, _reduced("Any")), "all": (1, _reduced("All")),
    "saturate": (1, _saturate), "transpose": (1, _transpose), "determinant": (1, _determinant), "ldexp": (2, _ldexp),
    "modf": (1, _modf), "reverseBits": (1, _bits("BitReverse")), "countOneBits": (1, _bits("BitCount")),
    "extractBits": (3, _bits("BitFieldExtract")), "insertBits": (4, _bits("BitFieldInsert")),
}  # fmt: skip
