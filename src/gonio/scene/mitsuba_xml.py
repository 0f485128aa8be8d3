"""Rewrite the XML of a Mitsuba scene as a single document in which Mitsuba need not search for any file.

Includes, search paths and parameters have the same meaning as in Mitsuba:

    <default name="spp" value="16"/>       the default of a parameter, whose value replaces "$spp"
    <include filename="materials.xml"/>    inserts another file here
    <path value="textures"/>               a folder that is searched first for the files of plugins

Mitsuba would also search the current folder. In the rewritten text, files are given by absolute paths and have been
checked, and all plugins are allowed.
"""

from __future__ import annotations

import functools
import os
import re
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple, NoReturn
from xml.parsers import expat

from ..bridge import plugin_search
from ..catalog import outside
from ..errors import InputError, did_you_mean
from ..measure import SAMPLE, parted
from ..pictures import formats, scene_files
from . import files, meshes

MAX_BYTES = 64 << 20  # maximum size of all files together, and of the text that parameters add
MAX_ELEMENTS = 1_000_000
MAX_DEPTH = 64
MAX_INCLUDES = 15  # maximum depth of nested includes, as in Mitsuba
MAX_PARAMETER = 100  # maximum number of characters of a parameter's name, all of which are compared after each $
MAX_VALUE = 1 << 20  # maximum number of characters of a value in which parameters are replaced

# elements that describe an object created by a plugin
OBJECTS = {"scene", "sensor", "film", "emitter", "sampler", "shape", "texture", "volume", "medium", "bsdf"}
OBJECTS |= {"integrator", "phase", "rfilter"}

# Characters to escape in attributes. Mitsuba interprets "$" as a parameter unless it is preceded by a backslash.
_ESCAPES = str.maketrans({"$": "\\$"} | {character: f"&#{ord(character)};" for character in '&<>"\t\n\r'})


class SceneText(NamedTuple):
    """A scene in the form that is passed to Mitsuba.

    text       XML with one element per line
    origins    the file and line from which each line of `text` originates
    files      the files that are read, by their names in the scene, including those of <include>
    sources    the texts of the XML files of the scene
    runs_code  whether the scene loads native plugins from its folder
    """

    text: str
    origins: list[tuple[Path, int]]
    files: dict[str, Path]
    sources: list[str]
    runs_code: bool

    def located(self, message: str) -> str:
        """A message of Mitsuba, in which lines of `text` are replaced by the user's files and lines."""

        def origin(match: re.Match[str]) -> str:
            file, line = self.origins[min(int(match[1]), len(self.origins)) - 1]
            return f"{file.name}, line {line}"

        return re.sub(r"string \(line (\d+), col \d+\)", origin, message)


def read(file: Path, parameters: Mapping[str, str], allow_outside: bool = False, allow_code: bool = False) -> SceneText:
    """Read a scene or a single object, and rewrite its text.

    parameters     values of the `$parameters`
    allow_outside  whether the scene may name files outside its folder
    allow_code     whether the scene may load native plugins from the folder `plugins` next to it
    Raises InputError, with file and line, for XML that is not well-formed, for a file that is missing or must not be
    read, for a plugin that must not be loaded, and for parameters that the scene does not have.
    """
    reader = _Reader(file, parameters, allow_outside, allow_code)
    reader.parse(file, [reader.folder, plugin_search.package()])
    reader.place_files()
    reader.check_references()
    unused = [name for name in parameters if name not in reader.used]
    if unused:
        known = [name for name in reader.values if name not in unused]
        hint = did_you_mean(unused[0], known[:200]) if known else "parameters appear as $name in its values"
        raise InputError(f"the scene has no parameter '{unused[0]}'", str(file), hint)
    return SceneText("\n".join(reader.lines) + "\n", reader.origins, reader.files, reader.sources, reader.runs_code)


def readable(name: str, path: Path, folder: Path, location: str, allow_outside: bool = False) -> str:
    """The absolute path of a file of a scene, for Mitsuba; errors give its `name` and its `location` in the scene.

    Raises InputError for a file that must not be opened, because it is outside the scene's folder, or because it is
    inconsistent and could cause memory errors in a C++ library.
    """
    files.checked(path, name, folder, location, allow_outside)
    try:
        scene_files.check_file(path)
        if path.suffix.lower() == ".ply" or meshes.is_ply(path):  # Mitsuba's reader does not check counts and indices
            meshes.read_mesh(path, location, ".ply")
    except formats.Unreadable as error:
        raise InputError(f"'{name}' cannot be used: {error}", location, "save it again") from None
    except OSError as error:
        raise InputError(f"'{name}' cannot be read: {error.strerror}", location, "check the file") from None
    return str(path.absolute())


