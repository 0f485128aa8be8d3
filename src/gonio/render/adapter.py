"""Every Gonio model as a Mitsuba plugin, by one generic adapter: `conductor` becomes `gonio_conductor`, and so on.

Here alone the two conventions meet. Mitsuba names the viewer's direction `wi` and the sampled one `wo`; Gonio's `wo`
is the viewer's. A plugin's properties carry the names of the model's parameters; a number or colour is held as an
opaque value (a changed value compiles nothing), anything else is a texture that is looked up at each hit. Widths may be
given as `alpha`, or as `alpha_x` and `alpha_y`. Every plugin takes two properties more: `two_sided` (shade both sides;
no nested call as in Mitsuba's own `twosided`) and, where the model has presets, `preset`.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numpy as np

from .. import ops
from ..errors import InputError, did_you_mean
from ..models import BSDF, Parameter, Sample, binding, choice, flag, models
from ..models.two_sided import TwoSided
from ..optics.indices import RGB_WAVELENGTHS

_registered: dict[str, type] = {}


def plugin_name(model_name: str) -> str:
    """Name of a model's plugin: "blinn-phong" is `gonio_blinn_phong`."""
    return "gonio_" + model_name.replace("-", "_")


def register(mi: ModuleType) -> None:
    """Register every model with Mitsuba's current variant; once a variant, whatever the number of calls."""
    variant = mi.variant()
    if variant is None or variant.startswith("scalar"):
        return  # Python plugins are written for arrays
    if variant not in _registered:
        _registered[variant] = _adapter_class(mi)
    for name, model in models().items():
        _register(mi, plugin_name(name), model)


def register_model(mi: ModuleType, model: type[BSDF]) -> str:
    """The name of a model's plugin, which a class of the user's own gets here; call `register` first."""
    if models().get(model.name) is model:
        return plugin_name(model.name)
    name = f"gonio_own_{model.name.replace('-', '_')}"
    _register(mi, name, model)
    return name


def _register(mi: ModuleType, name: str, model: type[BSDF]) -> None:
    adapter = _registered[mi.variant()]
    mi.register_bsdf(name, lambda props: adapter(props, model))


class _Slot:
    """Where a numeric parameter's value comes from: opaque values, or textures."""

    def __init__(self, parameter: Parameter, values: dict[str, Any], textures: dict[str, Any]) -> None:
        self.parameter, self.values, self.textures = parameter, values, textures


