"""Read a scene: parse the file, apply overrides, validate the result, and locate the files that it names."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from ..bridge.types import Json
from ..catalog import outside, texts
from ..errors import InputError, did_you_mean
from . import overrides as override
from .materials import BY_TYPE, OWN, MaterialPart, numbers_in
from .schema import SceneDescription
from .text import kind_of, pointer, read_json
from .values import Part

MAX_SHOWN = 4  # number of errors reported at once: enough to correct most files in one pass, but few enough to read


def read(
    path: Path | str,
    *,
    allow_outside: bool = False,
    allow_code: bool = False,
    overrides: Mapping[str, object] | None = None,
    names_output: bool = True,
) -> SceneDescription:
    """Read a scene from a folder with a scene.json, or from a .json file.

    allow_outside  whether textures and meshes outside the scene's folder are allowed
    allow_code     whether materials may be classes in Python files, such as "ward.py:Ward", which are then executed
    overrides      values to set before validation, by path, such as {"shapes.1.material.p": 16}; see `overrides`
    names_output   whether the picture is written to the file that the scene names, so that the name must be valid
    Raises InputError for any error in the file or in the files that it names.

        description = read("scenes/phong", overrides={"shapes.*.material.roughness": 0.3})
    """
    file = _scene_file(Path(path))
    raw = read_json(file)
    if overrides:
        override.apply(raw, overrides)
    context = {"folder": file.parent, "allow_code": allow_code, "allow_outside": allow_outside}
    context["names_output"] = names_output
    try:
        description = SceneDescription.model_validate(raw, context=context)
    except ValidationError as error:
        raise explain(error, raw, file) from None
    description._path = file
    description._allow_outside = allow_outside
    description._raw = raw
    if names_output:
        _check_output(description)
    checked: dict[MaterialPart, list[tuple[str, str]]] = {}
    for where, part in parts(description):
        if (name := part.__dict__.get("file")) is not None:
            description.locate(name, f"{where}/file")
        if isinstance(part, MaterialPart):
            if part not in checked:
                checked[part] = _check_material(description, where, part)
            description._warnings += [f"{description.where(where + key)}: {text}" for key, text in checked[part]]
    return description


def _scene_file(path: Path) -> Path:
    try:
        if path.is_dir():
            file = path / "scene.json"
            if not file.is_file():
                others = sorted(p.name for p in path.glob("*.json"))
                hint = "give a folder with a scene.json, or a .json file"
                hint = f"name the file: {path / others[0]}" if others else hint
                raise InputError("the folder has no scene.json", str(path), hint)
            return file
        if path.is_file():
            return path
        if path.exists():
            raise InputError("neither a folder nor a file", str(path), "give a scene's folder or its .json file")
        near = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be opened: {error}", str(path), "check the path") from None
    hint = did_you_mean(path.name, near[:200]) if near else "check the path"
    raise InputError("no such file or folder", str(path), hint if hint.startswith("did") else "check the path")


def _check_output(description: SceneDescription) -> None:
    name = Path(description.output.filename)
    if not description._allow_outside and (name.is_absolute() or ".." in name.parts or "\\" in str(name)):
        raise InputError(
            f"the picture '{name}' would be written outside the folder",
            description.where("/output/filename"),
            "give a plain file name, or use --allow-outside",
        )


def _check_material(description: SceneDescription, where: str, material: MaterialPart) -> list[tuple[str, str]]:
    """The warnings about a material, as pairs (JSON pointer relative to the material, text).

    Raises InputError if the material is invalid.
    """
    warnings = [("", f"{material._source}: {notice}") for notice in material._notices]
    for name, (value, key, _) in material.arguments().items():
        parameter = material.model.parameters()[name]
        if parameter.numeric and any(number > parameter.high for number in numbers_in(value)):
            told = f"{name} over {parameter.high:g}: the material reflects more light than it receives"
            warnings.append((f"/{key}", told))
    for key in material.lab.ignored if material.lab else ():
        if material.get(key) is not None:
            warnings.append((f"/{key}", f"ignored, as in the lab; 'gonio-{material.model.name}' uses it"))
    try:
        outside.probe(material.instance(description.locate, where))
    except InputError as error:
        raise InputError(error.what, description.where(where), error.hint or f"see {error.where}") from None
    return warnings


def parts(part: Part) -> Iterator[tuple[str, Part]]:
    """Every object of a scene with its JSON pointer, in the order of the keys in the file; parents come first."""
    todo = [("", part)]
    while todo:
        steps, part = todo.pop()
        yield steps, part
        below: list[tuple[str, Part]] = []
        for name, value in part.__dict__.items():
            if type(value) in _LEAVES:
                continue
            if isinstance(value, Part):
                below.append((steps + _key(type(part), name), value))
            elif isinstance(value, (list, tuple)):
                for index, item in enumerate(value):
                    if type(item) not in _LEAVES and isinstance(item, Part):
                        below.append((f"{steps}{_key(type(part), name)}/{index}", item))
        todo += reversed(below)


_LEAVES = frozenset((float, int, str, bool, type(None)))  # the types of most values in a large scene


@functools.cache
def _key(part: type[Part], field: str) -> str:
    """The key of a field as a JSON pointer."""
    return pointer(part.model_fields[field].alias or field)


def sources(description: SceneDescription) -> tuple[Callable[[], str], dict[str, Path]]:
    """A function that returns the scene as text, including overrides, and the files that the scene uses.

    The files are textures, meshes, documents and Python files, by their names in the scene.
    """
    named: dict[str, Path] = {}
    folder = description.folder.resolve()
    for where, part in parts(description):
        if (name := part.__dict__.get("file")) is not None:
            named[str(name)] = description.locate(name, f"{where}/file")
        if isinstance(part, MaterialPart) and part._source:
            named[part._source] = description.locate(part._source, where)
        if isinstance(part, MaterialPart):
            for code in part.code():
                near = code.is_relative_to(folder)
                named[code.relative_to(folder).as_posix() if near else str(code)] = code

    def text() -> str:
        return json.dumps(
            description.raw, sort_keys=True, default=lambda part: part.model_dump_json(by_alias=True, warnings=False)
        )

    return text, named


# ---------------------------------------------------------------------- pydantic's errors as InputErrors


def explain(error: ValidationError, raw: Json, file: Path) -> InputError:
    """Convert the errors of a validation to one InputError.

    The first error determines the location, the problem and the hint. Each of the next few errors is a line with the
    hint in parentheses.
    """
    problems: dict[str, tuple[str, str]] = {}
    for detail in error.errors(include_url=False):
        where, what, hint = _one(detail, raw)
        problems.setdefault(where, (what, hint))
    (where, (what, hint)), *others = problems.items()
    lines = [what]
    lines += [
        f"also {file}#{place}: {text}{f' ({tip})' if tip else ''}" for place, (text, tip) in others[: MAX_SHOWN - 1]
    ]
    if len(others) >= MAX_SHOWN:
        lines.append(f"and {len(others) - MAX_SHOWN + 1} more")
    return InputError("\n  ".join(lines), f"{file}#{where}", hint)


# hints for types of other programs, for which suggesting the most similar name would be misleading
ELSEWHERE = {
    "pointLight": "write 'spotLight', which shines equally in all directions",
    "point": "write 'spotLight', which shines equally in all directions",
}


# objects for which a string can only be meant as the value of one key
KEY_OF_STRING = {"output": "filename", "integrator": "type"}


def _type_of(file: str) -> str:
    """The type of the material or shape in a file, judging by its suffix."""
    from ..catalog import documents  # imported here, because most scenes do not need readers of files
    from ..measure import names_table

    for document in documents.Document.family.all().values():
        if file.lower().endswith(document.suffixes):
            return document.name
    return "measured" if names_table(file) else {".obj": "mesh", ".ply": "mesh"}.get(Path(file).suffix, "shader")


def _one(detail: ErrorDetails, raw: Json) -> tuple[str, str, str]:
    """The JSON pointer, problem and hint for one of pydantic's errors."""
    kind, context = detail["type"], detail.get("ctx", {})
    steps, value = _place(detail["loc"], raw, keep_last=kind == "missing")
    got = kind_of(value)
    more: tuple[str, ...] = ()
    hint = "`gonio schema` lists every key"
    if kind == "scene":
        what, hint = context["what"], context["hint"]
        more = (context["key"],) if context["key"] else ()
    elif kind == "unknown_key":
        what = f"unknown key '{context['key']}' of {context['of']}"
        hint, more = did_you_mean(context["key"], context["known"]), (context["key"],)
    elif kind == "missing":
        *steps, last = steps
        what = f"key '{last}' is missing"
        hint = f'add "{last}"'
    elif kind == "expected":
        what, hint = f"expected {detail['msg']}, got {got}", _unquote(value) or f"give {detail['msg']}"
    elif kind == "union_tag_invalid":
        tag = str(context["tag"])
        known = [name for item in context["expected_tags"].split(",") if (name := item.strip(" '")) != OWN]
        hint = ELSEWHERE.get(tag) or (tag not in BY_TYPE and _as_object(tag)) or did_you_mean(tag, _plain(known))
        what, more = f"unknown type '{tag}'", ("type",)
    elif kind == "union_tag_not_found":
        what, hint = "key 'type' is missing", 'add "type": it says what this object is'
        if isinstance(value, dict) and isinstance(file := value.get("file"), str):
            hint = f'add "type": "{_type_of(file)}"'
    elif kind == "literal_error":
        known = [item.strip(" '") for item in context["expected"].replace(" or ", ", ").split(",")]
        what = f"expected {context['expected']}, got {got}"
        hint = did_you_mean(value, known) if isinstance(value, str) else "one of the names listed"
    elif kind in ("float_type", "int_type"):
        what = f"expected a {'whole number' if kind == 'int_type' else 'number'}, got {got}"
        hint = _unquote(value) or "give a number"
    elif kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        sign = {"greater_than": ">", "greater_than_equal": ">=", "less_than": "<", "less_than_equal": "<="}[kind]
        limit = next(context[name] for name in ("gt", "ge", "lt", "le") if name in context)
        what, hint = f"expected a number {sign} {limit:g}, got {value}", f"give a number {sign} {limit:g}"
    elif kind in ("model_type", "model_attributes_type", "dict_type", "dataclass_type"):
        key = KEY_OF_STRING.get(str(steps[-1])) if steps and isinstance(value, str) else None
        hint = f'write {{"{key}": "{value}"}}' if key else _as_object(value) or "put it in { }"
        what = f"expected an object {{...}}, got {got}"
    elif kind == "list_type":
        what, hint = f"expected a list [...], got {got}", "put it in [ ]"
    elif kind == "bool_type":
        what, hint = f"expected true or false, got {got}", "without quotes"
    elif kind == "string_type":
        what, hint = f"expected a string, got {got}", "put it in double quotes"
    elif kind == "string_too_short":
        what, hint = "expected a name, got an empty string", "give a file name"
    else:
        what = f"{detail['msg'][0].lower()}{detail['msg'][1:]}, got {got}"
    return pointer(*steps, *more), what, hint


