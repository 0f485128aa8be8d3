"""Disney's principled BSDF of 2015, on the slabs of OpenPBR."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ... import ops
from ...material import BSDF, Colour, KnownViolation, Limit, Number, Sample, binding, flag, method, number, spectrum
from ...material.bsdf import Delta, Interior
from ...material.parameters import Angle
from ...ops import Direction, Mode, Node, Scalar, Spectrum, backend, clamp, max_component, sqrt, where
from ...optics import frame
from ...optics.roughness import SMOOTH
from ..microfacet.microfacet import rotation_angle
from ._openpbr_derived import Between
from .openpbr import OpenPBR

COAT_INDEX = 1.5  # refractive index of the clearcoat
SATIN, GLOSS = 0.1, 0.001  # widths of the clearcoat at gloss 0 and 1
STRENGTH = 0.25  # weight of the coat at `clearcoat` = 1
STRETCH = 0.9  # amount of stretch at `anisotropic` = 1


class _Slabs(OpenPBR):
    """OpenPBR with a coat that changes neither the index nor the width of its base."""

    name: ClassVar[str] = ""

    if TYPE_CHECKING:  # OpenPBR's parameters, which mypy does not recognize as declared
        specular_roughness: Number = number(0.3)
        specular_ior: Number = number(1.5)

    # The presence of slabs is determined by `DisneyBSDF._kind`, in recordings too.
    def has(self, name: str) -> bool:
        return bool(getattr(self.plain, name) != 0.0)

    def has_holes(self) -> bool:
        return False

    def may_be_smooth(self, name: str) -> bool:
        return bool(getattr(self.plain, name) ** 2 < SMOOTH)

    def roughened(self) -> Scalar:
        return self.specular_roughness

    def indices(self) -> tuple[Scalar, Scalar, Scalar]:
        eta = ops.maximum(self.specular_ior, 1.001)
        return eta, eta, ops.ones_like(eta)


class DisneyBSDF(BSDF):
    """Disney's principled BSDF of 2015 for metal, glass and thin sheets, built from energy-conserving slabs.

    The parameters are those of Burley2015. Compared with `disney`, the refractive index replaces `specular`,
    `subsurface` is omitted, and `spec_trans` (for glass), `diff_trans` (for a `thin` sheet) and `flatness` are added.
    Metal, dielectric and glass have the lobes of the paper: GGX with alpha = roughness^2, stretched by
    sqrt(1 - 0.9 anisotropic). F is computed from the index; for metal, it is Schlick's approximation with the base
    color. Glass is tinted by the square root of the base color at each crossing. Lobes that the paper adds are layered
    here, so no energy is gained, and multiple scattering between facets is included. The slabs are those of `openpbr`
    and satisfy the same laws.

    The model differs from the paper in these respects: the diffuse lobe is `eon` with the same roughness, below the
    dielectric (in the paper, `flatness` removes the bright rim of the diffuse lobe; here, it turns `eon` into
    `lambert`); the sheen lobe is `sheen`; the coat is GGX with the width of the paper's GTR1; masking is
    height-correlated; the tint is the base color divided by its largest channel; and a thin sheet transmits with the
    same roughness as it reflects. docs/openpbr.md reports the size of these differences.
    """

    name: ClassVar[str] = "disney2015"
    reads_wavelengths: ClassVar[bool] = True
    fits_factors: ClassVar[bool] = True  # clearcoat_gloss is 1 by default but is not a factor

    base_color: Colour = spectrum(default=0.5, doc="color of the surface", low=0.0, high=1.0)
    metallic: Number = number(default=0.0, doc="0 for a dielectric, 1 for a metal", low=0.0, high=1.0, off=0.0)
    roughness: Number = number(default=0.5, doc="roughness, the square root of alpha", low=0.0, high=1.0)
    anisotropic: Number = number(
        default=0.0, doc="anisotropy, from 0 (isotropic) to 1 (stretched along x)", low=0.0, high=1.0, off=0.0
    )
    rotation: Angle = rotation_angle()
    eta: Number = number(default=1.5, doc="refractive index inside divided by that outside", low=1.0, high=3.0)
    specular_tint: Number = number(
        default=0.0, doc="amount by which the base color tints a dielectric's reflection", low=0.0, high=1.0
    )
    spec_trans: Number = number(default=0.0, doc="fraction of the dielectric that is glass", low=0.0, high=1.0, off=0.0)
    sheen: Number = number(default=0.0, doc="weight of the sheen on a dielectric", low=0.0, high=1.0, off=0.0)
    sheen_tint: Number = number(default=0.5, doc="amount by which the base color tints the sheen", low=0.0, high=1.0)
    clearcoat: Number = number(default=0.0, doc="strength of the clearcoat", low=0.0, high=1.0, off=0.0)
    clearcoat_gloss: Number = number(
        default=1.0, doc="gloss of the clearcoat: 0 is satin, 1 is glossy", low=0.0, high=1.0
    )
    diff_trans: Number = number(
        default=0.0,
        doc="diffuse transmission of a thin sheet: 0 is opaque, 1 scatters equally to both sides, 2 only transmits",
        low=0.0,
        high=2.0,
    )
    flatness: Number = number(
        default=0.0, doc="reduction of the roughness of the diffuse lobe; 1 removes it", low=0.0, high=1.0
    )
    thin: bool = flag(default=False, doc="whether the surface is a thin sheet without an interior")

    limits: ClassVar[tuple[Limit, ...]] = (
        Limit({"sheen": 0.0}, mutes=("sheen_tint",)),
        Limit({"clearcoat": 0.0}, mutes=("clearcoat_gloss",)),
        Limit({"metallic": 1.0}, mutes=("specular_tint", "spec_trans", "sheen*", "diff_trans", "flatness")),
        Limit({"spec_trans": 1.0}, mutes=("diff_trans", "flatness")),
    )
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "reciprocity": KnownViolation(
            "the table of sheen lobes depends on the view direction only",
            lambda model: 4.0 if _some(model.sheen) else 0.0,
            certain=False,
        ),
        "energy": KnownViolation(
            OpenPBR.known_violations["energy"].reason,
            lambda model: 0.15 if _some(model.anisotropic) else 0.01,
            certain=False,
        ),
        "limits": KnownViolation(
            OpenPBR.known_violations["limits"].reason,
            0.02,
            certain=False,
        ),
        "linearity": KnownViolation(
            "tints are ratios of color channels, and glass uses the square root of the base color", 10.0, certain=False
        ),
    }

    # ------------------------------------------------------------------ as slabs

    def _kind(self) -> _Slabs:
        """The slabs that determine which components are compiled."""
        plain = self.plain

        def at(name: str, on: float = 0.5) -> float:
            return on if isinstance(getattr(self, name), Node) or _some(getattr(plain, name)) else 0.0

        def rough(name: str) -> float:
            value = getattr(plain, name)
            open_ = isinstance(getattr(self, name), Node) or backend.is_drjit(value)
            return 0.0 if open_ else float(np.min(np.asarray(value, float)))

        return _Slabs(
            base_diffuse_roughness=0.5,  # not a weight: code recorded at 0 must be valid for other values too
            base_metalness=at("metallic"),
            specular_roughness=rough("roughness"),
            specular_roughness_anisotropy=0.5 if _some(plain.anisotropic) else 0.0,
            transmission_weight=at("spec_trans"),
            subsurface_weight=1.0 if self.thin else 0.0,
            subsurface_radius=0.0,
            coat_weight=at("clearcoat"),
            coat_roughness=0.1,
            fuzz_weight=at("sheen"),
            geometry_thin_walled=self.thin,
        )

    def _slabs(self) -> _Slabs:
        """The slabs for these parameters."""
        kind, colour = self._kind(), self.base_color
        one, white = ops.ones_like(self.roughness), ops.ones_like(colour)
        most = max_component(colour)
        tint = where(most > 0.0, colour / where(most > 0.0, most, 1.0), white)
        # widths r^2 / a and r^2 a, a^2 = 1 - 0.9 anisotropic: a roughness for the same ratio and sum of squares
        low = 1.0 - STRETCH * self.anisotropic
        wide = sqrt(sqrt(0.5 * (low + 1.0 / low)))
        rest = {
            name: (white if parameter.kind == "spectrum" else one) * getattr(kind, name)
            for name, parameter in kind.parameters().items()
            if parameter.numeric and not parameter.inside
        }
        values = {
            **rest,
            "base_color": colour,
            "base_metalness": self.metallic,
            "base_diffuse_roughness": self.roughness * (1.0 - self.flatness),
            "specular_color": 1.0 + (tint - 1.0) * (self.specular_tint * (1.0 - self.metallic)),
            "specular_roughness": clamp(self.roughness * wide, 0.0, 1.0),
            "specular_roughness_anisotropy": STRETCH * self.anisotropic,
            "specular_ior": self.eta,
            "transmission_weight": self.spec_trans,
            "transmission_color": colour if self.thin else ops.safe_sqrt(colour),
            "subsurface_weight": one if self.thin else ops.zeros_like(one),
            "subsurface_color": colour,
            "subsurface_scatter_anisotropy": self.diff_trans - 1.0,
            "coat_weight": STRENGTH * self.clearcoat,
            "coat_roughness": sqrt(SATIN + (GLOSS - SATIN) * self.clearcoat_gloss),
            "coat_ior": COAT_INDEX * one,
            "coat_darkening": ops.zeros_like(one),
            "fuzz_weight": self.sheen * (1.0 - self.metallic),
            "fuzz_color": 1.0 + (tint - 1.0) * self.sheen_tint,
        }
        copy = binding.bound_copy(kind, values, self._derived)
        if self.wavelengths is not None:
            vars(copy)["wavelengths"] = self.wavelengths
        return copy

    def derive(self) -> Between:
        """The derived values of the slabs."""
        return self._slabs().derive()

    def prepare(self) -> None:
        """Compute the tables, before a loop is recorded."""
        self._kind().prepare()

    def _in_tangent_frame(self, w: Direction) -> Direction:
        return frame.rotate(w, self.rotation)

    # ------------------------------------------------------------------ values

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The value of the slabs, along the axes of the anisotropy."""
        return self._slabs().eval(self._in_tangent_frame(wo), self._in_tangent_frame(wi), mode)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The density of the slabs, along the axes of the anisotropy."""
        return self._slabs().pdf(self._in_tangent_frame(wo), self._in_tangent_frame(wi))

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """A sample of the slabs, rotated back to the surface's axes."""
        drawn = self._slabs().sample(self._in_tangent_frame(wo), u, mode)
        return drawn._replace(wi=frame.rotate_back(drawn.wi, self.rotation))

    # ------------------------------------------------------------------ facts

    @property
    def transmits(self) -> bool:
        return self.thin or bool(self._kind().refracts)

    @property
    def delta(self) -> Delta:
        return self._kind().delta

    @property
    def isotropic(self) -> bool:
        if isinstance(self.anisotropic, Node):
            return False
        return isinstance(self.plain.anisotropic, int | float) and self.plain.anisotropic == 0

    @property
    def interior(self) -> Interior | None:
        if self.thin or not self._kind().refracts:
            return None
        if not self.is_bound:
            return self.bind(backend.types("float64")).interior
        return Interior(self._slabs().indices()[1], ops.zeros_like(self.base_color), ops.zeros_like(self.eta))

    def tint(self, wo: Direction) -> Spectrum:
        """The tint of the slabs."""
        return self._slabs().tint(wo)


def _some(value: object) -> bool:
    """Whether the value of a parameter may differ from 0."""
    return backend.is_drjit(value) or bool(np.any(np.asarray(value, float) != 0.0))
