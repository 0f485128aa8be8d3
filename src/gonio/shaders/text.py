"""The text of a shader: its head, and blocks, each of which declares one name."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from .._version import __version__
from ..material import tree
from ..ops.table import Table
from .languages import Language
from .layout import COLUMNS, INDENT, comment, wrap
from .manifest import TERMS
from .method_writer import INTERPOLATED, MethodWriter
from .method_writer import readers as method_readers
from .names import Names
from .operations import operations
from .program import ENTRIES, Program, Routines, choices, written_from
from .routine import RoutineWriter
from .syntax import literal
from .textures import READERS, axes
from .values import Record, stem_of


class Block(NamedTuple):
    """The declaration of one name, or of one overload of a function.

    kind   "constant", "struct", "table", "function" or "values"
    name   name without prefix; for a table, "table_NAME", which also represents the functions that read it
    table  the table, if kind is "table"
    """

    kind: str
    name: str
    lines: list[str]
    table: Table | None = None


def blocks(made: Routines, names: Names, bindings: Mapping[int, int]) -> list[Block]:
    """The declarations of a shader, each before its use.

    bindings  number of the binding of each table, by the table's identity
    """
    language = names.language
    writer = MethodWriter if language.methods else RoutineWriter
    bodies = [
        Block("function", _raw(names, names.routines[r]), writer(names, r).text())
        for r in made.routines
        if stem_of(r) not in language.native
    ]
    result = []
    for name, (value, about) in names.constants.items():
        line = language.constant(names.constant(name), literal(value))
        if about and len(line) + len(about) + 4 <= 110:
            result.append(Block("constant", name, [f"{line}  // {about}"]))
        else:
            result.append(Block("constant", name, [*(f"// {text}" for text in textwrap.wrap(about, 105)), line]))
    for record in structs(made, names):
        lines = [*comment(record.doc), *_struct(record, names)]
        result.append(Block("struct", language.word(record.name), lines))
    if language.methods and any("lookup" in how for how in made.readings.values()):
        lines = INTERPOLATED.strip().format(name=names.public("interpolated")).splitlines()
        result.insert(0, Block("function", "interpolated", lines))
    tables = [Block("table", f"table_{t.name}", _table(made, names, t, bindings[id(t)]), t) for t in made.tables]
    return result + _helpers(names, [*tables, *bodies]) + tables + bodies


def _helpers(names: Names, bodies: Sequence[Block]) -> list[Block]:
    """The language's own helper functions that the bodies call."""
    text = "\n".join(line for block in bodies for line in block.lines)
    called = {name: names.public(name) for name in names.language.helpers}
    return [
        Block("function", name, [line.format(name=public) for line in names.language.helpers[name]])
        for name, public in called.items()
        if re.search(rf"\b{public}\(", text)
    ]


def _raw(names: Names, name: str) -> str:
    """A public name without the prefix, before any replacement."""
    name = name.removeprefix(names.placement.prefix)
    return next((before for before, after in names.renamed.items() if after == name), name)


def joined(head: Sequence[str], declared: Sequence[Block], language: Language, prefix: str = "") -> str:
    """The text of a shader: constants on consecutive lines, other declarations separated by empty lines.

    head  lines at the beginning
    """
    constants = [line for block in declared if block.kind == "constant" for line in block.lines]
    parts = [constants, *(block.lines for block in declared if block.kind != "constant")]
    lines = "\n\n".join("\n".join(part) for part in parts if part).split("\n")
    return "\n".join([*head, "", *language.finished(lines, prefix)]) + "\n"


def _table(made: Routines, names: Names, table: Table, binding: int) -> list[str]:
    """The declaration of a table's texture, and the functions that read it."""
    language = names.language
    size = " x ".join(map(str, table.shape))
    channels = f"{table.channels} channel{'s' * (table.channels > 1)}"
    readings = sorted(made.readings[id(table)])
    rule = "linear between texel centers, " if "lookup" in readings else ""
    about = [
        f"// {size} texels, {channels}; {rule}clamped outside.",
        f"// They are in {names.file(table)}, which an output folder (-o DIR/) contains next to the shader.",
    ]
    group = [names.placement.group] if language.groups else []
    dimension = 3 if len(axes(table)) == 3 else 2
    binding_lines = language.binding(names.table(table, "table_"), dimension, binding, *group)
    if language.methods:
        return [*binding_lines, "", *about, *method_readers(names, table, readings)]
    readers = [line for how in readings for line in ("", *READERS[how](names, table))]
    return [*binding_lines, "", *about, *readers[1:]]


