"""The expressions of a routine as nested text; some values have names, as in Python."""

from __future__ import annotations

import re
from collections.abc import Sequence

from .layout import INDENT, common_head, wrap
from .parameters import ParameterWriter
from .program import Struct, flat, place
from .source import returned_by
from .syntax import AND, ATOM, CHOICE, OPERATORS, OR, SIGN, SUM
from .values import SIZES, Member, Record, Routine, Value, stem_of

INLINE = 88  # number of characters above which a part of an expression is written on a separate line
# selections of existing values, which are never written on a separate line
SELECTED = ("parameter", "constant", "component", "swizzle", "element")


class ExpressionWriter(ParameterWriter):
    """Writes the expressions of one routine with the names of its parameters and local values."""

    def _name_for(self, value: Value) -> str:
        if value.op == "call" and isinstance(value.type, Routine):
            for other in self.routine.values():
                if other.op == "element" and other.args[0] is value:
                    holders = [part for part in other.name.split(".")[:-1] if not part.isdigit()]
                    if holders:
                        return holders[-1]
            tail = stem_of(value.static).rpartition("_")[2]
            return {"sample": "sampled"}.get(tail, tail)
        squared = value.args[0] if _squares(value) else None
        if squared is not None and (not value.name or self.locals.get(squared.order) == value.name):
            inner = self.expression(squared)[0].replace(".", "_")
            return f"{inner}2" if inner.isidentifier() and not inner[-1].isdigit() else "square"
        if value.name:
            parts = value.name.split(".")
            places = [part for part in parts if part.isdigit()]
            return "_".join([next(part for part in reversed(parts) if not part.isdigit()), *places])
        helper = returned_by(value.op, value.source, self.routine.source)
        if helper:
            return helper
        if value.op == "call":
            return stem_of(value.static).rpartition("_")[2].lower()
        if value.op == "texel" and value.static[0].channels > 4:
            return f"texel_{value.static[1]}"
        if value.type == "bool":
            return "holds"
        if value.op in ("abs", "neg") and value.args[0].type == value.type:
            inner = self.expression(value.args[0])[0].replace(".", "_")
            return {"abs": "abs", "neg": "minus"}[value.op] + f"_{inner}" if inner.isidentifier() else "size"
        return {
            "sqrt": "root",
            "dot": "cosine",
            "div": "ratio",
            "where": "chosen",
            "texel": "texel",
            "exp": "power",
        }.get(value.op, {"add": "sum", "sub": "difference", "mul": "product"}.get(value.op, "value"))

    def wrapped(self, line: str) -> list[str]:
        """A statement of the body, broken into lines."""
        return wrap(line, INDENT)

    # ------------------------------------------------------------------ expressions

    def statement(self, value: Value) -> str:
        """The text of a value on the right-hand side of a statement."""
        text = self.expression(value, root=True)[0]
        if self.language.templates and value.op in ("lt", "le", "and", "or") and "," not in text:
            # if there is no comma, these comparisons cannot be parsed as a template
            text = re.sub(r"(?<![\w!])\(([\w.]+ <=? [\w.]+)\)", r"\1", text)
        return text

    def part(self, value: Value, level: int, strict: bool = False) -> str:
        """An operand, in parentheses if it binds more loosely than `level`."""
        text, mine = self.expression(value)
        return f"({text})" if mine < level or (strict and mine == level) else text

    def expression(self, value: Value, root: bool = False) -> tuple[str, int]:
        """(text, precedence) of a value: the name of the value if it has one, else its expression."""
        if not root and value.order in self.locals:
            return self.locals[value.order], ATOM
        text, level = self.compose(value)
        if not root and len(text) > INLINE and value.op not in (*SELECTED, "call"):  # calls are broken at commas
            name = self.fresh(self._name_for(value))
            self.lines += self.wrapped(self.language.local(self.names.note(value.type), name, text))
            self.locals[value.order] = name
            return name, ATOM
        return text, level

    def compose(self, value: Value) -> tuple[str, int]:
        """(text, precedence) of a value's expression, even if it has a name."""
        op, args = value.op, value.args
        if op == "parameter":
            return self.parameter_names[value.order], ATOM
        if op == "constant":
            return self.constant(value)
        if op == "component":
            return f"{self.part(args[0], ATOM)}.{'xyzw'[value.static]}", ATOM
        if op == "swizzle":
            if not self.language.swizzles:
                return f"{self.language.type(value.type)}({', '.join(self._components(value))})", ATOM
            return f"{self.part(args[0], ATOM)}.{value.static}", ATOM
        if op == "element":
            return self._field(self.part(args[0], ATOM), args[0].static.record, value.static), ATOM
        if op == "splat":
            return self.splat(args[0], value.type), SIGN
        if op == "vector":
            parts = [text for a in args for text in self._components(a)]
            return f"{self.language.type(value.type)}({', '.join(parts)})", ATOM
        if op == "call" and stem_of(value.static) in self.language.native:
            return f"{self.names.routines[value.static]}({', '.join(self.splat(a, value.type) for a in args)})", ATOM
        if op == "call":
            return f"{self.names.routines[value.static]}({', '.join(self.call_arguments(value))})", ATOM
        if op == "texel":
            return self.texel(value), ATOM
        if op == "neg":
            return f"-{self.part(args[0], SIGN, strict=True)}", SIGN
        if op == "where":
            return self.choice(value)
        if op == "not" and value.type == "bool":
            return f"!{self.part(args[0], SIGN)}", SIGN
        wide = value.type.startswith("bvec")
        if op in OPERATORS and not (wide and op in self.language.compare):
            return self.infix(value)
        template = self.language.compare[op] if wide else self.language.words[op]
        spread = wide or op in ("minimum", "maximum")
        kind = max((a.type for a in args), key=lambda t: t.startswith("vec"))
        parts = [self.splat(a, kind) if spread else self.unparenthesized(a) for a in args]
        return template.format(*parts, prefix=self.names.placement.prefix), ATOM

    def _components(self, value: Value) -> list[str]:
        """An argument of a vector constructor, as separate components if the language requires them."""
        if self.language.swizzles or value.type not in SIZES:
            return [self.unparenthesized(value)]
        vector, letters = value, "xyzw"[: SIZES[value.type]]
        if value.op == "swizzle":
            vector, letters = value.args[0], value.static
        text = self.part(vector, ATOM)
        if not re.fullmatch(r"[\w.]+", text):
            text = self.fresh(self._name_for(vector))
            line = self.language.local(self.names.note(vector.type), text, self.unparenthesized(vector))
            self.lines += self.wrapped(line)
            self.locals[vector.order] = text
        return [f"{text}.{letter}" for letter in letters]

    def unparenthesized(self, value: Value) -> str:
        """The text of a function's argument."""
        return self.expression(value)[0]

    def infix(self, value: Value) -> tuple[str, int]:
        symbol, level = OPERATORS[value.op]
        a, b = value.args
        # the order of evaluation is that of the source, so a + (b + c) has parentheses
        strict = value.op not in ("and", "or")
        chain = level == SUM and a.order not in self.locals and OPERATORS.get(a.op, ("", ATOM))[1] == SUM
        left = self.compose(a)[0] if chain else self.part(a, level)  # a long sum is wrapped, not split
        right = self.part(b, level, strict)
        if level in (AND, OR):  # && inside || is parenthesized for readability
            left, right = (
                f"({text})"
                if other.op in ("and", "or") and other.op != value.op and other.order not in self.locals
                else text
                for text, other in ((self.expression(a)[0], a), (self.expression(b)[0], b))
            )
            left, right = (
                f"({text})" if other.op == "where" and other.order not in self.locals else text
                for text, other in ((left, a), (right, b))
            )
        if value.type.startswith("bvec"):
            left, right = self.splat(a, "vec" + value.type[-1]), self.splat(b, "vec" + value.type[-1])
        if value.op in ("lt", "le") and self.language.templates:  # otherwise `a < b, c > d` is parsed as a template
            return f"({left} {symbol} {right})", ATOM
        return f"{left} {symbol} {right}", level

    def choice(self, value: Value) -> tuple[str, int]:
        mask, a, b = value.args
        vector = mask.type.startswith("bvec")
        template = self.language.choice[vector]
        infix = "?" in template
        parts = [self.part(mask, OR) if infix else self.unparenthesized(mask)]
        parts += [self.splat(x, value.type, CHOICE + 1 if infix else CHOICE) for x in (a, b)]
        return template.format(*parts, prefix=self.names.placement.prefix), CHOICE if infix else ATOM

    def splat(self, value: Value, type_: str, level: int = CHOICE) -> str:
        """The text of a value; a float is converted to a vector if a vector is needed."""
        if value.type == type_ or value.type not in ("float",) or not type_.startswith("vec"):
            return self.part(value, level)
        if value.op == "constant":
            return self.spread(type_, self.constant(value))
        return self.spread(type_, self.expression(value))

    def spread(self, type_: str, text: tuple[str, int]) -> str:
        """The conversion of a float to the vector type `type_`; `text` is its expression and precedence."""
        template = self.language.spreads.get(type_, self.language.spread)
        inside = f"({text[0]})" if "){1}" in template and text[1] != ATOM else text[0]
        return template.format(self.language.type(type_), inside)

    def constant(self, value: Value) -> tuple[str, int]:
        if value.type in ("bool",) or value.type.startswith("bvec"):
            text = self.language.truth[bool(value.static)]
            return (text if value.type == "bool" else f"{self.language.type(value.type)}({text})"), ATOM
        text = self.names.number(value)
        if value.type != "float":
            return self.spread(value.type, (text, SIGN if text.startswith("-") else ATOM)), SIGN
        return text, SIGN if text.startswith("-") else ATOM

    def texel(self, value: Value) -> str:
        table, group, how = value.static
        arguments = [self.unparenthesized(a) for a in value.args]
        if table.channels > 4:
            arguments.append(str(group))
        return f"{self.names.table(table, how + '_')}({', '.join(arguments)})"

    # ------------------------------------------------------------------ calls

    def call_arguments(self, value: Value) -> list[str]:
        callee: Routine = value.static
        recorded = self.program.recorded[callee]
        entry = callee in self.program.entries.values()
        texts: list[str] = []
        given: set[str] = set()
        for argument, object_ in recorded.arguments.items():
            places = [i for i, p in enumerate(callee.parameters) if place(p.static)[0] == argument]
            struct, derived = self.program.struct_of(object_), self.program.derived_of(object_)
            if struct is not None or (derived is not None and isinstance(object_, dict)):
                for wanted, below in ((struct, False), (derived, True)):
                    if wanted is None:
                        continue
                    fields = {
                        flat(place(callee.parameters[i].static)[1]): (value.args[i], i in callee.used)
                        for i in places
                        if (place(callee.parameters[i].static)[2] or isinstance(object_, dict)) == below
                    }
                    if entry or any(used for _, used in fields.values()):
                        if wanted.record.name not in given:
                            texts.append(self.object(wanted, fields))
                        given.add(wanted.record.name)
                continue
            chosen = [i for i in places if i in callee.used or entry]
            for member in self._members([callee.parameters[i] for i in chosen]):
                values = [value.args[i] for i in chosen[member.first : member.first + max(member.length, 1)]]
                if member.length:
                    texts.append(self._array(member, [self.splat(one, member.type) for one in values]))
                else:
                    texts.append(self.unparenthesized(values[0]))
        return texts

    def _array(self, member: Member, parts: list[str], initializer: bool = False) -> str:
        """An array from the texts of its entries: an existing array that contains them, or a new one.

        initializer  whether the text is inside the braces of a declaration
        """
        stem = parts[0].removesuffix("[0]") if self.language.whole_members or not initializer else ""
        if self.arrays.get(stem) == len(parts) and parts == [f"{stem}[{index}]" for index in range(len(parts))]:
            return stem
        type_ = self.language.type(member.type)
        text = self.language.array(type_, parts)
        if self.language.array_literal or initializer:
            return text
        local = self.fresh(member.name)
        self.lines += self.wrapped(self.language.local(*self.names.declared(member, local), text))
        return local

    def member_texts(self, record: Record, values: Sequence[Value | None]) -> list[str]:
        """The texts of a struct's members, from the values of its fields; None for a field that is not read."""
        texts = []
        for member in self.names.members(record):
            parts = [
                self._member(value, member.type) if value is not None else self._zero(member.type)
                for value in values[member.first : member.first + max(member.length, 1)]
            ]
            braces = not self.language.struct_literal
            texts.append(self._array(member, parts, initializer=braces) if member.length else parts[0])
        return texts

    def _member(self, value: Value, type_: str) -> str:
        """The text of a struct's member in a list of members."""
        if self.language.whole_members or type_ not in ("vec2", "vec4") or value.op in ("constant", "vector"):
            return self.splat(value, type_)
        return f"{self.language.type(type_)}({', '.join(self._components(value))})"

    def _zero(self, type_: str) -> str:
        return "0.0" if type_ == "float" else self.spread(type_, ("0.0", ATOM))

    def object(self, struct: Struct, fields: dict[str, tuple[Value, bool]]) -> str:
        """A struct as an argument: this function's own struct if it contains exactly these fields, else a new one."""
        name = struct.record.name
        if name in self.objects:
            own = self.objects[name][1]
            if all(
                self.parameter_names.get(v.order) == self._field(own, struct.record, field)
                for field, (v, used) in fields.items()
                if used
            ):
                return own
        values: list[Value | None] = []
        for field, _ in struct.record.fields:
            given, used = fields.get(field, (None, False))
            if given is not None and given.op == "parameter" and given.order not in self.parameter_names:
                self._late(given)
            read = given is not None and (used or given.order in self.parameter_names)
            values.append(given if read else None)
        parts = self.member_texts(struct.record, values)
        key = (name, tuple(parts))
        if key not in self.built:
            local = self.fresh(common_head(parts) or name[0].lower() + name[1:])
            type_name = self.names.note(struct.record)
            if self.language.struct_literal:
                line = self.language.local(type_name, local, f"{type_name}({', '.join(parts)})")
            else:
                line = f"{type_name} {local} = {{ {', '.join(parts)} }};"
            self.lines += self.wrapped(line)
            self.built[key] = local
        return self.built[key]

    def _late(self, parameter: Value) -> None:
        """Name a field of this function's own structs that is only passed on in another struct."""
        root, path, derived = place(parameter.static)
        value = self.arguments.get(root)
        struct = self.program.derived_of(value) if derived or isinstance(value, dict) else self.program.struct_of(value)
        if struct is not None and struct.record.name in self.objects and path in struct.paths:
            own = self.objects[struct.record.name][1]
            self.parameter_names[parameter.order] = self._field(own, struct.record, flat(path))


def _squares(value: Value) -> bool:
    """Whether a value is the square of its first argument."""
    if value.op == "call":
        return stem_of(value.static) == "sqr"
    return value.op == "mul" and value.args[0] is value.args[1]
