"""Classes in Python files of the user, named by FILE.py:NAME.

Loading such a class runs the file. A file runs only if the user named it (on the command line, in a program or in
another such file) or if a scene for which code is allowed names it.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import inspect
import os
import re
import sys
import traceback
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

from .. import members
from ..errors import GonioError, InputError, did_you_mean

_CODE = re.compile(r"(?P<file>.+\.py):(?P<name>\w[\w-]*)")
PREFIX = "gonio_file_"  # prefix of the names of such modules in sys.modules

Stamp = tuple[int, int]
_loaded: dict[Path, tuple[Stamp, ModuleType]] = {}


def names_code(text: str) -> bool:
    """Whether a string has the form FILE.py:CLASS."""
    return _CODE.fullmatch(text.strip()) is not None


def member(
    text: str, folder: Path | None = None, where: str = "MODEL", family: members.Family[Any] | None = None
) -> str:
    """Register the member that FILE.py:NAME refers to (a distribution, a masking term etc.) and return its name.

    text    FILE.py:NAME
    folder  the folder to which the path is relative; by default the current folder
    where   the place of the string, for errors
    family  the family to which the member must belong; None accepts any
    Raises InputError if there is no such file or member, or if it belongs to another family.
    """
    named = thing(text, folder, where)
    return _added(named, place_of(named), family)


def absolute(text: str) -> str:
    """FILE.py:NAME with an absolute path, for another process; any other string is returned unchanged."""
    match = _CODE.fullmatch(text.strip())
    return text if match is None else f"{Path(os.path.expanduser(match['file'])).absolute()}:{match['name']}"


def member_name(value: object, where: str, family: members.Family[Any] | None = None) -> object:
    """The name of a member that a program passes: a class of a family or an instance of one, which is registered, or
    FILE.py:NAME, relative to the file of the calling line. Any other value is returned unchanged.

    A string runs code only if a line of a program passes it to Gonio, never if it comes from a scene, page or document.
    For `where` and `family`, see `member`.
    """
    if isinstance(value, str):
        folder = _folder_of_caller() if names_code(value) else None
        return value if folder is None else member(value, folder, where, family)
    return _added(value, where, family) if isinstance(getattr(value, "family", None), members.Family) else value


def option(text: str | None, where: str, family: members.Family[Any] | None) -> str | None:
    """The name of the member that an option specifies by name or as FILE.py:NAME, a file that is then run.

    For `where` and `family`, see `member`.
    """
    return text if text is None or not names_code(text) else member(text, None, where, family)


def _added(named: object, where: str, family: members.Family[Any] | None) -> str:
    own = members.family_of(named)
    if family is not None and own is not family:
        name = getattr(named, "__name__", type(named).__name__)
        what = f"{name} is {members.with_article(own.kind)}, {members.with_article(family.kind)} expected"
        raise InputError(what, where, "known: " + ", ".join(family.all()))
    return own.add(named, where)


def thing(text: str, folder: Path | None = None, where: str = "MODEL") -> object:
    """The object that FILE.py:NAME refers to: a class, or an instance of a distribution, a masking term etc.

    folder  the folder to which the path is relative; by default the current folder
    where   the place of the string, for errors
    Raises InputError if there is no such file or object, or if running the file fails.
    """
    match = _CODE.fullmatch(text.strip())
    if match is None:
        raise InputError(f"'{text}' names no class in a file", where, "give FILE.py:CLASS, such as ward.py:Ward")
    try:
        path = ((folder or Path()) / Path(os.path.expanduser(match["file"]))).resolve()
    except (OSError, RuntimeError, ValueError) as error:  # circular links, an unknown user, a zero byte
        raise InputError(f"'{match['file']}' is not a file path: {error}", where, "give FILE.py:CLASS") from None
    module, name = module_of(path, where), match["name"]
    named = vars(module).get(name)
    if not isinstance(named, type) and not isinstance(getattr(named, "family", None), members.Family):
        own = [n for n, v in vars(module).items() if isinstance(v, type) and v.__module__ == module.__name__]
        raise InputError(f"no class '{name}' in the file", str(path), did_you_mean(name, own) if own else "it has none")
    return named


_CONSTRUCTING = (
    "gonio.material.bsdf",
    "gonio.material.constructing",
    "gonio.material.kinds",
    "gonio.material.parameters",
    __name__,
)  # modules in the call stack of a constructor


def _folder_of_caller() -> Path | None:
    """The folder of the file whose line called a material's constructor or declared a parameter; the current folder at
    a prompt. None if that line is in Gonio, which passes on strings of scenes and pages."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        code, module = frame.f_code, str(frame.f_globals.get("__name__", ""))
        generated = code.co_name == "__init__" and code.co_filename.startswith("<")
        if not generated and code.co_name != "__post_init__" and module not in _CONSTRUCTING:
            break
        frame = frame.f_back
    if frame is None or module.partition(".")[0] == __name__.partition(".")[0]:
        return None
    file = Path(frame.f_code.co_filename)
    return file.resolve().parent if file.is_file() else Path()


