"""Materials in user files: classes in Python files, FILE.py:CLASS, and data files.

A Python file is run only if the user has named it or has allowed a scene to name it: `load` is called for operands of
the command line and of programs, and by the reader of scenes for which code is allowed.
"""

from __future__ import annotations

import inspect
import linecache
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import GonioError, InputError
from ..material import tree
from ..material.bsdf import BSDF
from ..material.sample import Sample
from ..material.user_code import (
    PREFIX,
    files_in,
    forget,
    is_outside,
    line_in,
    member,
    module_of,
    names_code,
    option,
    place_of,
    thing,
    with_imports,
)
from ..members import with_article
from ..ops import ForbiddenOperator, RecordingError
from ..owner import exclusive
from . import shaders

__all__ = [
    "PREFIX", "adopt", "as_material", "check_operators", "files_in", "forget", "is_outside", "load", "member",
    "module_of", "names_code", "names_data", "option", "probe", "reader_of", "thing", "with_imports",
]  # fmt: skip


def reader_of(text: str) -> type[BSDF] | None:
    """The material class for a data file, from its name, such as Measured for "gold.binary"; None if there is none."""
    return next((cls for cls in BSDF.family.all().values() if cls.reads(text)), None)


def names_data(text: str) -> bool:
    """Whether a string names a data file that is a material: measured values or a shader."""
    return shaders.names_shader(text) or reader_of(text) is not None


def load(text: str, folder: Path | None = None, where: str = "MODEL") -> type[BSDF]:
    """The material class named by FILE.py:CLASS. The file is run once per saved version.

    folder  the base of a relative path; None for the current folder
    where   the location that errors name
    Raises InputError, with file and line, if the file cannot be run or has no such class.
    """
    return as_material(thing(text, folder, where))


def as_material(cls: object) -> type[BSDF]:
    """Convert a class to a material class. Raises InputError if this is not possible."""
    place = place_of(cls)
    family = getattr(cls, "family", BSDF.family)
    if family is not BSDF.family or not isinstance(cls, type):
        hint = f"use it in a material: conductor(ndf=FILE.py:{getattr(cls, '__name__', 'NAME')})"
        raise InputError(f"{with_article(family.kind)} given, a material class expected", place, hint)
    if is_plugin(cls):
        name = "".join(f"-{c.lower()}" if c.isupper() else c for c in cls.__name__).lstrip("-")
        hint = f"register it by mi.register_bsdf('{name}', {cls.__name__}), then run gonio verify FILE.py:{name}"
        raise InputError(f"{cls.__name__} is a Mitsuba BSDF, a Gonio material expected", place, hint)
    if not issubclass(cls, BSDF):
        return adopt(cls, place)
    if cls.eval is BSDF.eval:
        raise InputError(f"{cls.__name__} has no eval", place, "write eval(self, wo, wi, mode): f |cos theta_i|")
    known = BSDF.family.all().get(cls.name)
    if known not in (None, cls) and known.__module__.startswith("gonio.") and not known.overridable:
        what = f"{cls.__name__} shadows Gonio's material '{cls.name}'"
        raise InputError(what, place, f"give the class another name, such as My{cls.__name__}")
    return cls


def is_plugin(cls: object) -> bool:
    """Whether a class derives from Mitsuba's BSDF in any variant. Does not load Mitsuba."""
    bases = cls.__mro__ if isinstance(cls, type) else ()
    return any(base.__name__ == "BSDF" and base.__module__.startswith("mitsuba") for base in bases)


def adopt(thing: object, where: str = "") -> type[BSDF]:
    """A material class for a class with `eval` that does not derive from gonio.BSDF, or for an instance of it.

    `pdf` and `sample` use a guide that is computed from `eval`. Errors name `where`.
    """
    cls = thing if isinstance(thing, type) else type(thing)
    if not callable(getattr(cls, "eval", None)):
        raise InputError(f"{cls.__name__} has no eval", where, "write eval(self, wo, wi): f |cos theta_i|")
    try:
        inner = cls() if thing is cls else thing
    except Exception as error:
        raise InputError(f"{cls.__name__}() fails: {type(error).__name__}: {error}", where, "give defaults") from None
    members: dict[str, object] = {}
    for name in ("eval", "pdf", "sample"):
        if callable(getattr(cls, name, None)):
            members[name] = _forward(inner, name)
    for name in ("transmits", "isotropic", "delta", "stochastic", "known_violations", "lossless_tolerance"):
        if hasattr(cls, name):
            members[name] = getattr(inner, name)
    namespace = {**members, "__doc__": cls.__doc__, "__module__": cls.__module__, "__annotations__": {}}
    return type(cls.__name__, (BSDF,), namespace)


