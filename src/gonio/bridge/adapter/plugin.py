"""The class of Gonio's plugins, which implements Mitsuba's BSDF interface for a `PlacedMaterial`.

Only this module converts between the conventions: in Mitsuba, `wi` points toward the viewer and `wo` is the sampled
direction; in Gonio, `wo` points toward the viewer.
"""

from __future__ import annotations

from types import ModuleType, new_class

import drjit as dr

from ...material import BSDF
from ...material.bsdf import Delta
from ...ops import Mode
from ..types import (
    BSDFContext,
    BSDFSample,
    Color,
    Float,
    Mask,
    OfVariant,
    Point,
    Properties,
    Radiance,
    SurfaceInteraction,
    TraversalCallback,
    Vector,
)
from .material import PlacedMaterial
from .variant import DISPERSES, NESTS, SEPARATES, Variant


def plugin_class(mi: ModuleType) -> OfVariant:
    """The class of Gonio's plugins for the current variant, which derives from Mitsuba's BSDF.

    Its constructor takes the properties of a plugin and a model.
    """
    methods = {name: value for name, value in vars(_Methods).items() if name not in ("__dict__", "__weakref__")}
    return new_class("GonioBSDF", (mi.BSDF,), exec_body=lambda names: names.update(methods, variant=Variant(mi)))


def _mode(mi: ModuleType, ctx: BSDFContext) -> Mode:
    return "radiance" if ctx.mode == mi.TransportMode.Radiance else "importance"


def _enabled(mi: ModuleType, ctx: BSDFContext, wo: Vector, wi: Vector, active: Mask) -> Mask:
    """A mask of the lanes on which the context enables the lobe of the two directions, reflection or transmission."""
    kinds = mi.BSDFFlags
    reflect, transmit = bool(ctx.type_mask & int(kinds.Reflection)), bool(ctx.type_mask & int(kinds.Transmission))
    if reflect and transmit:
        return active
    same = wo.z * wi.z > 0.0
    return active & ((same & reflect) | (~same & transmit))


def _at(placed: PlacedMaterial, ctx: BSDFContext, si: SurfaceInteraction, active: Mask) -> BSDF:
    """The material, bound to its parameters at a hit.

    The type mask of the integrator determines whether the index outside the surface and the first wavelength are used.
    """
    mask = int(ctx.type_mask)
    outer = 1.0 + si.duv_dx.x if mask == NESTS else None
    return placed.at(si, active, mask in (SEPARATES, NESTS), outer)


