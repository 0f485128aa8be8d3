"""Materials in files of the user's own: FILE.py:CLASS, which is code, and files of data.

A file runs only where the user named it, or allowed a scene to: `load` is called for what stands on the command line or
in a program, and by the reader of scenes where code is allowed.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import re
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np

from .. import members
from ..errors import GonioError, InputError, did_you_mean
from ..material import tree
from ..material.bsdf import BSDF
from ..material.sample import Sample
from ..ops import RecordingError
from ..owner import alone
from . import documents

_CODE = re.compile(r"(?P<file>.+\.py):(?P<name>\w+)")
PREFIX = "gonio_file_"  # of the names under which such modules stand in sys.modules

Stamp = tuple[int, int]
_loaded: dict[Path, tuple[Stamp, ModuleType]] = {}


def names_code(text: str) -> bool:
    """Whether a text is FILE.py:CLASS."""
    return _CODE.fullmatch(text.strip()) is not None


def reader_of(text: str) -> type[BSDF] | None:
    """The material that a file of data is, by the file's name: Measured of "gold.binary"; None where it is none."""
    return next((cls for cls in BSDF.family.all().values() if cls.reads(text)), None)


def names_data(text: str) -> bool:
    """Whether a text names a file of data that is a material: measured values, or another program's description."""
    return reader_of(text) is not None or documents.names_document(text)


def load(text: str, folder: Path | None = None, where: str = "MODEL") -> type[BSDF]:
    """The material class that FILE.py:CLASS names; the file is run, once for each state in which it was saved.

    folder  what a relative path starts from; the current folder if not given
    Raises InputError, with file and line, where the file cannot be run or has no such class.
    """
    return _material(thing(text, folder, where))


def member(text: str, folder: Path | None = None, where: str = "MODEL") -> str:
    """The name of what FILE.py:CLASS names: a distribution, a masking term or another member, which is registered."""
    named = thing(text, folder, where)
    return members.family_of(named).add(named, f"{inspect.getsourcefile(named)}{_line_of(named)}")


def thing(text: str, folder: Path | None = None, where: str = "MODEL") -> type:
    """The class that FILE.py:CLASS names, whatever it is; see `load`."""
    match = _CODE.fullmatch(text.strip())
    if match is None:
        raise InputError(f"'{text}' names no class in a file", where, "FILE.py:CLASS, such as ward.py:Ward")
    try:
        path = ((folder or Path()) / Path(match["file"]).expanduser()).resolve()
    except (OSError, RuntimeError, ValueError) as error:  # links in a circle, no such user, a zero byte
        raise InputError(f"'{match['file']}' is no path of a file: {error}", where, "FILE.py:CLASS") from None
    module, name = module_of(path, where), match["name"]
    named = vars(module).get(name)
    if not isinstance(named, type):
        own = [n for n, v in vars(module).items() if isinstance(v, type) and v.__module__ == module.__name__]
        raise InputError(f"no class '{name}' in it", str(path), did_you_mean(name, own) if own else "it has none")
    return named


def _material(cls: type) -> type[BSDF]:
    """The class itself as a material; InputError where it cannot be one."""
    place = f"{inspect.getsourcefile(cls)}{_line_of(cls)}"
    if not issubclass(cls, BSDF):
        return adopt(cls, place)
    if cls.eval is BSDF.eval:
        raise InputError(f"{cls.__name__} has no eval", place, "write eval(self, wo, wi, mode): f |cos theta_i|")
    known = BSDF.family.all().get(cls.name)
    if known is not None and known.__module__.startswith("gonio.") and not known.overridable:
        what = f"{cls.__name__} shadows Gonio's material '{cls.name}'"
        raise InputError(what, place, f"give the class another name, such as My{cls.__name__}")
    return cls


def files_in(text: str) -> list[Path]:
    """The files that a material's text names, those of inner materials and members too."""
    return [Path(match["file"]) for match in re.finditer(r"(?P<file>[^({=,\s]+\.py):\w+", text)]


