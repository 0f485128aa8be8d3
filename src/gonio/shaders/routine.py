"""One routine as text: expressions re-nested, values named as in Python where a name helps."""

from __future__ import annotations

import re

from .layout import INDENT, comment, common_head, wrap
from .names import Names
from .program import Struct, flat, place
from .simplify import ELEMENTWISE, Routine, Value, needed, stem_of
from .source import returned_by
from .syntax import AND, ATOM, CHOICE, OPERATORS, OR, SIGN, SUM

INLINE = 88  # characters: a longer part of an expression gets a line of its own

# what is there already, and only picked: never worth a line of its own
SELECTED = ("parameter", "constant", "component", "swizzle", "element")
COMPUTED = ELEMENTWISE | {"call", "where", "texel"}  # worth a line where a component of it is picked


class RoutineWriter:
    """Writes one routine: which values get a line, what they are called, and the text of each."""

    def __init__(self, names: Names, routine: Routine) -> None:
        self.names, self.routine, self.language = names, routine, names.language
        self.program = names.program
        self.arguments = self.program.recorded[routine].arguments if routine in self.program.recorded else {}
        self.taken: set[str] = {*names.routines.values()}
        self.parameter_names: dict[int, str] = {}
        self.heads: list[tuple[str, str]] = []
        self.objects: dict[str, tuple[Struct, str]] = {}  # "struct name" -> (struct, name of the parameter)
        self.locals: dict[int, str] = {}
        self.lines: list[str] = []
        self.built: dict[tuple, str] = {}
        self.holders: dict[str, Value] = {}  # name -> the value that it stands for now
        self.first_lines: dict[str, int] = {}  # name -> the line that declares it
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
            for parameter in (p for p in routine.parameters if place(p.static)[0] == argument):
                if parameter in mine or entry:
                    name = self.fresh(flat(parameter.static))
                    self.parameter_names[parameter.order] = name
                    if self.language.parameters_change:
                        self.holders[name] = parameter
                    self.heads.append((self.language.type(parameter.type), name))

    def _object(self, struct: Struct, name: str, parameters: list[Value]) -> None:
        name = self.fresh(name) if struct.record.name not in self.objects else self.objects[struct.record.name][1]
        if struct.record.name not in self.objects:
            self.objects[struct.record.name] = (struct, name)
            self.heads.append((self.names.note(struct.record), name))
        for parameter in parameters:
            field = flat(place(parameter.static)[1])
            self.parameter_names[parameter.order] = f"{name}.{self.language.word(field)}"

    def fresh(self, name: str) -> str:
        """A name that is free in this function."""
        base = self.language.word(name)
        found, count = base, 1
        while found in self.taken or found in self.language.reserved:
            count += 1
            # a digit without the dash is a power, x2 is x squared; and GLSL keeps "__" for itself
            found = f"{base.rstrip('_')}_{count}"
        self.taken.add(found)
        return found

    # ------------------------------------------------------------------ text

    def text(self) -> list[str]:
        routine = self.routine
        values = routine.values()
        self._plan(values)
        statements = [value for value in values if value.order in self.named]
        last_use = self._last_uses(statements)
        for index, value in enumerate(statements):
            self._define(value, index, last_use)
        body = self._result()
        head = self.language.signature(self.names.note(routine.type), self.names.routines[routine], self.heads)
        return [*comment(self._doc()), *wrap(head, ""), *self.lines, *body, "}"]

    def _doc(self) -> str:
        """The docstring, without what it says of arguments that shaped the code and are none of the function's."""
        entry = self.routine in self.program.entries.values()
        given = {place(p.static)[0] for i, p in enumerate(self.routine.parameters) if entry or i in self.routine.used}
        kept, dropping = [], False
        for line in self.routine.doc.splitlines():
            listed = re.match(r"(\w+(?:, \w+)*)  +\S", line)
            if listed:
                names = set(listed[1].split(", "))
                dropping = names <= set(self.arguments) and not names & given
            elif not line.startswith("  "):
                dropping = False
            if not dropping:
                kept.append(re.sub(r"`(?:\w+\.)+(\w+)`", r"`\1`", line))
        return "\n".join(kept)

    def _result(self) -> list[str]:
        routine = self.routine
        if routine.single:
            return wrap(f"return {self.whole(routine.results[0][1])};", INDENT)
        record = routine.record
        assert record is not None
        values = [value for _, value in routine.results]
        called = self._forwarded()
        if called is not None:
            return wrap(f"return {self.whole(called)};", INDENT)
        parts = [self.splat(value, type_) for value, (_, type_) in zip(values, record.fields, strict=True)]
        name = self.names.note(record)
        if self.language.struct_literal:
            return wrap(f"return {name}({', '.join(parts)});", INDENT)
        result = self.fresh("result")
        lines = wrap(f"{name} {result} = {{ {', '.join(parts)} }};", INDENT)
        return [*lines, f"{INDENT}return {result};"]

    def _forwarded(self) -> Value | None:
        """The call whose several results are returned as they stand, if there is one."""
        values = [value for _, value in self.routine.results]
        if self.routine.single or values[0].op != "element":
            return None
        called = values[0].args[0]
        same = all(v.op == "element" and v.args[0] is called and v.static == i for i, v in enumerate(values))
        return called if same else None

    def _plan(self, values: list[Value]) -> None:
        """Which values get a line and a name."""
        uses: dict[int, int] = {}
        for value in values:
            for argument in needed(value):
                uses[argument.order] = uses.get(argument.order, 0) + 1
        for _, result in self.routine.results:
            uses[result.order] = uses.get(result.order, 0) + 1
        results = {v.order for _, v in self.routine.results}
        self.named: set[int] = set()
        self.uses = uses
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
        """By named value: the last statement that reads it; the result comes after all."""
        last: dict[int, int] = {}
        roots = [(index, needed(value)) for index, value in enumerate(statements)]
        roots.append((len(statements), [value for _, value in self.routine.results]))
        for index, pending in roots:
            pending, seen = list(pending), set()
            while pending:
                value = pending.pop()
                if value.order in seen:
                    continue
                seen.add(value.order)
                if value.order in self.named or value.op == "parameter":
                    last[value.order] = index
                else:
                    pending.extend(needed(value))
        return last

    def _define(self, value: Value, index: int, last_use: dict[int, int]) -> None:
        text = self.whole(value)
        type_ = self.names.note(value.type)
        wanted = self.language.word(self._name_for(value))
        name = self._served(wanted, value, index, last_use)
        if name:  # Python gave the name anew when the old value had served: so does the shader
            if name in self.first_lines:
                line = self.first_lines[name]
                self.lines[line] = self.language.changeable(self.lines[line])
            self.lines += wrap(f"{name} = {text};", INDENT)
        else:
            name = self.fresh(wanted)
            self.first_lines[name] = len(self.lines)
            self.lines += wrap(self.language.local(type_, name, text), INDENT)
        self.holders[name] = value
        self.locals[value.order] = name

    def _served(self, wanted: str, value: Value, index: int, last_use: dict[int, int]) -> str:
        """A variable of the wanted name whose value nobody needs any more, or ""."""
        number = 1
        while (name := wanted if number == 1 else f"{wanted}_{number}") in self.taken:
            holder = self.holders.get(name)
            if holder is not None and holder.type == value.type and last_use.get(holder.order, -1) <= index:
                return name
            number += 1
        return ""

    def _name_for(self, value: Value) -> str:
        if value.op == "call" and isinstance(value.type, Routine):
            for other in self.routine.values():
                if other.op == "element" and other.args[0] is value and "." in other.name:
                    return other.name.rpartition(".")[0].rpartition(".")[2]
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

    # ------------------------------------------------------------------ expressions

    def whole(self, value: Value) -> str:
        """The text of a statement's value."""
        text = self.expression(value, root=True)[0]
        if self.language.templates and value.op in ("lt", "le", "and", "or") and "," not in text:
            text = re.sub(r"(?<![\w!])\(([\w.]+ <=? [\w.]+)\)", r"\1", text)  # nothing here can be read as a template
        return text

    def part(self, value: Value, level: int, strict: bool = False) -> str:
        """An argument, in parentheses where it binds looser than `level`."""
        text, mine = self.expression(value)
        return f"({text})" if mine < level or (strict and mine == level) else text

    def expression(self, value: Value, root: bool = False) -> tuple[str, int]:
        """(text, precedence)."""
        if not root and value.order in self.locals:
            return self.locals[value.order], ATOM
        text, level = self.compose(value)
        if not root and len(text) > INLINE and value.op not in (*SELECTED, "call"):  # a call is broken at its commas
            name = self.fresh(self._name_for(value))
            self.lines += wrap(self.language.local(self.names.note(value.type), name, text), INDENT)
            self.locals[value.order] = name
            return name, ATOM
        return text, level

    def compose(self, value: Value) -> tuple[str, int]:
        op, args = value.op, value.args
        if op == "parameter":
            return self.parameter_names[value.order], ATOM
        if op == "constant":
            return self.constant(value)
        if op == "component":
            return f"{self.part(args[0], ATOM)}.{'xyzw'[value.static]}", ATOM
        if op == "swizzle":
            return f"{self.part(args[0], ATOM)}.{value.static}", ATOM
        if op == "element":
            field = value.args[0].static.record.fields[value.static][0]
            return f"{self.part(args[0], ATOM)}.{self.language.word(field)}", ATOM
        if op == "splat":
            return self.splat(args[0], value.type), SIGN
        if op == "vector":
            parts = [self.whole_or_local(a) for a in args]
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
        parts = [self.splat(a, kind) if spread else self.whole_or_local(a) for a in args]
        return template.format(*parts), ATOM

    def whole_or_local(self, value: Value) -> str:
        return self.expression(value)[0]

    def infix(self, value: Value) -> tuple[str, int]:
        symbol, level = OPERATORS[value.op]
        a, b = value.args
        # the order of evaluation is the source's: a + (b + c) keeps its parentheses
        strict = value.op not in ("and", "or")
        chain = level == SUM and a.order not in self.locals and OPERATORS.get(a.op, ("", ATOM))[1] == SUM
        left = self.compose(a)[0] if chain else self.part(a, level)  # a long sum is broken, not taken apart
        right = self.part(b, level, strict)
        if level in (AND, OR):  # nobody should have to know which of && and || binds tighter
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
        if value.op in ("lt", "le") and self.language.templates:  # or `a < b, c > d` is read as a template
            return f"({left} {symbol} {right})", ATOM
        return f"{left} {symbol} {right}", level

    def choice(self, value: Value) -> tuple[str, int]:
        mask, a, b = value.args
        vector = mask.type.startswith("bvec")
        template = self.language.choice[vector]
        infix = "?" in template
        parts = [self.part(mask, OR) if infix else self.whole_or_local(mask)]
        parts += [self.splat(x, value.type, CHOICE + 1 if infix else CHOICE) for x in (a, b)]
        return template.format(*parts), CHOICE if infix else ATOM

    def splat(self, value: Value, type_: str, level: int = CHOICE) -> str:
        """The text of a value, spread over a vector where it is a float and a vector is wanted."""
        if value.type == type_ or value.type not in ("float",) or not type_.startswith("vec"):
            return self.part(value, level)
        if value.op == "constant":
            return self.spread(type_, self.constant(value))
        return self.spread(type_, self.expression(value))

    def spread(self, type_: str, text: tuple[str, int]) -> str:
        """A float spread over a vector."""
        inside = text[0] if "({1})" in self.language.spread or text[1] == ATOM else f"({text[0]})"
        return self.language.spread.format(self.language.type(type_), inside)

    def constant(self, value: Value) -> tuple[str, int]:
        if value.type in ("bool",) or value.type.startswith("bvec"):
            text = "true" if value.static else "false"
            return (text if value.type == "bool" else f"{self.language.type(value.type)}({text})"), ATOM
        text = self.names.number(value)
        if value.type != "float":
            return self.spread(value.type, (text, SIGN if text.startswith("-") else ATOM)), SIGN
        return text, SIGN if text.startswith("-") else ATOM

    def texel(self, value: Value) -> str:
        table, group, how = value.static
        arguments = [self.whole_or_local(a) for a in value.args]
        if table.channels > 4:
            arguments.append(str(group))
        return f"{how}_{table.name}({', '.join(arguments)})"

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
            texts += [self.whole_or_local(value.args[i]) for i in places if i in callee.used or entry]
        return texts

    def object(self, struct: Struct, fields: dict[str, tuple[Value, bool]]) -> str:
        """A struct as an argument: this function's own, where it holds just these fields, or a new one."""
        name = struct.record.name
        if name in self.objects:
            own = self.objects[name][1]
            if all(
                self.parameter_names.get(v.order) == f"{own}.{self.language.word(field)}"
                for field, (v, used) in fields.items()
                if used
            ):
                return own
        parts = []
        for field, type_ in struct.record.fields:
            given, used = fields.get(field, (None, False))
            if given is not None and given.op == "parameter" and given.order not in self.parameter_names:
                self._late(given)
            if given is not None and (used or given.order in self.parameter_names):
                parts.append(self.splat(given, type_))
            else:  # nobody reads it
                parts.append("0.0" if type_ == "float" else self.spread(type_, ("0.0", ATOM)))
        key = (name, tuple(parts))
        if key not in self.built:
            local = self.fresh(common_head(parts) or name[0].lower() + name[1:])
            type_name = self.names.note(struct.record)
            if self.language.struct_literal:
                line = self.language.local(type_name, local, f"{type_name}({', '.join(parts)})")
            else:
                line = f"{type_name} {local} = {{ {', '.join(parts)} }};"
            self.lines += wrap(line, INDENT)
            self.built[key] = local
        return self.built[key]

    def _late(self, parameter: Value) -> None:
        """A field of this function's own structs that only a struct passed on has."""
        root, path, derived = place(parameter.static)
        value = self.arguments.get(root)
        struct = self.program.derived_of(value) if derived or isinstance(value, dict) else self.program.struct_of(value)
        if struct is not None and struct.record.name in self.objects and path in struct.paths:
            own = self.objects[struct.record.name][1]
            self.parameter_names[parameter.order] = f"{own}.{self.language.word(flat(path))}"


def _squares(value: Value) -> bool:
    """Whether a value is the square of its first argument."""
    if value.op == "call":
        return stem_of(value.static) == "sqr"
    return value.op == "mul" and value.args[0] is value.args[1]


def _size(value: Value, sizes: dict[int, int]) -> int:
    """Operations in an expression, as a reader counts them."""
    if value.op in ("parameter", "constant"):
        return 0
    below = sum(sizes.get(a.order, 0) for a in needed(value))
    return below + (0 if value.op in SELECTED else 1)
