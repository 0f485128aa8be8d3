"""Materials as text: how the command line names one, with its parameters, and a material in a material.

    conductor                                   its name; parameters follow as NAME=VALUE
    ward.py:Ward                                a class in a Python file, which runs because the user named it
    gold.binary                                 a file of measured values
    chest.gltf:Wood                             a material of a glTF file, with its numbers (`documents`)
    alum-bronze                                 a material of the library (`gonio models --library`), by its default fit
    alum-bronze:low2012/lowsmooth_E2            the same by another published fit
    conductor(alpha=.3,preset=Au)               all in one; a comma parts them where a name and = follow
    {"type": "conductor", "alpha": [.1, .4]}    as in a scene

Values are numbers, "0.9,0.8,0.7" or [.9, .8, .7] for several, names, true or false, and materials again. A material
inside that is not given is metal of alpha .3, and the first of a mix Lambert's.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import InputError, did_you_mean
from ..material import is_model, model, tree
from ..material.bsdf import BSDF
from ..material.parameters import IndexParameter, Parameter, Value
from ..optics.indices import DispersiveIndex
from . import documents, library, outside

_CALL = re.compile(r"\s*([\w-]+(?::[\w/-]+)?|[^({]+\.py:\w+)\s*(?:\((.*)\))?\s*", re.DOTALL)
_SETTINGS = re.compile(r"\(\s*\w+\s*=.*\)\s*\Z", re.DOTALL)  # at a text's end


def material(name: str, fit: str = "", **parameters: Value) -> BSDF:
    """A named material, `material("alum-bronze")`, by one of the published fits; or one of a file, "chest.gltf:Wood".

    name        of the MERL database, or `NAME:FILE/FIT`; `materials()` lists them. Or a file in which another program
                describes materials, behind a colon which, where it holds several
    fit         FILE/FIT; Bagher2012's if not given
    parameters  in place of the fitted ones
    Raises InputError, with the nearest known name, where it is unknown or the paper left the material out, and for a
    file that cannot be read; GonioWarning for what a file has and Gonio's materials do not.
    """
    if documents.names_document(name) and not library.knows(name):
        cls, given = taken_apart(name, "material")
        return made(cls, {**given, **parameters})[0]
    cls, preset = library.named(f"{name}:{fit}" if fit else name)
    return cls.preset(preset, **parameters)


def assignment(text: str, option: str = "--param") -> tuple[str, str]:
    """("alpha", ".3") of "alpha=.3"."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise InputError(f"'{text}' sets nothing, NAME=VALUE expected", option, "such as alpha=0.3")
    return name.strip(), value.strip()


def named(text: str, assignments: Sequence[str] = (), preset: str = "") -> tuple[BSDF, dict[str, object]]:
    """A material as the command line names it, and what was set: values by parameter, "preset" among them.

    assignments  "name=value" each
    Raises InputError, with the nearest known spelling, for what is unknown or out of range.
    """
    cls, own = taken_apart(text)
    given = {**own, **dict(map(assignment, assignments))}
    material, values = made(cls, {**given, "preset": preset} if preset else given)
    return outside.probe(material), values


def several(texts: Sequence[str], assignments: Sequence[str]) -> list[tuple[type[BSDF], dict[str, object]]]:
    """Of each text the class and what is set of it: its own settings, and of the shared ones those that it has.

    assignments  "name=value" each, shared by all; InputError for one that no material has
    """
    shared = dict(map(assignment, assignments))
    found, known = [], set()
    for text in texts:
        cls, own = taken_apart(text)
        fits = {*cls.parameters(), *(["preset"] if cls.presets() else [])}
        found.append((cls, {**{name: value for name, value in shared.items() if name in fits}, **own}))
        known |= fits
    for name in shared:
        if name not in known:
            raise InputError(f"unknown parameter '{name}'", f"--param {name}", did_you_mean(name, sorted(known)))
    return found


