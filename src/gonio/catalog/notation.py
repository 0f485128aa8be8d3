"""The notation of materials on the command line: a material as text, with parameters and nested materials.

    conductor                                   the name of a model
    ward.py:Ward                                a class in a Python file, which is run because the user has named it
    gold.binary                                 a file of measured values
    chest.gltf:Wood                             a material of a glTF file, without its images (`documents`)
    gold.json                                   a result of `gonio fit`, or a material as JSON
    lambert+ggx                                 a sum; ggx and beckmann are lobes with Schlick's Fresnel term
    alum-bronze                                 a material of the library (`gonio models --library`), default fit
    alum-bronze:low2012/lowsmooth_E2            the same material with another published fit
    conductor(alpha=0.3,preset=Au)              a model with parameters; a comma before NAME= separates parameters
    kulla-conty(base=conductor,base.alpha=0.3)  a parameter of a nested material, by its path; the order is arbitrary
    gold.json(k=0)                              a parameter by its name, if only one nested material has it
    {"type": "conductor", "alpha": [0.1, 0.4]}  JSON, as in a scene

Values are numbers, several numbers ("0.9,0.8,0.7" or [0.9, 0.8, 0.7]), names, true or false, and materials. The default
nested material is a metal with alpha = 0.3; the default first material of a mix is Lambertian.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from ..errors import InputError, did_you_mean
from ..material import tree
from ..material.bsdf import BSDF
from ..material.constructing import WIDTHS, with_pair
from ..material.parameters import ChoiceParameter, IndexParameter, Parameter, Value
from ..ops import backend
from ..optics.indices import DispersiveIndex
from . import documents, outside, texts
from .texts import apart, assignment, class_named, split, taken_apart

Settings: TypeAlias = "tuple[type[BSDF], dict[str, object]]"  # a class and its settings, strings or JSON values
SHOWN = 1000  # maximum number of array entries that are written

__all__ = [
    "Settings", "apart", "as_json", "assignment", "build", "changed", "class_named", "for_files", "from_json", "made",
    "named", "settings", "several", "shared", "spelled", "split", "taken_apart", "typed",
    "written",
]  # fmt: skip


def named(
    text: str, assignments: Sequence[str] = (), preset: str = "", allow_code: bool = False
) -> tuple[BSDF, dict[str, object]]:
    """The material named by a string of the command line, and its settings: values by parameter, including "preset".

    assignments  further settings, each in the form "name=value"
    preset       name of a preset of the material; "" for none
    allow_code   whether a data file may name classes in Python files, which are then run
    Raises InputError for unknown names, with the closest known name, and for values out of range.
    """
    cls, own = taken_apart(text, allow_code=allow_code)
    given = {**own, **dict(map(assignment, assignments))}
    material, values = made(cls, {**given, "preset": preset} if preset else given)
    return outside.probe(material), values


def several(texts: Sequence[str], assignments: Sequence[str], nested: bool = True) -> list[Settings]:
    """The class and settings of each material: its own settings, and the shared settings that apply to it.

    texts        the materials, as on the command line
    assignments  the shared settings, each in the form "name=value"
    nested       as in `shared`
    Raises InputError for a shared setting that applies to none of the materials.
    """
    named = [taken_apart(text) for text in texts]
    return [
        (cls, {**given, **own}) for (cls, own), given in zip(named, shared(named, assignments, nested), strict=True)
    ]


def shared(named: Sequence[Settings], assignments: Sequence[str], nested: bool = True) -> list[dict[str, str]]:
    """The shared settings that apply to each material.

    assignments  the shared settings, each in the form "name=value"
    nested       whether a setting also applies to a material if only a nested material has the parameter
    Raises InputError for a setting that applies to none of the materials.
    """
    wanted = dict(map(assignment, assignments))
    assigned, known = [], set()
    for cls, own in named:
        fits = [name for name in wanted if _has(cls, {**wanted, **own}, name) or (nested and _inside(cls, own, name))]
        assigned.append({name: wanted[name] for name in fits})
        known |= {*fits, *cls.parameters(), *(["preset"] if cls.presets() else [])}
    for name in wanted:
        if name not in known:
            raise InputError(f"unknown parameter '{name}'", f"--param {name}", did_you_mean(name, sorted(known)))
    return assigned


def build(named: Settings) -> BSDF:
    """Build a material from its class and settings, and test it. Raises InputError as `named` does."""
    return outside.probe(made(*named)[0])


def _has(cls: type[BSDF], given: Mapping[str, object], path: str) -> bool:
    """Whether a material of a class has a parameter with the given path; `given` are its settings, as for `made`."""
    name, dot, rest = path.partition(".")
    parameter = cls.parameters().get(_own_name(cls.parameters(), name))
    if name in WIDTHS and parameter is None and "alpha" in cls.parameters():
        return True
    if parameter is None or not dot:
        return parameter is not None or (path == "preset" and bool(cls.presets()))
    if not parameter.inner:
        return False
    below = {key.removeprefix(f"{name}."): value for key, value in given.items() if key.startswith(f"{name}.")}
    inner, own = apart(given.get(name, _inner_default(parameter)), f"--param {name}")
    return _has(inner, {**own, **below}, rest)


def _inside(cls: type[BSDF], given: Mapping[str, object], name: str) -> list[str]:
    """The paths of all parameters with a given name in the nested materials of a class; `given` as for `made`.

    A parameter of a nested material hides those of the same name in the materials nested in it.
    """
    paths: list[str] = []
    for key, parameter in cls.parameters().items() if "." not in name else ():
        if parameter.inner:
            inner, own = apart(given.get(key, _inner_default(parameter)), f"--param {key}")
            places = [name] if name in inner.parameters() else _inside(inner, own, name)
            paths += [f"{key}.{place}" for place in places]
    return paths


def _one_of(owner: str, paths: Sequence[str], name: str) -> str:
    """The only path; "" if there is none. Raises InputError if there are several."""
    if len(paths) > 1:
        what = f"'{name}' of {owner} is ambiguous: {' and '.join(paths)}"
        raise InputError(what, f"--param {name}", f"give one of them, such as --param {paths[0]}=...")
    return paths[0] if paths else ""


def path_of(material: BSDF, name: str) -> str:
    """The path of a parameter that is given by its path, or by its name if only one nested material has it.

    Returns `name` itself if there is no such parameter. Raises InputError if several nested materials have it.
    """
    if "." in name or name in material.parameters():
        return name
    here = {key: getattr(material, key) for key, parameter in material.parameters().items() if parameter.inner}
    return _one_of(material.name, _inside(type(material), here, name), name) or name


def made(cls: type[BSDF], given: Mapping[str, object]) -> tuple[BSDF, dict[str, object]]:
    """The result of `named` for a class and its values, which are strings or other JSON values.

    The key "base.alpha" denotes a parameter of the nested material `base`, and overrides a value given in `base`
    itself.
    """
    known = cls.parameters()
    values: dict[str, object] = {}
    preset = "" if "preset" in known else str(given.get("preset", ""))
    if preset and not cls.presets():
        raise InputError(f"{cls.name} has no presets", "--preset", "give its parameters by --param")
    own, below = _by_level(cls, given)
    for name, value in own.items():
        if not known[name].inner:
            values[name] = typed(known[name], value)
    for name, parameter in known.items():
        if parameter.inner and (parameter.required or name in own or name in below):
            value = own.get(name, _inner_default(parameter))
            values[name] = _inner(value, f"--param {name}", below.get(name, {}))
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
    except Exception as error:  # raised by a user's class
        raise InputError(f"{cls.__name__} cannot be constructed: {type(error).__name__}: {error}", "TARGET") from None


def _own_name(known: Mapping[str, Parameter], name: str) -> str:
    """The name of a parameter, including the underscore that it has if materials have a member with this name."""
    return f"{name}_" if name not in known and f"{name}_" in known else name


def _by_level(cls: type[BSDF], given: Mapping[str, object]) -> tuple[dict[str, object], dict[str, dict[str, object]]]:
    """The settings of a material itself, and those of each nested material, by parameter.

    Raises InputError for unknown names.
    """
    known = cls.parameters()
    given = with_pair(known, {_own_name(known, name): value for name, value in given.items()}, "--param")
    own: dict[str, object] = {}
    below: dict[str, dict[str, object]] = {}
    for path, value in given.items():
        name, dot, rest = path.partition(".")
        if path in known:
            own[path] = value
        elif dot and name in known:
            if not known[name].inner:
                what = f"'{name}' of {cls.name} is not a material, and has no '{rest}'"
                raise InputError(what, f"--param {path}", f"give --param {name}=...")
            below.setdefault(name, {})[rest] = value
        elif path != "preset" and (inner := _one_of(cls.name, _inside(cls, given, path), path)):
            name, _, rest = inner.partition(".")
            below.setdefault(name, {}).setdefault(rest, value)
        elif path != "preset":
            hint = did_you_mean(name, [*known, *(["preset"] if cls.presets() else [])])
            raise InputError(f"{cls.name} has no parameter '{name}'", f"--param {path}", hint)
    return own, below


def typed(parameter: Parameter, value: Value) -> object:
    """Convert a string or another JSON value to the value of a parameter."""
    where = f"--param {parameter.name}"
    if parameter.inner:
        return _inner(value, where, {})
    if parameter.kind == "file":
        return value
    if parameter.kind == "choice":
        name = value.strip().strip('"') if isinstance(value, str) else value
        # the distribution or masking term of a user
        family = getattr(parameter, "family", None)
        return outside.option(name, where, family) if isinstance(name, str) else name
    if parameter.kind == "flag":
        if str(value).lower() not in ("true", "false"):
            raise InputError(f"'{value}' given, true or false expected", where)
        return str(value).lower() == "true"
    if isinstance(parameter, IndexParameter) and isinstance(value, str) and value.strip(' "')[:1].isalpha():
        return parameter.coerce(value.strip(' "'), where)
    if isinstance(value, np.ndarray | DispersiveIndex) or backend.is_drjit(value):
        return value  # one value per ray, or a curve, which only programs can give
    try:
        parts = value.strip(" []()").split(",") if isinstance(value, str) else value
        numbers = [float(part) for part in (parts if isinstance(parts, list | tuple) else [parts])]
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"'{value}' given, a number expected", where, parameter.range) from None
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def written(value: Value) -> str:
    """A value as a string that `typed` accepts.

    A material is written with its non-default parameters. Of an array with one value per ray, only the shape is
    written.
    """
    if isinstance(value, BSDF):
        inner = ",".join(f"{name}={setting(value, name, v)}" for name, v in settings(value).items())
        return f"{spelled(type(value))}({inner})" if inner else spelled(type(value))
    if isinstance(value, bool | np.bool_):
        return str(bool(value)).lower()
    if isinstance(value, DispersiveIndex):
        return value.constants.name
    if np.ndim(value):
        array = np.asarray(value)
        if array.size > SHOWN:
            return f"an array of shape {array.shape}"
        return ",".join(f"{v:.6g}" for v in array.ravel())
    if isinstance(value, float | int | np.floating | np.integer):
        return f"{value:.6g}"
    return str(value)


def setting(material: object, path: str, value: Value) -> str:
    """The value of a material's parameter as a string that `typed` accepts in any process.

    It is that of `written`, but FILE.py:NAME for a distribution or another member that only this program has
    registered.

    path  path of the parameter, such as "alpha" or "base.ndf"
    """
    above, _, name = path.rpartition(".")
    owner = tree.value_at(material, above) if above and isinstance(material, BSDF) else material
    parameter = owner.parameters().get(name) if isinstance(owner, BSDF) else None
    return parameter.spelled(value) if isinstance(parameter, ChoiceParameter) else written(value)


def as_json(material: BSDF) -> dict[str, object]:
    """The material as JSON, without rounding, such as {"type": "conductor", "alpha": 0.3}; `made` accepts the values.

    File paths are absolute, because the JSON may be read in another folder.
    Raises InputError for a class without a file, and for values that JSON cannot express.
    """
    notation: dict[str, object] = {"type": spelled(type(material))}
    if type(material).spelling:
        notation = {"type": texts.SHADER, "file": type(material).spelling}
    elif notation["type"] != type(material).name and ":" not in str(notation["type"]):
        what = f"the class {type(material).__name__} is defined only in this program"
        raise InputError(what, "material", "put it into a file, and name it FILE.py:CLASS")
    for name, value in settings(material).items():
        if isinstance(value, BSDF):
            notation[name] = as_json(value)
        elif material.parameters()[name].kind == "file":
            notation[name] = os.path.abspath(os.path.expanduser(value))
        elif isinstance(value, bool | str):
            parameter = material.parameters()[name]
            notation[name] = parameter.spelled(str(value)) if isinstance(parameter, ChoiceParameter) else value
        elif isinstance(value, DispersiveIndex):
            notation[name] = value.constants.name
        else:
            try:
                notation[name] = np.asarray(value, float).tolist()
            except (TypeError, ValueError):
                raise InputError(f"{name} = {value!r} is not a number", "material", "give numbers") from None
    return notation


def for_files(material: BSDF) -> dict[str, object] | None:
    """The material as JSON for result files, with the type names of scene files; None if it cannot be expressed."""
    try:
        return documents.for_scenes(as_json(material))
    except InputError:
        return None


def from_json(described: Mapping[str, object]) -> BSDF:
    """The material from the result of `as_json`. Raises InputError for other values."""
    if not isinstance(described, Mapping) or "type" not in described:
        raise InputError(f"{described!r:.60} does not describe a material", "material", 'such as {"type": "conductor"}')
    fields = dict(described)
    return made(class_named(texts.named_by(fields), "material"), fields)[0]


def settings(material: BSDF) -> dict[str, Value]:
    """The non-default parameters of a material, by name."""
    values = {}
    for name, parameter in material.parameters().items():
        value = getattr(material, name)
        if parameter.required or not _same(value, parameter.default):
            values[name] = value
    return values


def _same(a: object, b: object) -> bool:
    if isinstance(a, DispersiveIndex) or isinstance(b, DispersiveIndex):
        return a == b
    try:
        return bool(np.all(np.asarray(a) == np.asarray(b)))
    except (TypeError, ValueError):
        return False


def _inner(value: Value, where: str, below: Mapping[str, object]) -> BSDF:
    """The nested material that a string or JSON describes, with additional settings."""
    if isinstance(value, BSDF):
        return (
            value
            if not below
            else tree.replace(
                value,
                {path_of(value, path): _typed_at(value, path_of(value, path), v) for path, v in below.items()},
                where,
            )
        )
    cls, own = apart(value, where)
    return made(cls, {**own, **below})[0]


def _inner_default(parameter: Parameter) -> Value:
    """The default nested material of a parameter."""
    if not parameter.required:
        return parameter.default
    return "lambert" if parameter.name == "a" else "conductor(alpha=0.3)"


def _typed_at(material: BSDF, path: str, value: Value) -> object:
    """Convert a value for the parameter at a path. Raises InputError if there is no such parameter."""
    name, dot, rest = path.partition(".")
    parameter = material.parameters().get(name)
    if parameter is None or (dot and not parameter.inner):
        known = [leaf.path for leaf in tree.leaves(material)]
        raise InputError(f"{material.name} has no parameter '{path}'", f"--param {path}", did_you_mean(path, known))
    return _typed_at(getattr(material, name), rest, value) if dot else typed(parameter, value)


def changed(material: BSDF, values: Mapping[str, object]) -> BSDF:
    """The material with some parameters replaced. Raises InputError for invalid values.

    values  strings or other JSON values, by the path of the parameter
    """
    return _inner(material, "material", values)


def spelled(cls: type[BSDF]) -> str:
    """The string that names a class: the name of a material, FILE.py:CLASS, or the file of a shader."""
    if cls.spelling:
        return cls.spelling
    if BSDF.family.all().get(cls.name) is cls:
        return cls.name
    try:
        return f"{inspect.getsourcefile(cls)}:{cls.__qualname__}"
    except (TypeError, OSError):
        return cls.__qualname__
