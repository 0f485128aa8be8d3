"""The class of Gonio's plugins: what Mitsuba asks of a BSDF, answered by a placed material.

Here alone the two conventions meet. Mitsuba names the viewer's direction `wi` and the sampled one `wo`; Gonio's `wo`
is the viewer's.
"""

from __future__ import annotations

from types import ModuleType

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
    """The class for the variant that is set, whose BSDF it derives from; it is made of properties and a model."""
    variant = Variant(mi)
    base: OfVariant = mi.BSDF
    kinds = mi.BSDFFlags
    REFLECTION, TRANSMISSION = int(kinds.Reflection), int(kinds.Transmission)

    def mode_of(ctx: BSDFContext) -> Mode:
        return "radiance" if ctx.mode == mi.TransportMode.Radiance else "importance"

    def enabled(ctx: BSDFContext, wo: Vector, wi: Vector, active: Mask) -> Mask:
        """Lanes whose kind of lobe the context asks for."""
        reflect, transmit = bool(ctx.type_mask & REFLECTION), bool(ctx.type_mask & TRANSMISSION)
        if reflect and transmit:
            return active
        same = wo.z * wi.z > 0.0
        return active & ((same & reflect) | (~same & transmit))

    def mueller(
        model: BSDF, ctx: BSDFContext, wo: Vector, wi: Vector, value: Radiance, total: Radiance, delta: Mask
    ) -> Radiance:
        """The value as a Mueller matrix. In importance mode light goes the other way, from Gonio's wo to wi."""
        mode = mode_of(ctx)
        parts = model.polarized(wo, wi, delta, mode)
        total = dr.select(delta, sum((part.value for part in parts), dr.zeros(variant.spectrum)), total)
        toward, away = (wi, wo) if mode == "radiance" else (wo, wi)
        return variant.mueller(value, total, parts, toward, away)

    def separates(ctx: BSDFContext) -> bool:
        """Whether who asks goes on with one wavelength where they part."""
        return int(ctx.type_mask) in (SEPARATES, NESTS)

    def outer(ctx: BSDFContext, si: SurfaceInteraction) -> Float | None:
        """The index outside, where who asks knows it."""
        return 1.0 + si.duv_dx.x if int(ctx.type_mask) == NESTS else None

    class GonioBSDF(base):
        """A Gonio model in a Mitsuba scene."""

        def __init__(self, props: Properties, model: type[BSDF]) -> None:
            base.__init__(self, props)
            self.placed = PlacedMaterial(variant, props, model)
            self._set_flags(self.placed.model.delta)

        def _set_flags(self, delta: Delta) -> None:
            placed = self.placed
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
            # a width that was 0 may be so no longer: both kinds of lobe are possible from now on
            if self.placed.model.delta == "always" and any(key.startswith("alpha") for key in keys):
                self._set_flags("maybe")

        # -------------------------------------------------------------- values

        def eval(self, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask = True) -> Radiance:
            return self._eval(self.placed.at(si, active, separates(ctx), outer(ctx, si)), ctx, si, wo, active)

        def pdf(self, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask = True) -> Float:
            return self._pdf(self.placed.at(si, active, separates(ctx), outer(ctx, si)), ctx, si, wo, active)

        def eval_pdf(
            self, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask = True
        ) -> tuple[Radiance, Float]:
            model = self.placed.at(si, active, separates(ctx), outer(ctx, si))
            return self._eval(model, ctx, si, wo, active), self._pdf(model, ctx, si, wo, active)

        def sample(
            self, ctx: BSDFContext, si: SurfaceInteraction, sample1: Float, sample2: Point, active: Mask = True
        ) -> tuple[BSDFSample, Radiance]:
            return self._sample(
                self.placed.at(si, active, separates(ctx), outer(ctx, si)), ctx, si, sample1, sample2, active
            )

        def eval_pdf_sample(
            self,
            ctx: BSDFContext,
            si: SurfaceInteraction,
            wo: Vector,
            sample1: Float,
            sample2: Point,
            active: Mask = True,
        ) -> tuple[Radiance, Float, BSDFSample, Radiance]:
            model = self.placed.at(si, active, separates(ctx), outer(ctx, si))
            value, pdf = self._eval(model, ctx, si, wo, active), self._pdf(model, ctx, si, wo, active)
            return value, pdf, *self._sample(model, ctx, si, sample1, sample2, active)

        def _eval(self, model: BSDF, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask) -> Radiance:
            value = model.eval(si.wi, wo, mode_of(ctx))
            if mi.is_polarized:
                value = mueller(model, ctx, si.wi, wo, value, value, mi.Bool(False))
            return dr.select(enabled(ctx, si.wi, wo, active), variant.handed_out(value), 0.0)

        def _pdf(self, model: BSDF, ctx: BSDFContext, si: SurfaceInteraction, wo: Vector, active: Mask) -> Float:
            return dr.select(enabled(ctx, si.wi, wo, active), model.pdf(si.wi, wo), 0.0)

        def _sample(
            self, model: BSDF, ctx: BSDFContext, si: SurfaceInteraction, sample1: Float, sample2: Point, active: Mask
        ) -> tuple[BSDFSample, Radiance]:
            s = model.sample(si.wi, mi.Point3f(sample1, sample2.x, sample2.y), mode_of(ctx))
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.Vector3f(s.wi)
            active = enabled(ctx, si.wi, bs.wo, active) & (s.pdf > 0.0)
            bs.pdf = dr.select(active, s.pdf, 0.0)
            bs.eta = s.eta
            through = si.wi.z * bs.wo.z < 0.0
            glossy = dr.select(through, mi.UInt32(+kinds.GlossyTransmission), mi.UInt32(+kinds.GlossyReflection))
            ideal = dr.select(through, mi.UInt32(+kinds.DeltaTransmission), mi.UInt32(+kinds.DeltaReflection))
            bs.sampled_type = dr.select(s.delta, ideal, glossy)
            bs.sampled_component = mi.UInt32(0)
            weight = s.weight
            if mi.is_polarized:
                total = model.eval(si.wi, bs.wo, mode_of(ctx))
                weight = mueller(model, ctx, si.wi, bs.wo, weight, total, s.delta)
            return bs, dr.select(active, variant.handed_out(weight), 0.0)

        # -------------------------------------------------------------- colours

        def eval_diffuse_reflectance(self, si: SurfaceInteraction, active: Mask = True) -> Radiance:
            return mi.Spectrum(variant.spectrum(self.placed.at(si, active).tint(si.wi))) & active

        def has_attribute(self, name: str, active: Mask = True) -> Mask:
            return mi.Bool(name == "ambient" and self.placed.model.ambient is not None)

        def eval_attribute(self, name: str, si: SurfaceInteraction, active: Mask = True) -> Radiance:
            return self._attribute(name, si, active, variant.spectrum)

        def eval_attribute_3(self, name: str, si: SurfaceInteraction, active: Mask = True) -> Color:
            return self._attribute(name, si, active, mi.Color3f)

        def _attribute(self, name: str, si: SurfaceInteraction, active: Mask, kind: OfVariant) -> OfVariant:
            ambient = self.placed.at(si, active).ambient if name == "ambient" else None
            return kind(0.0) if ambient is None else kind(ambient) & active

        def to_string(self) -> str:
            return f"{self.placed.name}[{', '.join([*self.placed.slots, *self.placed.inner])}]"

    return GonioBSDF
