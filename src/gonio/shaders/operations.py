"""The number of operations of a shader's function, by kind."""

from __future__ import annotations

from collections import Counter

from .values import COMPARE, LOGIC, SIZES, Routine, Value

KINDS = {
    "arithmetic": {"add", "sub", "mul", "minimum", "maximum"},
    "divisions": {"div"},
    "functions": {"sqrt", "exp", "log", "sin", "cos", "atan2", "floor", "exponent", "scaled"},
    "selections": {"where", *COMPARE, *LOGIC},
    "lookups": {"texel"},
}
OF = {op: kind for kind, ops in KINDS.items() for op in ops}


def operations(routine: Routine) -> dict[str, int]:
    """The number of operations on numbers by kind, including those of called functions.

    An operation on a vector counts once per component, and a dot product counts as its products and sums; sign changes
    and absolute values are free. Both sides of a selection are counted, because a GPU computes both.
    """
    total = _count(routine, {})
    return {kind: total[kind] for kind in KINDS}


def _count(routine: Routine, known: dict[Routine, Counter[str]]) -> Counter[str]:
    if routine not in known:
        total: Counter[str] = Counter()
        for value in routine.values():
            if value.op == "call":
                total += _count(value.static, known)
            elif value.op == "dot":
                total["arithmetic"] += 2 * _size(value.args[0]) - 1
            elif value.op in OF:
                total[OF[value.op]] += 1 if value.op == "texel" else _size(value)
        known[routine] = total
    return known[routine]


def _size(value: Value) -> int:
    type_ = str(value.type)
    return int(type_[-1]) if type_.startswith("bvec") else SIZES.get(type_, 1)
