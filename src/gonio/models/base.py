"""What a material is: a frozen set of declared parameters, and pure methods over them.

    class Lambert(BSDF):
        albedo: Value = spectrum(0.5, "share of light that is reflected", high=1.0)

        def eval(self, wo, wi, mode="radiance"):
            return self.albedo * ops.where(..., ...)

Only `eval` must be written; `pdf` and `sample` fall back to cosine sampling, `f` follows from `eval`. A parameter is
declared once, with kind, range, unit and a line of documentation; the command line, the scene reader, the plugin and
the manual read that declaration.

The methods are written in the vocabulary of `gonio.ops` and see *bound* parameters: Dr.Jit values, or symbols while
recording. Whoever calls them from outside may hand over NumPy arrays, lists or Dr.Jit vectors: the wrapper that
`BSDF` puts around each method binds the parameters, converts, and returns the same kind.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, dataclass_transform

import numpy as np

from .. import ops
from ..errors import GonioWarning, InputError, did_you_mean
from ..ops import backend, graph
from ..optics import warp

Value = Any  # a number, an array with one value a ray, a texture in a scene; bound: a Dr.Jit value or a symbol

MODES = ("radiance", "importance")
CHANNELS = 3  # of a colour given as plain numbers; a renderer's spectra have their own number


class Sample(NamedTuple):
    """What `sample` returns: a direction and what it carries.

    wi      direction chosen, unit
    weight  eval / pdf; of a delta lobe, its reflectance over its probability; 0 where sampling failed
    pdf     density of wi, 1/sr; of a delta lobe, its discrete probability; 0 where sampling failed
    delta   whether wi was chosen from a delta lobe
    eta     index on wi's side over index on wo's side: 1 for reflection
    """

    wi: Any
    weight: Any
    pdf: Any
    delta: Any
    eta: Any


class Breach(NamedTuple):
    """A law that a model breaks by nature.

    reason   why, as a sentence part: the manual and the verifier print it
    size     how far at most, in the unit of the law's figure: a number, or a function of the model; 0 says that with
             these parameters it is not broken at all
    certain  whether it is always there: the verifier fails a model that declares a breach and keeps the law
    """

    reason: str
    size: Any
    certain: bool = True


@dataclass(frozen=True)
class Parameter:
    """Declaration of one parameter.

    kind       "float", "spectrum", "alpha" (one width or two), "angle", "choice", "flag" or "bsdf"
    low, high  closed range; outside it is an error, above `high` only a warning where `soft_high`
    choices    name -> what it means, for kind "choice"
    """

    name: str
    kind: str
    default: Any
    doc: str
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    soft_high: bool = False
    choices: dict[str, str] = dataclasses.field(default_factory=dict)

    @property
    def required(self) -> bool:
        return self.default is dataclasses.MISSING

    @property
    def numeric(self) -> bool:
        return self.kind in ("float", "spectrum", "alpha", "angle")

    @property
    def range(self) -> str:
        """The range in words, as errors and the manual print it."""
        if self.kind == "choice":
            return " | ".join(self.choices)
        if not self.numeric:
            return self.kind
        low = "" if self.low == -math.inf else f">= {self.low:g}"
        high = "" if self.high == math.inf else f"<= {self.high:g}"
        return " and ".join(x for x in (low, high) if x) or "any number"

    def check(self, value: Any, where: str) -> None:
        """Raise InputError, or warn, where `value` cannot stand for this parameter."""
        if self.kind == "choice":
            if value not in self.choices:
                raise InputError(f"unknown {self.name} '{value}'", where, did_you_mean(str(value), list(self.choices)))
        elif self.kind == "flag":
            if not isinstance(value, bool | np.bool_):
                raise InputError(f"{value!r} given, True or False expected", where)
        elif self.kind == "bsdf":
            if not isinstance(value, BSDF):
                raise InputError(f"{type(value).__name__} given, a material expected", where)
        elif not backend.is_drjit(value) and not isinstance(value, graph.Node) and value is not None:
            self._check_number(value, where)

    def _check_number(self, value: Any, where: str) -> None:
        if self.kind == "alpha" and isinstance(value, tuple | list):
            if len(value) != 2:
                raise InputError(f"{len(value)} widths given, one or two expected", where)
            for item in value:
                self.check(item, where)
            return
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError(f"{value!r} given, a number or an array expected", where) from None
        if isinstance(value, str | bytes) or array.ndim > (2 if self.kind == "spectrum" else 1):
            raise InputError(f"{value!r} given, a number or an array expected", where)
        if self.kind == "spectrum" and array.ndim and array.shape[-1] != CHANNELS:
            what = f"a colour of shape {array.shape}, a number, {CHANNELS} values or (N, {CHANNELS}) expected"
            raise InputError(what, where)
        if not np.all(np.isfinite(array)):
            raise InputError(f"{value!r} is not finite", where)
        if array.size and array.min() < self.low:
            raise InputError(f"{array.min():g} given, {self.range} expected", where)
        if array.size and array.max() > self.high:
            if not self.soft_high:
                raise InputError(f"{array.max():g} given, {self.range} expected", where)
            import warnings

            text = (
                f"{where}: {array.max():g} is over {self.high:g}: the material gives back more light than it receives"
            )
            warnings.warn(text, GonioWarning, stacklevel=5)


def _declare(kind: str, default: Any, doc: str, **more: Any) -> Any:
    return dataclasses.field(default=default, metadata={"kind": kind, "doc": doc, **more})


def number(default: Any = dataclasses.MISSING, doc: str = "", **more: Any) -> Any:
    """Declare a number; `low`, `high`, `unit` as in `Parameter`."""
    return _declare("float", default, doc, **more)


def spectrum(default: Any = dataclasses.MISSING, doc: str = "", **more: Any) -> Any:
    """Declare a colour: a number (grey), three values, or an array (N, channels)."""
    return _declare("spectrum", default, doc, **more)


def width(default: Any = dataclasses.MISSING, doc: str = "") -> Any:
    """Declare a microfacet width alpha, or a tuple of two (along x, along y); bound: a vector of two."""
    return _declare("alpha", default, doc, low=0.0, high=1.0)


def angle(default: Any = 0.0, doc: str = "") -> Any:
    """Declare an angle in radians; bound: the vector (cos, sin), or None where it is the plain number 0."""
    return _declare("angle", default, doc, unit="rad")


def choice(default: str, doc: str, choices: dict[str, str]) -> Any:
    """Declare a choice between names; it shapes the code, so it is known before anything runs."""
    return _declare("choice", default, doc, choices=choices)


def flag(default: bool, doc: str) -> Any:
    """Declare a switch that shapes the code."""
    return _declare("flag", default, doc)


def bsdf(doc: str) -> Any:
    """Declare a material inside a material."""
    return _declare("bsdf", dataclasses.MISSING, doc)


@dataclass_transform(
    frozen_default=True, eq_default=False, field_specifiers=(number, spectrum, width, angle, choice, flag, bsdf)
)
class BSDF:
    """Base of every material. Subclasses become frozen dataclasses; `name` is made from the class name.

    breaks      law -> Breach, for laws that the model breaks by nature (Phong: reciprocity, energy)
    stochastic  whether eval, pdf and weight are random numbers that only in the mean are what they are called
    lossless    the greatest loss that a white furnace may find (where F = 1 and every albedo 1); None claims nothing
    transmits   whether light can pass to the other side
    """

    name: ClassVar[str] = ""
    breaks: ClassVar[dict[str, Breach]] = {}
    stochastic: ClassVar[bool] = False
    lossless: ClassVar[float | None] = None
    _bound = False

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if not cls.__name__.startswith("_"):
            cls.name = (
                "".join("-" + c.lower() if c.isupper() else c for c in cls.__name__).lstrip("-").replace("_", "-")
            )
        for method in ("eval", "pdf", "sample", "terms"):
            if method in cls.__dict__:
                setattr(cls, method, _doorway(cls.__dict__[method]))
        dataclass(frozen=True, eq=False)(cls)

    def __post_init__(self) -> None:
        for parameter in self.parameters().values():
            parameter.check(getattr(self, parameter.name), f"{type(self).__name__}.{parameter.name}")

    @classmethod
    def parameters(cls) -> dict[str, Parameter]:
        """The declared parameters by name."""
        this: Any = cls  # mypy takes a class of ours for unhashable
        return dict(_declared(this))

    # ------------------------------------------------------------------ the protocol

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """f(wo, wi) |cos theta_i|, a spectrum, 1/sr; 0 for delta lobes.

        wo, wi  (N, 3) unit vectors away from the surface: toward the viewer, toward the light
        mode    "radiance" (transmission carries (eta_o/eta_i)^2) or "importance" (it does not)
        Returns (N, channels).
        """
        raise NotImplementedError(f"{type(self).__name__} has no eval")

    def pdf(self, wo: Any, wi: Any) -> Any:
        """Density with which `sample` chooses wi, 1/sr, (N,); 0 for delta lobes. Here: cosine sampling."""
        same_side = wo.z * wi.z > 0.0
        return ops.where(same_side, ops.abs(wi.z) * ops.inv_pi, 0.0)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        """Choose wi for wo.

        u  three numbers in [0, 1) a ray, (N, 3): the first picks the lobe, the others the direction
        Here: cosine sampling on wo's side.
        """
        local = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = ops.vec3(local.x, local.y, ops.copysign(local.z, wo.z))
        pdf = self.pdf(wo, wi)
        valid = pdf > 0.0
        weight = self.eval(wo, wi, mode) * ops.where(valid, 1.0 / ops.where(valid, pdf, 1.0), 0.0)
        return Sample(wi, weight, pdf, never(pdf), pdf * 0.0 + 1.0)

    @property
    def transmits(self) -> bool:
        return False

    @property
    def delta(self) -> str:
        """Whether the lobes are delta distributions: "never", "always" or "maybe" (it depends on the ray)."""
        return "never"

    @property
    def isotropic(self) -> bool:
        """Whether a turn about the normal changes nothing: no two widths differ, here and in inner materials."""
        for parameter in self.parameters().values():
            value = getattr(self, parameter.name)
            if parameter.kind == "bsdf" and not value.isotropic:
                return False
            pair = parameter.kind == "alpha" and isinstance(value, tuple | list)
            if pair and not np.array_equal(np.asarray(value[0], float), np.asarray(value[1], float)):
                return False
        return True

    def breaches(self) -> dict[str, Breach]:
        """The laws that it breaks with these parameters, sizes as numbers; those of inner materials may show or not."""
        found: dict[str, Breach] = {}
        for name, parameter in self.parameters().items():
            if parameter.kind == "bsdf":
                for law, breach in getattr(self, name).breaches().items():
                    size = max(breach.size, found[law].size if law in found else 0.0)
                    found[law] = Breach(f"{name}: {breach.reason}", size, certain=False)
        for law, breach in self.breaks.items():
            size = float(breach.size(self) if callable(breach.size) else breach.size)
            if size > 0.0:
                found[law] = breach._replace(size=size)
        return found

    def tint(self, wo: Any) -> Any:
        """A colour for denoisers to tell materials apart by: near the albedo seen from wo, without noise."""
        return getattr(self, "albedo", 1.0)

    # ------------------------------------------------------------------ what is dear to know

    def derive(self) -> Any:
        """Values that follow from the parameters alone and are dear to compute for every ray; a dict, or None."""
        return None

    def derived(self) -> Any:
        """What `derive` gives: `settle` found it once for all rays, or it is found here for each."""
        settled = self.__dict__.get("_settled")
        return self.derive() if settled is None else settled

    def settle(self) -> Any:
        """On a bound copy: compute `derive` now, once, where no parameter varies from ray to ray and none is being
        differentiated; never while Dr.Jit records a loop, in which nothing can be computed."""
        if type(self).derive is BSDF.derive:
            return None
        dr = backend.drjit()
        values = list(self._bound_values())
        if dr.flag(dr.JitFlag.SymbolicScope) or any(dr.width(v) != 1 or dr.grad_enabled(v) for v in values):
            return None
        settled = self.derive()
        dr.make_opaque(settled)
        self.__dict__["_settled"] = settled
        return settled

    def _bound_values(self) -> Any:
        for parameter in self.parameters().values():
            value = getattr(self, parameter.name)
            if parameter.kind == "bsdf":
                yield from value._bound_values()
            elif parameter.numeric and value is not None:
                yield value

    # ------------------------------------------------------------------ from outside

    def f(self, wo: Any, wi: Any, mode: str = "radiance", precision: str | None = None) -> Any:
        """The BSDF itself, eval / |cos theta_i|, 1/sr; 0 at cos theta_i = 0. Shapes as in `eval`."""
        value = self.eval(wo, wi, mode=mode, precision=precision)  # type: ignore[call-arg]
        if backend.is_drjit(wi):
            return value * ops.safe_div(1.0, ops.abs(wi.z))
        cos = np.abs(np.broadcast_to(np.asarray(wi, dtype=value.dtype), (len(value), 3))[:, 2:])
        return np.divide(value, cos, out=np.zeros_like(value), where=cos > 0)

    def bind(self, convert: Callable[[Parameter, Any], Any]) -> Any:
        """A copy whose numeric parameters are what `convert(parameter, value)` makes of them, inner materials too."""
        values = {}
        for parameter in self.parameters().values():
            value = getattr(self, parameter.name)
            if parameter.kind == "bsdf":
                values[parameter.name] = value.bind(convert)
            elif parameter.numeric:
                values[parameter.name] = convert(parameter, value)
        return self.bound(values)

    def bound(self, values: dict[str, Any]) -> Any:
        """A copy with these bound values: every numeric parameter's, and the inner materials'."""
        clone = object.__new__(type(self))
        clone.__dict__.update(self.__dict__, _bound=True, **values)
        clone.__dict__.pop("_kept", None)
        return clone

    def symbols(self) -> Any:
        """A copy bound to symbols, one for each numeric parameter; an angle that is the plain number 0 is none."""

        def symbol(parameter: Parameter, value: Any) -> Any:
            if _no_turn(parameter, value) or (parameter.kind == "angle" and value is None):
                return None
            return graph.symbol({"float": "float", "spectrum": "spectrum"}.get(parameter.kind, "vec2"))

        return self.bind(symbol)

    def record(self, method: str = "eval", mode: str = "radiance") -> graph.Graph:
        """The method as a typed graph; parameters are "self.alpha", ..., then the method's own."""
        bound = self.symbols()
        inner = inspect.unwrap(getattr(type(self), method))
        more: dict[str, Any] = {"mode": mode} if "mode" in inspect.signature(inner).parameters else {}
        kinds = {"wo": "vec3", "u": "vec3"} if method == "sample" else {"wo": "vec3", "wi": "vec3"}
        given: dict[str, Any] = {"self": bound, **more}
        return ops.record(inner, types=kinds, name=f"{type(self).__name__}_{method}", **given)


