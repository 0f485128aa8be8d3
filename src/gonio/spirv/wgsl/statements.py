"""WGSL's statements as blocks of instructions, with the merge blocks of SPIR-V's structured control flow."""

from __future__ import annotations

from ..module import Function as ModuleFunction
from . import operations
from .emitter import Emitter, Value
from .expressions import Expressions, Names, Place, Signature
from .sources import Unit
from .syntax import (
    Assign,
    Block,
    Declared,
    Evaluate,
    Expression,
    Function,
    If,
    Jump,
    Loop,
    Return,
    Statement,
    Switch,
)
from .types import BOOL, INT, UINT, VOID


class Body(Expressions):
    """The body of one function."""

    def __init__(self, emitter: Emitter, names: Names, unit: Unit, signature: Signature) -> None:
        super().__init__(emitter, names, unit)
        self.signature = signature
        self.targets: list[tuple[int, int | None]] = []  # labels of break and continue, innermost last

    def write(self, function: Function) -> ModuleFunction:
        """The function's blocks."""
        emitter = self.emitter
        made = ModuleFunction(self.signature.id, emitter.type_id(self.signature.result))
        emitter.function, emitter.variables = made, []
        entry = emitter.fresh()
        emitter.start(entry)
        scope: dict[str, Value | Place] = {}
        for parameter, type in zip(function.parameters, self.signature.parameters, strict=True):
            id = emitter.fresh()
            made.parameters.append((id, emitter.type_id(type)))
            emitter.module.names[id] = parameter.name
            scope[parameter.name] = Value(id, type)
        self.scopes.append(scope)
        try:
            self.run(function.body)
            if self.signature.result != VOID and _completes(function.body):
                emitter.line = function.line
                raise emitter.error(
                    f"the function '{function.name}' may end without a value", "return one on each path"
                )
            emitter.do("Return" if self.signature.result == VOID else "Unreachable")
            made.blocks[entry].instructions[:0] = emitter.variables
        finally:
            emitter.function = emitter.block = None
        return made

    def run(self, node: Statement) -> None:
        """Write one statement."""
        self.emitter.line = node.line
        if isinstance(node, Block):
            self.scopes.append({})
            for one in node.statements:
                self.run(one)
            self.scopes.pop()
        elif isinstance(node, Declared):
            self._declare(node)
        elif isinstance(node, Assign):
            self._assign(node)
        elif isinstance(node, Evaluate):
            self.value(node.value)
        elif isinstance(node, If):
            self._if(node)
        elif isinstance(node, Loop):
            self._loop(node)
        elif isinstance(node, Switch):
            self._switch(node)
        elif isinstance(node, Return):
            self._return(node)
        elif isinstance(node, Jump):
            self._jump(node)

    # ------------------------------------------------------------------ plain statements

    def _declare(self, node: Declared) -> None:
        type = None
        if node.type is not None:
            type = self.names.type(self.unit, node.type)
            if type is None:
                raise self.emitter.error("an unknown type", "declare it")
        value = self.value(node.value) if node.value is not None else None
        self.emitter.line = node.line
        if value is not None and type is not None:
            value = self.emitter.converted(value, type, f"'{node.name}'")
        if node.kind == "var":
            if value is None:
                if type is None:
                    raise self.emitter.error(f"var {node.name} without type and value")
                value = self.emitter.zero(type)
            value = self.emitter.with_concrete_type(value)
            pointer = self.emitter.variable(value.type)
            self.emitter.do("Store", pointer.id, value.id)
            self.scopes[-1][node.name] = Place(pointer.id, value.type)
            return
        if value is None or (node.kind == "const" and self.emitter.known(value) is None):
            raise self.emitter.error(f"{node.kind} {node.name} without a known value", "use let, with a value")
        self.scopes[-1][node.name] = value if node.kind == "const" else self.emitter.with_concrete_type(value)

    def _assign(self, node: Assign) -> None:
        if node.target is None:
            self.value(node.value)
            return
        place = self.place(node.target)
        if place is None:
            raise self.emitter.error("an assignment to a value that is not a variable", "declare it with var")
        value = self.value(node.value)
        self.emitter.line = node.line
        if node.sign != "=":
            value = operations.binary(self.emitter, node.sign[:-1], self.loaded(place), value)
        self.store(place, value)

    def _return(self, node: Return) -> None:
        if node.value is None:
            self.emitter.do("Return")
        else:
            value = self.value(node.value)
            self.emitter.line = node.line
            self.emitter.do("ReturnValue", self.emitter.converted(value, self.signature.result, "a result").id)
        self.emitter.start(self.emitter.fresh())  # later statements are never reached

    def _jump(self, node: Jump) -> None:
        if node.kind == "discard":
            self.emitter.do("Kill")
        else:
            targets = [one[node.kind == "continue"] for one in self.targets]
            target = next((one for one in reversed(targets) if one is not None), None)
            if target is None:
                raise self.emitter.error(f"{node.kind} outside a loop")
            self.emitter.do("Branch", target)
        self.emitter.start(self.emitter.fresh())

    # ------------------------------------------------------------------ blocks

    def _condition(self, node: Expression) -> Value:
        value = self.value(node)
        self.emitter.line = node.line
        if value.type != BOOL:
            raise self.emitter.error(f"a condition of type {value.type}, bool expected")
        return value

    def _if(self, node: If) -> None:
        emitter, end = self.emitter, self.emitter.fresh()
        for condition, block in node.clauses:
            if condition is None:
                self.run(block)
                continue
            value, then, otherwise = self._condition(condition), emitter.fresh(), emitter.fresh()
            emitter.do("SelectionMerge", end, 0)
            emitter.do("BranchConditional", value.id, then, otherwise)
            emitter.start(then)
            self.run(block)
            emitter.do("Branch", end)
            emitter.start(otherwise)
        emitter.do("Branch", end)
        emitter.start(end)

    def _loop(self, node: Loop) -> None:
        emitter = self.emitter
        header, test, body, after, end = (emitter.fresh() for _ in range(5))
        self.scopes.append({})
        if node.start is not None:
            self.run(node.start)
        emitter.do("Branch", header)
        emitter.start(header)
        emitter.line = node.line
        emitter.do("LoopMerge", end, after, 0)
        emitter.do("Branch", test)
        emitter.start(test)
        if node.condition is not None:
            emitter.do("BranchConditional", self._condition(node.condition).id, body, end)
        else:
            emitter.do("Branch", body)
        emitter.start(body)
        self.targets.append((end, after))
        self.scopes.append({})  # declarations in the body are visible in the `continuing` block
        for one in node.body.statements:
            self.run(one)
        self.targets.pop()
        emitter.do("Branch", after)
        emitter.start(after)
        for one in node.after:
            self.run(one)
        if node.until is not None:
            emitter.do("BranchConditional", self._condition(node.until).id, end, header)
        else:
            emitter.do("Branch", header)
        del self.scopes[-2:]
        emitter.start(end)

    def _switch(self, node: Switch) -> None:
        emitter = self.emitter
        selector = emitter.with_concrete_type(self.value(node.selector))
        if selector.type not in (INT, UINT):
            raise emitter.error(f"switch on {selector.type}, an integer expected")
        end = emitter.fresh()
        labels = [emitter.fresh() for _ in node.cases]
        default, targets = end, list[int]()
        for (selectors, _), label in zip(node.cases, labels, strict=True):
            for one in selectors:
                if one is None:
                    default = label
                    continue
                number = emitter.known(emitter.converted(self.value(one), selector.type, "a case"))
                if number is None:
                    raise emitter.error("a case that is not a constant")
                targets += [int(number) & 0xFFFFFFFF, label]
        emitter.do("SelectionMerge", end, 0)
        emitter.do("Switch", selector.id, default, *targets)
        self.targets.append((end, None))
        for (_, block), label in zip(node.cases, labels, strict=True):
            emitter.start(label)
            self.run(block)
            emitter.do("Branch", end)
        self.targets.pop()
        emitter.start(end)


def _completes(node: Statement) -> bool:
    """Whether the end of a statement can be reached for any values of its conditions."""
    if isinstance(node, Block):
        return all(map(_completes, node.statements))
    if isinstance(node, If):
        return all(condition is not None for condition, _ in node.clauses) or any(
            _completes(block) for _, block in node.clauses
        )
    if isinstance(node, Loop):
        return node.condition is not None or node.until is not None or _breaks(node.body)
    if isinstance(node, Switch):
        return any(_completes(block) or _breaks(block) for _, block in node.cases)  # one of them is `default`
    return not isinstance(node, Return | Jump)


def _breaks(node: Statement) -> bool:
    """Whether a statement contains a `break` that leaves the surrounding loop or switch."""
    if isinstance(node, Block):
        return any(map(_breaks, node.statements))
    if isinstance(node, If):
        return any(_breaks(block) for _, block in node.clauses)
    return isinstance(node, Jump) and node.kind == "break"