def _adapter_class(mi: ModuleType) -> type:
    import drjit as dr

    def read(props: Any, model: type[BSDF], preset: Mapping[str, Any], parameter: Parameter) -> tuple[_Slot, Any]:
        """A parameter's slot, and a plain value that tells of its range (a texture: the whole range)."""
        where = f"{plugin_name(model.name)}.{parameter.name}"
        names = [parameter.name]
        if parameter.kind == "alpha" and ("alpha_x" in props or "alpha_y" in props):
            names = ["alpha_x", "alpha_y"]
            if not all(name in props for name in names) or "alpha" in props:
                raise InputError("give alpha, or both alpha_x and alpha_y", where)
        values: dict[str, Any] = {}
        textures: dict[str, Any] = {}
        plain: list[Any] = []
        for name in names:
            if name in props:
                given = props.type(name)
                value: Any = None
                if given in (mi.Properties.Type.Float, mi.Properties.Type.Integer):
                    value = float(props[name])
                elif given == mi.Properties.Type.Color:
                    value = np.asarray(props[name], dtype=float).ravel()
                elif given == mi.Properties.Type.String:
                    raise InputError(f"'{props[name]}' given, a number or a texture expected", where)
                if value is None or (parameter.kind == "spectrum" and mi.is_spectral and np.ndim(value)):
                    textures[name] = props.get_unbounded_texture(name)
                    span = np.array([max(parameter.low, 0.0), min(parameter.high, 1.0)])
                    plain.append(np.tile(span[:, None], 3) if parameter.kind == "spectrum" else span)
                    constant = constant_of(textures[name]) if parameter.kind == "spectrum" else None
                    if constant is not None:
                        values[name], plain[-1] = constant, np.asarray(constant).ravel()
                        del textures[name]
                    continue
            elif name in preset:
                value = np.asarray(preset[name], dtype=float)
                if value.ndim and mi.is_spectral:
                    textures[name] = measured(value)
                    plain.append(value)
                    continue
                value = value if value.ndim else float(value)
            else:
                if parameter.required:
                    raise InputError("missing", where, parameter.doc)
                value = parameter.default
            parameter.check(value if np.ndim(value) else float(value), where)
            plain.append(value)
            if parameter.kind == "angle" and value == 0:
                continue  # no rotation at all
            if parameter.kind == "spectrum":
                values[name] = mi.Spectrum(*map(float, value)) if np.ndim(value) else mi.Spectrum(float(value))
            else:
                values[name] = mi.Float(float(value))
            dr.make_opaque(values[name])
        return _Slot(parameter, values, textures), (tuple(plain) if len(plain) == 2 else plain[0])

    def measured(value: np.ndarray) -> Any:
        """A spectrum through a preset's values at `RGB_WAVELENGTHS`, level beyond; Mitsuba's own way from colours to
        spectra is made for reflectances and would cut an index at 1."""
        nodes = (360.0, *reversed(RGB_WAVELENGTHS), 830.0)
        levels = (value[-1], *reversed(value), value[0])
        text = [", ".join(f"{float(x):.9g}" for x in row) for row in (nodes, levels)]
        return mi.load_dict({"type": "irregular", "wavelengths": text[0], "values": text[1]})

    def constant_of(texture: Any) -> Any:
        """The opaque colour of a texture that is one colour everywhere, else None; spectra stay textures."""
        if mi.is_spectral or mi.is_monochromatic or texture.is_spatially_varying():
            return None
        value = mi.Spectrum(texture.eval(dr.zeros(mi.SurfaceInteraction3f)))
        dr.make_opaque(value)
        return value

    class Foreign:
        """Another plugin's BSDF under Gonio's protocol, at one surface interaction."""

        def __init__(self, bsdf: Any, si: Any, active: Any) -> None:
            self.bsdf, self.si, self.active = bsdf, si, active

        def _at(self, wo: Any, mode: str) -> tuple[Any, Any]:
            si = mi.SurfaceInteraction3f(self.si)
            si.wi = mi.Vector3f(wo)
            return mi.BSDFContext(transport_mode(mode)), si

        def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
            ctx, si = self._at(wo, mode)
            return self.bsdf.eval(ctx, si, mi.Vector3f(wi), self.active)

        def pdf(self, wo: Any, wi: Any) -> Any:
            ctx, si = self._at(wo, "radiance")
            return self.bsdf.pdf(ctx, si, mi.Vector3f(wi), self.active)

        def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
            ctx, si = self._at(wo, mode)
            bs, weight = self.bsdf.sample(ctx, si, u.x, mi.Point2f(u.y, u.z), self.active)
            return Sample(bs.wo, weight, bs.pdf, mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta), bs.eta)

        def tint(self, wo: Any) -> Any:
            return self.bsdf.eval_diffuse_reflectance(self.si, self.active)

    def transport_mode(mode: str) -> Any:
        return mi.TransportMode.Radiance if mode == "radiance" else mi.TransportMode.Importance

    def mode_of(ctx: Any) -> str:
        return "radiance" if ctx.mode == mi.TransportMode.Radiance else "importance"

    REFLECTION, TRANSMISSION = int(mi.BSDFFlags.Reflection), int(mi.BSDFFlags.Transmission)

    class GonioBSDF(mi.BSDF):  # type: ignore[misc, name-defined]
        """A Gonio model in a Mitsuba scene."""

        model: Any

        def __init__(self, props: Any, model: type[BSDF]) -> None:
            mi.BSDF.__init__(self, props)
            self.model_class = model
            preset: Mapping[str, Any] = {}
            if "preset" in props and model.presets():
                made = model.preset(props["preset"])
                preset = {name: getattr(made, name) for name in next(iter(model.presets().values())).values}
            two_sided = bool(props.get("two_sided", False))
            self.slots: dict[str, _Slot] = {}
            self.inner: dict[str, Any] = {}
            plain: dict[str, Any] = {}
            for name, parameter in model.parameters().items():
                if parameter.kind in ("choice", "flag"):
                    plain[name] = props.get(name, parameter.default)
                    parameter.check(plain[name], f"{plugin_name(model.name)}.{name}")
                elif parameter.inner:
                    self.inner[name] = self._child(props, name)
                elif parameter.numeric:
                    self.slots[name], plain[name] = read(props, model, preset, parameter)
            unknown = list(props.unqueried())
            if unknown:
                known = [*model.parameters(), "two_sided"]
                hint = did_you_mean(unknown[0], known)
                raise InputError(f"unknown property '{unknown[0]}'", plugin_name(model.name), hint)
            for name, child in self.inner.items():
                plain[name] = child.model if isinstance(child, GonioBSDF) else _stand_in(child)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the slots have warned
                self.model = model(**{name: _summary(value) for name, value in plain.items()})
            self.two_sided = two_sided and not self.model.transmits
            self.sides = TwoSided(self.model) if self.two_sided else None
            self._set_flags(self.model.delta)
            self.settled: Any = None
            self._settle()

        def _settle(self) -> None:
            """Find once what the model derives from values that are the same at every hit."""
            self.settled = None
            if self.textured() and self.model.needs_uniform:
                what = (
                    "this base is measured: it takes colours and numbers, no texture, unlike conductor and dielectric"
                )
                raise InputError(what, f"{plugin_name(self.model.name)}.base")
            if self.model.derives and not self.textured():
                self.settled = binding.settled(self.at(dr.zeros(mi.SurfaceInteraction3f), True, inner=True))

        def textured(self) -> bool:
            """Whether a parameter of this material or of one inside it varies over the surface."""
            return any(slot.textures for slot in self.slots.values()) or any(
                not isinstance(child, GonioBSDF) or child.textured() for child in self.inner.values()
            )

        def _child(self, props: Any, name: str) -> Any:
            child = props.get(name, None)
            if not isinstance(child, mi.BSDF):
                raise InputError(f"no material '{name}' given", plugin_name(self.model_class.name))
            return child

        def _set_flags(self, delta: str) -> None:
            F = mi.BSDFFlags
            sides = F.FrontSide | F.BackSide if self.two_sided or self.model.transmits else F.FrontSide
            kinds = []
            if delta != "always":
                kinds.append(F.GlossyReflection)
                if self.model.transmits:
                    kinds.append(F.GlossyTransmission)
            if delta != "never":
                kinds.append(F.DeltaReflection)
                if self.model.transmits:
                    kinds.append(F.DeltaTransmission)
            if any(slot.textures for slot in self.slots.values()):
                sides = sides | F.SpatiallyVarying
            self.m_components = [kind | sides for kind in kinds]
            flags = self.m_components[0]
            for component in self.m_components[1:]:
                flags = flags | component
            self.m_flags = flags

        def traverse(self, cb: Any) -> None:
            for slot in self.slots.values():
                for name, value in slot.values.items():
                    cb.put(name, value, mi.ParamFlags.Differentiable)
                for name, texture in slot.textures.items():
                    cb.put(name, texture, mi.ParamFlags.Differentiable)
            for name, child in self.inner.items():
                cb.put(name, child, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys: list[str]) -> None:
            for slot in self.slots.values():
                dr.make_opaque(*slot.values.values())
            self._settle()
            # a width that was 0 may be so no longer: both kinds of lobe are possible from now on
            if self.model.delta == "always" and any(key.startswith("alpha") for key in keys):
                self._set_flags("maybe")

        # -------------------------------------------------------------- the model at a point

        def at(self, si: Any, active: Any, inner: bool = False) -> Any:
            """The model, its parameters bound to their values at a surface interaction.

            inner  it is part of another material, which alone decides whether both sides are shaded
            """
            found: dict[str, Any] = {}
            for name, slot in self.slots.items():
                kind = slot.parameter.kind
                got = dict(slot.values)
                for key, texture in slot.textures.items():
                    got[key] = texture.eval(si, active) if kind == "spectrum" else texture.eval_1(si, active)
                if kind == "alpha":
                    pair = list(got.values())
                    found[name] = ops.vec2(pair[0], pair[-1])
                elif kind == "angle":
                    found[name] = ops.vec2(*reversed(ops.sincos(got[name]))) if got else None
                else:
                    found[name] = got[name]
            for name, child in self.inner.items():
                own = isinstance(child, GonioBSDF)
                found[name] = child.at(si, active, inner=True) if own else Foreign(child, si, active)
            bound = binding.bound_copy(self.model, found, self.settled)
            return binding.bound_copy(self.sides, {"base": bound}) if self.sides and not inner else bound

        def _enabled(self, ctx: Any, wo: Any, wi: Any, active: Any) -> Any:
            """Lanes whose kind of lobe the context asks for."""
            reflect, transmit = bool(ctx.type_mask & REFLECTION), bool(ctx.type_mask & TRANSMISSION)
            if reflect and transmit:
                return active
            same = wo.z * wi.z > 0.0
            return active & ((same & reflect) | (~same & transmit))

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            value = self.at(si, active).eval(si.wi, wo, mode_of(ctx))
            return dr.select(self._enabled(ctx, si.wi, wo, active), mi.Spectrum(value), 0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return dr.select(self._enabled(ctx, si.wi, wo, active), self.at(si, active).pdf(si.wi, wo), 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self._eval_pdf(self.at(si, active), ctx, si, wo, active)

        def _eval_pdf(self, model: Any, ctx: Any, si: Any, wo: Any, active: Any) -> tuple[Any, Any]:
            enabled = self._enabled(ctx, si.wi, wo, active)
            value = mi.Spectrum(model.eval(si.wi, wo, mode_of(ctx)))
            return dr.select(enabled, value, 0.0), dr.select(enabled, model.pdf(si.wi, wo), 0.0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            return self._sample(self.at(si, active), ctx, si, sample1, sample2, active)

        def _sample(self, model: Any, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any) -> Any:
            s = model.sample(si.wi, mi.Point3f(sample1, sample2.x, sample2.y), mode_of(ctx))
            F = mi.BSDFFlags
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.Vector3f(s.wi)
            active = self._enabled(ctx, si.wi, bs.wo, active) & (s.pdf > 0.0)
            bs.pdf = dr.select(active, s.pdf, 0.0)
            bs.eta = s.eta
            through = si.wi.z * bs.wo.z < 0.0
            glossy = dr.select(through, mi.UInt32(+F.GlossyTransmission), mi.UInt32(+F.GlossyReflection))
            ideal = dr.select(through, mi.UInt32(+F.DeltaTransmission), mi.UInt32(+F.DeltaReflection))
            bs.sampled_type = dr.select(s.delta, ideal, glossy)
            bs.sampled_component = mi.UInt32(0)
            return bs, dr.select(active, mi.Spectrum(s.weight), 0.0)

        def eval_pdf_sample(self, ctx: Any, si: Any, wo: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            model = self.at(si, active)
            return *self._eval_pdf(model, ctx, si, wo, active), *self._sample(model, ctx, si, sample1, sample2, active)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(self.at(si, active).tint(si.wi)) & active

        def has_attribute(self, name: str, active: Any = True) -> Any:
            return mi.Bool(name == "ambient" and self.model.ambient is not None)

        def eval_attribute(self, name: str, si: Any, active: Any = True) -> Any:
            if name != "ambient" or not self.model.ambient is not None:
                return mi.Spectrum(0.0)
            return mi.Spectrum(self.at(si, active).ambient) & active

        def eval_attribute_3(self, name: str, si: Any, active: Any = True) -> Any:
            if name != "ambient" or not self.model.ambient is not None:
                return mi.Color3f(0.0)
            return mi.Color3f(self.at(si, active).ambient) & active

        def to_string(self) -> str:
            return f"{plugin_name(self.model_class.name)}[{', '.join([*self.slots, *self.inner])}]"

    return GonioBSDF


def _summary(value: Any) -> Any:
    """A parameter's plain value as a constructor takes it."""
    return tuple(_summary(v) for v in value) if isinstance(value, tuple) else value


def _stand_in(bsdf: Any) -> BSDF:
    """A model that answers for another plugin's BSDF when its lobes are asked for, before anything is evaluated."""
    transmits, delta = False, "maybe"
    flags = int(bsdf.flags())
    import mitsuba as mi

    transmits = bool(flags & int(mi.BSDFFlags.Transmission))
    smooth, ideal = bool(flags & int(mi.BSDFFlags.Smooth)), bool(flags & int(mi.BSDFFlags.Delta))
    delta = "maybe" if smooth and ideal else "always" if ideal else "never"
    return _Foreign(transmits, delta)


class _Foreign(BSDF):
    """Facts about a BSDF that is not Gonio's."""

    passes: bool = flag(False, "whether it transmits")
    lobes: str = choice(
        "maybe", "whether its lobes are delta distributions", dict.fromkeys(("never", "maybe", "always"), "")
    )

    @property
    def transmits(self) -> bool:
        return self.passes

    @property
    def delta(self) -> Any:
        return self.lobes