def values(made: Program, names: Names, numbers: Mapping[str, Any]) -> Block:
    """The material's own values as a constant of its struct; `numbers` contains them by path."""
    struct = made.struct_of(made.bound)
    assert struct is not None
    language = names.language
    parts = []
    for (_, type_), path in zip(struct.record.fields, struct.paths, strict=True):
        inside = ", ".join(map(literal, numbers[path])) if type_ != "float" else literal(numbers[path])
        parts.append(inside if type_ == "float" else f"{language.type(type_)}({inside})")
    name = f"{language.word(struct.record.name)}_values"
    line = language.values(names.struct(struct.record), names.public(name), parts or ["0.0"])
    return Block("values", name, ["// The values of this material.", *wrap(line, "")])


def head(made: Program, names: Names) -> list[str]:
    model, language = made.model, names.language
    entries = sorted(made.entries.items(), key=lambda entry: list(ENTRIES).index(entry[0]))
    shaped = [f"{path} = {value}" for path, value in choices(model)]
    lines = [f"// {type(model).__name__}, written by Gonio {__version__} from {written_from(model)}.", "//"]
    lines += comment(re.sub(r"\s\(`gonio\.[\w.]+`\)", "", inspect.cleandoc(type(model).__doc__ or "")))
    if made.without:
        off = ", ".join(f"{path} = {tree.value_at(model, path):g}" for path in made.without)
        lines += ["//", *(f"// {text}" for text in textwrap.wrap(f"Written without parts that are off: {off}.", 105))]
    if shaped:
        lines += ["//", *(f"// {text}" for text in textwrap.wrap("With " + ", ".join(shaped) + ".", 105))]
    lines += ["//"]
    calls = [
        f"{names.routines[routine]}({', '.join(_arguments(made, method, language))})" for method, routine in entries
    ]
    for call, (method, _) in zip(calls, entries, strict=True):
        lines.append(f"// {call:{max(map(len, calls))}}  {ENTRIES[method]}")
    lines += ["//", *costs({names.routines[routine]: operations(routine) for routine in made.entries.values()})]
    lines += [
        "//",
        "// wo points to the viewer, wi to the light: unit vectors of the local frame, away from the surface; +z is",
        f"// the shading normal. Colors are linear RGB. {language.precision}",
    ]
    return lines


def costs(counts: Mapping[str, Mapping[str, int]]) -> list[str]:
    """The number of operations of each function by kind, as lines of a comment."""
    parts = []
    for name, kinds in counts.items():
        listed = ", ".join(f"{count} {kind}" for kind, count in kinds.items() if count)
        parts.append(f"{name} {sum(kinds.values())} ({listed})")
    text = "Operations on numbers, one per component of a vector: " + "; ".join(parts) + "."
    return [f"// {line}" for line in textwrap.wrap(text, 105)]


def _arguments(made: Program, method: str, language: Language) -> list[str]:
    first = [language.word("self")]
    if method == "derive":
        return first
    return first + ["derived"] * (made.derived is not None) + ["wo", "u" if method == "sample" else "wi"]


def structs(made: Routines, names: Names) -> list[Record]:
    own = made.struct_of(made.bound)
    if own is not None:
        names.note(own.record)
    if made.derived is not None:
        names.note(made.derived.record)
    return list(names.records.values())


def _struct(record: Record, names: Names) -> list[str]:
    members = names.members(record)
    fields = [names.declared(member) for member in members]
    if not fields:  # a struct needs at least one member
        fields = [(names.language.type("float"), "nothing")]
    lines = names.language.struct(names.struct(record), fields)
    for place, (name, *_) in zip(range(len(lines) - 2, 0, -1), reversed(members), strict=False):
        about = record.docs.get(name) or (TERMS.get(name, "") if record.name.endswith("Terms") else "")
        if about and len(lines[place]) + len(about) + 5 <= COLUMNS + 10:
            lines[place] += f"  // {about}"
        elif about:
            lines[place:place] = [f"{INDENT}// {text}" for text in textwrap.wrap(about, COLUMNS)]
    return lines
