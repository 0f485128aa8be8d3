"""What a material is: a frozen set of declared parameters, pure formulas over them, and facts about itself.

    class Lambert(BSDF):
        albedo: Colour = spectrum(0.5, "share of light that is reflected", high=1.0)

        @method
        def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
            return self.albedo * where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)

Only `eval` must be written. `pdf` and `sample` fall back to a guide that is found from it (`gonio.material.guide`), `f`
follows too, and every fact has an honest default. Whoever wants to know something about a material asks it: no other
room tests for a class.

The formulas are written in the vocabulary of `gonio.ops` and see *bound* parameters (`gonio.material.binding`): Dr.Jit
values, or symbols while recording. Callers hand over NumPy arrays, lists or Dr.Jit vectors (`gonio.material.calling`).
"""

from __future__ import annotations

import html
import inspect
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import Field, dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple, Self, TypeAlias, dataclass_transform, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import ops
from ..errors import InputError, did_you_mean
from ..members import Family, subclasses_of
from ..ops import Direction, Mask, Mode, Pair, Precision, Scalar, Spectrum, backend, graph
from ..optics import warp
from . import binding, guide_search, recording, tree
from .angular_range import EVERYWHERE, AngularRange
from .calling import V3, Given, method
from .parameters import Floats, Material, Parameter, Value, bsdf, declared, file, pair_of
from .polarization import Polarized
from .sample import Sample

Delta: TypeAlias = Literal["never", "maybe", "always"]

# Directional albedo of an inner material at (mu, phi), (N, 3); None where it is not known this way.
InnerAlbedo: TypeAlias = "Callable[[BSDF, NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64] | None]"


class KnownViolation(NamedTuple):
    """A law that a model violates by nature.

    reason   why, as a sentence part: the manual and the verifier print it
    size     how far at most, in the unit of the law's figure: a number, or a function of the model; 0 says that with
             these parameters it is not broken at all
    certain  whether it is always there: the verifier fails a model that declares a breach and keeps the law
    """

    reason: str
    size: Any
    certain: bool = True


class Preset(NamedTuple):
    """Named values of some parameters.

    title   the long name, "gold"
    values  parameter -> value
    source  where the figures come from
    """

    title: str
    values: Mapping[str, Value]
    source: str = ""


class Microsurface(NamedTuple):
    """The rough surface behind a material, whose energy `gonio.energy` has tables of.

    ndf, masking, fresnel  by name
    alpha, rotation        widths and turn, as the parameters hold them
    eta                    index inside over index outside, of a dielectric; None of a conductor
    albedo                 factor on everything that leaves
    transmits              whether refracted light goes on
    """

    ndf: str
    masking: str
    fresnel: str
    alpha: Pair
    rotation: Pair | None
    eta: Scalar | None
    albedo: Spectrum
    transmits: bool


