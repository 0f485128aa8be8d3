"""One module for the shaders of several materials, in which common declarations appear once."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping

import numpy as np

from ..ops.table import Table
from . import text as texts
from .languages import Language
from .manifest import Json, manifest
from .names import Names
from .placement import Placement
from .program import Program
from .text import Block


class Module:
    """A text to which shaders are added one at a time.

    head    the comment at the beginning of the text
    blocks  the declarations
    tables  name of the uniform -> table
    """

    def __init__(self, language: Language, placement: Placement, constants: bool = False) -> None:
        self.language, self.placement, self.constants = language, placement, constants
        self.head: list[str] = []
        self.blocks: list[Block] = []
        self.tables: dict[str, Table] = {}
        self._declared: dict[str, list[Block]] = {}  # by name without prefix
        self._bindings: dict[str, int] = {}  # by the name of a table's block

    def add(self, made: Program, numbers: Mapping[str, Json]) -> dict[str, Json]:
        """Add a material's shader and return its manifest.

        A name that is already declared differently, or that depends on such a name, is replaced by NAME_2.

        numbers  values of the numeric parameters, by path
        """
        names = Names(made, self.language, self.placement)
        bindings = self._numbered(made, names)
        written = self._written(made, names, numbers, bindings)
        renamed = self._conflicts(written)
        if renamed:
            names = Names(made, self.language, self.placement, renamed)
            bindings = self._numbered(made, names)
            written = self._written(made, names, numbers, bindings)
        for block in written:
            name = renamed.get(block.name, block.name)
            if any(self._same(block, other) for other in self._declared.get(name, ())):
                continue
            self._declared.setdefault(name, []).append(block)
            self.blocks.append(block)
            if block.table is not None:
                self.tables[names.table(block.table, "table_")] = block.table
                self._bindings[name] = bindings[id(block.table)]
        self.head += [*([""] if self.head else []), *texts.head(made, names)]
        return manifest(made, names, numbers, bindings)

    def _written(
        self, made: Program, names: Names, numbers: Mapping[str, Json], bindings: Mapping[int, int]
    ) -> list[Block]:
        blocks = texts.blocks(made, names, bindings)
        return [*blocks, texts.values(made, names, numbers)] if self.constants else blocks

    def _numbered(self, made: Program, names: Names) -> dict[int, int]:
        """The binding of each table: the existing binding, or the next free one."""
        bindings: dict[int, int] = {}
        following = self.placement.first_binding + len(self._bindings)
        for table in made.tables:
            name = names.table(table, "table_").removeprefix(self.placement.prefix)
            tables = [block.table for block in self._declared.get(name, ()) if block.table is not None]
            if any(_same_table(table, other) for other in tables):
                bindings[id(table)] = self._bindings[name]
            else:
                bindings[id(table)] = following
                following += 1
        return bindings

    def _conflicts(self, written: list[Block]) -> dict[str, str]:
        """Names of a shader that have another meaning in the module -> free names, or names of equal declarations."""
        used = {*self._declared, *(block.name for block in written)}
        renamed: dict[str, str] = {}
        decided = -1
        while decided < len(renamed):  # another overload of a name may follow functions that call the first
            decided = len(renamed)
            self._rename(written, used, renamed)
        return renamed

    def _rename(self, written: list[Block], used: set[str], renamed: dict[str, str]) -> None:
        """Add the names that must be replaced because those in `renamed` are replaced."""
        for block in written:
            others = self._declared.get(block.name, [])
            needed = set(re.findall(r"\w+", "\n".join(_code(block)))) & set(_words(renamed, self.placement.prefix))
            if block.name not in renamed and others and (needed or any(self._clash(block, o) for o in others)):
                renamed[block.name] = self._another(block, used | set(renamed.values()), renamed)

    def _another(self, block: Block, used: set[str], renamed: Mapping[str, str]) -> str:
        """The first of NAME_2, NAME_3, ... whose declaration is the same or that is free."""
        for count in itertools.count(2):
            name = f"{block.name}_{count}"
            words = _words({**renamed, block.name: name}, self.placement.prefix)
            code = [_replaced(line, words) for line in _code(block)]
            declared = self._declared.get(name, [])
            if name not in used or any(_code(o) == code and _equal_tables(o, block) for o in declared):
                return name
        raise AssertionError("endless")

    def _clash(self, block: Block, other: Block) -> bool:
        """Whether two declarations of the same name cannot coexist in a module."""
        if self._same(block, other):
            return False
        overloaded = block.kind == other.kind == "function" and self.language.overloads
        return not overloaded or _types(block) == _types(other)

    def _same(self, block: Block, other: Block) -> bool:
        return block.kind == other.kind and _code(block) == _code(other) and _equal_tables(block, other)


def _words(renamed: Mapping[str, str], prefix: str) -> dict[str, str]:
    """Words of a text -> replacements; for a table, these include its texture and the functions that read it."""
    words = {}
    for name, other in renamed.items():
        words[prefix + name] = prefix + other
        if name.startswith("table_"):
            for how in ("lookup_", "fetch_"):
                words[prefix + how + name.removeprefix("table_")] = prefix + how + other.removeprefix("table_")
    return words


def _replaced(line: str, words: Mapping[str, str]) -> str:
    return re.sub(r"\w+", lambda word: words.get(word[0], word[0]), line)


def _same_table(table: Table, other: Table) -> bool:
    return table is other or np.array_equal(table.values, other.values)


def _equal_tables(block: Block, other: Block) -> bool:
    """Whether two blocks declare the same table, or none."""
    if block.table is None or other.table is None:
        return block.table is other.table
    return _same_table(block.table, other.table)


def _code(block: Block) -> list[str]:
    """The lines of a declaration without comments; for a table, without the binding, which the module chooses."""
    lines = [line.partition("//")[0].rstrip() for line in block.lines]
    return [line for line in lines if line][block.kind == "table" :]


def _types(block: Block) -> list[str]:
    """The types of a function's parameters, which distinguish overloads."""
    head = "".join(_code(block)).partition("{")[0]
    return re.findall(r"(\w+) \w+(?=[,)])", head)


def of_several(manifests: list[dict[str, Json]], language: Language) -> dict[str, Json]:
    """The manifest of a module: the manifests of all materials, and all textures."""
    textures = {texture["uniform"]: texture for each in manifests for texture in each["textures"]}
    shader = "materials" + language.suffix
    return {
        "version": 1,
        "lang": language.name,
        "shader": shader,
        "materials": [{**each, "shader": shader} for each in manifests],
        "textures": list(textures.values()),
    }
