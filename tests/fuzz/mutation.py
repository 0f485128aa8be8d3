"""How an input is spoilt: bits, bytes, numbers, lines, and the values of JSON."""

from __future__ import annotations

import json
import re
import struct
import zlib
from collections.abc import Callable, Sequence
from random import Random

Change = Callable[[bytearray, Random], None]

NUMBERS = (
    "0", "-1", "1", "1e999", "-1e308", "1e-320", "NaN", "Infinity", "2147483648", "4294967295", "18446744073709551616",
    "9" * 400, "0x10", "1_0", "", "65536", "1e18", "-0", "3.5",
)  # fmt: skip
VALUES = (
    None, True, False, 0, -1, 1e308, 2**63, -0.0, "", "x", "\0", "\ud800", "é" * 300, [], {}, [[]], [1, [2]],
    {"type": "x"},
)  # fmt: skip
BYTES = (b"\0", b"\xff", b"\x80", b"\x7f", b"\n", b'"', b"\\", b"\xed\xa0\x80", b"../" * 3, b"%s%n", b"$", b"<!--")


def mutated(seeds: Sequence[bytes], tokens: Sequence[bytes], random: Random) -> bytes:
    """One seed with up to a dozen changes, most often few."""
    data = bytearray(random.choice(seeds))
    if random.random() < 0.25 and (tree := _json(bytes(data))) is not None:
        for _ in range(random.choice((1, 1, 2, 5))):
            tree = _spoilt(tree, random)
        return json.dumps(tree).encode("utf-8", "surrogatepass")
    for _ in range(random.choice((1, 1, 1, 2, 3, 5, 12))):
        change = random.choice(CHANGES)
        change(data, random)
    if tokens and random.random() < 0.3:
        at = random.randint(0, len(data))
        data[at : at + random.choice((0, 1, 4))] = random.choice(tokens)
    if random.random() < 0.1:
        other = random.choice(seeds)
        at = random.randint(0, min(len(data), len(other)))
        data[at:] = other[at:]
    return bytes(data)


# ---------------------------------------------------------------------- bytes


def _flip(data: bytearray, random: Random) -> None:
    if data:
        data[random.randrange(len(data))] ^= 1 << random.randrange(8)


def _set(data: bytearray, random: Random) -> None:
    if data:
        data[random.randrange(len(data))] = random.choice((0, 1, 2, 0x7F, 0x80, 0xFE, 0xFF, random.randrange(256)))


def _integer(data: bytearray, random: Random) -> None:
    kind = random.choice(("<H", ">H", "<I", ">I", "<Q", ">Q"))
    size = struct.calcsize(kind)
    if len(data) >= size:
        bits = 8 * size
        value = random.choice((0, 1, 2**bits - 1, 2 ** (bits - 1), 2 ** (bits - 1) - 1, 2 ** (bits // 2), len(data)))
        at = random.randrange(len(data) - size + 1)
        data[at : at + size] = struct.pack(kind, value % 2**bits)


def _cut(data: bytearray, random: Random) -> None:
    a = random.randint(0, len(data))
    del data[a : a + random.choice((1, 2, 4, 16, len(data)))]


def _again(data: bytearray, random: Random) -> None:
    a = random.randint(0, len(data))
    part = bytes(data[a : a + random.choice((1, 4, 16, 64))])
    data[a:a] = part * random.choice((1, 2, 50))


def _moved(data: bytearray, random: Random) -> None:
    a, b = (random.randint(0, len(data)) for _ in range(2))
    part = bytes(data[a : a + random.choice((1, 4, 16, 64))])
    data[b : b + len(part)] = part


def _inserted(data: bytearray, random: Random) -> None:
    a = random.randint(0, len(data))
    data[a:a] = random.choice(BYTES)


def _number(data: bytearray, random: Random) -> None:
    found = [match.span() for match in re.finditer(rb"-?\d+(\.\d+)?([eE][-+]?\d+)?", data)]
    if found:
        a, b = random.choice(found)
        data[a:b] = random.choice(NUMBERS).encode()


def _line(data: bytearray, random: Random) -> None:
    lines = bytes(data).split(b"\n")
    a, b = random.randrange(len(lines)), random.randrange(len(lines))
    match random.randrange(3):
        case 0:
            del lines[a]
        case 1:
            lines.insert(b, lines[a])
        case _:
            lines[a], lines[b] = lines[b], lines[a]
    data[:] = b"\n".join(lines)


CHANGES: tuple[Change, ...] = (
    _flip, _flip, _set, _set, _integer, _cut, _again, _moved, _inserted, _number, _number, _line,
)  # fmt: skip


# ---------------------------------------------------------------------- structure


def _json(data: bytes) -> object | None:
    if data[:1] not in (b"{", b"["):
        return None
    try:
        return json.loads(data)
    except ValueError:
        return None


def _spoilt(tree: object, random: Random) -> object:
    """The tree with one value, key or branch that is another."""
    if isinstance(tree, dict) and tree:
        key = random.choice(list(tree))
        copy = dict(tree)
        match random.randrange(8):
            case 0:
                copy[key] = random.choice(VALUES)
            case 1:
                del copy[key]
            case 2:
                copy[random.choice((key + "x", "", "type", "\0"))] = copy.pop(key)
            case 3:
                copy[key] = [copy[key]] * random.choice((0, 1, 3))
            case _:
                copy[key] = _spoilt(copy[key], random)
        return copy
    if isinstance(tree, list) and tree:
        at = random.randrange(len(tree))
        match random.randrange(5):
            case 0:
                return tree[:at] + tree[at + 1 :]
            case 1:
                return [*tree, random.choice(VALUES)]
            case _:
                return [*tree[:at], _spoilt(tree[at], random), *tree[at + 1 :]]
    if isinstance(tree, int | float) and random.random() < 0.5:
        return random.choice((tree * -1, tree * 1e6, tree / 1e6, float(tree) + 0.5, 10**20))
    return random.choice(VALUES)


def png_repaired(data: bytes) -> bytes:
    """The chunks' checksums as they should be, or libpng would look no further."""
    out, at = bytearray(data[:8]), 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        if length > len(data) - at - 12:
            break
        body = data[at + 4 : at + 8 + length]
        out += data[at : at + 4] + body + struct.pack(">I", zlib.crc32(body))
        at += 12 + length
    return bytes(out + data[at:])