def adopt(cls: type, where: str = "") -> type[BSDF]:
    """A class that is no gonio.BSDF but has `eval`, as one: `pdf` and `sample` fall back to a guide found from it."""
    if not callable(getattr(cls, "eval", None)):
        raise InputError(f"{cls.__name__} has no eval", where, "write eval(self, wo, wi): f |cos theta_i|")
    try:
        inner = cls()
    except Exception as error:
        raise InputError(f"{cls.__name__}() fails: {type(error).__name__}: {error}", where, "give defaults") from None
    kept: dict[str, object] = {}
    for name in ("eval", "pdf", "sample"):
        if callable(getattr(cls, name, None)):
            kept[name] = _forward(inner, name)
    for name in ("transmits", "isotropic", "delta", "stochastic", "known_violations", "lossless_tolerance"):
        if hasattr(cls, name):
            kept[name] = getattr(inner, name)
    namespace = {**kept, "__doc__": cls.__doc__, "__module__": cls.__module__, "__annotations__": {}}
    return type(cls.__name__, (BSDF,), namespace)


def _forward(inner: object, name: str) -> Callable[..., object]:
    formula = getattr(inner, name)
    takes_mode = "mode" in inspect.signature(formula).parameters
    if name == "pdf":
        return lambda self, wo, wi: formula(wo, wi)

    def forwarded(self: object, wo: object, other: object, mode: str = "radiance") -> object:
        return formula(wo, other, mode) if takes_mode else formula(wo, other)

    return forwarded


def forget() -> None:
    """Run files anew when they are asked for next, also those that did not change: what they import may have."""
    _loaded.clear()


def is_outside(cls: type) -> bool:
    """Whether a class came from a file that `load` ran."""
    return cls.__module__.startswith(PREFIX)


# --------------------------------------------------------------------------- running a file


def module_of(path: Path, where: str) -> ModuleType:
    """The file's module, run where it has not been since it was saved."""
    try:
        about = path.stat()
        source = path.read_bytes() if path.is_file() else None
    except (OSError, ValueError) as error:
        raise InputError(f"no file '{path}'", where, str(getattr(error, "strerror", "") or "")) from None
    if source is None:
        raise InputError(f"'{path}' is no file", where)
    stamp = (about.st_mtime_ns, about.st_size)
    if path in _loaded and _loaded[path][0] == stamp:
        return _loaded[path][1]
    name = PREFIX + hashlib.sha256(str(path).encode("utf-8", "surrogateescape")).hexdigest()[:16]
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    before = sys.modules.get(name)
    sys.modules[name] = module  # dataclasses and pickles look a class's module up
    sys.path.insert(0, str(path.parent))  # a file may import its neighbours
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
    """What went wrong while a file ran, with file and line."""
    if isinstance(error, SyntaxError) and error.filename:
        text = f": {error.text.strip()}" if error.text else ""
        return InputError(
            f"{type(error).__name__}: {error.msg}{text}", f"{error.filename}:{error.lineno}", "mend the line"
        )
    place = line_in(error, path) or str(path)
    if isinstance(error, GonioError):
        return InputError(error.what, f"{place}: {error.where}" if error.where else place, error.hint)
    text = str(error).strip().partition("\n")[0]
    return InputError(f"{type(error).__name__}: {text}" if text else type(error).__name__, place, "the file must run")


def line_in(error: BaseException, path: Path) -> str:
    """file:line of the innermost call in a file, "" where there is none."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename) == path]
    return f"{path}:{frames[-1].lineno}" if frames else ""


def _line_of(cls: type) -> str:
    try:
        return f":{inspect.getsourcelines(cls)[1]}"
    except (OSError, TypeError):
        return ""


# --------------------------------------------------------------------------- trying a material


@alone
def probe(material: BSDF) -> BSDF:
    """The material itself, after its formulas were tried on two directions. InputError, with file and line, where one
    raises, uses Python's `if` on a value, or returns what it must not: better than a failure deep inside a render."""
    if any(is_outside(type(inner)) for _, inner in tree.walk(material)):
        _try(material)
    return material


WO = np.array([[0.0, 0.6, 0.8], [0.36, -0.48, 0.8]])
WI = np.array([[0.48, 0.36, 0.8], [-0.8, 0.0, 0.6]])
U = np.array([[0.3, 0.7, 0.2], [0.8, 0.1, 0.6]])


