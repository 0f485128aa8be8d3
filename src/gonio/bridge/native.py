"""A Mitsuba BSDF, built in or a user's plugin, as a material, which may be nested in one of Gonio's materials.

Mitsuba's `wi` is Gonio's `wo`, and vice versa. Mitsuba's BSDFs require a surface interaction. A BSDF nested in a Gonio
plugin receives the interaction of the ray; any other BSDF receives one at uv = (0.5, 0.5), whose shading frame is the
local frame. Values are float32, because Mitsuba's wheel has no double-precision variant. Mueller matrices are reduced
to their values for unpolarized light.
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
    """A material that wraps a BSDF of Mitsuba."""

    precisions: ClassVar[tuple[str, ...]] = ("float32",)
    zero_weight_is_failure: ClassVar[bool] = True
    bsdf: ClassVar[BSDFPlugin]  # an attribute of each instance, but not a parameter
    _si: ClassVar[SurfaceInteraction | None] = None  # the interaction at which a copy made by `at` is evaluated
    _active: ClassVar[Mask] = True

    def __init__(self, bsdf: BSDFPlugin) -> None:
        object.__setattr__(self, "bsdf", bsdf)

    def at(self, si: SurfaceInteraction, active: Mask) -> MitsubaBSDF:
        """A copy of this material that is evaluated at a given surface interaction."""
        return binding.bound_copy(self, {"_si": si, "_active": active})

    # ------------------------------------------------------------------ formulas

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The value of Mitsuba's BSDF, which includes the cosine."""
        value = self.bsdf.eval(context(mi, mode), self._interaction(wo), mi.Vector3f(wi), self._active)
        return _like(wo, mi.unpolarized_spectrum(value))

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The sampling density of Mitsuba's BSDF, 1/sr."""
        return self.bsdf.pdf(mi.BSDFContext(), self._interaction(wo), mi.Vector3f(wi), self._active)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample[Direction, Spectrum, Scalar]:
        """Sample a direction with three random numbers in [0, 1).

        Null interactions, in which light passes straight through, count as delta lobes.
        """
        ctx, si, flags = context(mi, mode), self._interaction(wo), mi.BSDFFlags
        bs, value = self.bsdf.sample(ctx, si, mi.Float(u.x), mi.Point2f(u.y, u.z), self._active)
        weight = mi.unpolarized_spectrum(value)
        delta = mi.has_flag(bs.sampled_type, flags.Delta) | mi.has_flag(bs.sampled_type, flags.Null)
        pdf = bs.pdf
        if self._si is None:
            # Mitsuba signals a failed sample by the weight 0 with any pdf, as its own chi-square test assumes. However,
            # a sample in a direction in which no light is reflected is valid if it has the density that `pdf` returns.
            # If light is reflected in this direction, the weight 0 means that a lobe was sampled on the wrong side of
            # the surface, or that a lobe of a mixture is black.
            stated, value = (call(ctx, si, bs.wo, self._active) for call in (self.bsdf.pdf, self.bsdf.eval))
            black = dr.all(mi.unpolarized_spectrum(value) == 0.0) & (dr.abs(stated - pdf) < 1e-3 * pdf)
            failed = dr.all(weight == 0.0) & ~((pdf > 0.0) & black)
            pdf, delta = dr.select(failed, 0.0, pdf), delta & ~failed
        return Sample(bs.wo, _like(wo, weight), pdf, delta, bs.eta)

    def tint(self, wo: Direction) -> Spectrum:
        """The diffuse reflectance of the plugin."""
        return mi.unpolarized_spectrum(self.bsdf.eval_diffuse_reflectance(self._interaction(wo), self._active))

    def _interaction(self, wo: Direction) -> SurfaceInteraction:
        if self._si is not None:
            si = mi.SurfaceInteraction3f(self._si)
            si.wi = mi.Vector3f(wo)
            return si
        if self.bsdf.variant_name() != mi.variant():
            what = f"this BSDF was built in variant {self.bsdf.variant_name()}, but {mi.variant()} is set"
            raise InputError(what, type(self).__name__, "set its variant again, or build the BSDF again")
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wo))
        si.wi = mi.Vector3f(wo)
        si.t = 1.0
        si.n = mi.Normal3f(0.0, 0.0, 1.0)
        si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
        si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
        si.uv = mi.Point2f(0.5, 0.5)
        # `null` and `mask` check whether the interaction is on a surface
        si.prim_index = mi.UInt32(0)
        return si

    # ------------------------------------------------------------------ facts

    def renderer_calls(self, seed: int) -> Iterator[Answer]:
        """The results of the calls that a renderer makes in addition to eval, pdf and sample.

        seed  seed of the random directions
        """
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
    """Mitsuba's BSDF context for a transport mode."""
    modes = mi.TransportMode
    return mi.BSDFContext(modes.Radiance if mode == "radiance" else modes.Importance)


def _like(wo: Direction, value: Spectrum) -> Spectrum:
    """The value in double precision if wo is in double precision, so that formulas can combine both."""
    types = backend.types_like(type(wo))
    return types.vec3(value) if dr.itemsize_v(types.float) == 8 else value
