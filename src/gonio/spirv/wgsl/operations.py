"""WGSL's operators: the instruction for each operator, by the types of the operands."""

from __future__ import annotations

from .emitter import Emitter, Value
from .types import ABSTRACT_INT, BOOL, INT, UINT, Type, matrix

_ARITHMETIC = {"+": "Add", "-": "Sub", "*": "Mul", "/": "Div", "%": "Rem"}
_COMPARED = {"==": "Equal", "!=": "NotEqual", "<": "Less", ">": "Greater", "<=": "LessEqual", ">=": "GreaterEqual"}
_BITS = {"&": "BitwiseAnd", "|": "BitwiseOr", "^": "BitwiseXor"}
_INTEGERS = (INT, UINT, ABSTRACT_INT)


def binary(emitter: Emitter, sign: str, left: Value, right: Value) -> Value:
    """`left sign right`. Raises InputError for types that the operator does not accept."""
    if sign in ("<<", ">>"):
        return _shift(emitter, sign, left, right)
    left, right = emitter.together([left, right], f"'{sign}'")
    scalar = left.type.scalar
    if sign in ("&&", "||"):
        _check(emitter, sign, left, right, (BOOL,))
        return emitter.emit("LogicalAnd" if sign == "&&" else "LogicalOr", left.type, left.id, right.id)
    if "matrix" in (left.type.kind, right.type.kind):
        return _matrices(emitter, sign, left, right)
    shape = _broadcast(emitter, sign, left.type, right.type)
    if sign in _COMPARED:
        return emitter.emit(_comparison(sign, scalar), shape.of(BOOL), left.id, right.id)
    if sign in _BITS:
        if scalar == BOOL:
            name = {"&": "LogicalAnd", "|": "LogicalOr", "^": "LogicalNotEqual"}[sign]
            return emitter.emit(name, shape, left.id, right.id)
        _check(emitter, sign, left, right, _INTEGERS)
        return emitter.emit(_BITS[sign], shape, left.id, right.id)
    if scalar == BOOL:
        raise emitter.error(f"'{sign}' of {left.type}, {right.type}", "compute with numbers")
    if scalar in _INTEGERS and sign in "/%":
        name = ("U" if scalar == UINT else "S") + {"/": "Div", "%": "Mod" if scalar == UINT else "Rem"}[sign]
        return emitter.emit(name, shape, left.id, right.id)
    return emitter.emit(("I" if scalar in _INTEGERS else "F") + _ARITHMETIC[sign], shape, left.id, right.id)


def unary(emitter: Emitter, sign: str, value: Value) -> Value:
    """-x, !x or ~x."""
    scalar = value.type.scalar
    accepted = {"!": (BOOL,), "~": _INTEGERS}.get(sign)
    if not value.type.numbers or (accepted and scalar not in accepted) or (sign == "-" and scalar in (BOOL, UINT)):
        raise emitter.error(f"'{sign}' of {value.type}")
    name = {"!": "LogicalNot", "~": "Not"}.get(sign) or ("SNegate" if scalar in _INTEGERS else "FNegate")
    return emitter.emit(name, value.type, value.id)


def _comparison(sign: str, scalar: Type) -> str:
    name = _COMPARED[sign]
    if scalar == BOOL:
        return f"Logical{name}"
    if scalar in _INTEGERS:
        return f"I{name}"
    return f"FUnord{name}" if sign == "!=" else f"FOrd{name}"


def _check(emitter: Emitter, sign: str, left: Value, right: Value, accepted: tuple[Type, ...]) -> None:
    if left.type != right.type or left.type.scalar not in accepted:
        raise emitter.error(f"'{sign}' of {left.type}, {right.type}")


def _broadcast(emitter: Emitter, sign: str, left: Type, right: Type) -> Type:
    """The common shape of two operands, with a scalar broadcast to a vector."""
    if left.kind == "vector" and right.kind == "vector" and left.length != right.length:
        raise emitter.error(f"'{sign}' of {left}, {right}", "use vectors of one length")
    return left if left.kind == "vector" else right


def _shift(emitter: Emitter, sign: str, left: Value, right: Value) -> Value:
    if left.type.scalar not in _INTEGERS or right.type.scalar not in _INTEGERS:
        raise emitter.error(f"'{sign}' of {left.type}, {right.type}", "shift integers")
    arithmetic = "ShiftRightLogical" if left.type.scalar == UINT else "ShiftRightArithmetic"
    return emitter.emit("ShiftLeft" if sign == "<<" else arithmetic, left.type, left.id, right.id)


def _matrices(emitter: Emitter, sign: str, left: Value, right: Value) -> Value:
    a, b = left.type, right.type
    rows = [one.parts[0].length if one.kind == "matrix" else one.length for one in (a, b)]
    scalar = a.scalar
    if sign == "*" and scalar.kind in ("float", "abstract float"):
        if a.kind == "matrix" and b.kind == "matrix" and a.length == rows[1]:
            return emitter.emit("MatrixTimesMatrix", matrix(scalar, b.length, rows[0]), left.id, right.id)
        if a.kind == "matrix" and b.kind == "vector" and a.length == b.length:
            return emitter.emit("MatrixTimesVector", a.parts[0], left.id, right.id)
        if a.kind == "vector" and b.kind == "matrix" and a.length == rows[1]:
            return emitter.emit("VectorTimesMatrix", Type("vector", (scalar,), b.length), left.id, right.id)
        if "vector" not in (a.kind, b.kind) and a.kind != b.kind:
            return emitter.emit("FMul", a if a.kind == "matrix" else b, left.id, right.id)
    elif sign in "+-" and a == b:
        return emitter.emit("FAdd" if sign == "+" else "FSub", a, left.id, right.id)
    raise emitter.error(f"'{sign}' of {a}, {b}")