class Interior(NamedTuple):
    """What lies behind a surface that light enters.

    eta         index inside over that of the vacuum, where media are nested; else over the outside's
    absorption  light lost per unit length
    priority    of media that overlap the one with the highest is there
    """

    eta: Scalar
    absorption: Spectrum
    priority: Scalar


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(bsdf, file))
class BSDF(Material):
    """Base of every material. Subclasses become frozen dataclasses; `name` is made from the class name, where a class
    does not give its own.

    known_violations    law -> KnownViolation, for laws that the model violates by nature (Phong: reciprocity, energy)
    only_rgb    whether eval gives red, green and blue, whatever channels the renderer has
    stochastic  whether eval, pdf and weight are random numbers that only in the mean are what they are called
    reads_wavelengths  whether it wants to know the rays' wavelengths, as `wavelengths` of its bound copy
    reads_surface  whether it wants to know dp/du.x, dp/dv.x and dp/dv.y at a hit, as `surface` of its bound copy
    lossless_tolerance  the greatest loss that a white furnace may find (F = 1, every albedo 1); None claims nothing
    """

    family: ClassVar[Family[type[BSDF]]]
    name: ClassVar[str] = ""
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {}
    stochastic: ClassVar[bool] = False
    only_rgb: ClassVar[bool] = False
    reads_wavelengths: ClassVar[bool] = False
    wavelengths: ClassVar[Spectrum | None] = None  # nm, one for each channel, on copies bound in spectral variants
    reads_surface: ClassVar[bool] = False
    surface: ClassVar[tuple[Scalar, Scalar, Scalar] | None] = None  # on copies bound in scenes
    lossless_tolerance: ClassVar[float | None] = None
    has_terms: ClassVar[bool] = False  # whether `terms` is written
    overridable: ClassVar[bool] = False  # whether a user's own class may take its name: of Gonio's, those of papers do
    preset_kind: ClassVar[str] = "preset"  # what its presets are called in errors
    _declared: ClassVar[Mapping[str, Parameter]] = {}

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        if not cls.__name__.startswith("_") and not vars(cls).get("name"):
            letters = ("-" + c.lower() if c.isupper() else c for c in cls.__name__)
            cls.name = "".join(letters).lstrip("-").replace("_", "-")
        elif cls.__name__.startswith("_") and "name" not in vars(cls):
            cls.name = ""  # a part of some model: it must not stand in its base's place
        _move_former_names(cls)
        own = vars(cls)
        for formula in ("eval", "pdf", "sample", "terms"):
            if formula in own:
                setattr(cls, formula, method(own[formula]))
        cls.derives = cls.derive is not Material.derive
        cls.has_terms = cls.terms is not BSDF.terms
        _check_pair(cls)
        cls.guided = cls.pdf is BSDF.pdf and cls.sample is BSDF.sample and cls.eval is not BSDF.eval
        dataclass(frozen=True, eq=False, repr=False)(cls)
        cls._declared = declared(cls)  # on the class, and gone with it when a user's file is loaded anew

    def __post_init__(self) -> None:
        for parameter in self.parameters().values():
            given = getattr(self, parameter.name)
            coerced = parameter.coerce(given, f"{type(self).__name__}.{parameter.name}")
            if coerced is not given:
                object.__setattr__(self, parameter.name, coerced)
        object.__setattr__(self, "_count", tree.count(self))

    @classmethod
    def parameters(cls) -> dict[str, Parameter]:
        """The declared parameters by name."""
        return dict(cls._declared)

    # ------------------------------------------------------------------ formulas

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """f(wo, wi) |cos theta_i|, a spectrum, 1/sr; 0 for delta lobes.

        wo, wi  (N, 3) unit vectors away from the surface: toward the viewer, toward the light
        mode    "radiance" (transmission carries (eta_o/eta_i)^2) or "importance" (it does not)
        Returns (N, channels).
        """
        raise NotImplementedError(f"{type(self).__name__} has no eval")

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density with which `sample` chooses wi, 1/sr, (N,); 0 for delta lobes.

        Here, where `sample` is not written either: that of a guide found from `eval` (`gonio.material.guide`).
        """
        return guide_search.guide_of(self.plain).pdf(self, wo, wi)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """Choose wi for wo.

        u  three numbers in [0, 1) per ray, (N, 3): the first picks the lobe, the others the direction
        Here by a guide found from `eval`.
        """
        wi = guide_search.guide_of(self.plain).draw(self, wo, u)
        return self._weighted(wo, wi, mode)

    def sample_cosine(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """A `sample` for classes whose `pdf` is |cos theta_i| / pi on wo's side: the cosine-weighted hemisphere."""
        local = warp.square_to_cosine_hemisphere(u.y, u.z)
        return self._weighted(wo, ops.vec3(local.x, local.y, ops.copysign(local.z, wo.z)), mode)

    def _weighted(self, wo: Direction, wi: Direction, mode: Mode) -> Sample:
        """The sample of a direction chosen by `pdf`."""
        pdf = self.pdf(wo, wi)
        valid = pdf > 0.0
        weight = self.eval(wo, wi, mode) * ops.where(valid, 1.0 / ops.where(valid, pdf, 1.0), 0.0)
        return Sample.of_density(wi, weight, pdf)

    @method
    def terms(self, wo: Direction, wi: Direction) -> tuple[Value, ...]:
        """What `eval` is made of, to be looked at one by one: a NamedTuple, of a microfacet lobe D, G and F."""
        raise InputError(f"{type(self).__name__} has no terms", "terms", "`has_terms` tells")

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """The parts of the light from wi to wo whose polarization is known: what single smooth facets have sent there.
        What `eval` has beyond them leaves unpolarized; here all of it.

        delta  lanes where the two directions are joined by delta lobes, whose weights are then the values
        """
        return ()

    def tint(self, wo: Direction) -> Spectrum:
        """A colour for denoisers to tell materials apart by: near the albedo seen from wo, without noise."""
        shares = [name for name, p in self.parameters().items() if p.white == 1.0]
        white: Value = 1.0
        return getattr(self, shares[0]) if shares else white

    # ------------------------------------------------------------------ facts

    @property
    def transmits(self) -> bool:
        """Whether light can pass to the other side."""
        return False

    @property
    def delta(self) -> Delta:
        """Whether the lobes are delta distributions: "never", "always" or "maybe" (it depends on the ray)."""
        return "never"

    @property
    def isotropic(self) -> bool:
        """Whether a turn about the normal changes nothing: no two widths differ, here and in inner materials."""
        return all(_alike(*pair_of(leaf.value)) for leaf in tree.leaves(self.plain) if leaf.parameter.kind == "alpha")

    @property
    def angular_range(self) -> AngularRange:
        """The angles at which its values, and those of inner materials, are known; elsewhere they are made up."""
        known = EVERYWHERE
        for inner in tree.children(self).values():
            known = known.within(inner.angular_range)
        return known

    @property
    def perturbs_normal(self) -> bool:
        """Whether its normal, or that of an inner material, may differ from the surface's."""
        return any(inner.perturbs_normal for inner in tree.children(self).values())

    @property
    def two_sided(self) -> bool:
        """Whether a surface that does not transmit looks from below as from above."""
        return False

    @property
    def ambient(self) -> Spectrum | None:
        """Factor of the scene's ambient light, of the empirical models; None has no such part."""
        return None

    @property
    def microsurface(self) -> Microsurface | None:
        """The rough surface that light is scattered by, where the material is one; its energy has been tabulated."""
        return None

    @property
    def interior(self) -> Interior | None:
        """What lies behind the surface, of a material that light enters, or of the first inside it; None: nothing."""
        interiors = (inner.interior for inner in tree.children(self).values())
        return next((interior for interior in interiors if interior is not None), None)

    @property
    def needs_uniform(self) -> bool:
        """Whether its parameters, inner ones too, must not vary from ray to ray: no textures, no arrays."""
        return any(inner.needs_uniform for inner in tree.children(self).values())

    @property
    def fixed(self) -> frozenset[str]:
        """Paths of the parameters that must not vary from ray to ray: tables are found from them once."""
        paths = {f"{name}.{path}" for name, inner in tree.children(self).items() for path in inner.fixed}
        return frozenset(paths)

    def normal_reflectance(self) -> Spectrum | None:
        """F0, the reflectance at normal incidence, its albedo included; None where there is no such thing."""
        return None

    def mean_reflectance(self, average: str = "exact") -> Spectrum | Scalar | None:
        """F_avg = 2 int F(mu) mu dmu, what light meets on average between facets, albedo left out; None: no Fresnel.

        average  "exact", or the name of a fit
        """
        return None

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """Directional albedo of power, (N, 3), where it is known better than by integrating `eval`; else None.

        mu, phi  cosine and azimuth of wo, (N,)
        inner    the albedo of an inner material, where that is known
        nodes    of a quadrature that the material makes itself; None asks for closed forms only
        """
        return None

    @classmethod
    def reads(cls, text: str) -> bool:
        """Whether a text names a file that is such a material: "gold.binary". Its path is then the parameter `file`."""
        return False

    @classmethod
    def presets(cls) -> Mapping[str, Preset]:
        """Named values of its parameters, by short name ("Au"); empty where there are none."""
        return {}

    @classmethod
    def preset(cls, name: str, **parameters: Value) -> Self:
        """A material by a preset's name: Conductor.preset("Au", alpha=0.2). InputError where it is unknown."""
        known = cls.presets()
        by_name = {key.lower(): key for key in known} | {p.title.lower(): key for key, p in known.items()}
        key = by_name.get(str(name).lower())
        if key is None:
            if not known:
                raise InputError(f"{cls.name} has no presets", "preset", "give its parameters")
            hint = did_you_mean(str(name), [*known, *(p.title for p in known.values())])
            raise InputError(f"unknown {cls.preset_kind} '{name}'", "preset", hint)
        return cls(**{**known[key].values, **parameters})

    def renderer_calls(self, seed: int) -> Iterable[Any]:
        """What a renderer asks of it beside eval, pdf and sample, and what comes, for the verifier; here nothing."""
        return ()

    def violations(self) -> dict[str, KnownViolation]:
        """The laws that it violates with these parameters, sizes as numbers; those of inner materials may not show."""
        violated: dict[str, KnownViolation] = {}
        for name, inner in tree.children(self).items():
            for law, one in inner.violations().items():
                size = max(one.size, violated[law].size if law in violated else 0.0)
                violated[law] = KnownViolation(f"{name}: {one.reason}", size, certain=False)
        for law, one in self.known_violations.items():
            size = float(one.size(self) if callable(one.size) else one.size)
            if size > 0.0:
                violated[law] = one._replace(size=size)
        return violated

    def lossless(self) -> Self:
        """The lossless variant: every share of light 1 and F = 1, here and in inner materials; itself where nothing
        changes. What a furnace finds missing is lost by the lobe's shape. Bound copies give bound ones.
        """
        values: dict[str, object] = {}
        for name, parameter in self.parameters().items():
            value = getattr(self, name)
            if parameter.inner:
                variant = value.lossless()
                if variant is not value:
                    values[name] = variant
            elif parameter.white is not None:
                values[name] = value * 0.0 + parameter.white if self.is_bound and parameter.numeric else parameter.white
        if not values:
            return self
        return binding.bound_copy(self, values) if self.is_bound else tree.rebuild(self, values)

    # ------------------------------------------------------------------ bound copies and recordings

    @property
    def derived(self) -> Value:
        """What `derive` gives: found once for all rays on a bound copy that holds it, else here for each."""
        return self.derive() if self._derived is None else self._derived

    def bind(self, types: backend.Types) -> Self:
        """A bound copy for Dr.Jit values of these types; see `gonio.material.binding`."""
        return binding.bind_to(self, types)

    def record(self, method: str = "eval", mode: Mode = "radiance") -> graph.Graph:
        """A method as a typed graph; parameters are "self.alpha", ..., then the method's own."""
        return recording.record(self, method, mode)

    def __parts__(self) -> dict[str, object]:
        """What a recording follows: the parameters, and what is derived where this copy holds it."""
        parts = {name: getattr(self, name) for name, parameter in self.parameters().items() if not parameter.inside}
        return parts if self._derived is None else {**parts, binding.DERIVED: self._derived}

    def __with_parts__(self, parts: Mapping[str, object]) -> Self:
        """A copy with these parts."""
        values = dict(parts)
        return binding.bound_copy(self, values, values.pop(binding.DERIVED, None))

    # ------------------------------------------------------------------ from outside

    @overload
    def f(self, wo: Direction, wi: Direction, mode: Mode = ...) -> Spectrum: ...
    @overload
    def f(self, wo: V3, wi: V3, mode: Mode = ..., precision: Precision | None = ...) -> V3: ...
    @overload
    def f(self, wo: ArrayLike, wi: ArrayLike, mode: Mode = ..., precision: Precision | None = ...) -> Floats: ...
    def f(self, wo: Given, wi: Given, mode: Mode = "radiance", precision: Precision | None = None) -> object:
        """The BSDF itself, eval / |cos theta_i|, 1/sr; 0 at cos theta_i = 0. Shapes as in `eval`."""
        value = self.eval(wo, wi, mode=mode, precision=precision)
        if backend.is_drjit(wi):
            return value * ops.safe_div(1.0, ops.abs(wi.z))
        cos = np.abs(np.broadcast_to(np.asarray(wi, dtype=value.dtype), (len(value), 3))[:, 2:])
        return np.divide(value, cos, out=np.zeros_like(value), where=cos > 0)

    def __repr__(self) -> str:
        set_ = ", ".join(f"{name}={getattr(self, name)!r}" for name in self.parameters())
        return f"{type(self).__name__}({set_})"

    def _repr_html_(self) -> str:
        """For notebooks: every parameter with its value and what it means."""
        rows = "".join(
            f"<tr><td><code>{html.escape(leaf.path)}</code></td><td>{html.escape(_short(leaf.value))}</td>"
            f"<td style='text-align:left'>{html.escape(leaf.parameter.doc)}</td></tr>"
            for leaf in tree.leaves(self)
        )
        return f"<b>{html.escape(type(self).__name__)}</b><table>{rows}</table>"

    def __eq__(self, other: object) -> bool:
        """Same class, same values: a material equals its pickled copy."""
        if self is other:
            return True
        if not isinstance(other, BSDF) or type(self) is not type(other) or self.is_bound or other.is_bound:
            return False
        return all(_same(getattr(self, name), getattr(other, name)) for name in self.parameters())

    def __hash__(self) -> int:
        if self.is_bound:
            return id(self)
        return hash((type(self), *(_hashable(getattr(self, name)) for name in self.parameters())))

    def __reduce__(self) -> tuple[object, ...]:
        values = {name: parameter.portable(getattr(self, name)) for name, parameter in self.parameters().items()}
        return tree.rebuild_from, (type(self), values)