def _try(material: BSDF) -> None:
    """By recording, which compiles nothing; by running it where code is for Dr.Jit alone and cannot be recorded."""
    path = Path(inspect.getsourcefile(inspect.unwrap(type(material).eval)) or "")
    for formula in ("eval", "pdf", "sample"):
        if material.stochastic or not _recorded(material, formula, path):
            _run(material, formula, path)


def _recorded(material: BSDF, formula: str, path: Path) -> bool:
    """Whether a formula can be recorded; then its answer has the right kinds of values."""
    try:
        result = material.record(formula).entry.result
    except RecordingError as error:
        if "`if`" in error.what:  # a single ray would pass it unseen
            raise InputError(error.what, error.where, error.hint) from error
        return False
    except Exception:
        return False
    parts = {"wi": result.wi, "weight": result.weight, "pdf": result.pdf} if isinstance(result, Sample) else {}
    if formula == "sample" and not parts:
        raise _wrong_sample(material, result, path)
    for name, value in parts.items() if parts else [(formula, result)]:
        kind = getattr(value, "type", type(value).__name__)
        expected = KINDS[name]
        if kind not in expected:
            what = f"{formula if not parts else f'sample: {name}'} returned a {kind}, a {expected[0]} expected"
            hint = "multiply by a colour of the material" if name in ("eval", "weight") else ""
            raise InputError(what, _place(type(material), formula, path), hint)
    return True


KINDS = {"eval": ("spectrum", "vec3"), "weight": ("spectrum", "vec3"), "pdf": ("float",), "wi": ("vec3",)}


def _run(material: BSDF, formula: str, path: Path) -> None:
    cls = type(material)
    call = getattr(material, formula)
    value = _called(material, formula, path, lambda: call(WO, U if formula == "sample" else WI))
    if formula != "sample":
        _check_shape(formula, value, (2, 3) if formula == "eval" else (2,), path, cls)
        return
    if not isinstance(value, Sample):
        raise _wrong_sample(material, value, path)
    for part, shape in (("wi", (2, 3)), ("weight", (2, 3)), ("pdf", (2,))):
        _check_shape(f"sample: {part}", getattr(value, part), shape, path, cls)


def _wrong_sample(material: BSDF, value: object, path: Path) -> InputError:
    what = f"sample returned {type(value).__name__}, a gonio.Sample expected"
    return InputError(what, _place(type(material), "sample", path), "return go.Sample(wi, weight, pdf, delta, eta)")


def _called(material: BSDF, formula: str, path: Path, call: Callable[[], object]) -> object:
    try:
        return call()
    except (KeyboardInterrupt, GonioError):
        raise
    except Exception as error:
        text = str(error).strip().partition("\n")[0]
        place = line_in(error, path) or _place(type(material), formula, path)
        raise InputError(f"{type(error).__name__}: {text}", place, _remedy(text)) from error


def _remedy(text: str) -> str:
    if "__bool__" in text or "truth" in text or "bool" in text:
        return "a value differs from ray to ray: use where(mask, a, b) instead of if, &, | and ~"
    if "integer" in text or "iter" in text or "range" in text:
        return "a loop must have a length that is known before anything runs"
    return "mend the formula: it must run on Dr.Jit values, in the words of gonio.ops"


def _check_shape(what: str, value: object, shape: tuple[int, ...], path: Path, cls: type[BSDF]) -> None:
    formula = what.split(":")[0]
    if not isinstance(value, np.ndarray) or value.shape != shape:
        given = f"shape {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
        expected = "a spectrum (N, 3)" if shape == (2, 3) and "wi" not in what else f"shape {('N', *shape[1:])}"
        hint = "multiply by a colour of the material, or return spectrum values" if formula == "eval" else ""
        raise InputError(f"{what} returned {given} for two rays, {expected} expected", _place(cls, formula, path), hint)


def _place(cls: type[BSDF], formula: str, path: Path) -> str:
    code = getattr(inspect.unwrap(getattr(cls, formula)), "__code__", None)
    return f"{path}:{code.co_firstlineno}" if code is not None and Path(code.co_filename) == path else str(path)