def property_value(
    kind: str, name: str, value: str, location: str, locate: Callable[[str], str], allow_code: bool = False
) -> str:
    """The value of a string property of a plugin; if it names a file, the path of this file.

    locate  a function that maps the name of a file to its path, if the file may be read
    Raises InputError for code that is not allowed, and if Mitsuba would search other folders for the file.
    """
    if outside.names_code(value) and not allow_code:
        what = f"'{value}' is code, which a scene alone does not run"
        raise InputError(what, location, "read the file first; then --allow-code lets the scene run it")
    if name == "filename":
        return locate(value)
    if name == "file":
        path, item = parted(value)
        path = path if path == SAMPLE else locate(path)
        return f"{path}:{item}" if item else path
    if name == "material" and kind in ("conductor", "roughconductor") and value != "none":
        known = [path.name.removesuffix(".eta.spd") for path in plugin_search.package().glob("data/ior/*.eta.spd")]
        if value not in known:
            raise InputError(f"Mitsuba has no material '{value}'", location, did_you_mean(value, known))
    return value


class _Reader:
    """The common state of all files of a scene.

    values   values of the parameters, by name
    folders  folders searched for files of plugins: those of <path> in the main file, the scene's, and Mitsuba's own
    """

    def __init__(self, file: Path, parameters: Mapping[str, str], allow_outside: bool, allow_code: bool) -> None:
        self.file, self.folder = file, file.parent.resolve()
        self.values, self.used = dict(parameters), set[str]()
        self.lengths = sorted({len(name) for name in parameters}, reverse=True)  # lengths of the names of parameters
        self.allow_outside, self.allow_code = allow_outside, allow_code
        self.lines: list[str] = []
        self.origins: list[tuple[Path, int]] = []
        self.files: dict[str, Path] = {}
        self.sources: list[str] = []
        self.folders: list[Path] = []
        self.texts: list[tuple[int, str, dict[str, str], str]] = []  # strings of plugins: line, plugin, element, place
        self.references: dict[str, set[str]] = {}  # id of an object -> ids of the objects on which it depends
        self.runs_code = False
        self.version = ""  # version of the main file
        self.bytes = self.elements = self.grown = 0  # bytes and elements read, and bytes that parameters have added

    # ------------------------------------------------------------------ files

    def parse(self, file: Path, folders: list[Path], included: Mapping[str, str] | None = None, level: int = 0) -> None:
        """Append a file, whose own files are searched in `folders`; `included` has the attributes of its <include>."""
        try:
            data = file.read_bytes()
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror or error}", str(file), "check the file") from None
        self.bytes += len(data)
        if self.bytes > MAX_BYTES:
            raise InputError(f"more than {MAX_BYTES >> 20} MiB of XML", str(file), "keep large data in other files")
        self.sources.append(data.decode(errors="surrogateescape"))
        document = _File(self, file, folders, included, level)
        try:
            document.parser.Parse(data, True)
        except (expat.ExpatError, ValueError, LookupError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"not well-formed XML: {error}", str(file), "correct it there") from None
        if included is None:
            self.folders = folders

    def place_files(self) -> None:
        """Insert the paths of the files of plugins. The folders to search are known only after all files are read."""
        for line, kind, attributes, location in self.texts:
            locate = functools.partial(self.located, folders=self.folders, location=location)
            name, value = attributes.get("name", ""), attributes["value"]
            value = property_value(kind, name, value, location, locate, self.allow_code)
            self.lines[line] = _tag("string", {**attributes, "value": value})

    def check_references(self) -> None:
        """Raise InputError for circular or too long chains of references, because Mitsuba follows them recursively."""
        depths = dict.fromkeys({*self.references, *(n for names in self.references.values() for n in names)}, 0)
        waiting = Counter(name for names in self.references.values() for name in names)
        ready = [name for name in depths if not waiting[name]]
        for name in ready:  # an object is appended to `ready` when all of its references have been followed
            for inner in self.references.get(name, ()):
                depths[inner] = max(depths[inner], depths[name] + 1)
                waiting[inner] -= 1
                if not waiting[inner]:
                    ready.append(inner)
        deepest = max(depths.values(), default=0)
        if deepest > MAX_DEPTH or len(ready) < len(depths):
            what = f"references are chained {deepest} times, at most {MAX_DEPTH} are possible"
            if len(ready) < len(depths):
                what = f"the object '{min(set(depths) - set(ready))}' is part of itself, or refers to one that is"
            raise InputError(what, str(self.file), "leave some references out")

    def located(self, name: str, folders: list[Path], location: str) -> str:
        """The absolute path of a file that the scene names. Raises InputError if it must not be read."""
        try:
            choices = [folder / name for folder in folders]
            path = next((choice for choice in choices if os.path.exists(choice)), self.folder / name)
            own = path.resolve().is_relative_to(plugin_search.package().resolve())
        except (OSError, ValueError, RuntimeError) as error:
            raise InputError(f"no usable file name: {error}", location, "give a file beside the scene") from None
        if not own:
            self.files[os.path.relpath(path, self.folder)] = path
        return readable(name, path, self.folder, location, self.allow_outside or own)

    # ------------------------------------------------------------------ parameters

    def replaced(self, value: str, location: str) -> str:
        """A value in which parameters are replaced by their values. After each $, the longest matching name is used."""
        if "$" not in value:
            return value
        first, *others = re.split(r"(?<!\\)\$", value)
        result, length = [first.replace("\\$", "$")], len(first)
        for text in others:
            name = next((text[:n] for n in self.lengths if text[:n] in self.values), None)
            if name is None:
                unknown = re.match(r"\w*", text)[0]  # type: ignore[index]  # it matches any text
                hint = did_you_mean(unknown, list(self.values)[:200]) if self.values else "give it a <default>"
                raise InputError(f"the parameter ${unknown} has no value", location, hint)
            self.used.add(name)
            self.count(location)
            rest = text[len(name) :].replace("\\$", "$")
            length += len(self.values[name]) + len(rest)
            self.grown += len(self.values[name])
            if length > MAX_VALUE or self.grown > MAX_BYTES:
                raise InputError(
                    f"parameters such as ${name} make the text too long", location, "write the values directly"
                )
            result += [self.values[name], rest]
        return "".join(result)

    def add(self, name: str, value: str, location: str) -> None:
        """Set the default of a parameter."""
        if len(name) > MAX_PARAMETER:
            raise InputError(f"a parameter's name of {len(name)} characters", location, f"use {MAX_PARAMETER} or fewer")
        self.values.setdefault(name, value)
        if len(name) not in self.lengths:
            self.lengths = sorted({*self.lengths, len(name)}, reverse=True)

    def count(self, location: str) -> None:
        """Count an element or a replaced parameter. Raises InputError if there are too many of them."""
        self.elements += 1
        if self.elements > MAX_ELEMENTS:
            raise InputError(f"more than {MAX_ELEMENTS} elements", location, "keep large data in other files")


