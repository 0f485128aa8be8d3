"""Shader files as material classes, which are created once per saved version of the shader and its included files.

cls = class_of("my.glsl")      # a class with the shader's parameters
Shader("my.glsl", roughness=0.3)
"""

from __future__ import annotations

import copyreg
import keyword
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...material import parameters as kinds
from ...material.bsdf import BSDF
from ...spirv import Module, compile_text, parse, translated
from . import adapter as adapters
from . import emitted, explorer, tables
from .adapter import Adapter
from .declared import INTEGERS, Declared, integer
from .material import _SampledShaderFile, _ShaderFile
from .names import options_in, parted, with_options
from .program import Program

_LANGUAGES = {".hlsl": "hlsl", ".slang": "slang", ".wgsl": "wgsl"}  # others are GLSL
MAX_FILE = 4 << 20  # maximum size of a shader in bytes
MAX_CLASSES = 64  # maximum number of classes in memory
# names of parameters that are assumed to be in [0, 1]
_UNIT = re.compile(r"rough|metal|albedo|colou?r|specular$|sheen|coat|tint|subsurface|reflectan|^k[ds]$|f0", re.I)


def Shader(
    file: str | os.PathLike[str],
    *,
    defines: Mapping[str, object] | None = None,
    adapter: Mapping[str, object] | None = None,
    **parameters: Any,
) -> BSDF:
    """A material from a shader: GLSL, HLSL, WGSL, SPIR-V, or a .brdf file of the BRDF Explorer.

        go.Shader("my.glsl", roughness=0.3)
        go.Shader("my.glsl", defines={"USE_SHEEN": 1}, adapter={"function": "evalSheen", "textures": {"lut": "e.npy"}})

    file        the shader, whose adapter is FILE.toml beside it, see docs/shaders.md
    defines     macros of GLSL, HLSL and Slang, or overrides of WGSL, by name, in addition to those of the adapter
    adapter     entries of the adapter, which override those in FILE.toml
    parameters  values of the shader's parameters
    Raises InputError, with file and line, for a shader that cannot be read, and MachineError if there is no shader
    compiler.
    """
    macros = [(f"defines.{key}", value) for key, value in (defines or {}).items()]
    options = [(key, adapters.as_option(value)) for key, value in (*_flat(adapter or {}), *macros)]
    cls: Any = class_of(with_options(os.fspath(file), options))
    known = cls.parameters()
    given = {name if name in known else f"{name}_": value for name, value in parameters.items()}
    unknown = [name for name in parameters if not {name, f"{name}_"} & {*known}]
    if unknown:
        raise InputError(f"no parameter '{unknown[0]}'", os.fspath(file), f"it has: {', '.join(known) or 'none'}")
    material: BSDF = cls(**given)
    return material


