"""Values constructed from parts: f32(x), vec3f(a, b), mat3x3(...), array(...), and structs."""

from __future__ import annotations

from .emitter import Emitter, Value
from .types import MATRICES, VECTORS, Type, matrix, vector


def constructed(emitter: Emitter, type: Type, values: list[Value]) -> Value:
    """type(values). Raises InputError if the parts do not match the type."""
    if not values:
        return emitter.zero(type)
    if type.kind == "vector":
        return _vector(emitter, type, values)
    if type.kind == "matrix":
        return _matrix(emitter, type, values)
    if type.kind in ("array", "struct"):
        count = len(emitter.structs[type.name][1]) if type.kind == "struct" else type.length
        if count != len(values):
            raise emitter.error(f"{len(values)} values for the {count} of {type}")
        parts = emitter.structs[type.name][1] if type.kind == "struct" else type.parts * count
        constituents = [emitter.converted(value, part) for value, part in zip(values, parts, strict=True)]
        return _composed(emitter, type, constituents)
    if len(values) != 1 or not type.numbers or values[0].type.kind in ("vector", "matrix"):
        raise emitter.error(f"{type} of {', '.join(str(value.type) for value in values)}")
    if not values[0].type.numbers:
        raise emitter.error(f"{type} of {values[0].type}")
    return emitter.cast(values[0], type)


def inferred(emitter: Emitter, name: str, values: list[Value]) -> Value:
    """vec3(...), mat3x3(...) or array(...); the scalar type is that of the values."""
    if not values:
        raise emitter.error(f"{name}() without a type", f"{name}<f32>()" if name != "array" else "array<f32, 2>()")
    if name == "array":
        first = values[0].type
        if first.numbers:
            values = emitter.together(values, "an array")
        return constructed(emitter, Type("array", (values[0].type,), len(values)), values)
    values = emitter.together(values, name, floats=name in MATRICES)
    scalar = values[0].type.scalar
    type = vector(scalar, VECTORS[name]) if name in VECTORS else matrix(scalar, *MATRICES[name])
    return constructed(emitter, type, values)


def _composed(emitter: Emitter, type: Type, values: list[Value]) -> Value:
    emitter.type_id(type)  # rejects types that are too large
    return emitter.emit("CompositeConstruct", type, *[value.id for value in values])


def _vector(emitter: Emitter, type: Type, values: list[Value]) -> Value:
    if any(not value.type.numbers or value.type.kind == "matrix" for value in values):
        raise emitter.error(f"{type} of {', '.join(str(value.type) for value in values)}")
    if len(values) == 1 and values[0].type.kind == "vector" and values[0].type.length == type.length:
        return emitter.cast(values[0], type.scalar)
    values = [emitter.converted(value, value.type.of(type.scalar)) for value in values]
    if len(values) == 1 and values[0].type.kind != "vector":
        values *= type.length
    if sum(value.type.length or 1 for value in values) != type.length:
        raise emitter.error(f"{type} of {', '.join(str(value.type) for value in values)}")
    return _composed(emitter, type, values)


def _matrix(emitter: Emitter, type: Type, values: list[Value]) -> Value:
    column = type.parts[0]
    if len(values) == 1 and values[0].type.kind == "matrix":
        return emitter.converted(values[0], type)
    if all(value.type.kind == "vector" for value in values) and len(values) == type.length:
        return _composed(emitter, type, [emitter.converted(value, column) for value in values])
    if len(values) != type.length * column.length:
        raise emitter.error(f"{len(values)} values for {type}", "give its columns, or all numbers")
    numbers = [emitter.converted(value, type.scalar) for value in values]
    rows = column.length
    return _composed(
        emitter, type, [_composed(emitter, column, numbers[at : at + rows]) for at in range(0, len(numbers), rows)]
    )
