"""TSL, the shading language of three.js: a JavaScript module of functions that compose nodes."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import ClassVar

from .base import Language

_NODES = """
    abs atan bool bvec2 bvec3 clamp cos dot exp float floatBitsToInt floor int intBitsToFloat ivec2 ivec3 log max min
    mix normalize select sin sqrt texture texture3D vec2 vec3 vec4
"""
_TEXTURES = ("Data3DTexture", "DataTexture")
_RESERVED = """
    await break case catch class const continue debugger default delete do else enum export extends false finally for
    function if implements import in instanceof interface let new null package private protected public return static
    super switch this throw true try typeof var void while with yield arguments eval undefined NaN Infinity
    choose2 choose3 interpolated Math
"""


class TSL(Language):
    """A module for three.js, whose functions accept and return nodes; structs are plain objects of nodes."""

    name = "tsl"
    title = "TSL (three.js)"
    suffix = ".js"
    precision = "The renderer must compute at highp: 16 bits are not sufficient."
    words: ClassVar[Mapping[str, str]] = {
        **Language.words,
        "atan2": "atan({0}, {1})",
        "exponent": "float(floatBitsToInt({0}).shiftRight(int(23)).sub(int(127)))",
        "scaled": "{0}.mul(intBitsToFloat(int({1}).add(int(127)).shiftLeft(int(23))))",
    }
    helpers: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "choose2": ("const {name} = (mask, a, b) => vec2(select(mask.x, a.x, b.x), select(mask.y, a.y, b.y));",),
        "choose3": (
            "const {name} = (mask, a, b) => vec3(",
            "    select(mask.x, a.x, b.x), select(mask.y, a.y, b.y), select(mask.z, a.z, b.z));",
        ),
    }
    reserved = frozenset([*_RESERVED.split(), *_NODES.split(), *_TEXTURES])
    overloads = False
    parameters_change = False
    methods = True

    def array_declaration(self, type_: str, name: str, count: int) -> tuple[str, str]:
        return type_, name

    def array(self, type_: str, parts: list[str]) -> str:
        return f"[{', '.join(parts)}]"

    def signature(self, result: str, name: str, parameters: list[tuple[str, str]]) -> str:
        return f"export function {name}({', '.join(p for _, p in parameters)}) {{"

    def local(self, type_: str, name: str, text: str) -> str:
        return f"const {name} = {text};"

    def changeable(self, line: str) -> str:
        return line.replace("const ", "let ", 1)

    def constant(self, name: str, text: str) -> str:
        return f"const {name} = float({text});"

    def values(self, type_: str, name: str, parts: list[str]) -> str:
        return f"export const {name} = {type_}({', '.join(p if '(' in p else f'float({p})' for p in parts)});"

    def struct(self, name: str, fields: list[tuple[str, str]]) -> list[str]:
        names = ", ".join(field for _, field in fields)
        return [f"export const {name} = (", *(f"    {field}," for _, field in fields), f") => ({{ {names} }});"]

    def binding(self, name: str, dimension: int, place: int) -> list[str]:
        made = "texture(new DataTexture())" if dimension == 2 else "texture3D(new Data3DTexture())"
        return [f"export const {name} = {made};  // set its value"]

    def fetch(self, table: str, places: list[str]) -> str:
        return f"{table}.load(ivec{len(places)}({', '.join(places)}))"

    def finished(self, lines: Sequence[str], prefix: str) -> list[str]:
        """The lines, after imports of the names that occur."""
        text = "\n".join(lines)
        nodes, textures = (
            [name for name in names if re.search(rf"\b{name}\(", text)] for names in (_NODES.split(), _TEXTURES)
        )
        three = [f"import {{ {', '.join(textures)} }} from 'three';"] if textures else []
        names = textwrap.wrap(", ".join(nodes), 100)
        return [*three, "import {", *(f"    {line}" for line in names), "} from 'three/tsl';", "", *lines]
