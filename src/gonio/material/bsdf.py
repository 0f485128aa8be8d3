"""The base class of all materials: frozen, declared parameters, pure functions of them, and facts about the material.

    class Lambert(BSDF):
        albedo: Colour = spectrum(0.5, "fraction of light that is reflected", high=1.0)

        @method
        def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
            return self.albedo * where((wo.z > 0.0) & (wi.z > 0.0), wi.z * inv_pi, 0.0)

Only `eval` must be defined. By default, `pdf` and `sample` use a guide, a density tabulated from `eval`
(`gonio.material.guide`); `f` is computed from `eval`, and every fact has a safe default. Other packages query these
members and never test for a class.

The formulas are written in the vocabulary of `gonio.ops` and use *bound* parameters (`gonio.material.binding`): Dr.Jit
values, or symbols while recording. Callers pass NumPy arrays, lists or Dr.Jit vectors (`gonio.material.calling`).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Self, TypeAlias, dataclass_transform, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import ops
from ..errors import InputError, did_you_mean
from ..members import Family, subclasses_of
from ..ops import Direction, Mask, Mode, Precision, Scalar, Spectrum, backend, graph
from ..optics import warp
from . import binding, equality, notebook, recording, tensors, tree
from .angular_range import EVERYWHERE, AngularRange
from .calling import V3, Given, method
from .constructing import accepted, with_pair
from .facts import Interior, KnownViolation, Limit, Microsurface, Preset
from .former_names import add_former_names, move_former_names
from .parameters import Floats, Material, Parameter, Value, bsdf, declared, file, pair_of
from .polarization import Polarized
from .sample import Sample

if TYPE_CHECKING:
    from .guide import Guide


class StatedAlbedo(NamedTuple):
    """A directional albedo stated by the authors of a model.

    source     the reference and equation
    value      the albedo, (N, 3)
    tolerance  the largest absolute error that the authors claim
    """

    source: str
    value: NDArray[np.float64]
    tolerance: float


Delta: TypeAlias = Literal["never", "maybe", "always"]

# directional albedo of an inner material at (mu, phi), (N, 3), or None
InnerAlbedo: TypeAlias = "Callable[[BSDF, NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64] | None]"


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(bsdf, file))
class BSDF(Material):
    """Base of every material. Subclasses are frozen dataclasses; `name` is derived from the class name by default.

    known_violations    law -> KnownViolation, for laws that the model violates by design (Phong: reciprocity, energy)
    limits              values at which a part of the model is switched off, and the model that it then equals
    spelling            path of the file that defines the class, its name in strings; "" if it is written in Python
    only_rgb            whether `eval` returns red, green and blue regardless of the renderer's channels
    stochastic          whether `eval`, `pdf` and the weight are random estimates whose expectation is the exact value
    reads_wavelengths   whether its bound copy needs the rays' wavelengths, as the attribute `wavelengths`
    reads_surface       whether its bound copy needs dp/du.x, dp/dv.x and dp/dv.y at a hit, as the attribute `surface`
    fits_factors        whether fits vary parameters whose default and maximum are 1, which are redundant factors in
                        other models
    lossless_tolerance  the largest loss allowed in a white furnace (F = 1, every albedo 1); None if the model makes no
                        claim
    """

    family: ClassVar[Family[type[BSDF]]]
    name: ClassVar[str] = ""
    spelling: ClassVar[str] = ""
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {}
    limits: ClassVar[tuple[Limit, ...]] = ()
    stochastic: ClassVar[bool] = False
    only_rgb: ClassVar[bool] = False
    fits_factors: ClassVar[bool] = False
    reads_wavelengths: ClassVar[bool] = False
    wavelengths: ClassVar[Spectrum | None] = None  # nm, one per channel, on copies bound in spectral variants
    reads_surface: ClassVar[bool] = False
    surface: ClassVar[tuple[Scalar, Scalar, Scalar] | None] = None  # on copies bound in scenes
    lossless_tolerance: ClassVar[float | None] = None
    has_terms: ClassVar[bool] = False  # whether `terms` is defined
    overridable: ClassVar[bool] = False  # whether a user's class may take its name: true for Gonio's historic models
    preset_kind: ClassVar[str] = "preset"  # the noun for its presets in errors
    _declared: ClassVar[Mapping[str, Parameter]] = {}

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        if not cls.__name__.startswith("_") and not vars(cls).get("name"):
            letters = ("-" + c.lower() if c.isupper() else c for c in cls.__name__)
            cls.name = "".join(letters).lstrip("-").replace("_", "-")
        elif cls.__name__.startswith("_") and "name" not in vars(cls):
            cls.name = ""  # a shared base of models, which must not be registered under the name of its base
        move_former_names(cls)
        own = vars(cls)
        for formula in ("eval", "pdf", "sample", "terms"):
            if formula in own:
                setattr(cls, formula, method(own[formula]))
        cls.derives = cls.derive is not Material.derive
        cls.has_terms = cls.terms is not BSDF.terms
        _check_pair(cls)
        cls.guided = cls.pdf is BSDF.pdf and cls.sample is BSDF.sample and cls.eval is not BSDF.eval
        dataclass(frozen=True, eq=False, repr=False)(cls)
        cls.__init__ = accepted(cls.__init__)  # type: ignore[method-assign]
        cls._declared = declared(cls)  # on the class, so that it is discarded when a user's file is loaded again

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

        wo, wi       (N, 3), unit vectors away from the surface: toward the viewer and toward the light
        mode         "radiance" (transmission includes the factor (eta_o/eta_i)^2) or "importance" (without it)
        precision    for arrays and tensors: "float32" or "float64"; by default that of the tensors, or for arrays
                     that of `go.set_precision`
        derivatives  for arrays: paths of parameters; the result stacks the values and one derivative per path
        wavelengths  for arrays: wavelengths in nm, (M,); the result is (N, M). Colors must be gray: three numbers are
                     not a spectrum
        parameters   for tensors of PyTorch or JAX (wo, wi or these): path -> tensor, which receives gradients
        Returns (N, channels); for arrays of shape (..., 3), (..., channels); for tensors, a tensor on the device of wo.
        """
        raise NotImplementedError(f"{type(self).__name__} has no eval")

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Density with which `sample` chooses wi, 1/sr, (N,); 0 for delta lobes. Arguments as for `eval`.

        If neither `pdf` nor `sample` is defined, it is the density of a guide (`gonio.material.guide`).
        """
        return _guide(self).pdf(self, wo, wi)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """Sample wi for wo; returns a `Sample`.

        u  three random numbers in [0, 1) per ray, (N, 3): the first selects the lobe, the others the direction
        The default uses a guide computed from `eval`. For `mode`, `precision` and `parameters`, see `eval`.
        """
        wi = _guide(self).draw(self, wo, u)
        return self._weighted(wo, wi, mode)

    def sample_cosine(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """An implementation of `sample` for classes whose `pdf` is |cos theta_i| / pi on wo's side."""
        local = warp.square_to_cosine_hemisphere(u.y, u.z)
        return self._weighted(wo, ops.vec3(local.x, local.y, ops.copysign(local.z, wo.z)), mode)

    def _weighted(self, wo: Direction, wi: Direction, mode: Mode) -> Sample:
        """The `Sample` for a direction wi drawn with density `pdf`."""
        pdf = self.pdf(wo, wi)
        valid = pdf > 0.0
        weight = self.eval(wo, wi, mode) * ops.where(valid, 1.0 / ops.where(valid, pdf, 1.0), 0.0)
        return Sample.of_density(wi, weight, pdf)

    @method
    def terms(self, wo: Direction, wi: Direction) -> tuple[Value, ...]:
        """The factors of `eval` as a NamedTuple, for inspection: D, G and F for a microfacet lobe.

        Raises InputError if the class does not define `terms`; see `has_terms`.
        """
        raise InputError(f"{type(self).__name__} has no terms", "terms", "see `has_terms`")

    def polarized(self, wo: Direction, wi: Direction, delta: Mask, mode: Mode = "radiance") -> tuple[Polarized, ...]:
        """The parts of the light from wi to wo whose polarization is known: light scattered once, by a smooth facet.
        The remainder of `eval` is unpolarized; by default, all light is.

        delta  mask of rays whose wo and wi are connected by a delta lobe; their values are the weights of the lobes
        """
        return ()

    def tint(self, wo: Direction) -> Spectrum:
        """A noise-free color close to the albedo for wo, by which denoisers distinguish materials."""
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
        """Whether `eval` is invariant under rotation about the normal. By default, true if no width is anisotropic,
        here and in inner materials."""
        return all(
            equality.alike(*pair_of(leaf.value)) for leaf in tree.leaves(self.plain) if leaf.parameter.kind == "alpha"
        )

    @property
    def angular_range(self) -> AngularRange:
        """The angles at which its values and those of inner materials are known; elsewhere they are extrapolated."""
        known = EVERYWHERE
        for inner in tree.children(self).values():
            known = known.within(inner.angular_range)
        return known

    @property
    def perturbs_normal(self) -> bool:
        """Whether the shading normal, here or in an inner material, may differ from the surface normal."""
        return any(inner.perturbs_normal for inner in tree.children(self).values())

    @property
    def two_sided(self) -> bool:
        """For a surface that does not transmit: whether it reflects from below exactly as from above."""
        return False

    @property
    def back_differs(self) -> bool:
        """For a surface that does not transmit: whether it, or an inner material, also reflects from below, but with
        different values than from above."""
        return any(inner.back_differs for inner in tree.children(self).values())

    @property
    def ambient(self) -> Spectrum | None:
        """The factor by which the scene's ambient light is multiplied, for empirical models; None for all others."""
        return None

    @property
    def microsurface(self) -> Microsurface | None:
        """The rough surface that scatters the light, if energy tables exist for it; else None."""
        return None

    @property
    def interior(self) -> Interior | None:
        """The medium behind a surface that transmits, or behind the first inner material that does; None if there is
        none."""
        interiors = (inner.interior for inner in tree.children(self).values())
        return next((interior for interior in interiors if interior is not None), None)

    @property
    def needs_uniform(self) -> bool:
        """Whether its parameters, including those of inner materials, must be the same for all rays, so that neither
        textures nor arrays are accepted."""
        return any(inner.needs_uniform for inner in tree.children(self).values())

    @property
    def fixed(self) -> frozenset[str]:
        """Paths of the parameters that must be the same for all rays because tables are computed from them once."""
        paths = {f"{name}.{path}" for name, inner in tree.children(self).items() for path in inner.fixed}
        return frozenset(paths)

    def normal_reflectance(self) -> Spectrum | None:
        """F0, the reflectance at normal incidence including the albedo; None if it is undefined."""
        return None

    def mean_reflectance(self, average: str = "exact") -> Spectrum | Scalar | None:
        """F_avg = 2 int F(mu) mu dmu, the average Fresnel reflectance without the albedo; None without a Fresnel term.

        average  "exact", or the name of a published fit to the integral
        """
        return None

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64] | None:
        """Directional albedo in power, without the factor (eta_o/eta_i)^2, (N, 3), if it is known more accurately than
        by integrating `eval`; else None.

        mu, phi  cosine of the polar angle of wo, and its azimuth, (N,)
        inner    function (material, mu, phi) that returns the albedo of an inner material, or None if it is not known
        nodes    number of nodes for a quadrature by the material itself; None requests closed forms only
        """
        return None

    def stated_albedo(self, wo: NDArray[np.float64]) -> StatedAlbedo | None:
        """The albedo for wo, (N, 3), that the authors of the model state, such as a fit by which they weight the base
        below a layer. The law `energy` compares it with the integral of `eval`."""
        return None

    @classmethod
    def reads(cls, text: str) -> bool:
        """Whether a string is the path of a file that this material reads, such as "gold.binary". The path then becomes
        the parameter `file`."""
        return False

    @classmethod
    def presets(cls) -> Mapping[str, Preset]:
        """The presets of this class by short name ("Au"); empty if there are none."""
        return {}

    @classmethod
    def preset(cls, name: str, **parameters: Value) -> Self:
        """A material with the values of a preset: Conductor.preset("Au", alpha=0.2).

        name        short name or title of the preset, ignoring case
        parameters  values of parameters, which override those of the preset
        Raises InputError if the name is unknown.
        """
        parameters = with_pair(cls.parameters(), parameters, cls.__name__)
        known = cls.presets()
        names = [(key, key) for key in known] + [(one, key) for key, p in known.items() for one in (p.title, *p.also)]
        key = {one.lower(): key for one, key in names}.get(str(name).lower())
        if key is None:
            if not known:
                raise InputError(f"{cls.name} has no presets", "preset", "give its parameters")
            hint = did_you_mean(str(name), [*known, *(p.title for p in known.values())])
            raise InputError(f"unknown {cls.preset_kind} '{name}'", "preset", hint)
        return cls(**{**known[key].values, **parameters})

    def renderer_calls(self, seed: int) -> Iterable[Any]:
        """Calls of a renderer other than eval, pdf and sample, each with its results, for the law `calls`; by default
        none.

        seed  seed of the directions and random numbers
        """
        return ()

    def violations(self) -> dict[str, KnownViolation]:
        """The laws that this material, or an inner one, violates with these parameters; each size is a number."""
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
        """The lossless variant, in which every albedo is 1 and F = 1, here and in inner materials; the material itself
        if nothing changes. Any loss that remains in a furnace is due to the shape of the lobe.

        The variant of a bound copy is bound.
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
        """The result of `derive`: stored in a bound copy if it is the same for all rays, else computed here per ray."""
        return self.derive() if self._derived is None else self._derived

    def bind(self, types: backend.Types) -> Self:
        """A bound copy for Dr.Jit values of these types; see `gonio.material.binding`."""
        return binding.bind_to(self, types)

    def record(self, method: str = "eval", mode: Mode = "radiance") -> graph.Graph:
        """A method as a typed graph. Its inputs are the material's parameters, "self.alpha", ..., then the arguments of
        the method.

        method  "eval", "pdf", "sample" or "terms"
        mode    as in `eval`; the mode is fixed in the graph
        """
        return recording.record(self, method, mode)

    def __parts__(self) -> dict[str, object]:
        """The values that are inputs of a recording: the parameters, and the derived values if this copy holds them."""
        parts = {name: getattr(self, name) for name, parameter in self.parameters().items() if not parameter.inside}
        return parts if self._derived is None else {**parts, binding.DERIVED: self._derived}

    def __with_parts__(self, parts: Mapping[str, object]) -> Self:
        """A copy with these values replaced."""
        values = dict(parts)
        return binding.bound_copy(self, values, values.pop(binding.DERIVED, None))

    # ------------------------------------------------------------------ the public interface

    @overload
    def f(self, wo: Direction, wi: Direction, mode: Mode = ...) -> Spectrum: ...
    @overload
    def f(self, wo: V3, wi: V3, mode: Mode = ..., precision: Precision | None = ...) -> V3: ...
    @overload
    def f(self, wo: ArrayLike, wi: ArrayLike, mode: Mode = ..., precision: Precision | None = ...) -> Floats: ...
    @overload
    def f(
        self,
        wo: tensors.Tensor,
        wi: tensors.Tensor,
        mode: Mode = ...,
        precision: Precision | None = ...,
        *,
        parameters: Mapping[str, tensors.Tensor] = ...,
    ) -> tensors.Tensor: ...
    def f(
        self,
        wo: Given,
        wi: Given,
        mode: Mode = "radiance",
        precision: Precision | None = None,
        *,
        parameters: Mapping[str, tensors.Tensor] | None = None,
    ) -> object:
        """The BSDF itself, eval / |cos theta_i|, 1/sr; 0 at cos theta_i = 0. Arguments and shapes as in `eval`."""
        value = self.eval(wo, wi, mode=mode, precision=precision, parameters=parameters or {})
        if backend.is_drjit(wi):
            return value * ops.safe_div(1.0, ops.abs(wi.z))
        if kind := tensors.library(value):
            return tensors.over_cosine(kind, value, wi)
        cos = np.abs(np.broadcast_to(np.asarray(wi, dtype=value.dtype), value.shape)[..., 2:])
        return np.divide(value, cos, out=np.zeros_like(value), where=cos > 0)

    def __repr__(self) -> str:
        set_ = ", ".join(f"{name}={getattr(self, name)!r}" for name in self.parameters())
        return f"{type(self).__name__}({set_})"

    def _repr_html_(self) -> str:
        """An HTML table for notebooks, with the value and documentation of every parameter."""
        return notebook.table(type(self).__name__, tree.leaves(self))

    def __eq__(self, other: object) -> bool:
        """Whether the other material is of the same class and has the same values, as a pickled copy has."""
        if self is other:
            return True
        if not isinstance(other, BSDF) or type(self) is not type(other) or self.is_bound or other.is_bound:
            return False
        return all(equality.same(getattr(self, name), getattr(other, name)) for name in self.parameters())

    def __hash__(self) -> int:
        if self.is_bound:
            return id(self)
        return hash((type(self), *(equality.hashable(getattr(self, name)) for name in self.parameters())))

    def __reduce__(self) -> tuple[object, ...]:
        values = {name: parameter.portable(getattr(self, name)) for name, parameter in self.parameters().items()}
        return tree.rebuild_from, (type(self), values)


def _folders() -> list[str]:
    """The folders of `gonio.materials`."""
    folders = (Path(__file__).parents[1] / "materials").glob("*/__init__.py")
    return [f"gonio.materials.{folder.parent.name}" for folder in sorted(folders)]


add_former_names(BSDF)
BSDF.family = Family("material", "gonio.models", _folders, subclasses_of(BSDF), where="model")


def _guide(material: BSDF) -> Guide:
    """The guide of a material that defines only `eval`."""
    from . import guide_search  # only such a material needs it, and the import takes 10 ms

    return guide_search.guide_of(material.plain)


def _check_pair(cls: type[BSDF]) -> None:
    """Raise InputError for a class with only one of `pdf` and `sample`, unless its name marks a shared base (_Base)."""
    written = {"pdf": cls.pdf is not BSDF.pdf, "sample": cls.sample is not BSDF.sample}
    if cls.__name__.startswith("_") or len(set(written.values())) == 1:
        return
    here, missing = sorted(written, key=lambda name: not written[name])
    code = inspect.unwrap(getattr(cls, here)).__code__
    hint = f"write `{missing}` too, or neither: a guide is then computed from `eval`"
    if missing == "sample":
        hint += "; where pdf is |cos theta_i| / pi, `sample` is `return self.sample_cosine(wo, u, mode)`"
    what = f"{cls.__name__} has `{here}` and no `{missing}`, which must have the same density"
    raise InputError(what, f"{code.co_filename}, line {code.co_firstlineno}", hint)