class _FormerName:
    """A member's name in Gonio 0.1: it gives what has the new name, with a warning."""

    def __init__(self, new: str) -> None:
        self.new = new

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, material: BSDF | None, cls: type[BSDF]) -> Value:
        _warn_of_former(cls, self.name, self.new)
        return getattr(cls if material is None else material, self.new)


# Delete after one release, with `_move_former_names`. `lossless`, a number in 0.1, is the method that `white` was.
FORMER_NAMES = {
    "breaks": "known_violations",
    "breaches": "violations",
    "gives_way": "overridable",
    "leans": "perturbs_normal",
    "white": "lossless",
}
for _old, _new in FORMER_NAMES.items():
    setattr(BSDF, _old, _FormerName(_new))
    vars(BSDF)[_old].__set_name__(BSDF, _old)


def _warn_of_former(cls: type, old: str, new: str) -> None:
    warnings.warn(f"{cls.__name__}.{old} is now {new}", DeprecationWarning, stacklevel=3)


def _move_former_names(cls: type[BSDF]) -> None:
    """Give what a class defines under a name of Gonio 0.1 its new name."""
    own = vars(cls)
    former = [(old, new) for old, new in FORMER_NAMES.items() if old in own and not isinstance(own[old], Field)]
    if "lossless" in own and not callable(own["lossless"]):
        former.insert(0, ("lossless", "lossless_tolerance"))
    for old, new in former:
        _warn_of_former(cls, old, new)
        setattr(cls, new, own[old])
        delattr(cls, old)


