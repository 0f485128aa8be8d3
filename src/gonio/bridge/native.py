"""A BSDF of Mitsuba's, built in or a user's plugin, as a material: alone, or inside one of Gonio's.

Mitsuba's `wi` is Gonio's `wo`, and the other way round. Mitsuba's BSDFs see a surface interaction: inside a plugin of
Gonio's that of the ray, alone one whose shading frame is the local frame, at uv = (0.5, 0.5). Values are float32, the
wheel has no 64-bit variant; of a Mueller matrix they are what unpolarized light gives.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType
from typing import ClassVar

import drjit as dr
import mitsuba as mi

from ..errors import InputError
from ..material import BSDF, Sample, binding, method
from ..material.bsdf import Delta
from ..ops import Direction, Mode, Scalar, Spectrum, backend
from . import calls
from .answers import Answer
from .types import BSDFContext, BSDFPlugin, Mask, SurfaceInteraction


class MitsubaBSDF(BSDF):
    """A BSDF of Mitsuba's."""

    precisions: ClassVar[tuple[str, ...]] = ("float32",)
    zero_weight_is_failure: ClassVar[bool] = True
    bsdf: ClassVar[BSDFPlugin]  # of an instance, but no parameter
    _si: ClassVar[SurfaceInteraction | None] = None  # where it is asked, on a copy that `at` bound
    _active: ClassVar[Mask] = True

    def __init__(self, bsdf: BSDFPlugin) -> None:
        object.__setattr__(self, "bsdf", bsdf)

    def at(self, si: SurfaceInteraction, active: Mask) -> MitsubaBSDF:
        """The copy that answers at a surface interaction."""
        return binding.bound_copy(self, {"_si": si, "_active": active})

    # ------------------------------------------------------------------ formulas

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """Its value."""
        value = self.bsdf.eval(context(mi, mode), self._interaction(wo), mi.Vector3f(wi), self._active)
        return _like(wo, mi.unpolarized_spectrum(value))

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """Its density."""
        return self.bsdf.pdf(mi.BSDFContext(), self._interaction(wo), mi.Vector3f(wi), self._active)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample[Direction, Spectrum, Scalar]:
        """A direction; null interactions, which go straight on, count as delta lobes."""
        ctx, si, flags = context(mi, mode), self._interaction(wo), mi.BSDFFlags
        bs, value = self.bsdf.sample(ctx, si, mi.Float(u.x), mi.Point2f(u.y, u.z), self._active)
        weight = mi.unpolarized_spectrum(value)
        delta = mi.has_flag(bs.sampled_type, flags.Delta) | mi.has_flag(bs.sampled_type, flags.Null)
        pdf = bs.pdf
        if self._si is None:
            # Mitsuba tells of a failed sample by its weight, 0, and leaves any pdf: so reads its own chi-square test.
            # Inside a mix that may be a black lobe too, whose direction the other material reflects to.
            failed = dr.all(weight == 0.0)
            pdf, delta = dr.select(failed, 0.0, pdf), delta & ~failed
        return Sample(bs.wo, _like(wo, weight), pdf, delta, bs.eta)

    def tint(self, wo: Direction) -> Spectrum:
        """What the plugin gives for it."""
        return mi.unpolarized_spectrum(self.bsdf.eval_diffuse_reflectance(self._interaction(wo), self._active))

    def _interaction(self, wo: Direction) -> SurfaceInteraction:
        if self._si is not None:
            si = mi.SurfaceInteraction3f(self._si)
            si.wi = mi.Vector3f(wo)
            return si
        if self.bsdf.variant_name() != mi.variant():
            what = f"this BSDF is of the variant {self.bsdf.variant_name()}, and {mi.variant()} is set"
            raise InputError(what, type(self).__name__, "set its variant again, or build it anew")
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wo))
        si.wi = mi.Vector3f(wo)
        si.t = 1.0
        si.n = mi.Normal3f(0.0, 0.0, 1.0)
        si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
        si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
        si.uv = mi.Point2f(0.5, 0.5)
        # a BSDF that knows it is lit on a visible surface (`null`, `mask`) asks whether there is one
        si.prim_index = mi.UInt32(0)
        return si

    # ------------------------------------------------------------------ facts

    def renderer_calls(self, seed: int) -> Iterator[Answer]:
        """What else a renderer asks of it, and what comes."""
        front = dr.zeros(mi.Vector3f, calls.COUNT) + mi.Vector3f(0.0, 0.0, 1.0)
        return calls.answers(self.bsdf, self._interaction(front), seed)

    def _has(self, *kinds: str) -> bool:
        return any(int(self.bsdf.flags()) & int(getattr(mi.BSDFFlags, kind)) for kind in kinds)

    @property
    def transmits(self) -> bool:
        return self._has("Transmission", "Null")

    @property
    def isotropic(self) -> bool:
        return not self._has("Anisotropic")

    @property
    def delta(self) -> Delta:
        ideal = self._has("Delta", "Null")
        return "never" if not ideal else "maybe" if self._has("Smooth") else "always"


def context(mi: ModuleType, mode: Mode) -> BSDFContext:
    """Mitsuba's context of a transport mode."""
    modes = mi.TransportMode
    return mi.BSDFContext(modes.Radiance if mode == "radiance" else modes.Importance)


def _like(wo: Direction, value: Spectrum) -> Spectrum:
    """The value with 64 bits where wo has them, as a formula expects that mixes it with another."""
    types = backend.types_like(type(wo))
    return types.vec3(value) if dr.itemsize_v(types.float) == 8 else value
