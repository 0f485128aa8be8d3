"""Shader files as material classes, made once per saved version of the shader and of all that it includes.

cls = class_of("my.glsl")      # a class with the shader's parameters
Shader("my.glsl", roughness=0.3)
"""

from __future__ import annotations

import copyreg
import keyword
import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...material import parameters as kinds
from ...material.bsdf import BSDF
from ...ops.table import Table
from ...spirv import Module, compile_text, parse, translated
from ...spirv.images import Texture
from . import adapter as adapters
from . import explorer
from .adapter import Adapter
from .declared import INTEGERS, Declared, integer
from .material import _SampledShaderFile, _ShaderFile
from .program import Program

_LANGUAGES = {".hlsl": "hlsl", ".slang": "slang", ".wgsl": "wgsl"}  # others are GLSL
MAX_FILE = 4 << 20  # bytes of a shader
MAX_TABLE = 1 << 28
MAX_CLASSES = 64  # in memory
# parameters whose names say that they lie in [0, 1]
_UNIT = re.compile(r"rough|metal|albedo|colou?r|specular$|sheen|coat|tint|subsurface|reflectan|^k[ds]$|f0", re.I)


def Shader(file: str | os.PathLike[str], **parameters: Any) -> BSDF:
    """A material from a shader: GLSL, HLSL, WGSL, SPIR-V, or a .brdf file of the BRDF Explorer.

        go.Shader("my.glsl", roughness=0.3)

    file        the shader; FILE.toml beside it is its adapter, see docs/shaders.md
    parameters  values of its parameters
    Raises InputError, with file and line, for what cannot be read; MachineError without a compiler.
    """
    cls: Any = class_of(os.fspath(file))
    unknown = [name for name in parameters if name not in cls.parameters()]
    if unknown:
        known = ", ".join(cls.parameters()) or "none"
        raise InputError(f"no parameter '{unknown[0]}'", os.fspath(file), f"it has: {known}")
    material: BSDF = cls(**parameters)
    return material


_Stamp = tuple[tuple[str, int, int], ...]
_classes: dict[tuple[str, str, str], tuple[_Stamp, type[BSDF]]] = {}


def files_read(shader: Path) -> frozenset[Path]:
    """What a shader was last made from: it, its adapter, includes and textures. Empty if it was never made."""
    stamps = [stamp for (path, _, _), (stamp, _) in _classes.items() if Path(path) == shader.absolute()]
    return frozenset(Path(name) for stamp in stamps for name, _, _ in stamp)


def class_of(text: str, inside: Path | None = None, function: str = "") -> type[BSDF]:
    """The class of a shader file.

    inside    the folder in which the files that the adapter names must lie, None for any folder
    function  the BRDF, in place of the one that the adapter names or that is guessed
    """
    path = Path(os.path.expanduser(text.strip())).absolute()
    adapters_ = Path(f"{path}.toml"), path.with_suffix(".toml")
    adapter_file = next((one for one in adapters_ if one.is_file()), None)
    own = [path, *(one for one in adapters_ if one == adapter_file)]
    try:
        first = _stamp(own)
    except (OSError, ValueError) as error:
        raise InputError(f"no file '{text}'", text, str(getattr(error, "strerror", "") or "")) from None
    key = str(path), str(inside), function
    known = _classes.pop(key, None)
    if known is None or known[0][: len(first)] != first or not _is_current(known[0]):
        program = read(path, adapter_file, inside, function)
        known = first + _stamp([one for one in program.files if one not in own]), _made(path, program, inside)
    _classes[key] = known
    while len(_classes) > MAX_CLASSES:
        _classes.pop(next(iter(_classes)))
    return known[1]


def _stamp(files: list[Path]) -> _Stamp:
    abouts = [(one, one.stat()) for one in files]
    return tuple((str(one), about.st_mtime_ns, about.st_size) for one, about in abouts)


def _is_current(stamp: _Stamp) -> bool:
    try:
        return _stamp([Path(name) for name, _, _ in stamp]) == stamp
    except OSError:
        return False