@functools.cache
def _declared(cls: type[BSDF]) -> dict[str, Parameter]:
    """Asked at every binding, so found once a class."""
    return {
        field.name: Parameter(name=field.name, default=field.default, **field.metadata)
        for field in dataclasses.fields(cls)  # type: ignore[arg-type]
        if field.metadata
    }


def never(like: Any) -> Any:
    """False for every ray."""
    return like != like


def _no_turn(parameter: Parameter, value: Any) -> bool:
    return parameter.kind == "angle" and isinstance(value, int | float) and value == 0


def converter(kind: backend.Types) -> Callable[[Parameter, Any], Any]:
    """How plain parameter values become Dr.Jit values of the given types."""

    def convert(parameter: Parameter, value: Any) -> Any:
        if parameter.kind == "spectrum":
            if backend.is_drjit(value):
                return value if backend.drjit().is_vector_v(value) else kind.vec3(value, value, value)
            array = np.asarray(value, dtype=np.float64)
            if array.ndim == 0:
                array = np.broadcast_to(array, (CHANNELS,))
            return backend.vector_of(array, CHANNELS, kind)
        if parameter.kind == "alpha":
            if isinstance(value, tuple | list):
                return kind.vec2(backend.float_of(value[0], kind), backend.float_of(value[1], kind))
            if backend.is_drjit(value) and backend.drjit().is_vector_v(value):
                return value
            one = backend.float_of(value, kind)
            return kind.vec2(one, one)
        if parameter.kind == "angle":
            if _no_turn(parameter, value):
                return None
            if backend.is_drjit(value) and backend.drjit().is_vector_v(value):
                return value
            s, c = ops.sincos(backend.float_of(value, kind))
            return kind.vec2(c, s)
        return backend.float_of(value, kind)

    return convert


