"""A Mitsuba scene's file, read with the same care as the lab's."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

from ..bridge import foreign
from ..bridge.faults.exr_threads import file_threads
from ..bridge.native import MitsubaBSDF
from ..bridge.types import Scene
from ..errors import InputError
from ..pictures import formats
from . import meshes


def load(
    mi: ModuleType,
    file: Path,
    parameters: Mapping[str, object],
    *,
    allow_outside: bool = False,
    size: tuple[int, int] | None = None,
    own_integrator: bool = True,
) -> Scene:
    """The scene of a Mitsuba XML file.

    parameters      values of its `$parameters`
    allow_outside   let it read files outside its folder
    size            of the film in pixels; None: the scene's own
    own_integrator  whether the scene must name an integrator
    Raises InputError.
    """
    where = str(file)
    check_files(file, parameters, allow_outside)
    try:
        # one after the other, and none merged: else the order of shapes, and with it the last bit, is left to chance
        with file_threads():
            # In parallel a file that cannot be read ends the process: the error has a thread of its own.
            values = {key: _as_xml(value) for key, value in parameters.items()}
            scene = mi.load_file(where, parallel=False, optimize=False, **values)
        if not isinstance(scene, mi.Scene):
            raise InputError("this file holds no <scene>", where, "give a Mitsuba scene, a folder or a .json")
        if not scene.sensors():
            raise InputError("the scene has no <sensor>", where, "add one: it holds the camera and the film")
        if scene.integrator() is None and own_integrator:
            raise InputError("the scene has no <integrator>", where, "add one, or give --integrator path")
        if size is not None:
            film = mi.traverse(scene.sensors()[0])
            film["film.size"] = list(size)
            film.update()
    except InputError:
        raise
    except (RuntimeError, ValueError, TypeError, KeyError) as error:
        raise InputError(_mitsuba_text(error), where, "mend it there; the texts are Mitsuba's") from error
    return scene


def load_bsdf(path: Path) -> MitsubaBSDF:
    """The BSDF of a Mitsuba XML file: its root, or the first in a scene. Raises InputError where there is none."""
    mi = foreign.mitsuba()
    check_files(path, {}, allow_outside=True)
    try:
        with file_threads():
            loaded = mi.load_file(str(path), parallel=False)
    except Exception as error:
        raise InputError(f"Mitsuba refuses it: {_mitsuba_text(error)}", str(path)) from None
    if isinstance(loaded, mi.BSDF):
        return MitsubaBSDF(loaded)
    if isinstance(loaded, mi.Scene):
        for shape in loaded.shapes():
            if shape.bsdf() is not None:
                return MitsubaBSDF(shape.bsdf())
    raise InputError("no BSDF in this file", str(path), "give a file whose root is <bsdf>, or a scene with one")


def _as_xml(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _mitsuba_text(error: Exception) -> str:
    """Mitsuba's message without places in its C++ source and without a Python traceback of ours."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    ours = [line for line in lines if re.match(r"\w*(Error|Exception): ", line)]
    text = lines[0] if lines else type(error).__name__
    if ours:  # an error of a Gonio material, raised within Mitsuba's parser
        text = text.removesuffix("Traceback (most recent call last):")
        text += ours[-1].split(": ", 1)[1] if text != lines[0] else ""
    elif len(lines) > 1:
        text += " " + "; ".join(lines[1:4])
    return re.sub(r"\[\w+\.(cpp|h):\d+\] ", "", text)


def sources(file: Path, parameters: Mapping[str, object]) -> tuple[Callable[[], str], dict[str, Path]]:
    """What tells the text of a scene and all that it includes; and the files that it names, by their names in it."""
    texts, named = [repr(sorted((key, _as_xml(value)) for key, value in parameters.items()))], {}
    texts.append(file.read_text(encoding="utf-8", errors="surrogateescape"))
    for _, name, target, included in _named(file, parameters):
        named[name] = target
        if included:
            texts.append(target.read_text(encoding="utf-8", errors="surrogateescape"))
    return lambda: "\n".join(texts), named


def check_files(file: Path, parameters: Mapping[str, object], allow_outside: bool = False) -> None:
    """Raise InputError where a Mitsuba scene, or a file it includes, names a file that must not be opened: one outside
    the scene's folder, or a picture that contradicts itself, by which a library in C++ could be corrupted."""
    folder = file.parent.resolve()
    for current, name, target, _ in _named(file, parameters):
        if not allow_outside and not target.is_relative_to(folder):
            what = f"'{name}' lies outside the scene's folder {folder}"
            raise InputError(what, str(current), "copy it there, or use --allow-outside")
        try:
            formats.check_file(target)
            if target.suffix.lower() == ".ply" or meshes.is_ply(target):  # Mitsuba's reader believes counts and indices
                meshes.read_mesh(target, str(current), ".ply")
        except formats.Unreadable as error:
            raise InputError(f"'{name}' cannot be used: {error}", str(current), "save it again") from None
        except OSError as error:
            raise InputError(f"'{name}' cannot be read: {error.strerror}", str(current), "check the file") from None


def _named(file: Path, parameters: Mapping[str, object]) -> Iterator[tuple[Path, str, Path, bool]]:
    """Each file that exists and is named by a Mitsuba scene, or by a file that it includes: (where, its name there,
    the file, whether it is included)."""
    folder, seen, waiting = file.parent.resolve(), set(), [file.resolve()]
    while waiting:
        current = waiting.pop()
        if current in seen:
            continue
        seen.add(current)
        try:
            root = ElementTree.parse(current).getroot()
        except (ElementTree.ParseError, OSError, ValueError, LookupError) as error:
            raise InputError(f"not well-formed XML: {error}", str(current), "mend it there") from error
        values = {x.get("name", ""): x.get("value", "") for x in root.iter("default")}
        values |= {name: _as_xml(value) for name, value in parameters.items()}
        for element in root.iter():
            name = element.get("filename") or (element.get("value") if element.tag in ("string", "path") else None)
            if not name:
                continue
            for key in sorted(values, key=len, reverse=True):
                name = name.replace("$" + key, values[key])
            try:
                target = (folder / name).resolve()
                exists = target.is_file()
            except (OSError, ValueError, RuntimeError):  # no file's name, such as a long or odd string, or a loop
                continue
            if exists:
                yield current, name, target, element.tag == "include"
                if element.tag == "include":
                    waiting.append(target)