def read(path: Path, adapter_file: Path | None, inside: Path | None = None, function: str = "") -> Program:
    """The program of a file, with the adapter beside it or guesses; `function` as in `class_of`."""
    where = path.name
    if not path.is_file():
        raise InputError(f"'{path}' is no file", where)
    if path.stat().st_size > MAX_FILE:
        raise InputError(f"over {MAX_FILE >> 20} MB", where, "a shader is shorter")
    if adapter_file is not None:
        _confined(adapter_file, inside)
    adapter = adapters.read(adapter_file) if adapter_file is not None else Adapter()
    data, files = path.read_bytes(), list[Path]()
    if path.suffix.lower() == ".spv":
        module = parse(data, where)
    else:
        text = data.decode("utf-8", "replace")
        if path.suffix.lower() == ".brdf":
            text, described = explorer.read(text, where)
            adapter = described if adapter_file is None else adapter
        language = adapter.language or _LANGUAGES.get(path.suffix.lower(), "glsl")
        folders = [_confined(path.parent / folder, inside) for folder in adapter.includes]
        module = _compiled(text, where, language, adapter.defines, [path.parent, *folders], files)
    if function and function != adapter.function:  # what the adapter says of another function does not hold
        adapter = replace(adapter, function=function, arguments=(), cosine=None, pdf="", sample="")
    textures = {name: _texture(name, about, path.parent, inside) for name, about in adapter.textures.items()}
    files += [path.parent / about["file"] for about in adapter.textures.values()]
    return Program(module, adapter, textures, where, tuple(dict.fromkeys(files)))


def _compiled(
    text: str, where: str, language: str, defines: Mapping[str, str], folders: list[Path], files: list[Path]
) -> Module:
    """The module of a text; `folders` begin with the shader's own, in which #include <FILE> does not look.

    files  gets the files that it includes
    """
    if language == "wgsl":
        return translated(text, where, defines, folders, files)
    own, *named = folders
    binary = compile_text(text, where, language=language, defines=defines, folders=named, own_folder=own, read=files)
    return parse(binary, where)


def _confined(path: Path, inside: Path | None) -> Path:
    """A file or folder that an adapter names."""
    resolved = path.resolve()
    if inside is not None and not resolved.is_relative_to(inside.resolve()):
        raise InputError(f"'{path.name}' lies outside the scene's folder {inside}", str(path), "copy it there")
    return resolved


def _texture(name: str, about: Mapping[str, str], folder: Path, inside: Path | None) -> Texture:
    path = _confined(folder / about["file"], inside)
    where = f"textures.{name}"
    try:
        if path.stat().st_size > MAX_TABLE:
            raise InputError(f"'{path.name}' has over {MAX_TABLE >> 20} MB", where)
        values = np.load(path, allow_pickle=False)
        values = np.asarray(values, np.float64)
    except (OSError, ValueError, EOFError) as error:
        what = f"'{about['file']}' is no table: {error}"
        raise InputError(what[:200], where, "an .npy of numbers, (rows, columns, channels)") from None
    if values.ndim not in (2, 3, 4) or values.shape[-1] > 4 or values.size == 0 or not np.all(np.isfinite(values)):
        what = f"'{about['file']}' of shape {values.shape}, finite numbers of 1 to 4 channels last expected"
        raise InputError(what, where, "numpy.save(FILE, array) with shape (rows, columns, channels)")
    return Texture(name, Table(name, values), about.get("wrap", "clamp"), about.get("filter", "linear"))


# --------------------------------------------------------------------------- classes


class _ShaderType(type):
    """The type of classes made from files, by which they are pickled as the file's name."""


def _pickled(cls: _ShaderType) -> object:
    text = getattr(cls, "spelling", "")
    return (class_of, (text, getattr(cls, "inside", None))) if text else cls.__qualname__


copyreg.pickle(_ShaderType, _pickled)  # type: ignore[arg-type]


class _Shader(_ShaderFile, metaclass=_ShaderType):
    """Base of classes without a density of their own."""


class _SampledShader(_SampledShaderFile, metaclass=_ShaderType):
    """Base of classes with one."""


