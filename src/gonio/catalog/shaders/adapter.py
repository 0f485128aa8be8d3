"""The meanings of a shader's functions and uniforms, from a short TOML file beside the shader, FILE.toml, or guessed.

function = "BRDF"                       # f, a color or a number
arguments = ["light", "view", "normal"] # the meaning of each argument
cosine = false                          # whether the function includes |cos theta_i|
albedo = "sheenAlbedo"                  # a function of the view that returns the integral of the BRDF
lossless_tolerance = 0.02               # the largest intended loss in a white furnace

[parameters.roughness]                  # a uniform, or an argument
default = 0.5
low = 0.0
high = 1.0
unit = "nm"                             # the unit in plots and at sliders
doc = "width of the lobe"

[textures.table]
file = "table.npy"                      # (rows, columns, channels); or numbers without a header, .f32 and .f16
wrap = "clamp"
filter = "linear"
"""

from __future__ import annotations

import math
import re
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ...errors import InputError, did_you_mean
from ...spirv.images import FILTERS, WRAPS

MEANINGS = {
    "light": "unit vector toward the light",
    "view": "unit vector toward the viewer",
    "incident": "unit vector in the direction in which the light travels, -light",
    "normal": "surface normal, (0, 0, 1)",
    "tangent": "(1, 0, 0)",
    "bitangent": "(0, 1, 0)",
    "half": "unit vector between light and view",
    "n.l": "cosine between light and normal",
    "n.v": "cosine between view and normal",
    "n.h": "cosine between half vector and normal",
    "l.h": "cosine between light and half vector",
    "l.v": "cosine between light and view",
    "u": "three random numbers, for `sample`",
    "derived": "result of the function `derive` for the parameters",
    "result": "argument to which a function without a return value writes its result, such as `out vec3 color`",
    "ignored": "additional output of the function, which is not used",
    "parameter": "a parameter of the material; for a struct, every member is a parameter",
}
# names of arguments, in lower case and without prefixes, by meaning
_GUESSES = {
    "light": ("l", "wi", "light", "lightdir", "lightdirection", "ldir", "tolight", "omegai", "dirl"),
    "view": ("v", "wo", "view", "viewdir", "viewdirection", "eye", "eyedir", "vdir", "toeye", "toview", "omegao"),
    "normal": ("n", "normal", "shadingnormal", "surfacenormal", "norm", "ns"),
    "tangent": ("x", "t", "tangent"),
    "bitangent": ("y", "b", "bitangent", "binormal"),
    "half": ("h", "half", "halfvector", "halfdir", "m"),
    "n.l": ("ndotl", "nol", "nl", "dotnl", "ldotn"),
    "n.v": ("ndotv", "nov", "nv", "dotnv", "vdotn"),
    "n.h": ("ndoth", "noh", "nh", "dotnh", "hdotn"),
    "l.h": ("ldoth", "loh", "vdoth", "voh", "lh", "dotlh", "dotvh", "hdotv", "hdotl", "hol", "hov"),
    "l.v": ("ldotv", "lov", "vdotl", "vol", "lv", "vl", "dotlv", "dotvl"),
    "u": ("u", "xi", "rand", "random", "rnd"),
}
_BY_NAME = {name: meaning for meaning, names in _GUESSES.items() for name in names}
MAX_TOML = 1 << 18


@dataclass(frozen=True)
class Uniform:
    """The description of a parameter in the adapter. Missing entries are determined from the shader.

    kind  for a vector with two components: "alpha" for widths along x and y, or "angle" for cosine and sine; "fixed"
          for a parameter that keeps its default
    """

    default: Any = None
    low: float | None = None
    high: float | None = None
    unit: str = ""
    doc: str = ""
    kind: str = ""


@dataclass(frozen=True)
class Adapter:
    """The meanings of the functions and uniforms of a shader, see the docstring of this module.

    pdf, sample         names of functions; "" for none
    pdf_arguments, sample_arguments  meanings of the arguments of these functions
    derive              name of a function that depends only on the parameters, and whose result is passed to other
                        functions as the argument "derived"
    struct              type of the first argument, which distinguishes overloads; only for shaders from `gonio emit`
    albedo              name of a function that returns the albedo for the view direction; "" for none
    albedo_tolerance    intended error of this function
    lossless_tolerance  intended loss in a white furnace; None if the shader makes no claim
    includes            folders, relative to the shader, from which it may include files
    defines             macros
    where               name of the adapter file in errors
    unset_is_zero       whether variables and inputs that are never set are 0; otherwise, reading one is an error
    """

    function: str = ""
    arguments: tuple[str, ...] = ()
    cosine: bool | None = None
    pdf: str = ""
    pdf_arguments: tuple[str, ...] = ()
    sample: str = ""
    sample_arguments: tuple[str, ...] = ()
    derive: str = ""
    derive_arguments: tuple[str, ...] = ()
    struct: str = ""
    albedo: str = ""
    albedo_arguments: tuple[str, ...] = ()
    albedo_tolerance: float = 0.01
    lossless_tolerance: float | None = None
    transmits: bool = False
    unset_is_zero: bool = False
    language: str = ""
    doc: str = ""
    includes: tuple[str, ...] = ()
    defines: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Uniform] = field(default_factory=dict)
    textures: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    where: str = ""