def _flat(content: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """The values in nested dictionaries by path, such as "textures.lut.file"."""
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


_Stamp = tuple[tuple[str, int, int], ...]
_classes: dict[tuple[str, str, str], tuple[_Stamp, type[BSDF]]] = {}


def files_read(shader: Path) -> frozenset[Path]:
    """The files read at the last use of a shader (shader, adapter, includes, textures); empty if it was never used."""
    stamps = [stamp for (path, _, _), (stamp, _) in _classes.items() if Path(path) == shader.absolute()]
    return frozenset(Path(name) for stamp in stamps for name, _, _ in stamp)


def class_of(text: str, inside: Path | None = None) -> type[BSDF]:
    """The class for the name of a shader, which may contain options, such as "my.glsl" or "my.glsl?function=f".

    inside  the folder that must contain the files named by the adapter; None allows any folder
    """
    file, query = parted(text)
    path = Path(os.path.expanduser(file)).absolute()
    try:
        _stamp([path])
        adapter_file = adapter_of(path)
        own = [path, *([] if adapter_file is None else [adapter_file])]
        first = _stamp(own)
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise InputError(f"no file '{file}'", text, str(getattr(error, "strerror", "") or "")) from None
    key = str(path), str(inside), query
    known = _classes.pop(key, None)
    if known is None or known[0][: len(first)] != first or not _is_current(known[0]):
        program = read(path, adapter_file, inside, options_in(query))
        name = with_options(str(path), options_in(query))
        files = [one for one in program.files if one not in own]
        known = first + _stamp(files), _made(path, name, program, inside)
    _classes[key] = known
    while len(_classes) > MAX_CLASSES:
        _classes.pop(next(iter(_classes)))
    return known[1]


def adapter_of(path: Path) -> Path | None:
    """The file that describes a shader: the adapter beside it, or the manifest from `gonio emit`."""
    named = Path(f"{path}.toml"), path.with_suffix(".toml")
    return next((one for one in named if one.is_file()), None) or emitted.manifest_of(path)


def _stamp(files: list[Path]) -> _Stamp:
    abouts = [(one, one.stat()) for one in files]
    return tuple((str(one), about.st_mtime_ns, about.st_size) for one, about in abouts)


def _is_current(stamp: _Stamp) -> bool:
    try:
        return _stamp([Path(name) for name, _, _ in stamp]) == stamp
    except OSError:
        return False


def read(
    path: Path, adapter_file: Path | None, inside: Path | None = None, options: Sequence[tuple[str, str]] = ()
) -> Program:
    """Read a shader and its adapter.

    adapter_file  the result of `adapter_of`; if it is None, meanings are guessed from names
    inside        as in `class_of`
    options       entries that override those of the adapter, as pairs (key, value)
    """
    where = path.name
    if not path.is_file():
        raise InputError(f"'{path}' is not a file", where)
    if path.stat().st_size > MAX_FILE:
        raise InputError(f"larger than {MAX_FILE >> 20} MB", where, "shaders are shorter")
    if adapter_file is not None:
        _confined(adapter_file, inside)
    data, files = path.read_bytes(), list[Path]()
    text, described = data.decode("utf-8", "replace") if path.suffix.lower() != ".spv" else "", Adapter()
    if path.suffix.lower() == ".brdf":
        text, described = explorer.read(text, where)
    adapter = _adapter(described, adapter_file, options)
    if path.suffix.lower() == ".spv":
        module = parse(data, where)
    else:
        language = adapter.language or _LANGUAGES.get(path.suffix.lower(), "glsl")
        folders = [_folder(path.parent / folder, inside, adapter.where) for folder in adapter.includes]
        module = _compiled(text, where, language, adapter.defines, [path.parent, *folders], files)
    textures = {
        name: tables.texture(name, about, _confined(path.parent / about["file"], inside), adapter.where)
        for name, about in adapter.textures.items()
    }
    files += [path.parent / about["file"] for about in adapter.textures.values()]
    return Program(module, adapter, textures, where, tuple(dict.fromkeys(files)))


def _adapter(described: Adapter, file: Path | None, options: Sequence[tuple[str, str]]) -> Adapter:
    """The adapter in a file, or else the one in the text of the shader, with entries overridden by options."""
    function = dict(options).get("function", "")
    if file is not None and file.suffix == ".json":
        described = adapters.parsed(emitted.content(file, function), str(file))
    elif file is not None:
        described = adapters.read(file)
    if function and function != described.function:  # the adapter's entries are for another function and do not apply
        described = replace(described, arguments=(), cosine=None, pdf="", sample="", derive="", struct="")
    return adapters.with_options(described, options)


def _compiled(
    text: str, where: str, language: str, defines: Mapping[str, str], folders: list[Path], files: list[Path]
) -> Module:
    """Compile the text of a shader to a module.

    folders  the folder of the shader, which is not searched for #include <FILE>, and then the folders in the adapter
    files    a list to which the included files are appended
    """
    if language == "wgsl":
        return translated(text, where, defines, folders, files)
    own, *named = folders
    binary = compile_text(text, where, language=language, defines=defines, folders=named, own_folder=own, read=files)
    return parse(binary, where)


def _folder(path: Path, inside: Path | None, where: str) -> Path:
    """The resolved path of a folder in `includes`. Raises InputError with the adapter `where` if it is missing."""
    if not _confined(path, inside).is_dir():
        raise InputError(f"includes: there is no folder '{path}'", where, "give folders relative to the shader")
    return path.resolve()


def _confined(path: Path, inside: Path | None) -> Path:
    """The resolved path of a file or folder named by an adapter. Raises InputError if it is outside `inside`."""
    resolved = path.resolve()
    if inside is not None and not resolved.is_relative_to(inside.resolve()):
        raise InputError(f"'{path.name}' lies outside the scene's folder {inside}", str(path), "copy it there")
    return resolved


# --------------------------------------------------------------------------- classes


class _ShaderType(type):
    """The metaclass of classes created from files, which are pickled by the name of the file."""


def _pickled(cls: _ShaderType) -> object:
    text = getattr(cls, "spelling", "")
    return (class_of, (text, getattr(cls, "inside", None))) if text else cls.__qualname__


copyreg.pickle(_ShaderType, _pickled)  # type: ignore[arg-type]


class _Shader(_ShaderFile, metaclass=_ShaderType):
    """The base of classes for shaders without their own density."""


class _SampledShader(_SampledShaderFile, metaclass=_ShaderType):
    """The base of classes for shaders with their own density."""


def _made(path: Path, spelling: str, program: Program, inside: Path | None) -> type[BSDF]:
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
        "spelling": spelling,
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
    """Raise InputError, with file and line, for unsupported constructs, before they cause an error in a render."""
    for formula in ("eval", "pdf", "sample") if not type(material).guided else ("eval",):
        material.record(formula)
    material.stated_albedo(np.array([[0.0, 0.0, 1.0]]))


_SCENES = ("file", "type", "preset", "normalmap", "bump", "two_sided")  # keys of materials in scenes
_RESERVED = {*dir(_SampledShaderFile), *keyword.kwlist, *_SCENES, "program"}


def bounds(declared: Declared) -> tuple[float, float, Any]:
    """The range and default of a parameter, which are guessed from its name if the adapter does not state them."""
    uniform = declared.uniform
    named = declared.shape not in INTEGERS and _UNIT.search(declared.name)
    any_number = 0.0 if declared.shape == "uint" else -np.inf, np.inf
    guess = (0.0, 1.0) if named else any_number
    low = guess[0] if uniform.low is None else float(uniform.low)
    high = guess[1] if uniform.high is None else float(uniform.high)
    start = 0.0 if declared.shape in INTEGERS else 0.5
    return low, high, min(max(start, low), high) if uniform.default is None else uniform.default


def _fields(declared: Declared) -> list[tuple[str, Any]]:
    """The fields for a parameter: a single one, or one per component of a vector that is not a color."""
    name = declared.name.lstrip("_")
    name = f"{name}_" if name in _RESERVED else name
    uniform = declared.uniform
    doc = uniform.doc or f"{declared.shape} {declared.name} of the shader"
    low, high, default = bounds(declared)
    if uniform.kind == "fixed":
        return []
    if declared.shape == "bool":
        return [(name, kinds.flag(bool(uniform.default), doc))]
    if uniform.kind == "alpha":
        return [(name, kinds.width(default, doc, low=low, high=high))]
    if uniform.kind == "angle":
        return [(name, kinds.angle(default, doc))]
    if declared.shape == "vec3":
        color = default if isinstance(default, tuple) else float(default)
        return [(name, kinds.spectrum(color, doc, low=low, high=high, unit=uniform.unit))]
    if declared.shape in ("vec2", "vec4"):
        letters = "xyzw"[: int(declared.shape[-1])]
        parts = default if isinstance(default, tuple) else (default,) * len(letters)
        if len(parts) != len(letters):
            raise InputError(f"{len(parts)} default values for {declared.shape} {declared.name}", "adapter")
        return [
            (f"{name}_{letter}", kinds.number(float(part), f"{doc}, {letter}", low=low, high=high))
            for letter, part in zip(letters, parts, strict=True)
        ]
    if isinstance(default, tuple):
        raise InputError(f"{len(default)} default values for {declared.shape} {declared.name}", "adapter", "give one")
    if declared.shape in INTEGERS:
        return [(name, integer(default, doc, low, high))]
    return [(name, kinds.number(float(default), doc, low=low, high=high, unit=uniform.unit))]


def forget() -> None:
    """Clear the cache, so that all files are read again when they are next used."""
    _classes.clear()