def _made(path: Path, program: Program, inside: Path | None) -> type[BSDF]:
    sampled = {"pdf", "sample"} <= set(program.formulas)
    fields: dict[str, tuple[str, ...]] = {}
    namespace: dict[str, Any] = {"__annotations__": {}}
    for declared in program.parameters.values():
        for name, value in _fields(declared):
            fields[declared.name] = (*fields.get(declared.name, ()), name)
            namespace[name] = value
            namespace["__annotations__"][name] = "parameter"
    stem = "".join(word.capitalize() for word in re.findall(r"[A-Za-z0-9]+", path.stem)) or "Shader"
    stem = stem if stem[0].isalpha() else f"Shader{stem}"
    about = program.adapter.doc or f"The function {program.adapter.function} of {path.name}"
    namespace |= {
        "__doc__": f"{about.rstrip('.')}.",
        "__module__": __name__,
        "spelling": str(path),
        "inside": inside,
        "name": re.sub(r"[^a-z0-9]+", "-", path.stem.lower()).strip("-") or "shader",
        "program": program,
        "fields": fields,
        "lossless_tolerance": program.adapter.lossless_tolerance,
    }
    cls: Any = _ShaderType(stem, (_SampledShader if sampled else _Shader,), namespace)
    _probe(cls())
    return cls  # type: ignore[no-any-return]


def _probe(material: BSDF) -> None:
    """Raise InputError, with file and line, for constructs that are not read, before a law or a render meets them."""
    for formula in ("eval", "pdf", "sample") if not type(material).guided else ("eval",):
        material.record(formula)
    material.stated_albedo(np.array([[0.0, 0.0, 1.0]]))


_SCENES = ("file", "type", "preset", "normalmap", "bump", "two_sided")  # keys of materials in scenes
_RESERVED = {*dir(_SampledShaderFile), *keyword.kwlist, *_SCENES, "program"}


def bounds(declared: Declared) -> tuple[float, float, Any]:
    """Range and default of a parameter; by its name where the adapter does not say."""
    uniform = declared.uniform
    named = declared.shape not in INTEGERS and _UNIT.search(declared.name)
    any_number = 0.0 if declared.shape == "uint" else -np.inf, np.inf
    guess = (0.0, 1.0) if named else any_number
    low = guess[0] if uniform.low is None else float(uniform.low)
    high = guess[1] if uniform.high is None else float(uniform.high)
    usual = min(max(0.0, low), high) if declared.shape in INTEGERS else 0.5
    return low, high, usual if uniform.default is None else uniform.default


def _fields(declared: Declared) -> list[tuple[str, Any]]:
    """The fields of a parameter: one, or one per component of vectors that are no colors."""
    name = f"{declared.name}_" if declared.name in _RESERVED else declared.name.lstrip("_")
    uniform = declared.uniform
    doc = uniform.doc or f"{declared.shape} {declared.name} of the shader"
    low, high, default = bounds(declared)
    if declared.shape == "bool":
        return [(name, kinds.flag(bool(uniform.default), doc))]
    if declared.shape == "vec3":
        color = default if isinstance(default, tuple) else float(default)
        return [(name, kinds.spectrum(color, doc, low=low, high=high, unit=uniform.unit))]
    if declared.shape in ("vec2", "vec4"):
        letters = "xyzw"[: int(declared.shape[-1])]
        parts = default if isinstance(default, tuple) else (default,) * len(letters)
        if len(parts) != len(letters):
            raise InputError(f"{len(parts)} defaults of {declared.shape} {declared.name}", "adapter")
        return [
            (f"{name}_{letter}", kinds.number(float(part), f"{doc}, {letter}", low=low, high=high))
            for letter, part in zip(letters, parts, strict=True)
        ]
    if isinstance(default, tuple):
        raise InputError(f"{len(default)} defaults of {declared.shape} {declared.name}", "adapter", "one number")
    if declared.shape in INTEGERS:
        return [(name, integer(default, doc, low, high))]
    return [(name, kinds.number(float(default), doc, low=low, high=high, unit=uniform.unit))]


def forget() -> None:
    """Read all files again on their next use."""
    _classes.clear()