def meaning_of(name: str) -> str:
    """The meaning of an argument, from its name; "parameter" for unknown names."""
    plain = re.sub(r"^(?:in|a|p|u|f)_|_(?:ws|ts|dir|vec)$|_", "", name.lower())
    return _BY_NAME.get(name.lower(), _BY_NAME.get(plain, "parameter"))


def read(path: Path) -> Adapter:
    """Read an adapter from a TOML file. Raises InputError, which states what is accepted, for invalid entries."""
    try:
        if path.stat().st_size > MAX_TOML:
            raise InputError(f"larger than {MAX_TOML} bytes", str(path), "an adapter is a short file")
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"not an adapter: {error}", str(path), "write TOML as `gonio adopt` does") from None
    return parsed(content, str(path))


KINDS: dict[str, type] = {
    "function": str, "arguments": list, "cosine": bool, "pdf": str, "pdf_arguments": list, "sample": str,
    "sample_arguments": list, "derive": str, "derive_arguments": list, "struct": str, "transmits": bool,
    "unset_is_zero": bool, "language": str, "doc": str, "includes": list, "defines": dict,
    "parameters": dict, "textures": dict,
    "albedo": str, "albedo_arguments": list, "albedo_tolerance": float, "lossless_tolerance": float,
}  # fmt: skip


def parsed(content: Mapping[str, Any], where: str, over: Adapter | None = None) -> Adapter:
    """The adapter from the keys and values of a TOML file.

    where  name of the file in errors
    over   an adapter from which missing entries are copied
    Raises InputError, which states what is accepted, for unknown keys and values of the wrong type.
    """
    over = Adapter() if over is None else over
    fields: dict[str, Any] = {"where": where}
    for key, value in content.items():
        if key not in KINDS:
            raise InputError(f"unknown key '{key}'", where, did_you_mean(key, list(KINDS)))
        number = KINDS[key] is float and isinstance(value, int | float) and not isinstance(value, bool)
        if not number and not isinstance(value, KINDS[key]):
            what = f"{key} = {value!r:.40}, a {KINDS[key].__name__} expected"
            raise InputError(what, where, "see `gonio adopt FILE`")
        if isinstance(value, int | float) and number and not 0.0 <= value < 1.0:
            raise InputError(f"{key} = {value!r:.40}", where, "give a share of the light, 0 to 1")
        fields[key] = _READERS.get(key, _as_is)(key, value, where, over)
    return replace(over, **fields)


def with_options(adapter: Adapter, options: Sequence[tuple[str, str]]) -> Adapter:
    """An adapter in which entries are replaced by command-line options such as ("parameters.alpha.low", "0.1").

    Raises InputError as `parsed` does.
    """
    content: dict[str, Any] = {}
    for key, text in options:
        place, path = content, key.split(".")
        if path[0] == "defines":
            path = ["defines", key.removeprefix("defines.")]
        for name in path[:-1]:
            place = place.setdefault(name, {})
            if not isinstance(place, dict):
                raise InputError(f"{key} = {text:.40}, but '{name}' already has a value", OPTION, "give one of them")
        place[path[-1]] = _value(path, text)
    return replace(parsed(content, OPTION, adapter), where=adapter.where or OPTION) if content else adapter


OPTION = "--adapter"


def _value(path: Sequence[str], text: str) -> object:
    """Convert the text of an option to a value: a list if it contains commas, a number, true, false, or the text."""
    if KINDS.get(path[0]) is str or path[0] == "defines" or path[-1] in ("unit", "doc", "file"):
        return text
    if KINDS.get(path[0]) is list or "," in text:
        return [_scalar(one.strip()) for one in text.strip("[] ").split(",") if one.strip()]
    return _scalar(text)


def _scalar(text: str) -> object:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        number = float(text)
    except ValueError:
        return text.strip("\"' ")
    return int(number) if re.fullmatch(r"[+-]?\d+", text) else number


def as_option(value: object) -> str:
    """Convert a value to a string that `with_options` accepts."""
    if isinstance(value, bool):
        return str(value).lower()
    return ",".join(map(as_option, value)) if isinstance(value, list | tuple) else str(value)


def _as_is(key: str, value: Any, where: str, over: Adapter) -> object:
    return value


def _meanings(key: str, values: list[object], where: str, over: Adapter) -> tuple[str, ...]:
    for value in values:
        if not isinstance(value, str) or value not in MEANINGS:
            what = f"{key}: unknown meaning of an argument {value!r:.40}"
            raise InputError(what, where, did_you_mean(str(value), [*MEANINGS]))
    return tuple(map(str, values))


def _folders(key: str, values: list[object], where: str, over: Adapter) -> tuple[str, ...]:
    if not all(isinstance(value, str) for value in values):
        raise InputError(f"{key} = {values!r:.40}, names of folders expected", where, 'such as includes = ["chunks"]')
    return tuple(map(str, values))