def _forward(inner: object, name: str) -> Callable[..., object]:
    formula = getattr(inner, name)
    takes_mode = "mode" in inspect.signature(formula).parameters
    if name == "pdf":
        return lambda self, wo, wi: formula(wo, wi)

    def forwarded(self: object, wo: object, other: object, mode: str = "radiance") -> object:
        return formula(wo, other, mode) if takes_mode else formula(wo, other)

    return forwarded


# --------------------------------------------------------------------------- tests of a material


@exclusive
def probe(material: BSDF) -> BSDF:
    """Test the formulas of a material for two directions, so that they do not fail later in a render; return the
    material.

    Raises InputError, with file and line, if a formula raises an exception, uses `if` on a value, or returns a wrong
    type.
    """
    if any(is_outside(type(inner)) for _, inner in tree.walk(material)):
        _try(material)
    return material


@exclusive
def check_operators(material: BSDF) -> BSDF:
    """Return the material. Raises InputError, with file and line, if a user's formula applies `**` to a value.

    A formula is recorded only if its file contains this operator. The verifier runs all other formulas in a supervised
    process, because they may not terminate.
    """
    classes = {type(inner) for _, inner in tree.walk(material)}
    files = [_file_of(cls) for cls in classes if not cls.__module__.startswith("gonio.")]
    if not any("**" in line for file in files for line in linecache.getlines(file)):
        return material
    for formula in ("eval", "pdf", "sample"):
        try:
            material.record(formula)
        except ForbiddenOperator as error:
            if "`**`" in error.what:
                raise InputError(error.what, error.where, error.hint) from error
        except Exception:
            continue  # the verifier reports it
    return material


def _file_of(cls: type) -> str:
    try:
        return inspect.getsourcefile(cls) or ""
    except (OSError, TypeError):  # defined at an interactive prompt
        return ""


WO = np.array([[0.0, 0.6, 0.8], [0.36, -0.48, 0.8]])
WI = np.array([[0.48, 0.36, 0.8], [-0.8, 0.0, 0.6]])
U = np.array([[0.3, 0.7, 0.2], [0.8, 0.1, 0.6]])


def _try(material: BSDF) -> None:
    """Test the formulas by recording them, or by running them if direct use of Dr.Jit prevents recording."""
    path = Path(inspect.getsourcefile(inspect.unwrap(type(material).eval)) or "")
    for formula in ("eval", "pdf", "sample"):
        if material.stochastic or not _recorded(material, formula, path):
            _run(material, formula, path)


def _recorded(material: BSDF, formula: str, path: Path) -> bool:
    """Whether a formula can be recorded. If so, the types of its result are checked."""
    try:
        result = material.record(formula).entry.result
    except RecordingError as error:
        if isinstance(error, ForbiddenOperator):  # for a single ray, it would run without an error
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
            hint = "multiply by a color of the material" if name in ("eval", "weight") else ""
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
        return "the length of a loop must not depend on values"
    return "correct the formula: it must run on Dr.Jit values, with the functions of gonio.ops"


def _check_shape(what: str, value: object, shape: tuple[int, ...], path: Path, cls: type[BSDF]) -> None:
    formula = what.split(":")[0]
    if not isinstance(value, np.ndarray) or value.shape != shape:
        given = f"shape {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
        expected = "a spectrum (N, 3)" if shape == (2, 3) and "wi" not in what else f"shape {('N', *shape[1:])}"
        hint = "multiply by a color of the material, or return spectrum values" if formula == "eval" else ""
        raise InputError(f"{what} returned {given} for two rays, {expected} expected", _place(cls, formula, path), hint)


def _place(cls: type[BSDF], formula: str, path: Path) -> str:
    code = getattr(inspect.unwrap(getattr(cls, formula)), "__code__", None)
    return f"{path}:{code.co_firstlineno}" if code is not None and Path(code.co_filename) == path else str(path)