def _folders() -> list[str]:
    """The folders of `gonio.materials`."""
    folders = (Path(__file__).parents[1] / "materials").glob("*/__init__.py")
    return [f"gonio.materials.{folder.parent.name}" for folder in sorted(folders)]


BSDF.family = Family("material", "gonio.models", _folders, subclasses_of(BSDF), where="model")


def _check_pair(cls: type[BSDF]) -> None:
    """Raise InputError for a class with `pdf` or `sample` alone: the other would be that of another density. A class
    whose name starts with an underscore is a part of materials, which may leave the other to them."""
    written = {"pdf": cls.pdf is not BSDF.pdf, "sample": cls.sample is not BSDF.sample}
    if cls.__name__.startswith("_") or len(set(written.values())) == 1:
        return
    here, missing = sorted(written, key=lambda name: not written[name])
    code = inspect.unwrap(getattr(cls, here)).__code__
    hint = f"write `{missing}` too, or neither: a guide is then found from `eval`"
    if missing == "sample":
        hint += "; where pdf is |cos theta_i| / pi, `sample` is `return self.sample_cosine(wo, u, mode)`"
    what = f"{cls.__name__} has `{here}` and no `{missing}`, which must be of the same density"
    raise InputError(what, f"{code.co_filename}, line {code.co_firstlineno}", hint)


def _alike(x: object, y: object) -> bool:
    return x is y or bool(np.array_equal(np.asarray(x, float), np.asarray(y, float)))


def _same(a: Value, b: Value) -> bool:
    if isinstance(a, BSDF) or isinstance(b, BSDF):
        return bool(a == b)
    if backend.is_drjit(a) or backend.is_drjit(b):
        return a is b
    try:
        return type(a) is type(b) and bool(np.array_equal(np.asarray(a), np.asarray(b)))
    except ValueError:  # a ragged tuple of widths
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))


def _hashable(value: Value) -> object:
    if isinstance(value, tuple | list):
        return tuple(map(_hashable, value))
    if backend.is_drjit(value):
        return id(value)
    return value.tobytes() if isinstance(value, np.ndarray) else value


def _short(value: object) -> str:
    if isinstance(value, tuple | list | np.ndarray):
        values = [_short(v) for v in list(value)[:6]]
        return ", ".join(values) + (", ..." if len(value) > 6 else "")
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)