class _File:
    """The handlers for the elements of one file of a scene, which the parser calls."""

    def __init__(
        self, scene: _Reader, file: Path, folders: list[Path], included: Mapping[str, str] | None, level: int
    ) -> None:
        self.scene, self.file, self.folders, self.included, self.level = scene, file, folders, included, level
        self.open: list[str] = []  # enclosing elements; "" for those that are resolved here and not written
        self.kinds: list[str] = []  # plugin types of the same elements
        self.ids: list[str] = []  # ids of the same elements
        self.parser = expat.ParserCreate()
        self.parser.StartDoctypeDeclHandler = self.parser.EntityDeclHandler = self._refused
        self.parser.StartElementHandler, self.parser.EndElementHandler = self._start, self._end

    @property
    def location(self) -> str:
        return f"{self.file}:{self.parser.CurrentLineNumber}"

    def _refused(self, *_: object) -> NoReturn:
        raise InputError("it declares a document type or entities, which may grow without bounds", self.location)

    def _start(self, tag: str, given: dict[str, str]) -> None:
        scene = self.scene
        scene.count(self.location)
        if len(self.open) >= MAX_DEPTH:
            raise InputError(f"more than {MAX_DEPTH} nested elements", self.location)
        if len(self.open) > 1 and not self.open[-1]:
            raise InputError(
                f"<{tag}> is inside an element that cannot contain other elements", self.location, "correct it there"
            )
        attributes = {name: scene.replaced(value, self.location) for name, value in given.items()}
        written = tag
        if not self.open:
            written = self._root(tag, attributes)
        elif tag in ("default", "include", "path"):
            getattr(self, f"_{tag}")(attributes)
            written = ""
        self.open.append(written)
        self.kinds.append(attributes.get("type", ""))
        self.ids.append("" if tag == "ref" else attributes.get("id", ""))
        if written:
            self._write(tag, attributes)

    def _end(self, tag: str) -> None:
        self.kinds.pop()
        self.ids.pop()
        if self.open.pop():
            self._line(f"</{tag}>")

    def _line(self, text: str) -> None:
        self.scene.lines.append(text)
        self.scene.origins.append((self.file, self.parser.CurrentLineNumber))

    # ------------------------------------------------------------------ elements

    def _write(self, tag: str, attributes: dict[str, str]) -> None:
        """Append an element after checking its plugin and its files."""
        scene = self.scene
        if "type" in attributes and (tag in OBJECTS or tag == "spectrum"):
            kind = attributes["type"]
            file = plugin_search.check(kind, self.location, scene.folder, scene.allow_code)
            if file is not None:
                scene.files[f"plugins/{file.name}"], scene.runs_code = file, True
        elif tag == "spectrum" and attributes.get("filename"):
            attributes = {**attributes, "filename": scene.located(attributes["filename"], self.folders, self.location)}
        elif tag == "string" and "value" in attributes and len(self.kinds) > 1:
            scene.texts.append((len(scene.lines), self.kinds[-2], attributes, self.location))
        self._note_reference(tag, attributes)
        self._line(_tag(tag, attributes))

    def _note_reference(self, tag: str, attributes: Mapping[str, str]) -> None:
        """Record the objects on which a named object depends: objects to which it refers, and named ones inside it."""
        references, name = self.scene.references, attributes.get("id", "")
        if tag == "alias":
            references.setdefault(attributes.get("as", ""), set()).add(name)
        elif name and (outer := next(filter(None, reversed(self.ids[:-1])), "")):
            references.setdefault(outer, set()).add(name)

    def _default(self, attributes: Mapping[str, str]) -> None:
        name, value = self._required("default", attributes, "name", "value")
        self.scene.add(name, value, self.location)

    def _path(self, attributes: Mapping[str, str]) -> None:
        (value,) = self._required("path", attributes, "value")
        if len(self.open) != 1:
            raise InputError("<path> is inside another element", self.location, "put it into <scene> itself")
        try:
            choices = [folder / value for folder in (self.file.parent.resolve(), *self.folders)]
            path = next((choice for choice in choices if choice.is_dir()), None)
            outside = path is not None and not path.resolve().is_relative_to(self.scene.folder)
        except (OSError, ValueError, RuntimeError) as error:
            raise InputError(f"no usable folder name: {error}", self.location) from None
        if path is None:
            raise InputError(f"no folder '{value}'", self.location, "folders are relative to the scene's")
        if outside and not self.scene.allow_outside:
            what = f"'{value}' lies outside the scene's folder {self.scene.folder}"
            raise InputError(what, self.location, "copy it there, or use --allow-outside")
        self.folders.insert(0, path)

    def _include(self, attributes: Mapping[str, str]) -> None:
        (name,) = self._required("include", attributes, "filename")
        if self.level + 1 >= MAX_INCLUDES:
            raise InputError(f"more than {MAX_INCLUDES} nested includes", self.location)
        folders = [self.file.parent.resolve(), *self.folders]
        path = Path(self.scene.located(name, folders, self.location))
        self.scene.parse(path, folders, attributes, self.level + 1)

    def _root(self, tag: str, attributes: dict[str, str]) -> str:
        """The root element as it is written: "" for an included scene, of which only the content is written; any other
        included object gets the name of its <include>."""
        if tag not in OBJECTS:
            raise InputError(f"the file begins with <{tag}>", self.location, "a <scene> or another object is expected")
        (version,) = self._required(tag, attributes, "version")
        if self.included is None:
            self.scene.version = version
            return tag
        if _is_old(version) != _is_old(self.scene.version):
            what = f"a file of version {version} is included in a scene of version {self.scene.version}"
            raise InputError(what, self.location, "names of properties changed in version 2: write both in the same")
        del attributes["version"]
        attributes.pop("name", None)
        if "name" in self.included:
            attributes["name"] = self.included["name"]
        return "" if attributes.get("type", tag) == "scene" else tag

    def _required(self, tag: str, attributes: Mapping[str, str], *names: str) -> list[str]:
        """The values of attributes that an element must have."""
        for name in names:
            if name not in attributes:
                raise InputError(f"<{tag}> has no {name}", self.location, f'<{tag} {name}="..."/>')
        return [attributes[name] for name in names]


def _is_old(version: str) -> bool:
    """Whether Mitsuba interprets the property names of a file as those of versions before 2."""
    return version.strip().split(".")[0] in ("0", "1")


def _tag(tag: str, attributes: Mapping[str, str]) -> str:
    """The start tag of an element, with escaped attribute values."""
    written = [f' {name}="{value.translate(_ESCAPES)}"' for name, value in attributes.items()]
    return f"<{tag}{''.join(written)}>"
