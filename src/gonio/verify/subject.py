"""A subject: a BSDF under test, with its protocol and its declared properties.

A subject evaluates `eval`, `pdf` and `sample` on NumPy arrays, in the precisions that the BSDF supports, and provides a
copy of the model that is bound to Dr.Jit arrays. An exception inside the BSDF, or a result of the wrong shape, becomes
a `Fault` that states the line. Nothing in this module depends on a particular material.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import inspect
import os
import shlex
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..catalog import notation, outside
from ..errors import GonioError, InputError, out_of_loop
from ..material import BSDF, KnownViolation, Parameter, Sample, models, tree
from ..material.sample import SampleArrays
from ..ops import Direction, Mode, Precision, Spectrum, backend
from . import directions
from .isolation import watch


class Fault(Exception):
    """A failure of the BSDF: an exception that it raises, or an invalid result."""

    def __init__(self, what: str, location: str = "") -> None:
        super().__init__(f"{what} ({location})" if location else what)


@dataclasses.dataclass(frozen=True)
class Subject:
    """A BSDF under test.

    model     the material or plugin
    target    its name, such as "conductor", "glass.py:Glass" or "mitsuba:plastic"
    settings  the parameters that were set, by name, for titles and commands
    drawn_by  another subject whose samples are used to locate the lobes, if computing this subject's own guide would
              take seconds; else None
    memo      cache of values that are expensive to compute, such as those of `estimators`
    """

    model: Any
    target: str
    settings: dict[str, Any] = dataclasses.field(default_factory=dict)
    drawn_by: Subject | None = dataclasses.field(default=None, kw_only=True, repr=False, compare=False)
    memo: dict[str, Any] = dataclasses.field(default_factory=dict, init=False, repr=False, compare=False)

    # ------------------------------------------------------------------ facts

    @property
    def title(self) -> str:
        """The target with its settings: "conductor, alpha = 0.3"."""
        return ", ".join(
            [self.target, *(f"{name} = {notation.written(value)}" for name, value in self.settings.items())]
        )

    @property
    def transmits(self) -> bool:
        return bool(self.model.transmits)

    @property
    def isotropic(self) -> bool:
        return bool(self.model.isotropic)

    @property
    def perturbs_normal(self) -> bool:
        """Whether its shading normal may differ from the surface normal."""
        return bool(self.model.perturbs_normal)

    @functools.cached_property
    def guided(self) -> bool:
        """Whether it or an inner material defines only `eval`, and is sampled with a guide: a density tabulated from
        `eval`."""
        return isinstance(self.model, BSDF) and any(one.guided for _, one in tree.walk(self.model))

    @property
    def sampler(self) -> Subject:
        """The subject whose samples are used to locate the lobes: `drawn_by` or, if it is None, this subject."""
        return self.drawn_by or self

    @property
    def stochastic(self) -> bool:
        """Whether `eval` and the weight are random estimates whose expectation is the exact value."""
        return bool(getattr(self.model, "stochastic", False))

    @property
    def zero_weight_is_failure(self) -> bool:
        """Whether a sample of weight 0 counts as failed, because this is how Mitsuba's plugins mark failed samples."""
        return bool(getattr(self.model, "zero_weight_is_failure", False))

    @property
    def precisions(self) -> tuple[Precision, ...]:
        """The precisions in which it can be evaluated, in increasing order."""
        return tuple(getattr(self.model, "precisions", backend.PRECISIONS))

    @property
    def best(self) -> Precision:
        return self.precisions[-1]

    @property
    def parameters(self) -> dict[str, Parameter]:
        return self.model.parameters()

    @property
    def breaches(self) -> dict[str, KnownViolation]:
        """The declared violations, by the names of the laws."""
        return self.model.violations()

    @property
    def by_nature(self) -> Mapping[str, str]:
        """The laws that this kind of material inherently violates, with the reasons."""
        return getattr(self.model, "by_nature", {})

    @property
    def inner(self) -> list[Subject]:
        """The inner materials, each as a subject."""
        held = getattr(self.model, "held", None)
        children = held if held is not None else tree.children(self.model) if isinstance(self.model, BSDF) else {}
        return [Subject(inner, f"the inner material `{name}` of {self.target}") for name, inner in children.items()]

    def with_sound_inside(self) -> Subject:
        """The same BSDF with diffuse inner materials, which violate no law."""
        if hasattr(self.model, "with_diffuse_inside"):
            return Subject(self.model.with_diffuse_inside(), self.target, self.settings)
        return self.with_inside(models()["lambert"]())

    def with_inside(self, material: BSDF) -> Subject:
        """The same material, with each inner material replaced by another one."""
        return Subject(tree.replace(self.model, dict.fromkeys(tree.children(self.model), material)), self.target)

    @functools.cached_property
    def sides(self) -> tuple[int, ...]:
        """The sides of the surface from which light is reflected or transmitted: 1 above, -1 below; () if black."""
        rng = np.random.default_rng(5)
        sides = []
        for side in (1, -1):
            wo = directions.single(directions.on_side(directions.uniform(rng, 512), side))
            wi = directions.single(directions.uniform(rng, 512))
            if np.any(self.eval(wo, wi, precision="float32") > 0.0):
                sides.append(side)
                continue
            with contextlib.suppress(Fault):  # the laws that test sampling report it
                if np.any(self.sampler.sample(wo, directions.numbers(rng, 512), precision="float32").weight > 0.0):
                    sides.append(side)
        return tuple(sides)

    @functools.cached_property
    def has_density(self) -> bool:
        """Whether some lobe is not a delta lobe: `eval` is positive somewhere, or samples have a density."""
        rng = np.random.default_rng(6)
        wo, wi = (directions.single(directions.uniform(rng, 2048)) for _ in range(2))
        if np.any(self.eval(wo, wi, precision="float32") > 0.0):
            return True
        try:
            drawn = self.sample(wo, directions.numbers(rng, 2048), precision="float32")
        except Fault:  # the laws that test sampling report it
            return True
        return bool(np.any((drawn.pdf > 0.0) & ~drawn.delta))

    @functools.cached_property
    def steady(self) -> bool:
        """Whether repeated calls of `eval` and `sample` give the same results, and whether those of `eval` are also the
        same for fewer pairs."""
        rng = np.random.default_rng(7)
        wo, wi = (directions.single(directions.uniform(rng, 512)) for _ in range(2))
        first = self.eval(wo, wi)
        repeated = [self.eval(wo, wi), self.eval(wo[256:], wi[256:])]
        u = directions.numbers(rng, len(wo))
        if not np.allclose(self.sample(wo, u).wi, self.sample(wo, u).wi, atol=1e-5, equal_nan=True):
            return False
        return all(
            np.allclose(v, w, rtol=1e-5, equal_nan=True) for v, w in zip(repeated, (first, first[256:]), strict=True)
        )

    def replace(self, **values: Any) -> Subject:
        """The same BSDF with other parameter values.

        values  values by path: "alpha", "base.alpha"
        """
        model = self.model
        changed = tree.replace(model, values) if isinstance(model, BSDF) else model.replace(**values)
        return Subject(changed, self.target, {**self.settings, **values}, drawn_by=self.drawn_by)

    def rebuilt(self) -> Subject | None:
        """A new object for the same BSDF that has not been called yet; None if it cannot be created."""
        make = getattr(self.model, "rebuilt", None)
        return None if make is None else Subject(make(), self.target, self.settings)

    def command(self, *more: str) -> str:
        """The command line that tests this BSDF, with additional arguments `more`."""
        parts = ["gonio", "verify", self.target]
        for name, value in self.settings.items():
            # the user's files relative to the current folder
            text = notation.setting(self.model, name, value).removeprefix(f"{Path.cwd()}{os.sep}")
            parts += ["--param", f"{name}={text}"]
        return " ".join(part if part == "verify" else shlex.quote(part) for part in [*parts, *more])

    # ------------------------------------------------------------------ the protocol

    def eval(
        self, wo: np.ndarray, wi: np.ndarray, mode: str = "radiance", precision: Precision | None = None
    ) -> np.ndarray:
        """f |cos theta_i| for directions wo and wi, (N, 3) each. Returns (N, channels), float64.

        mode       as in `BSDF.eval`
        precision  precision of the evaluation; None for the highest
        """
        value = self._call("eval", wo, wi, mode=mode, precision=precision or self.best)
        return self._shaped("eval", value, len(wo), 2)

    def pdf(self, wo: np.ndarray, wi: np.ndarray, precision: Precision | None = None) -> np.ndarray:
        """Density with which `sample` chooses wi, 1/sr, (N,), float64. For the arguments, see `eval`."""
        value = self._call("pdf", wo, wi, precision=precision or self.best)
        return self._shaped("pdf", value, len(wo), 1)

    def sample(
        self, wo: np.ndarray, u: np.ndarray, mode: str = "radiance", precision: Precision | None = None
    ) -> SampleArrays:
        """A `Sample` of float64 and bool arrays. `wo` and `u` are (N, 3) each; for other arguments, see `eval`."""
        s = self._call("sample", wo, u, mode=mode, precision=precision or self.best)
        if not isinstance(s, tuple) or len(s) != 5:
            raise Fault(f"sample returned {type(s).__name__} instead of a Sample", _place(self.model, "sample"))
        n = len(wo)
        return Sample(
            self._shaped("sample: wi", s[0], n, 2),
            self._shaped("sample: weight", s[1], n, 2),
            self._shaped("sample: pdf", s[2], n, 1),
            np.broadcast_to(np.asarray(s[3]).astype(bool), (n,)),
            self._shaped("sample: eta", s[4], n, 1),
        )

    def f(
        self, wo: np.ndarray, wi: np.ndarray, mode: str = "radiance", precision: Precision | None = None
    ) -> np.ndarray:
        """The BSDF without the cosine, 1/sr; 0 for cos theta_i = 0. For the arguments, see `eval`."""
        value = self.eval(wo, wi, mode, precision)
        cos = np.abs(wi[:, 2:])
        return np.divide(value, cos, out=np.zeros_like(value), where=cos > 0.0)

    def bound(self, precision: Precision = "float32") -> Any:
        """The model bound to Dr.Jit arrays of a precision, so that new parameter values do not recompile kernels."""
        if isinstance(self.model, BSDF):
            return self.model.bind(backend.types(precision))
        return self.model

    def power(self) -> Callable[[Direction, Direction], Spectrum]:
        """`eval` for power (mode "importance") in the highest precision, as a function of float64 Dr.Jit vectors."""
        own, exact = backend.types(self.best), backend.types("float64")
        model = self.bound(self.best)
        # without transmission the two modes are equal, and one kernel is enough
        mode: Mode = "importance" if self.transmits else "radiance"

        def eval(wo: Direction, wi: Direction) -> Spectrum:
            value = guarded(self.model, "eval", lambda: model.eval(own.vec3(wo), own.vec3(wi), mode))
            return exact.vec3(value)

        return eval

    def _call(self, method: str, first: np.ndarray, second: np.ndarray, **more: Any) -> Any:
        if not (self.transmits or method == "sample" or "mode" not in more):
            more["mode"] = "radiance"  # the two modes are equal, and one kernel is enough
        if "mode" in more and not (isinstance(self.model, BSDF) or self._takes_mode(method)):
            del more["mode"]
        return guarded(self.model, method, lambda: getattr(self.model, method)(first, second, **more))

    def _takes_mode(self, method: str) -> bool:
        return "mode" in inspect.signature(getattr(self.model, method)).parameters

    def _shaped(self, what: str, value: Any, count: int, dimensions: int) -> np.ndarray:
        array = np.asarray(value)
        fault = ""
        if array.dtype.kind not in "fiu" or array.ndim != dimensions or (array.ndim and array.shape[0] != count):
            expected = f"({count},)" if dimensions == 1 else f"({count}, channels)"
            fault = f"shape {array.shape} instead of {expected}"
        elif what in ("eval", "sample: weight") and array.shape[1] not in (1, 3, 4):
            fault = f"{array.shape[1]} channels instead of 1, 3 or 4"
        elif what == "sample: wi" and array.shape[1] != 3:
            fault = f"{array.shape[1]} components instead of 3"
        if fault:
            raise Fault(f"{what} returned {fault}", _place(self.model, what.split(":")[0]))
        return array.astype(np.float64)


