"""What a shader's functions and uniforms mean: a short TOML beside the shader, FILE.toml, or a guess from names.

function = "BRDF"                       # f, a color or a number
arguments = ["light", "view", "normal"] # the meaning of each argument
cosine = false                          # whether the function includes |cos theta_i|
albedo = "sheenAlbedo"                  # a function of the view that states the integral of the BRDF
lossless_tolerance = 0.02               # the largest loss that is meant in a white furnace

[parameters.roughness]                  # a uniform, or an argument
default = 0.5
low = 0.0
high = 1.0
unit = ""
doc = "width of the lobe"

[textures.table]
file = "table.npy"                      # (rows, columns, channels); or .exr, .hdr, .png
wrap = "clamp"
filter = "linear"
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...errors import InputError, did_you_mean
from ...spirv.images import FILTERS, WRAPS

MEANINGS = {
    "light": "unit vector toward the light",
    "view": "unit vector toward the viewer",
    "incident": "unit vector along the light's travel, -light",
    "normal": "the surface's normal, (0, 0, 1)",
    "tangent": "(1, 0, 0)",
    "bitangent": "(0, 1, 0)",
    "half": "unit vector between light and view",
    "n.l": "cosine of light and normal",
    "n.v": "cosine of view and normal",
    "n.h": "cosine of half vector and normal",
    "l.h": "cosine of light and half vector",
    "l.v": "cosine of light and view",
    "u": "three random numbers, of `sample`",
    "parameter": "a parameter of the material; of a struct every member is one",
}
# names of arguments, in lower case and without prefixes, to their meaning
_GUESSES = {
    "light": ("l", "wi", "light", "lightdir", "lightdirection", "ldir", "tolight", "omegai", "dirl"),
    "view": ("v", "wo", "view", "viewdir", "viewdirection", "eye", "eyedir", "vdir", "toeye", "toview", "omegao"),
    "normal": ("n", "normal", "shadingnormal", "surfacenormal", "norm", "ns"),
    "tangent": ("x", "t", "tangent"),
    "bitangent": ("y", "b", "bitangent", "binormal"),
    "half": ("h", "half", "halfvector", "halfdir", "m"),
    "n.l": ("ndotl", "nol", "nl", "dotnl"),
    "n.v": ("ndotv", "nov", "nv", "dotnv"),
    "n.h": ("ndoth", "noh", "nh", "dotnh"),
    "l.h": ("ldoth", "loh", "vdoth", "voh", "lh", "dotlh", "dotvh", "hdotv", "hdotl"),
    "u": ("u", "xi", "rand", "random", "rnd"),
}
_BY_NAME = {name: meaning for meaning, names in _GUESSES.items() for name in names}
MAX_TOML = 1 << 18


@dataclass(frozen=True)
class Uniform:
    """A parameter as the adapter describes it; absent entries leave what the shader says."""

    default: Any = None
    low: float | None = None
    high: float | None = None
    unit: str = ""
    doc: str = ""


@dataclass(frozen=True)
class Adapter:
    """The meaning of a shader, see the head of this file.

    pdf, sample  names of functions, "" for none; pdf_arguments, sample_arguments: their meanings
    albedo       the name of a function that states the albedo for the view, "" for none, and its error that is meant
    lossless_tolerance  the loss that is meant in a white furnace, None makes no claim
    includes     folders, relative to the shader, from which it may include
    defines      macros
    unset_is_zero  whether variables and inputs that nothing sets are 0; else a shader that reads one is refused
    """

    function: str = ""
    arguments: tuple[str, ...] = ()
    cosine: bool | None = None
    pdf: str = ""
    pdf_arguments: tuple[str, ...] = ()
    sample: str = ""
    sample_arguments: tuple[str, ...] = ()
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
    textures: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


def meaning_of(name: str) -> str:
    """The meaning of an argument by its name, "parameter" for any other name."""
    plain = re.sub(r"^(?:in|a|p|u|f)_|_(?:ws|ts|dir|vec)$|_", "", name.lower())
    return _BY_NAME.get(name.lower(), _BY_NAME.get(plain, "parameter"))


def read(path: Path) -> Adapter:
    """The adapter in a TOML file. Raises InputError, with what is accepted, for unknown keys and wrong types."""
    try:
        if path.stat().st_size > MAX_TOML:
            raise InputError(f"over {MAX_TOML} bytes", str(path), "an adapter is a short file")
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"no adapter: {error}", str(path), "TOML as `gonio adopt` writes it") from None
    kinds = {"function": str, "arguments": list, "cosine": bool, "pdf": str, "pdf_arguments": list, "sample": str,
             "sample_arguments": list, "transmits": bool, "unset_is_zero": bool, "language": str, "doc": str,
             "includes": list, "defines": dict, "parameters": dict, "textures": dict, "albedo": str,
             "albedo_arguments": list, "albedo_tolerance": float, "lossless_tolerance": float}  # fmt: skip
    for key, value in content.items():
        if key not in kinds:
            raise InputError(f"unknown key '{key}'", str(path), did_you_mean(key, list(kinds)))
        number = kinds[key] is float and isinstance(value, int | float) and not isinstance(value, bool)
        if not number and not isinstance(value, kinds[key]):
            what = f"{key} = {value!r:.40}, a {kinds[key].__name__} expected"
            raise InputError(what, str(path), "see `gonio adopt FILE`")
        if isinstance(value, int | float) and number and not 0.0 <= value < 1.0:
            raise InputError(f"{key} = {value!r:.40}", str(path), "a share of the light, 0 to 1")
    for key in ("arguments", "pdf_arguments", "sample_arguments", "albedo_arguments"):
        content[key] = tuple(_meaning(value, path) for value in content.get(key, ()))
    content["includes"] = tuple(map(str, content.get("includes", ())))
    content["defines"] = {str(key): str(value) for key, value in content.get("defines", {}).items()}
    content["parameters"] = {key: _uniform(key, value, path) for key, value in content.get("parameters", {}).items()}
    content["textures"] = {key: _texture(key, value, path) for key, value in content.get("textures", {}).items()}
    if content.get("language", "glsl") not in ("glsl", "hlsl", "wgsl"):
        raise InputError(f"unknown language '{content['language']}'", str(path), "glsl, hlsl or wgsl")
    return Adapter(**content)


def _meaning(value: object, path: Path) -> str:
    if value not in MEANINGS:
        raise InputError(f"unknown meaning of an argument '{value}'", str(path), did_you_mean(str(value), [*MEANINGS]))
    return str(value)


def _uniform(name: str, value: object, path: Path) -> Uniform:
    known = {"default": (int, float, list, bool), "low": (int, float), "high": (int, float), "unit": str, "doc": str}
    _check_entry(name, value, known, path)
    assert isinstance(value, dict)
    default = value.get("default")
    numbers = default if isinstance(default, list) else [] if default is None else [default]
    if not all(isinstance(number, int | float) for number in numbers) or (isinstance(default, list) and not default):
        raise InputError(f"parameters.{name}: default = {default!r:.40}", str(path), "a number, or a list of numbers")
    return Uniform(**{**value, "default": tuple(default) if isinstance(default, list) else default})


def _texture(name: str, value: object, path: Path) -> dict[str, str]:
    _check_entry(name, value, {"file": str, "wrap": str, "filter": str}, path)
    assert isinstance(value, dict)
    for key, accepted in (("wrap", WRAPS), ("filter", FILTERS)):
        if value.get(key, accepted[0]) not in accepted:
            raise InputError(f"textures.{name}: unknown {key} '{value[key]}'", str(path), " or ".join(accepted))
    if "file" not in value:
        raise InputError(f"textures.{name} names no file", str(path), "file = 'table.npy'")
    return value


def _check_entry(name: str, value: object, known: Mapping[str, Any], path: Path) -> None:
    if not isinstance(value, dict):
        raise InputError(f"'{name}' = {value!r:.40}, a table of {', '.join(known)} expected", str(path))
    for key, entry in value.items():
        if key not in known:
            raise InputError(f"'{name}': unknown key '{key}'", str(path), did_you_mean(key, list(known)))
        if not isinstance(entry, known[key]):
            raise InputError(f"'{name}': {key} = {entry!r:.40} has the wrong type", str(path))