class _Methods:
    """The methods of the plugin class. `plugin_class` copies them, because nanobind allows only one base class."""

    variant: Variant
    placed: PlacedMaterial
    m_components: list[int]
    m_flags: int

    def __init__(self, props: Properties, model: type[BSDF]) -> None:
        self.variant.mi.BSDF.__init__(self, props)
        self.placed = PlacedMaterial(self.variant, props, model)
        self._set_flags(self.placed.model.delta)

    def _set_flags(self, delta: Delta) -> None:
        placed, kinds = self.placed, self.variant.mi.BSDFFlags
        transmits = placed.model.transmits
        sides = kinds.FrontSide | kinds.BackSide if placed.sides or transmits else kinds.FrontSide
        if any(slot.varies for slot in placed.slots.values()):
            sides = sides | kinds.SpatiallyVarying
        if placed.disperses:
            sides = sides | DISPERSES
        lobes = []
        if delta != "always":
            lobes += [kinds.GlossyReflection, *([kinds.GlossyTransmission] if transmits else [])]
        if delta != "never":
            lobes += [kinds.DeltaReflection, *([kinds.DeltaTransmission] if transmits else [])]
        self.m_components = [lobe | sides for lobe in lobes]
        flags = self.m_components[0]
        for component in self.m_components[1:]:
            flags = flags | component
        self.m_flags = flags

    def traverse(self, cb: TraversalCallback) -> None:
        self.placed.traverse(cb)

    def parameters_changed(self, keys: list[str]) -> None:
        self.placed.changed()
        if self.placed.follows:
            self._set_flags(self.placed.model.delta)
        # An alpha that was 0 may have become positive, so the lobe may now be either delta or smooth.
        if self.placed.model.delta == "always" and any(key.startswith("alpha") for key in keys):
            self._set_flags("maybe")

    # ------------------------------------------------------------------ values

    def eval(self, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask = True) -> Radiance:
        return self._eval(_at(self.placed, ctx, si, active), ctx, si, wo, active)

    def pdf(self, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask = True) -> Float:
        return self._pdf(_at(self.placed, ctx, si, active), ctx, si, wo, active)

    def eval_pdf(
        self, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask = True
    ) -> tuple[Radiance, Float]:
        model = _at(self.placed, ctx, si, active)
        return self._eval(model, ctx, si, wo, active), self._pdf(model, ctx, si, wo, active)

    def sample(
        self, ctx: BSDFContext, si: SurfaceInteraction, sample1: Float, sample2: Point, active: Mask = True
    ) -> tuple[BSDFSample, Radiance]:
        return self._sample(_at(self.placed, ctx, si, active), ctx, si, sample1, sample2, active)

    def eval_pdf_sample(
        self,
        ctx: BSDFContext,
        si: SurfaceInteraction,
        wo: Vector,
        sample1: Float,
        sample2: Point,
        active: Mask = True,
    ) -> tuple[Radiance, Float, BSDFSample, Radiance]:
        model = _at(self.placed, ctx, si, active)
        value, pdf = self._eval(model, ctx, si, wo, active), self._pdf(model, ctx, si, wo, active)
        return value, pdf, *self._sample(model, ctx, si, sample1, sample2, active)

    def _eval(self, model: BSDF, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask) -> Radiance:
        mi = self.variant.mi
        value = model.eval(si.wi, wo, _mode(mi, ctx))
        if mi.is_polarized:
            value = self._mueller(model, ctx, si.wi, wo, value, value, mi.Bool(False))
        return dr.select(_enabled(mi, ctx, si.wi, wo, active), self.variant.to_mitsuba(value), 0.0)

    def _pdf(self, model: BSDF, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask) -> Float:
        return dr.select(_enabled(self.variant.mi, ctx, si.wi, wo, active), model.pdf(si.wi, wo), 0.0)

    def _sample(
        self, model: BSDF, ctx: BSDFContext, si: SurfaceInteraction, sample1: Float, sample2: Point, active: Mask
    ) -> tuple[BSDFSample, Radiance]:
        mi = self.variant.mi
        kinds, mode = mi.BSDFFlags, _mode(mi, ctx)
        s = model.sample(si.wi, mi.Point3f(sample1, sample2.x, sample2.y), mode)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.Vector3f(s.wi)
        active = _enabled(mi, ctx, si.wi, bs.wo, active) & (s.pdf > 0.0)
        bs.pdf = dr.select(active, s.pdf, 0.0)
        bs.eta = s.eta
        through = si.wi.z * bs.wo.z < 0.0
        glossy = dr.select(through, mi.UInt32(+kinds.GlossyTransmission), mi.UInt32(+kinds.GlossyReflection))
        ideal = dr.select(through, mi.UInt32(+kinds.DeltaTransmission), mi.UInt32(+kinds.DeltaReflection))
        bs.sampled_type = dr.select(s.delta, ideal, glossy)
        bs.sampled_component = mi.UInt32(0)
        weight = s.weight
        if mi.is_polarized:
            total = model.eval(si.wi, bs.wo, mode)
            weight = self._mueller(model, ctx, si.wi, bs.wo, weight, total, s.delta)
        return bs, dr.select(active, self.variant.to_mitsuba(weight), 0.0)

    def _mueller(
        self, model: BSDF, ctx: BSDFContext, wo: Vector, wi: Vector, value: Radiance, total: Radiance, delta: Mask
    ) -> Radiance:
        """The value as a Mueller matrix. In importance mode, light travels in reverse, from Gonio's wo to wi."""
        mode = _mode(self.variant.mi, ctx)
        parts = model.polarized(wo, wi, delta, mode)
        total = dr.select(delta, sum((part.value for part in parts), dr.zeros(self.variant.spectrum)), total)
        toward, away = (wi, wo) if mode == "radiance" else (wo, wi)
        return self.variant.mueller(value, total, parts, toward, away)

    # ------------------------------------------------------------------ colors

    def eval_diffuse_reflectance(self, si: SurfaceInteraction, active: Mask = True) -> Radiance:
        return self.variant.mi.Spectrum(self.variant.spectrum(self.placed.at(si, active).tint(si.wi))) & active

    def has_attribute(self, name: str, active: Mask = True) -> Mask:
        return self.variant.mi.Bool(name == "ambient" and self.placed.model.ambient is not None)

    def eval_attribute(self, name: str, si: SurfaceInteraction, active: Mask = True) -> Radiance:
        return self._attribute(name, si, active, self.variant.spectrum)

    def eval_attribute_3(self, name: str, si: SurfaceInteraction, active: Mask = True) -> Color:
        return self._attribute(name, si, active, self.variant.mi.Color3f)

    def _attribute(self, name: str, si: SurfaceInteraction, active: Mask, kind: OfVariant) -> OfVariant:
        ambient = self.placed.at(si, active).ambient if name == "ambient" else None
        return kind(0.0) if ambient is None else kind(ambient) & active

    def to_string(self) -> str:
        return f"{self.placed.name}[{', '.join([*self.placed.slots, *self.placed.inner])}]"
