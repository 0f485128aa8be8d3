"""Parse the string of a material into its name and its settings.

    taken_apart("conductor(alpha=0.3,preset=Au)")    (Conductor, {"alpha": "0.3", "preset": "Au"})
    taken_apart("lambert+ggx")                       (Sum, {"a": "lambert", "b": "conductor(fresnel=schlick,...)"})

`notation` interprets the settings.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping

from ..errors import InputError
from ..material import is_model, model, tree
from ..material.bsdf import BSDF
from ..material.parameters import Value
from ..optics.ndf import distributions
from . import documents, library, outside, shaders

# lobes that can be terms of a sum, as in "lambert+ggx": Schlick's Fresnel term, with an index without absorption
LOBES = {
    "ggx": "conductor(fresnel=schlick,eta=1.5,k=0)",
    "beckmann": "conductor(fresnel=schlick,eta=1.5,k=0,ndf=beckmann)",
}
SHADER = "shader"  # the type of shaders in scenes and JSON: {"type": "shader", "file": "my.glsl"}
RANGE_STEPS = 5  # number of values in a range
_RANGE = re.compile(r"(.+?)\.\.(.+)", re.DOTALL)
_CALL = re.compile(r"\s*([\w-]+(?::[\w/-]+)?|[^({]+\.py:\w+)\s*(?:\((.*)\))?\s*", re.DOTALL)
_SETTINGS = re.compile(r"\(\s*[\w.]+\s*=.*\)\s*\Z", re.DOTALL)  # settings at the end of a string


def assignment(text: str, option: str = "--param") -> tuple[str, str]:
    """Split "alpha=0.3" into ("alpha", "0.3")."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise InputError(f"'{text}' given, NAME=VALUE expected", option, "such as alpha=0.3")
    return name.strip(), value.strip()


def taken_apart(text: str, where: str = "MODEL", allow_code: bool = False) -> tuple[type[BSDF], dict[str, object]]:
    """The class and the settings of a material given as NAME, FILE or NAME(parameter=value,...).

    The settings are strings, or JSON values if the material is given by a document or as JSON.

    where       the location that errors name
    allow_code  whether a document may name classes in Python files
    Raises InputError if the string does not name a material, and for a document that names code without permission.
    """
    if text.count("(") + text.count("{") > tree.MAX_MATERIALS:
        raise InputError(f"more than {tree.MAX_MATERIALS} nested materials", where, "mix fewer materials")
    if parts := summands(text):
        return model("sum"), {"a": as_call("+".join(parts[:-1])), "b": parts[-1]}
    head, inside = split(text)
    given: dict[str, object] = {**assignments(inside, where)}
    if head.startswith("{"):
        cls, own = apart(_json(head, where), where)
        return cls, {**own, **given}
    if documents.names_document(head):  # before tables, whose names the name of a material in a document may resemble
        described = documents.without_pictures(head)
        _refuse_code(described, head, allow_code)
        cls = class_named(str(described.pop("type")), where)
        return cls, {**described, **given}
    if shaders.names_shader(head):
        return shaders.class_of(head), given
    reader = outside.reader_of(head)
    if reader is not None:
        return reader, {"file": head, **given}
    if not _CALL.fullmatch(text) or re.fullmatch(r"[\d.-]+", head):
        raise _no_material(text, where)
    cls, preset = class_and_preset(head, where)
    return cls, {"preset": preset, **given} if preset else given


def split(text: str) -> tuple[str, str]:
    """Split NAME(parameter=value,...) into the name and the settings, such as ("conductor", "alpha=0.3").

    The settings are "" if there are none. File names and JSON may contain brackets.
    """
    text = text.strip()
    if summands(text):
        return text, ""
    if text.startswith("{"):
        try:
            end = json.JSONDecoder().raw_decode(_with_zeros(text))[1]
        except (ValueError, RecursionError):
            return text, ""
        text = _with_zeros(text)
        return text[:end], text[end:].strip("() ")
    head = text
    while True:
        if outside.names_data(head) or (documents.names_document(head) and not _SETTINGS.search(head)):
            return head, text[len(head) :].strip("() ")
        head, bracket, _ = head.rpartition("(")
        if not bracket:
            break
    match = _CALL.fullmatch(text)
    return (match[1].strip(), match[2] or "") if match else (text, "")


def terms(text: str) -> list[str]:
    """The terms of a sum such as "lambert+ggx". A plus sign in brackets or in a file name does not separate terms."""
    if documents.names_document(text) or outside.names_data(text):
        return [text.strip()]
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "+" and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def summands(text: str) -> list[str]:
    """The terms of a sum of materials, in which the lobes of `LOBES` are expanded; empty for other strings."""
    parts = terms(text)
    if len(parts) < 2 or not all(parts):
        return []
    return list(map(expanded, parts)) if any(_is_known(split(part)[0]) for part in parts) else []


def as_call(text: str) -> str:
    """A sum in the form "sum(a=lambert,b=...)", to which settings can be added; other strings are not changed."""
    parts = summands(text)
    return f"sum(a={as_call('+'.join(parts[:-1]))},b={parts[-1]})" if parts else text


def expanded(part: str) -> str:
    """A term of a sum, in which a lobe is expanded: "ggx(alpha=0.2)" becomes a conductor with alpha = 0.2."""
    head, bracket, rest = part.partition("(")
    if head.strip() not in LOBES:
        return part
    lobe = LOBES[head.strip()].removesuffix(")")
    return f"{lobe},{rest}" if bracket and rest.strip() != ")" else f"{lobe})"


