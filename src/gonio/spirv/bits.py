"""Operations on the bits of floats that are not constant, as needed for logarithms, powers of two and signs.

(floatBitsToInt(x) >> 23) - 127                                             floor(log2 |x|)
intBitsToFloat((e + 127) << 23)                                             2^e
uintBitsToFloat((bits(x) & 0x7FFFFFFF) | (bits(y) & 0x80000000))            copysign(x, y); likewise with ^
"""

from __future__ import annotations

import math
import struct

from .. import ops
from .values import Bits, Value, numeric, refuse, static, wrapped

MANTISSA = 23  # number of bits
BIAS = 127
SIGN, MAGNITUDE = 0x80000000, 0x7FFFFFFF


def cast(value: Value, before: str, kind: str) -> Value:
    """The bits of a scalar of type `before`, interpreted as type `kind`; both are "float", "int" or "uint"."""
    if static(value):
        words = struct.pack("<f", value) if isinstance(value, float) else struct.pack("<I", wrapped(int(value), False))
        if kind == "float":
            return float(struct.unpack("<f", words)[0])
        return int(struct.unpack("<i" if kind == "int" else "<I", words)[0])
    if isinstance(value, Bits):
        if value.part == "sign" and kind == "float":
            return ops.copysign(0.0 * value.number, value.number)
        if kind != "float" or value.number is not None:
            return value.number if kind == "float" else value
        return _power_of_two(value.exponent - float(BIAS))
    if before != "float" and kind != "float":  # an integer value; negative values are taken modulo 2^32
        value = numeric(value)
        return (
            ops.where(value < 0.0, value + 2.0**32, value)
            if kind == "uint"
            else ops.where(value < 2.0**31, value, value - 2.0**32)
        )
    if kind == "float":
        raise refuse("floats from the bits of varying integers are not supported", "compute with floats")
    return Bits(value, None)


def _power_of_two(e: Value) -> Value:
    """2^e for an integer e; exact, except for a rounding error in single precision for e >= 100.

    The error of `exp`, a few ulps, is in the lower half of the digits, which are 0 for a power of two and are removed
    by Veltkamp's splitting (Dekker1971).
    """
    about = ops.exp(e * math.log(2.0))
    multiple = about * ((2.0**12 if ops.is_short(e) else 2.0**27) + 1.0)
    return ops.where(e < 100.0, multiple - (multiple - about), about)


def shifted_right(value: Bits, count: Value) -> Value:
    """The bits of a float shifted right by 23, which are the sign and the exponent."""
    if value.number is None or value.part == "sign" or count != MANTISSA:
        raise refuse("bit operations on varying integers are not supported", "compute with floats")
    size = ops.abs(value.number)
    guess = ops.floor(ops.log(size) * (1.0 / math.log(2.0)))
    # the logarithm of a power of two may be rounded in either direction
    mantissa = size * ops.exp(-guess * math.log(2.0))
    exponent = ops.where(mantissa < 1.0 - 1e-12, guess - 1.0, ops.where(mantissa > 2.0 - 1e-12, guess + 1.0, guess))
    return exponent + float(BIAS)


def shifted_left(value: Value, count: Value) -> Value:
    """The bits of a power of two, from its biased exponent."""
    if isinstance(value, Bits) or count != MANTISSA:
        raise refuse("bit operations on varying integers are not supported", "compute with floats")
    return Bits(None, numeric(value))


def masked(a: Value, b: Value) -> Value:
    """a & b, where one operand is the bits of a float; the result is the sign or the magnitude of the float."""
    bits, mask = (a, b) if isinstance(a, Bits) else (b, a)
    word = 0 if isinstance(mask, Bits) or not static(mask) else wrapped(int(mask), False)
    if bits.number is None or bits.part == "sign" or word not in (SIGN, MAGNITUDE):
        raise refuse("bit operations on varying integers are not supported", "compute with floats")
    return Bits(bits.number, None, "sign") if word == SIGN else Bits(ops.abs(bits.number), None, "magnitude")


def joined(a: Value, b: Value) -> Value:
    """a | b for a magnitude and a sign."""
    size: Value
    size, sign = (b, a) if isinstance(a, Bits) and a.part == "sign" else (a, b)
    if not isinstance(sign, Bits) or sign.part != "sign":
        raise refuse("bit operations on varying integers are not supported", "compute with floats")
    if not isinstance(size, Bits) and static(size) and wrapped(int(size), False) < SIGN:
        size = Bits(float(cast(int(size), "uint", "float")), None, "magnitude")
    if not isinstance(size, Bits) or size.part != "magnitude":
        raise refuse("bit operations on varying integers are not supported", "compute with floats")
    number = ops.abs(sign.number) * 0.0 + size.number if static(size.number) else size.number
    return Bits(ops.copysign(number, sign.number), None)


def flipped(a: Value, b: Value) -> Value:
    """a ^ b for the bits of a float and a sign."""
    bits, sign = (b, a) if isinstance(a, Bits) and a.part == "sign" else (a, b)
    if static(bits):
        bits, sign = sign, bits
    if isinstance(bits, Bits) and bits.number is not None and bits.part != "sign":
        if isinstance(sign, Bits):
            if sign.part == "sign":
                return Bits(bits.number * ops.copysign(0.0 * sign.number + 1.0, sign.number), None)
        elif static(sign) and wrapped(int(sign), False) == SIGN:
            return Bits(-bits.number, None)
    raise refuse("bit operations on varying integers are not supported", "compute with floats")
