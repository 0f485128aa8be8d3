"""A routine as text: its statements, docstring and result."""

from __future__ import annotations

import re

from .expressions import SELECTED, ExpressionWriter
from .layout import INDENT, comment, wrap
from .names import Names
from .program import place
from .values import ELEMENTWISE, Routine, Value, needed

COMPUTED = ELEMENTWISE | {"call", "where", "texel"}  # on a separate line if a component is selected


class RoutineWriter(ExpressionWriter):
    """Writes one routine: decides which values are separate lines, and writes their names and texts."""

    def __init__(self, names: Names, routine: Routine) -> None:
        super().__init__(names, routine)
        self.named: set[int] = set()  # orders of the values that are separate lines

    def text(self) -> list[str]:
        """The lines of the routine."""
        body = self.body()
        return [*comment(self.doc()), *wrap(self.head(), ""), *body, "}"]

    def head(self) -> str:
        """The line with the routine's name and parameters."""
        result = self.names.note(self.routine.type)
        return self.language.signature(result, self.names.routines[self.routine], self.heads)

    def body(self) -> list[str]:
        """The statements."""
        values = self.routine.values()
        self._plan(values)
        statements = [value for value in values if value.order in self.named]
        last_use = self._last_uses(statements)
        for index, value in enumerate(statements):
            self._define(value, index, last_use)
        result = self._result()
        return [*self.lines, *result]

    def doc(self) -> str:
        """The docstring, without entries for arguments that are not arguments of the written function."""
        entry = self.routine in self.program.entries.values()
        given = {place(p.static)[0] for i, p in enumerate(self.routine.parameters) if entry or i in self.routine.used}
        lines, dropping = [], False
        for line in self.routine.doc.splitlines():
            listed = re.match(r"(\w+(?:, \w+)*)  +\S", line)
            if listed:
                names = set(listed[1].split(", "))
                dropping = names <= set(self.arguments) and not names & given
            elif not line.startswith("  "):
                dropping = False
            if not dropping:
                lines.append(re.sub(r"`(?:\w+\.)+(\w+)`", r"`\1`", line))
        return "\n".join(lines)

    def _result(self) -> list[str]:
        routine = self.routine
        if routine.single:
            return self.wrapped(f"return {self.statement(routine.results[0][1])}{self.language.end}")
        record = routine.record
        assert record is not None
        values = [value for _, value in routine.results]
        called = self._forwarded()
        if called is not None:
            return self.wrapped(f"return {self.statement(called)}{self.language.end}")
        parts = self.member_texts(record, values)
        name = self.names.note(record)
        if self.language.struct_literal:
            return self.wrapped(f"return {name}({', '.join(parts)}){self.language.end}")
        result = self.fresh("result")
        lines = wrap(f"{name} {result} = {{ {', '.join(parts)} }};", INDENT)
        return [*lines, f"{INDENT}return {result};"]

    def _forwarded(self) -> Value | None:
        """The call whose results are returned unchanged, if there is one."""
        values = [value for _, value in self.routine.results]
        if self.routine.single or values[0].op != "element":
            return None
        called = values[0].args[0]
        same = all(v.op == "element" and v.args[0] is called and v.static == i for i, v in enumerate(values))
        return called if same else None

    def _plan(self, values: list[Value]) -> None:
        """Decide which values have a line and a name."""
        uses: dict[int, int] = {}
        for value in values:
            for argument in needed(value):
                uses[argument.order] = uses.get(argument.order, 0) + 1
        for _, result in self.routine.results:
            uses[result.order] = uses.get(result.order, 0) + 1
        results = {v.order for _, v in self.routine.results}
        sizes: dict[int, int] = {}
        for value in values:
            sizes[value.order] = _size(value, sizes)
            if value.op in SELECTED:
                if value.op in ("component", "swizzle") and value.args[0].op in COMPUTED:
                    self.named.add(value.args[0].order)
                if value.op == "element":
                    self.named.add(value.args[0].order)
                continue
            several = uses[value.order] > 1
            own = 1 + sum(_size(a, sizes) for a in needed(value) if a.order not in self.named)
            cheap = own <= 1 and value.op not in ("call", "texel", "div", "sqrt", "vector", "dot")
            telling = sizes[value.order] >= 2 or value.op in ("minimum", "maximum", "where", "call")
            author = bool(value.name) and value.order not in results and telling and value.op != "neg"
            if (several and not (cheap and not value.name)) or author or (several and value.op in ("div", "sqrt")):
                self.named.add(value.order)
        if len(results) == 1 and self.routine.single:
            order = self.routine.results[0][1].order
            if uses[order] == 1:
                self.named.discard(order)
        called = self._forwarded()
        if called is not None and uses[called.order] == len(self.routine.results):
            self.named.discard(called.order)

    def _last_uses(self, statements: list[Value]) -> dict[int, int]:
        """The index of the last statement that reads each named value; the result counts as the last statement."""
        last: dict[int, int] = {}
        roots = [(index, needed(value)) for index, value in enumerate(statements)]
        roots.append((len(statements), [value for _, value in self.routine.results]))
        for index, pending in roots:
            pending, visited = list(pending), set()
            while pending:
                value = pending.pop()
                if value.order in visited:
                    continue
                visited.add(value.order)
                if value.order in self.named or value.op == "parameter":
                    last[value.order] = index
                else:
                    pending.extend(needed(value))
        return last

    def _define(self, value: Value, index: int, last_use: dict[int, int]) -> None:
        text = self.statement(value)
        type_ = self.names.note(value.type)
        wanted = self.language.word(self._name_for(value))
        name = self._reusable(wanted, value, index, last_use)
        if name:  # as in Python, a name is reassigned once its old value is no longer used
            if name in self.first_lines:
                line = self.first_lines[name]
                self.lines[line] = self.language.changeable(self.lines[line])
            self.lines += self.wrapped(f"{name} = {text}{self.language.end}")
        else:
            name = self.fresh(wanted)
            self.first_lines[name] = len(self.lines)
            self.lines += self.wrapped(self.language.local(type_, name, text))
        self.holders[name] = value
        self.locals[value.order] = name

    def _reusable(self, wanted: str, value: Value, index: int, last_use: dict[int, int]) -> str:
        """A variable with the wanted name whose value is no longer needed, or ""."""
        number = 1
        while (name := wanted if number == 1 else f"{wanted}_{number}") in self.used_names:
            holder = self.holders.get(name)
            if holder is not None and holder.type == value.type and last_use.get(holder.order, -1) <= index:
                return name
            number += 1
        return ""


def _size(value: Value, sizes: dict[int, int]) -> int:
    """The number of operations in an expression, without selections."""
    if value.op in ("parameter", "constant"):
        return 0
    below = sum(sizes.get(a.order, 0) for a in needed(value))
    return below + (0 if value.op in SELECTED else 1)