def made(cls: type[BSDF], given: Mapping[str, object]) -> tuple[BSDF, dict[str, object]]:
    """As `named`, of a class; a value is text, or what JSON has for it."""
    known = cls.parameters()
    values: dict[str, object] = {}
    preset = "" if "preset" in known else str(given.get("preset", ""))
    if preset and not cls.presets():
        raise InputError(f"{cls.name} has no presets", "--preset", "give its parameters by --param")
    for name, value in given.items():
        if name in known:
            values[name] = typed(known[name], value)
        elif name != "preset":
            hint = did_you_mean(name, [*known, *(["preset"] if cls.presets() else [])])
            raise InputError(f"{cls.name} has no parameter '{name}'", f"--param {name}", hint)
    for name, parameter in known.items():
        if parameter.inner and parameter.required and name not in values:
            values[name] = model("lambert")() if name == "a" else model("conductor")(alpha=0.3)  # type: ignore[call-arg]
    if preset:
        return cls.preset(preset, **values), {"preset": preset, **values}
    missing = [name for name, parameter in known.items() if parameter.required and name not in values]
    if missing:
        hint = "give --preset, such as Au, or " if cls.presets() else "give "
        hint += " ".join(f"--param {name}=..." for name in missing)
        raise InputError(f"{cls.name} needs {', '.join(missing)}", "--param", hint)
    try:
        return cls(**values), values
    except InputError:
        raise
    except Exception as error:  # a user's own class
        raise InputError(f"{cls.__name__} cannot be made: {type(error).__name__}: {error}", "TARGET") from None


def typed(parameter: Parameter, value: Value) -> object:
    """A parameter's value from text, or from what JSON has for it."""
    where = f"--param {parameter.name}"
    if parameter.inner:
        return _inner(value, where)
    if parameter.kind == "file":
        return value
    if parameter.kind == "choice":
        name = value.strip().strip('"') if isinstance(value, str) else value
        # a distribution or a masking term of the user's own
        return outside.member(name, where=where) if isinstance(name, str) and outside.names_code(name) else name
    if parameter.kind == "flag":
        if str(value).lower() not in ("true", "false"):
            raise InputError(f"'{value}' given, true or false expected", where)
        return str(value).lower() == "true"
    if isinstance(parameter, IndexParameter) and isinstance(value, str) and value.strip(' "')[:1].isalpha():
        return parameter.coerce(value.strip(' "'), where)
    try:
        parts = value.strip(" []()").split(",") if isinstance(value, str) else value
        numbers = [float(part) for part in (parts if isinstance(parts, list | tuple) else [parts])]
    except (TypeError, ValueError):
        raise InputError(f"'{value}' given, a number expected", where, parameter.range) from None
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def written(value: Value) -> str:
    """A value as `typed` takes it, a material with the parameters that are not the default."""
    if isinstance(value, BSDF):
        inner = ",".join(f"{name}={written(v)}" for name, v in settings(value).items())
        return f"{spelled(type(value))}({inner})" if inner else spelled(type(value))
    if isinstance(value, bool | np.bool_):
        return str(bool(value)).lower()
    if isinstance(value, DispersiveIndex):
        return value.constants.name
    if np.ndim(value):
        return ",".join(f"{v:.6g}" for v in np.asarray(value).ravel())
    if isinstance(value, float | int | np.floating | np.integer):
        return f"{value:.6g}"
    return str(value)


def as_json(material: BSDF) -> dict[str, object]:
    """The material as JSON has it, to the last digit: {"type": "conductor", "alpha": 0.3}; `made` takes the values.

    Raises InputError for a class that no file holds, and for values that JSON has no word for.
    """
    found: dict[str, object] = {"type": spelled(type(material))}
    if found["type"] != type(material).name and ":" not in str(found["type"]):
        what = f"the class {type(material).__name__} is known to this program alone"
        raise InputError(what, "material", "put it into a file, and name it FILE.py:CLASS")
    for name, value in settings(material).items():
        if isinstance(value, BSDF):
            found[name] = as_json(value)
        elif isinstance(value, bool | str):
            found[name] = value
        elif isinstance(value, DispersiveIndex):
            found[name] = value.constants.name
        else:
            try:
                found[name] = np.asarray(value, float).tolist()
            except (TypeError, ValueError):
                raise InputError(f"{name} = {value!r} is no number", "material", "give numbers") from None
    return found


def from_json(described: Mapping[str, object]) -> BSDF:
    """The material that `as_json` describes."""
    fields = dict(described)
    return made(class_named(str(fields.pop("type")), "material"), fields)[0]


def settings(material: BSDF) -> dict[str, Value]:
    """The parameters that are not the default, by name."""
    found = {}
    for name, parameter in material.parameters().items():
        value = getattr(material, name)
        if parameter.required or not _same(value, parameter.default):
            found[name] = value
    return found


