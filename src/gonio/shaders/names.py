"""The global names of a shader: those of its routines, and those of the constants and structs that the routines use."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping

from ..ops.graph import first_free
from ..ops.table import Table
from .languages import Language
from .placement import Placement
from .program import Routines, place
from .source import module_constant
from .syntax import literal
from .values import Kind, Member, Record, Routine, Value, check_single, members, stem_of

CONSTANTS = {"PI": math.pi, "TWO_PI": 2.0 * math.pi, "INV_PI": 1.0 / math.pi, "INV_TWO_PI": 0.5 / math.pi}


class Names:
    """The names in a program's shader.

    routines   name of each routine
    constants  name -> (number, description)
    records    name -> struct
    renamed    names that another shader of the module uses differently -> their replacements, all without prefix
    """

    def __init__(
        self,
        program: Routines,
        language: Language,
        placement: Placement | None = None,
        renamed: Mapping[str, str] | None = None,
    ) -> None:
        self.program, self.language = program, language
        self.placement, self.renamed = placement or Placement(), renamed or {}
        self.constants: dict[str, tuple[float, str]] = {}
        self.routines: dict[Routine, str] = {}
        self.records: dict[str, Record] = {}
        self.signatures: dict[tuple, Routine] = {}
        used: set[str] = set()
        for routine in program.routines:
            name = self._routine_name(routine, used)
            used.add(name)
            self.routines[routine] = name
        for routine, name in self.routines.items():
            if stem_of(routine) not in language.native:
                self.routines[routine] = self.public(name)

    def public(self, name: str) -> str:
        """A global name as it is written: with the prefix, and replaced if another shader of the module uses it."""
        return self.placement.prefix + self.renamed.get(name, name)

    def constant(self, name: str) -> str:
        """The public name of a constant."""
        return self.public(self.language.word(name))

    def table(self, table: Table, start: str = "") -> str:
        """The public name of a table or, if `start` is "table_", "lookup_" or "fetch_", of its texture or function."""
        stem = self.renamed.get(f"table_{table.name}", f"table_{table.name}").removeprefix("table_")
        return f"{self.placement.prefix}{start}{stem}"

    def file(self, table: Table) -> str:
        """The name of a table's file."""
        return self.table(table) + self.placement.suffix(self.language)

    def struct(self, record: Record) -> str:
        """The public name of a struct."""
        return self.public(self.language.word(record.name))

    def members(self, record: Record) -> list[Member]:
        """The members with which a struct is declared and constructed."""
        return members(record.fields, record.arrays and self.program.arrays)

    def declared(self, member: Member, name: str = "") -> tuple[str, str]:
        """(type, name) in the declaration of a member, or of a function's parameter with the given name."""
        type_, name = self.language.type(member.type), name or self.language.word(member.name)
        return self.language.array_declaration(type_, name, member.length) if member.length else (type_, name)

    def access(self, record: Record, index: int) -> tuple[str, str, int]:
        """(expression that selects a field, such as "c[3]"; name of the field's member; length of the member)."""
        member = next(m for m in reversed(self.members(record)) if m.first <= index)
        name = self.language.word(member.name)
        return (f"{name}[{index - member.first}]" if member.length else name), name, member.length

    def _routine_name(self, routine: Routine, used: set[str]) -> str:
        name = self.language.word(stem_of(routine))
        of_floats = any(n == name and r.type == "float" for r, n in self.routines.items())
        if of_floats and routine.type == "vec3" and not self.language.overloads:
            name = f"{name}_rgb"
        if stem_of(routine) in self.language.native:
            return stem_of(routine)
        if self.language.overloads:
            types = self._types(routine)
            if self.signatures.setdefault((name, types), routine) is routine and self._same_doc(name, routine):
                return name
        name = self._distinguished(name, routine) if name in used else name
        return first_free(name, used)

    def _types(self, routine: Routine) -> tuple[object, ...]:
        """The types that distinguish overloads: those of the written arguments, with the struct for an object."""
        arguments = self.program.recorded[routine].arguments
        struct_of = functools.cache(lambda root: self.program.struct_of(arguments.get(root)))
        types: dict[object, object] = {}
        for index in sorted(routine.used):
            parameter = routine.parameters[index]
            root, rest, _ = place(parameter.static)
            struct = struct_of(root) if rest else None
            types[root if struct else index] = struct.record.name if struct else parameter.type
        return tuple(types.values())

    def _distinguished(self, name: str, routine: Routine) -> str:
        """The name, extended by the flag or word for which a copy was recorded: "masking_shadowing_transmits"."""
        first = next(r for r, known in self.routines.items() if known == name)
        if first.source != routine.source:
            return name
        before, now = (self.program.recorded[r].arguments for r in (first, routine))
        for argument, value in now.items():
            if value is True and before[argument] is False:
                return f"{name}_{argument}"
            if isinstance(value, str) and isinstance(before[argument], str) and value != before[argument]:
                return f"{name}_{value.replace('-', '_')}"
        return name

    def _same_doc(self, name: str, routine: Routine) -> bool:
        """Whether all routines with a name come from one function of the source and differ only in types."""
        return all(self.routines[r] != name or r.source == routine.source for r in self.routines)

    def note(self, record: Kind) -> str:
        """The name of a type in the language; structs are recorded for declaration."""
        if isinstance(record, Routine):
            record = record.record
        if isinstance(record, Record):
            self.records.setdefault(record.name, record)
            return self.struct(record)
        return self.language.type(record)

    def number(self, value: Value) -> str:
        """A constant, written as its name if it has one, else as a literal."""
        number = float(value.static)
        if self.language.single:
            check_single(number, value.source)
        if value.name and self.constants.get(value.name, (number,))[0] == number:
            self.constants.setdefault(value.name, (number, module_constant(number, value.source)[1]))
            return self.constant(value.name)
        for name, known in CONSTANTS.items():
            if abs(number) == known:
                self.constants.setdefault(name, (known, ""))
                return self.constant(name) if number > 0 else f"-{self.constant(name)}"
        return literal(number) if self.language.single else repr(number)