def files_in(text: str) -> list[Path]:
    """The Python files that a material's description names, including those of inner materials and members."""
    return [Path(match["file"]) for match in re.finditer(r"(?P<file>[^({=,\s]+\.py):\w[\w-]*", text)]


def with_imports(path: Path) -> list[Path]:
    """A Python file and, recursively, the local files that it imports, on all of which its behavior depends."""
    files: dict[Path, None] = {}
    waiting = [path]
    while waiting:
        file = waiting.pop()
        if file in files:
            continue
        files[file] = None
        try:
            nodes = list(ast.walk(ast.parse(file.read_bytes())))
        except (OSError, SyntaxError, ValueError):
            continue
        names = [name.name for node in nodes if isinstance(node, ast.Import) for name in node.names]
        names += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
        for first in {name.partition(".")[0] for name in names}:
            # "" is `from . import`: the entire package
            package = path.parent / first if first else file.parent
            local = [
                path.parent / f"{first}.py",
                *(package.rglob("*.py") if (package / "__init__.py").is_file() else []),
            ]
            waiting += [one for one in local if one.is_file()]
    return list(files)


def forget() -> None:
    """Discard all loaded files: each is run again on its next use, even if it is unchanged, because its imports may
    have changed."""
    _loaded.clear()


def is_outside(cls: type) -> bool:
    """Whether a class comes from a file of the user."""
    return cls.__module__.startswith(PREFIX)


# --------------------------------------------------------------------------- running a file


def module_of(path: Path, where: str) -> ModuleType:
    """The module of a file, which is run if it has not been run or has changed since.

    where  the place of the file's name, for errors
    Raises InputError if the file cannot be read or fails to run.
    """
    try:
        about = path.stat()
        source = path.read_bytes() if path.is_file() else None
    except (OSError, ValueError) as error:
        raise InputError(f"no file '{path}'", where, str(getattr(error, "strerror", "") or "")) from None
    if source is None:
        raise InputError(f"'{path}' is not a file", where)
    stamp = (about.st_mtime_ns, about.st_size)
    if path in _loaded and _loaded[path][0] == stamp:
        return _loaded[path][1]
    name = PREFIX + hashlib.sha256(str(path).encode("utf-8", "surrogateescape")).hexdigest()[:16]
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    before = sys.modules.get(name)
    sys.modules[name] = module  # dataclasses and pickle look up the module of a class
    sys.path.insert(0, str(path.parent))  # a file may import modules from its folder
    try:
        exec(compile(source, str(path), "exec"), vars(module))
    except (KeyboardInterrupt, GeneratorExit):
        raise
    except BaseException as error:
        sys.modules.pop(name)
        if before is not None:
            sys.modules[name] = before
        raise _located(error, path) from error
    finally:
        sys.path.remove(str(path.parent))
    _loaded[path] = stamp, module
    return module


def _located(error: BaseException, path: Path) -> GonioError:
    """An error, raised while a file ran, as a GonioError with file and line."""
    if isinstance(error, SyntaxError) and error.filename:
        text = f": {error.text.strip()}" if error.text else ""
        return InputError(
            f"{type(error).__name__}: {error.msg}{text}", f"{error.filename}:{error.lineno}", "correct the line"
        )
    place = line_in(error, path) or str(path)
    if isinstance(error, GonioError):
        return InputError(error.what, f"{place}: {error.where}" if error.where else place, error.hint)
    text = str(error).strip().partition("\n")[0]
    if "before setting a variant" in text:  # a file of plugins: the verifier sets one
        hint = f"to judge a Mitsuba BSDF, give its registered name: gonio verify {path.name}:NAME"
        return InputError(f"{type(error).__name__}: {text.partition('.')[0]}", place, hint)
    return InputError(f"{type(error).__name__}: {text}" if text else type(error).__name__, place, "the file must run")


def line_in(error: BaseException, path: Path) -> str:
    """FILE:LINE of the innermost frame of an error's traceback in a file; "" if there is none."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename) == path]
    return f"{path}:{frames[-1].lineno}" if frames else ""


def place_of(thing: object) -> str:
    """FILE:LINE of a class, or of an instance's class; the name of the class if they are unknown."""
    cls = thing if isinstance(thing, type) else type(thing)
    try:
        file = inspect.getsourcefile(cls)
        return f"{file}:{inspect.getsourcelines(cls)[1]}"
    except (OSError, TypeError):
        return cls.__qualname__