def _settled(model: BSDF, kind: backend.Types) -> Any:
    """The model bound to types and settled; what plain numbers derive is kept with the model, which is frozen."""
    bound = model.bind(converter(kind))
    if type(model).derive is BSDF.derive:
        return bound
    kept = model.__dict__.setdefault("_kept", {})
    if kind.float in kept:
        bound.__dict__["_settled"] = kept[kind.float]
    else:
        settled = bound.settle()
        if settled is not None and all(isinstance(v, int | float | tuple) for v in model._bound_values()):
            kept[kind.float] = settled
    return bound


def _doorway(method: Callable) -> Callable:
    """Let bound parameters through; for anything else bind, convert to Dr.Jit and convert the answer back."""
    inner = ops.function(method)

    @functools.wraps(method)
    def enter(self: BSDF, wo: Any, other: Any, mode: str = "radiance", precision: str | None = None) -> Any:
        args = (mode,) if takes_mode else ()
        if self._bound:
            return inner(self, wo, other, *args)
        if mode not in MODES:
            raise InputError(f"unknown mode '{mode}'", f"{type(self).__name__}.{method.__name__}", " or ".join(MODES))
        as_drjit = backend.is_drjit(wo)
        if as_drjit:
            return inner(_settled(self, backend.types_like(type(wo))), wo, other, *args)
        kind = backend.types(precision)
        first, second, count = _rows(wo, other, method.__name__)
        _check_rows(self, count)
        if count == 0:  # Dr.Jit joins no array of no entries with one of one entry
            first = second = np.array([0.0, 0.0, 1.0])
        bound = _settled(self, kind)
        result = inner(bound, backend.vector_of(first, 3, kind), backend.vector_of(second, 3, kind), *args)

        def out(value: Any) -> np.ndarray:
            return backend.to_numpy(value, count) if count else backend.to_numpy(value, 1)[:0]

        if isinstance(result, tuple):
            return type(result)(*[out(value) for value in result])  # type: ignore[call-arg]
        return out(result)

    takes_mode = "mode" in inspect.signature(method).parameters
    return enter