def _defines(key: str, values: Mapping[str, object], where: str, over: Adapter) -> dict[str, str]:
    for name, value in values.items():
        if isinstance(value, dict | list):
            raise InputError(f"{key}.{name} = {value!r:.40}, a string or a number expected", where, '{ NAME = "1" }')
    return {**over.defines, **{name: _macro(value) for name, value in values.items()}}


def _macro(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _language(key: str, value: str, where: str, over: Adapter) -> str:
    if value not in ("glsl", "hlsl", "slang", "wgsl"):
        raise InputError(f"unknown language '{value}'", where, "use glsl, hlsl, slang or wgsl")
    return value


def _parameters(key: str, values: Mapping[str, object], where: str, over: Adapter) -> dict[str, Uniform]:
    made = {name: _uniform(name, value, where, over.parameters.get(name, Uniform())) for name, value in values.items()}
    return {**over.parameters, **made}


def _uniform(name: str, value: object, where: str, over: Uniform) -> Uniform:
    number, words = (int, float), ("unit", "doc", "kind")
    known = {"default": (*number, list, bool), "low": number, "high": number, **dict.fromkeys(words, str)}
    _check_entry(f"parameters.{name}", value, known, where)
    assert isinstance(value, dict)
    default = value.get("default")
    numbers = default if isinstance(default, list) else [] if default is None else [default]
    if not all(isinstance(one, int | float) for one in numbers) or (isinstance(default, list) and not default):
        raise InputError(f"parameters.{name}: default = {default!r:.40}", where, "give a number or a list of numbers")
    ends = [(key, value[key]) for key in ("low", "high") if key in value]
    for key, one in [*(("default", one) for one in numbers), *ends]:
        if not (-LARGEST <= one <= LARGEST) and not (key != "default" and one in (math.inf, -math.inf)):
            raise InputError(f"parameters.{name}: {key} = {str(one)[:40]}", where, "give a number that fits in 64 bits")
    if value.get("kind", "") not in UNIFORMS:
        raise InputError(f"parameters.{name}: unknown kind '{value['kind']}'", where, ", ".join(UNIFORMS[1:]))
    made = replace(over, **{**value, "default": over.default if default is None else _plain(default)})
    check_range(name, made, where)
    return made


def check_range(name: str, uniform: Uniform, where: str) -> None:
    """Raise InputError, which names `where`, for a default outside the range, and for an empty range."""
    low = -math.inf if uniform.low is None else uniform.low
    high = math.inf if uniform.high is None else uniform.high
    default = uniform.default
    numbers = default if isinstance(default, tuple) else () if default is None else (default,)
    if low > high or not all(low <= one <= high for one in numbers):
        what = f"parameters.{name}: default = {default!r:.40}, low = {uniform.low}, high = {uniform.high}"
        raise InputError(what, where, "the default must lie between low and high")


LARGEST = sys.float_info.max
UNIFORMS = ("", "alpha", "angle", "fixed")


def _plain(default: object) -> object:
    return tuple(default) if isinstance(default, list) else default


def _textures(key: str, values: Mapping[str, object], where: str, over: Adapter) -> dict[str, Mapping[str, Any]]:
    made = {name: _texture(name, value, where, over.textures.get(name, {})) for name, value in values.items()}
    return {**over.textures, **made}


def _texture(name: str, value: object, where: str, over: Mapping[str, Any]) -> dict[str, Any]:
    value = {"file": value} if isinstance(value, str) else value
    _check_entry(f"textures.{name}", value, {"file": str, "wrap": str, "filter": str, "shape": list}, where)
    assert isinstance(value, dict)
    made = {**over, **value}
    for key, accepted in (("wrap", WRAPS), ("filter", FILTERS)):
        if made.get(key, accepted[0]) not in accepted:
            raise InputError(f"textures.{name}: unknown {key} '{made[key]}'", where, " or ".join(accepted))
    if "file" not in made:
        raise InputError(f"textures.{name} names no file", where, "add file = 'table.npy'")
    sizes = made.get("shape", [1, 1])
    if not all(isinstance(one, int) and 0 < one < 1 << 24 for one in sizes) or not 2 <= len(sizes) <= 4:
        what = f"textures.{name}: shape = {sizes!r:.40}"
        raise InputError(what, where, "give [rows, columns, channels] for a file without a header")
    return made


def _check_entry(name: str, value: object, known: Mapping[str, Any], where: str) -> None:
    if not isinstance(value, dict):
        raise InputError(f"{name} = {value!r:.40}, a table of {', '.join(known)} expected", where)
    for key, entry in value.items():
        if key not in known:
            raise InputError(f"{name}: unknown key '{key}'", where, did_you_mean(key, list(known)))
        if not isinstance(entry, known[key]):
            raise InputError(f"{name}: {key} = {entry!r:.40} has the wrong type", where)


_READERS: dict[str, Callable[[str, Any, str, Adapter], object]] = {
    **dict.fromkeys((key for key in KINDS if key.endswith("arguments")), _meanings),
    "includes": _folders, "defines": _defines, "language": _language, "parameters": _parameters,
    "textures": _textures,
}  # fmt: skip
