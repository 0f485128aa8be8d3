"""What the routines of a shader share: their names, the constants and structs that they come to need."""

from __future__ import annotations

import math
from typing import Any

from .dialect import NATIVE, Dialect, literal
from .program import Program
from .routine import RoutineWriter
from .simplify import Record, Routine, Value, check_single, stem_of
from .source import module_constant

CONSTANTS = {
    "PI": math.pi,
    "TWO_PI": 2.0 * math.pi,
    "INV_PI": 1.0 / math.pi,
    "INV_TWO_PI": 0.5 / math.pi,
}


class Writer:
    """Writes the routines of a program in a dialect."""

    def __init__(self, program: Program, dialect: Dialect) -> None:
        self.program, self.dialect = program, dialect
        self.constants: dict[str, tuple[float, str]] = {}
        self.names: dict[Routine, str] = {}
        self.records: dict[str, Record] = {}
        self.signatures: dict[tuple, Routine] = {}
        taken: set[str] = set()
        for routine in program.routines:
            name = self._routine_name(routine, taken)
            taken.add(name)
            self.names[routine] = name

    def _routine_name(self, routine: Routine, taken: set[str]) -> str:
        name = self.dialect.word(stem_of(routine))
        of_floats = any(n == name and r.type == "float" for r, n in self.names.items())
        if of_floats and routine.type == "vec3" and not self.dialect.overloads:
            name = f"{name}_rgb"
        if stem_of(routine) in NATIVE:
            return stem_of(routine)
        if self.dialect.overloads:
            types = tuple(v.type for v in routine.parameters)
            if self.signatures.setdefault((name, types), routine) is routine and self._same_doc(name, routine):
                return name
        name = self._told_apart(name, routine) if name in taken else name
        found, number = name, 1
        while found in taken:
            number += 1
            found = f"{name}_{number}"
        return found

    def _told_apart(self, name: str, routine: Routine) -> str:
        """The name with what a copy was recorded for, where that is a flag or a word: "masking_shadowing_transmits"."""
        first = next(r for r, known in self.names.items() if known == name)
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
        """Whether a name stands for one function of the source, in different types."""
        return all(self.names[r] != name or r.source == routine.source for r in self.names)

    def note(self, record: Any) -> str:
        """The name of a type in the language; structs are noted, to be declared."""
        if isinstance(record, Routine):
            record = record.record
        if isinstance(record, Record):
            self.records.setdefault(record.name, record)
            return self.dialect.word(record.name)
        return self.dialect.type(record)

    def routine(self, routine: Routine) -> list[str]:
        """The text of a function, its documentation above it; nothing where the language has its own."""
        if stem_of(routine) in NATIVE:
            return []
        return RoutineWriter(self, routine).text()

    def number(self, value: Value) -> str:
        """A constant by its name, where it has one, or in digits."""
        number = float(value.static)
        check_single(number, value.source)
        if value.name and self.constants.get(value.name, (number,))[0] == number:
            self.constants.setdefault(value.name, (number, module_constant(number, value.source)[1]))
            return value.name
        for name, known in CONSTANTS.items():
            if abs(number) == known:
                self.constants.setdefault(name, (known, ""))
                return name if number > 0 else f"-{name}"
        return literal(number)