def _same(a: object, b: object) -> bool:
    if isinstance(a, DispersiveIndex) or isinstance(b, DispersiveIndex):
        return a == b
    try:
        return bool(np.all(np.asarray(a) == np.asarray(b)))
    except (TypeError, ValueError):
        return False


def _inner(value: Value, where: str) -> BSDF:
    if isinstance(value, str) and not value.lstrip().startswith("{"):
        return made(*taken_apart(value.strip().strip('"'), where))[0]
    try:
        fields = dict(json.loads(re.sub(r"(?<![\w.])\.(?=\d)", "0.", value)) if isinstance(value, str) else value)
        name = str(fields.pop("type"))
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
        raise _no_material(value, where) from None
    cls, preset = class_and_preset(name, where)
    return made(cls, {"preset": preset, **fields} if preset else fields)[0]


def class_named(name: str, where: str = "MODEL") -> type[BSDF]:
    """The class of a name, or of FILE.py:CLASS."""
    return class_and_preset(name, where)[0]


def names_material(name: str) -> bool:
    """Whether a name, without parameters, is meant for a material: known, code, or nearest to one of the library."""
    return outside.names_code(name) or is_model(name) or library.resembles(name)


def class_and_preset(name: str, where: str = "MODEL") -> tuple[type[BSDF], str]:
    """The class of a name, of FILE.py:CLASS or of a material of the library, of which the preset too; "" for none.
    InputError, with the nearest known name, where there is nothing of that name."""
    if outside.names_code(name):
        return outside.load(name, where=where), ""
    if not is_model(name) and (":" in name or library.resembles(name)):
        return library.named(name, where)
    return model(name), ""


def spelled(cls: type[BSDF]) -> str:
    """How a text names a class: a material's name, or FILE.py:CLASS."""
    if BSDF.family.all().get(cls.name) is cls:
        return cls.name
    try:
        return f"{inspect.getsourcefile(cls)}:{cls.__qualname__}"
    except (TypeError, OSError):
        return cls.__qualname__


def taken_apart(text: str, where: str = "MODEL") -> tuple[type[BSDF], dict[str, object]]:
    """The class and the text of each parameter of NAME, FILE or NAME(parameter=value,...); of a document's material
    what JSON has for them."""
    if text.count("(") + text.count("{") > tree.MAX_MATERIALS:
        raise InputError(f"more than {tree.MAX_MATERIALS} materials inside each other", where, "mix fewer materials")
    head = text.strip()
    while True:  # a file's name may have brackets in it
        reader = outside.reader_of(head)
        document = documents.names_document(head) and not _SETTINGS.search(head)
        if reader is not None or document:
            given: dict[str, object] = {"file": head} if reader is not None else documents.without_pictures(head)
            cls = reader if reader is not None else class_named(str(given.pop("type")), where)
            given.update(assignment(part, where) for part in _parts(text.strip()[len(head) :].strip("() ")))
            return cls, given
        head, bracket, _ = head.rpartition("(")
        if not bracket:
            break
    match = _CALL.fullmatch(text)
    if not match or re.fullmatch(r"[\d.-]+", match[1]):
        raise _no_material(text, where)
    own: dict[str, object] = dict(assignment(part, where) for part in _parts(match[2] or ""))
    cls, preset = class_and_preset(match[1], where)
    return cls, {"preset": preset, **own} if preset else own


def _parts(text: str) -> list[str]:
    """At commas outside of brackets, where a name and = follow; any other comma is part of a colour."""
    parts, depth, start = [], 0, 0
    for at, letter in enumerate(text):
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and depth == 0 and re.match(r",\s*[A-Za-z_]\w*\s*=", text[at:]):
            parts.append(text[start:at])
            start = at + 1
    return [part for part in [*parts, text[start:]] if part.strip()]


def _no_material(value: object, where: str) -> InputError:
    if str(value).endswith(".py"):
        return InputError(f"'{value}' names a file, but no class in it", where, f"give {value}:CLASS")
    hint = 'such as lambert, \'conductor(alpha=.3,preset=Au)\' or \'{"type": "conductor", "preset": "Au"}\''
    return InputError(f"'{value}' is no material", where, hint)
