"""The parameters of a routine: the arguments of the written function, and the names of the values in the function."""

from __future__ import annotations

from collections.abc import Sequence

from .names import Names
from .program import Struct, flat, place
from .values import Member, Record, Routine, Value, members


class ParameterWriter:
    """Names the parameters of one routine, and chooses names for its local values that do not collide with them."""

    def __init__(self, names: Names, routine: Routine) -> None:
        self.names, self.routine, self.language = names, routine, names.language
        self.program = names.program
        self.arguments = self.program.recorded[routine].arguments if routine in self.program.recorded else {}
        self.used_names: set[str] = {*names.routines.values()}
        self.parameter_names: dict[int, str] = {}
        self.heads: list[tuple[str, str]] = []
        self.objects: dict[str, tuple[Struct, str]] = {}  # "struct name" -> (struct, name of the parameter)
        self.locals: dict[int, str] = {}
        self.lines: list[str] = []
        self.arrays: dict[str, int] = {}  # text of an existing array -> its length
        self.built: dict[tuple, str] = {}
        self.holders: dict[str, Value] = {}  # name -> its current value
        self.first_lines: dict[str, int] = {}  # name -> index of the line that declares it
        self._parameters()

    # ------------------------------------------------------------------ parameters

    def _parameters(self) -> None:
        routine, entry = self.routine, self.routine in self.program.entries.values()
        used = [routine.parameters[i] for i in sorted(routine.used)]
        derive = self.program.entries.get("derive") is routine
        for argument, value in self.arguments.items():
            mine = [p for p in used if place(p.static)[0] == argument]
            struct = self.program.struct_of(value)
            derived = self.program.derived_of(value)
            if struct is not None or (derived is not None and isinstance(value, dict)):
                plain = [p for p in mine if struct is not None and not place(p.static)[2]]
                if struct is not None and (plain or entry):
                    self._object(struct, "self", plain)
                rest = [p for p in mine if p not in plain]
                if derived is not None and (rest or (entry and not derive)):
                    self._object(derived, "derived", rest)
                continue
            given = [p for p in routine.parameters if place(p.static)[0] == argument and (p in mine or entry)]
            for member in self._members(given):
                self._plain(member, given[member.first : member.first + max(member.length, 1)])

    def _members(self, parameters: Sequence[Value]) -> list[Member]:
        """The arguments that contain the parameters."""
        return members([(flat(p.static), p.type) for p in parameters], self.program.arrays)

    def _plain(self, member: Member, parameters: list[Value]) -> None:
        """An argument of the function: a number, a vector, or an array of them."""
        name = self.fresh(member.name)
        self.heads.append(self.names.declared(member, name))
        if member.length:
            self.arrays[name] = member.length
            self.parameter_names |= {p.order: f"{name}[{index}]" for index, p in enumerate(parameters)}
            return
        self.parameter_names[parameters[0].order] = name
        if self.language.parameters_change:
            self.holders[name] = parameters[0]

    def _object(self, struct: Struct, name: str, parameters: list[Value]) -> None:
        name = self.fresh(name) if struct.record.name not in self.objects else self.objects[struct.record.name][1]
        if struct.record.name not in self.objects:
            self.objects[struct.record.name] = (struct, name)
            self.heads.append((self.names.note(struct.record), name))
        for parameter in parameters:
            self.parameter_names[parameter.order] = self._field(name, struct.record, flat(place(parameter.static)[1]))

    def _field(self, owner: str, record: Record, field: str | int) -> str:
        """The text of a struct's field, by its name or index."""
        names = [name for name, _ in record.fields]
        text, array, count = self.names.access(record, field if isinstance(field, int) else names.index(field))
        if count:
            self.arrays[f"{owner}.{array}"] = count
        return f"{owner}.{text}"

    def fresh(self, name: str) -> str:
        """A name that is not used in this function."""
        base = self.language.word(name)
        result, count = base, 1
        while result in self.used_names or result in self.language.reserved:
            count += 1
            # a digit without an underscore means a power: x2 is x squared; and GLSL reserves "__"
            result = f"{base.rstrip('_')}_{count}"
        self.used_names.add(result)
        return result