def _as_object(value: Json) -> str:
    """A hint for a name of a material, class or file where an object is expected; "" for other values."""
    if not isinstance(value, str):
        return ""
    name, bracket, _ = value.partition("(")
    if outside.names_code(value):
        return f'write {{"type": "{value}"}}, and allow it with --allow-code'
    if texts.summands(value):
        return 'write {"type": "sum", "a": {...}, "b": {...}}, with an object for each part'
    if name in BY_TYPE:
        return f'write {{"type": "{name}"{", ..." if bracket else ""}}}, with its parameters as keys'
    return f'write {{"type": "{_type_of(value)}", "file": "{value}"}}' if Path(value).suffix and not bracket else ""


def _plain(known: list[str]) -> list[str]:
    """One spelling of each name, without underscores and without the prefix "gonio-"."""
    return [name for name in known if "_" not in name and not name.startswith("gonio-")]


def _unquote(value: Json) -> str:
    try:
        return f"write {float(value):g} without quotes" if isinstance(value, str) else ""
    except ValueError:
        return ""


def _place(location: tuple[str | int, ...], raw: Json, keep_last: bool) -> tuple[list[str | int], Json]:
    """The path to a value in the file, without the union tags that pydantic adds to locations, and the value."""
    steps: list[str | int] = []
    value = raw
    for index, step in enumerate(location):
        # A tag equals the `type` of the object, and no key has the name of a type.
        in_object = isinstance(value, dict) and step in value and step != value.get("type")
        in_list = isinstance(value, list) and isinstance(step, int) and step < len(value)
        if in_object or in_list:
            value = value[step]  # type: ignore[index, call-overload]
        elif not (keep_last and index == len(location) - 1):
            continue
        steps.append(step)
    return steps, value