@dataclasses.dataclass(frozen=True)
class Described(Subject):
    """A subject that is tested in another process: its name and title, without the model."""

    heading: str = ""

    @property
    def title(self) -> str:
        return self.heading

    @classmethod
    def of(cls, subject: Subject) -> Described:
        settings = {name: str(value) for name, value in subject.settings.items()}
        return cls(None, subject.target, settings, heading=subject.title)


def guarded(model: Any, method: str, run: Any) -> Any:
    """The result of calling `run`. An exception inside the model becomes a Fault that states its line.

    method  name of the method that is called
    """
    try:
        with watch.calling(model, method) if watch.calling else contextlib.nullcontext():
            return run()
    except (Fault, GonioError, KeyboardInterrupt, TimeoutError):
        raise
    except (Exception, SystemExit, GeneratorExit) as raised:
        error = out_of_loop(raised)
        if isinstance(error, GonioError):
            raise Fault(f"{error.what} in {method}", error.where) from raised
        text = str(error).strip().splitlines()
        if text and "implicit conversion to 'bool'" in text[0]:
            what = f"Python's `if`, `and`, `or` or `not` was applied to the values of many rays in {method}"
            hint = "use `ops.where(condition, a, b)`, `&`, `|` or `~`"
            raise Fault(f"{what}; {hint}", _line(model, error)) from raised
        raise Fault(f"{type(error).__name__} in {method}: {text[0] if text else ''}", _line(model, error)) from raised


def _line(model: Any, error: BaseException) -> str:
    """FILE:LINE of the innermost frame in the model's own file; if there is none, of the innermost frame."""
    frames = traceback.extract_tb(error.__traceback__)
    try:
        own = Path(inspect.getsourcefile(type(model)) or "").name
    except TypeError:
        own = ""
    inside = [f for f in frames if own and Path(f.filename).name == own] or frames
    return f"{Path(inside[-1].filename).name}:{inside[-1].lineno}" if inside else ""


def _place(model: Any, method: str) -> str:
    try:
        function = inspect.unwrap(getattr(type(model), method))
        return f"{Path(inspect.getsourcefile(function) or '').name}:{function.__code__.co_firstlineno}"
    except (AttributeError, TypeError):
        return ""


def of(model: Any) -> Subject:
    """The subject for a Python object, named by its class, with the parameters that differ from their defaults."""
    if isinstance(model, Subject):
        return model
    if not isinstance(model, BSDF):
        raise InputError(f"{type(model).__name__} given, a material expected", "verify", "give a gonio.BSDF")
    return Subject(outside.check_operators(model), notation.spelled(type(model)), notation.settings(model))