def _is_known(head: str) -> bool:
    """Whether a string without settings names a material, or a lobe of a sum."""
    return (
        head in LOBES
        or is_model(head)
        or library.knows(head)
        or outside.names_code(head)
        or outside.names_data(head)
        or documents.names_document(head)
    )


def assignments(inside: str, where: str = "MODEL") -> dict[str, str]:
    """The value of each parameter in "alpha=0.3,preset=Au", as a string; errors name `where`."""
    return dict(assignment(part, where) for part in _parts(inside))


def _with_zeros(text: str) -> str:
    """Add leading zeros to the numbers in JSON, such as 0.3 for `.3`."""
    return re.sub(r"(?<![\w.])\.(?=\d)", "0.", text)


def _json(text: str, where: str) -> Value:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise _no_material(text, where) from None


def _refuse_code(described: documents.Notation, file: str, allowed: bool) -> None:
    """Raise InputError if the description in a file names a class in a Python file."""
    code = next(_code_in(described), None)
    if code is not None and not allowed:
        hint = f"read that file first; then name the material itself: '{as_text(described)}'"
        raise InputError(f"it names '{code}', code that a data file may not run", file, hint)


def _code_in(described: Mapping[str, object]) -> Iterator[str]:
    for value in described.values():
        if isinstance(value, Mapping):
            yield from _code_in(value)
        elif isinstance(value, str) and outside.names_code(value):
            yield value


def _parts(text: str) -> list[str]:
    """The settings in a string: those commas outside brackets separate that NAME= follows; others belong to colors."""
    parts, depth, start = [], 0, 0
    for at, letter in enumerate(text):
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and depth == 0 and re.match(r",\s*[A-Za-z_][\w.]*\s*=", text[at:]):
            parts.append(text[start:at])
            start = at + 1
    return [part for part in [*parts, text[start:]] if part.strip()]


def _no_material(value: object, where: str) -> InputError:
    if str(value).endswith(".py"):
        return InputError(f"'{value}' names a file, but no class in it", where, f"give {value}:CLASS")
    hint = 'such as lambert, \'conductor(alpha=0.3,preset=Au)\' or \'{"type": "conductor", "preset": "Au"}\''
    expected = ', an object with a "type" expected' if isinstance(value, Mapping) else ""
    return InputError(f"'{value}' is not a material{expected}", where, hint)


def class_named(name: str, where: str = "MODEL") -> type[BSDF]:
    """The class with a given name, or given as FILE.py:CLASS; errors name `where`."""
    return class_and_preset(name, where)[0]


def class_and_preset(name: str, where: str = "MODEL") -> tuple[type[BSDF], str]:
    """The class of a name, of FILE.py:CLASS or of a library material, and the name of its preset, or "".

    Raises InputError, which names `where` and the closest known name, if the name is unknown.
    """
    if outside.names_code(name):
        return outside.load(name, where=where), ""
    if shaders.names_shader(name):
        return shaders.class_of(name), ""
    if not is_model(name):
        if name in distributions():
            hint = f"as a material: conductor(ndf={name})"
            raise InputError(f"'{name}' is a distribution of normals, a material expected", where, hint)
        if ":" in name or library.resembles(name):
            return library.named(name, where)
    return model(name), ""


def apart(value: Value, where: str) -> tuple[type[BSDF], dict[str, object]]:
    """The result of `taken_apart` for a material given as a string or another JSON value; errors name `where`."""
    if isinstance(value, BSDF):
        return type(value), {}
    if isinstance(value, str):
        return taken_apart(value.strip().strip('"'), where)
    if not isinstance(value, Mapping) or not isinstance(value.get("type"), str):
        raise _no_material(value, where)
    fields = documents.from_scenes(value)
    if fields["type"] in documents.types() and isinstance(fields.get("file"), str):
        return taken_apart(":".join(filter(None, [str(fields["file"]), str(fields.get("material", ""))])), where)
    name = named_by(fields)
    cls, preset = class_and_preset(name, where)
    return cls, {"preset": preset, **fields} if preset else fields


def named_by(fields: dict[str, object]) -> str:
    """The name of the class of a description, from its "type" and, for a shader, its "file"; both are removed."""
    name = str(fields.pop("type"))
    return str(fields.pop("file")) if name == SHADER and "file" in fields else name


def as_text(value: object) -> str:
    """Convert a JSON value to a string."""
    if isinstance(value, Mapping):
        inner = ",".join(f"{name}={as_text(v)}" for name, v in value.items() if name != "type")
        return f"{value.get('type')}({inner})" if inner else str(value.get("type"))
    if isinstance(value, list | tuple):
        return ",".join(map(as_text, value))
    return str(value).lower() if isinstance(value, bool) else str(value)


def range_of(text: str) -> list[str]:
    """The five values of a range "LOW..HIGH"; empty for other strings.

    They form a geometric sequence if the range spans a factor of ten or more. Raises InputError if the ends are not
    numbers or do not increase.
    """
    import numpy as np

    ends = _RANGE.fullmatch(text)
    if ends is None:
        return []
    try:
        low, high = float(ends[1]), float(ends[2])
    except ValueError:
        raise InputError(f"'{text}' is not a range", "--vary", "such as --vary alpha=0.01..1") from None
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise InputError(f"'{text}' is not an increasing range", "--vary", "such as --vary alpha=0.01..1")
    steps = np.geomspace if low > 0.0 and high >= 10.0 * low else np.linspace
    return [f"{value:.6g}" for value in steps(low, high, RANGE_STEPS)]
