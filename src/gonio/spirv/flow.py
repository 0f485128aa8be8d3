"""The order in which a function's blocks run, its loops, and the blocks in which its variables are read."""

from __future__ import annotations

from dataclasses import dataclass, field

from .module import Function, Instruction

ENDS = frozenset({"Branch", "BranchConditional", "Switch", "Return", "ReturnValue", "Kill", "Unreachable", "refused"})


@dataclass
class Flow:
    """The control flow of a function's blocks.

    order     label -> position; a loop's blocks are contiguous and precede the block that follows the loop
    loops     label -> the loops that contain it, as sets of labels, innermost first
    reads     variable -> the labels of blocks that read it or pass it to a function
    lasting   ids that are defined inside a loop and used outside
    """

    order: dict[int, int]
    loops: dict[int, list[frozenset[int]]]
    reads: dict[int, set[int]] = field(default_factory=dict)
    lasting: set[int] = field(default_factory=set)


def flow_of(function: Function) -> Flow:
    """The control flow of a function. Raises KeyError for branches to blocks that do not exist."""
    order = _structured(function)
    labels = sorted(order, key=order.__getitem__)
    loops: dict[int, list[frozenset[int]]] = {label: [] for label in labels}
    for header in labels:
        merge = next((one for one in function.blocks[header].instructions if one.name == "LoopMerge"), None)
        if merge is None:
            continue
        end = order.get(merge.operands[0], len(labels))
        inside = frozenset(labels[order[header] : end])
        for label in inside:
            loops[label].insert(0, inside)  # headers are in order, so the innermost loop is inserted last
    flow = Flow(order, loops)
    _find_uses(function, flow)
    return flow


def _structured(function: Function) -> dict[int, int]:
    """The blocks in reverse postorder, in which the merge block of a construct follows the blocks of the construct."""
    entry = next(iter(function.blocks))
    postorder: list[int] = []
    visited = {entry}
    stack = [(entry, iter(successors(function, entry)))]
    while stack:
        label, rest = stack[-1]
        following = next((one for one in rest if one not in visited), None)
        if following is None:
            postorder.append(label)
            stack.pop()
        else:
            visited.add(following)
            stack.append((following, iter(successors(function, following))))
    return {label: place for place, label in enumerate(reversed(postorder))}


def successors(function: Function, label: int) -> list[int]:
    """The successors of a block, the merge block of its construct first."""
    result: list[int] = []
    for one in function.blocks[label].instructions:
        if one.name == "LoopMerge":
            result += one.operands[:2]
        elif one.name == "SelectionMerge":
            result += one.operands[:1]
        elif one.name in ENDS:
            result += targets(one)
            break
    for target in result:
        if target not in function.blocks:
            raise KeyError(f"block {target}")
    return result


def targets(one: Instruction) -> list[int]:
    """The labels of a branch."""
    if one.name == "Branch":
        return [one.operands[0]]
    if one.name == "BranchConditional":
        return list(one.operands[1:3])
    return [one.operands[1], *one.operands[3::2]] if one.name == "Switch" else []


def _find_uses(function: Function, flow: Flow) -> None:
    roots: dict[int, int] = {}
    defined: dict[int, int] = {}
    for label in sorted(flow.order, key=flow.order.__getitem__):
        for one in function.blocks[label].instructions:
            if one.result:
                defined[one.result] = label
            if one.name == "Variable":
                roots[one.result] = one.result
                continue
            if one.name == "AccessChain" and one.operands[0] in roots:
                roots[one.result] = roots[one.operands[0]]
                used = one.operands[1:]
            else:
                used = one.operands[1:] if one.name == "Store" else one.operands
            for id in used:
                if id in roots:
                    flow.reads.setdefault(roots[id], set()).add(label)
            for id in one.operands:
                home = defined.get(id)
                if home is not None and flow.loops[home] and label not in flow.loops[home][0]:
                    flow.lasting.add(id)
