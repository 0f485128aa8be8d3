"""The functions that the functions of a module call, and the globals that they read and write."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .flow import successors
from .module import Block, Function, Module

Part = tuple[int, int | None]  # a global and a member of the global; None for the whole global


def blocks_of(module: Module, starts: Iterable[int], without: Iterable[int] = ()) -> Iterator[Block]:
    """The blocks of functions with the given ids, and of all functions that these call.

    without  functions to omit, together with the functions that only they call
    """
    visited, waiting = set(without), list(starts)
    while waiting:
        id = waiting.pop()
        if id in visited or id not in module.functions:
            continue
        visited.add(id)
        blocks = list(module.functions[id].blocks.values())
        waiting += called(blocks)
        yield from blocks


def called(blocks: Iterable[Block]) -> set[int]:
    """The functions that blocks call."""
    return {one.operands[0] for block in blocks for one in block.instructions if one.name == "FunctionCall"}


def following(function: Function, labels: Iterable[int]) -> list[Block]:
    """The blocks with these labels, and those that may run after them."""
    visited, waiting = set[int](), list(labels)
    while waiting:
        one = waiting.pop()
        if one not in visited:
            visited.add(one)
            waiting += successors(function, one)
    return [function.blocks[one] for one in visited]


def read(module: Module, blocks: Iterable[Block]) -> set[Part]:
    """The globals, or members of globals, that blocks read. A global that is passed to a function counts as a whole."""
    return _used(module, blocks, writes=False)


def written(module: Module, blocks: Iterable[Block]) -> set[int]:
    """The globals to which blocks store, or which they pass to a function."""
    return {id for id, _ in _used(module, blocks, writes=True)}


def _used(module: Module, blocks: Iterable[Block], writes: bool) -> set[Part]:
    parts: dict[int, Part] = {id: (id, None) for id in module.variables}
    used = set[Part]()
    for block in blocks:
        for one in block.instructions:
            if one.name == "AccessChain" and one.operands[0] in parts:
                id, member = parts[one.operands[0]]
                first = module.constants.get(one.operands[1]) if len(one.operands) > 1 else None
                parts[one.result] = id, first if member is None and isinstance(first, int) else member
            elif one.name == "Store":
                ids = one.operands[:1] if writes else one.operands[1:]
                used |= {parts[id] for id in ids if id in parts}
            elif one.name == "FunctionCall" or (one.name == "Load" and not writes):
                used |= {parts[id] for id in one.operands if id in parts}
    return used
