"""What the routines of a shader share: their names, and the constants and structs that they come to need."""

from __future__ import annotations

import math

from ..ops.graph import first_free
from .languages import Language
from .program import Program, place
from .simplify import Kind, Record, Routine, Value, check_single, stem_of
from .source import module_constant
from .syntax import literal

CONSTANTS = {"PI": math.pi, "TWO_PI": 2.0 * math.pi, "INV_PI": 1.0 / math.pi, "INV_TWO_PI": 0.5 / math.pi}


class Names:
    """Names in the shader of a program: of its routines, and of what they come to need while they are written.

    routines   the name of each
    constants  name -> (number, what it is)
    records    name -> struct
    """

    def __init__(self, program: Program, language: Language) -> None:
        self.program, self.language = program, language
        self.constants: dict[str, tuple[float, str]] = {}
        self.routines: dict[Routine, str] = {}
        self.records: dict[str, Record] = {}
        self.signatures: dict[tuple, Routine] = {}
        taken: set[str] = set()
        for routine in program.routines:
            name = self._routine_name(routine, taken)
            taken.add(name)
            self.routines[routine] = name

    def _routine_name(self, routine: Routine, taken: set[str]) -> str:
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
        name = self._told_apart(name, routine) if name in taken else name
        return first_free(name, taken)

    def _types(self, routine: Routine) -> tuple[object, ...]:
        """What tells overloads apart: the types of the arguments that are written, an object's being its struct."""
        arguments = self.program.recorded[routine].arguments
        found: dict[object, object] = {}
        for index in sorted(routine.used):
            parameter = routine.parameters[index]
            root, rest, _ = place(parameter.static)
            struct = self.program.struct_of(arguments.get(root)) if rest else None
            found[root if struct else index] = struct.record.name if struct else parameter.type
        return tuple(found.values())

    def _told_apart(self, name: str, routine: Routine) -> str:
        """The name with what a copy was recorded for, where that is a flag or a word: "masking_shadowing_transmits"."""
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
        """Whether a name stands for one function of the source, in different types."""
        return all(self.routines[r] != name or r.source == routine.source for r in self.routines)

    def note(self, record: Kind) -> str:
        """The name of a type in the language; structs are noted, to be declared."""
        if isinstance(record, Routine):
            record = record.record
        if isinstance(record, Record):
            self.records.setdefault(record.name, record)
            return self.language.word(record.name)
        return self.language.type(record)

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