def _rows(a: Any, b: Any, name: str) -> tuple[np.ndarray, np.ndarray, int]:
    """Two arguments as arrays of shape (N, 3) or (3,), and N."""
    arrays = []
    for label, value in (("wo", a), ("u" if name == "sample" else "wi", b)):
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.empty(0)
        if array.ndim not in (1, 2) or array.shape[-1] != 3:
            raise InputError(f"an array of shape {array.shape}, expected (N, 3)", f"{name}: {label}")
        arrays.append(array)
    sizes = sorted({len(x) for x in arrays if x.ndim == 2 and len(x) != 1}) or [1]
    if len(sizes) > 1:
        raise InputError(f"{sizes[0]} and {sizes[1]} rows given, the same number expected", name)
    return arrays[0], arrays[1], sizes[0]


def _check_rows(material: BSDF, count: int) -> None:
    """Raise InputError where a parameter has one value a ray, for another number of rays."""
    for name, parameter in material.parameters().items():
        value = getattr(material, name)
        if parameter.kind == "bsdf":
            _check_rows(value, count)
        if not parameter.numeric or isinstance(value, int | float):
            continue
        single = 1 if parameter.kind == "spectrum" else 0  # dimensions of one ray's value
        for part in value if parameter.kind == "alpha" and isinstance(value, tuple | list) else (value,):
            rows = 1 if backend.is_drjit(part) or np.ndim(part) <= single else len(part)
            if rows not in (1, count) and count != 1:
                where = f"{type(material).__name__}.{name}"
                raise InputError(f"{rows} rows given for {count} directions, the same number expected", where)


for _name in ("pdf", "sample"):  # the fall-backs are called from outside too
    setattr(BSDF, _name, _doorway(BSDF.__dict__[_name]))
