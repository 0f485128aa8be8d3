"""The files of a WGSL shader: its own, and those that it imports by Bevy's #import, only from specified folders."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...errors import did_you_mean
from ..values import refuse
from .parser import parsed
from .preprocessor import preprocessed
from .syntax import Assertion, Declaration

MAX_FILES = 256
MAX_TEXT = 4 << 20  # total number of characters in all files
MAX_FOLDER = 4096  # number of entries of a folder that is searched for imports
_IMPORT_PATH = re.compile(r"^[ \t]*#[ \t]*define_import_path[ \t]+([\w:]+)", re.MULTILINE)


@dataclass
class Unit:
    """One file: its declarations, and its imports as name -> path."""

    where: str
    path: str
    declarations: dict[str, Declaration]
    assertions: list[Assertion]
    imports: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)


class Sources:
    """The files of a shader, each of which is read when one of its names is first used."""

    def __init__(self, text: str, where: str, defines: Mapping[str, str], folders: Sequence[Path]) -> None:
        self.defines, self.folders = defines, [folder.resolve() for folder in folders]
        self._size, self._units = 0, 0
        self._known: dict[str, Unit | None] = {}
        self._files: dict[str, Path] | None = None
        self.read: list[Path] = []
        self.main = self._unit(text, where)
        if self.main.path:
            self._known[self.main.path] = self.main

    def find(self, unit: Unit, name: str, line: int) -> tuple[Unit, Declaration] | None:
        """The declaration of a name in a file; None if there is none. `a::b` is resolved through the file's imports.

        Raises InputError, with file and line, for an import that is not found.
        """
        if name in unit.declarations:
            return unit, unit.declarations[name]
        first, _, rest = name.partition("::")
        imported = first in unit.imports
        if not imported and not rest:
            return None
        path = f"{unit.imports[first]}{'::' if rest else ''}{rest}" if imported else name
        module, _, item = path.rpartition("::")
        other = self._module(module) if module else None
        if other is not None and item in other.declarations:
            return other, other.declarations[item]
        place = f"{unit.where}:{unit.lines.get(first, line) if other is None else line}"
        if other is not None:
            raise refuse(f"'{other.where}' has no '{item}'", did_you_mean(item, list(other.declarations)), place)
        hint = "name the folder of the file in the adapter: includes = ['FOLDER']"
        raise refuse(f"no file with #define_import_path {module or path} in the named folders", hint, place)

    def _unit(self, text: str, where: str) -> Unit:
        self._size, self._units = self._size + len(text), self._units + 1
        if self._size > MAX_TEXT or self._units > MAX_FILES:
            raise refuse(f"more than {MAX_TEXT >> 20} MB of text or {MAX_FILES} files", "import less", where)
        left = preprocessed(text, where, self.defines)
        declarations, assertions = parsed(left.text, where)
        return Unit(where, left.path, declarations, assertions, left.imports, left.lines)

    def _module(self, path: str) -> Unit | None:
        if path not in self._known:
            file = self._located(path)
            self._known[path] = None
            if file is not None:
                self._known[path] = self._unit(file.read_text(encoding="utf-8", errors="replace"), file.name)
        return self._known[path]

    def _located(self, path: str) -> Path | None:
        if path.startswith('"'):
            for folder in self.folders:
                file = (folder / path.strip('"')).resolve()
                if file.is_relative_to(folder) and file.is_file():
                    return self._small(file)
            return None
        if self._files is None:
            self._files = {}
            for file in self._listed():
                with file.open(encoding="utf-8", errors="replace") as opened:
                    match = _IMPORT_PATH.search(opened.read(1 << 16))
                if match is not None:
                    self._files.setdefault(match[1], file)
        files = self._files.get(path)
        return files and self._small(files)

    def _listed(self) -> list[Path]:
        files: list[Path] = []
        for folder in self.folders:
            try:
                entries = sorted(one for one in folder.iterdir() if one.suffix == ".wgsl")
            except OSError as error:
                raise refuse(f"the folder '{folder}' cannot be read", str(error.strerror), "includes") from None
            inside = (one for one in entries if one.is_file() and one.resolve().is_relative_to(folder))
            files += list(inside)[: MAX_FOLDER - len(files)]
        return files

    def _small(self, file: Path) -> Path:
        if file.stat().st_size > MAX_TEXT:
            raise refuse(f"'{file.name}' has over {MAX_TEXT >> 20} MB", "import less", self.main.where)
        self.read.append(file)
        return file
