"""OpenPBR, the surface of the Academy Software Foundation, as a composition of what this package has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Self

from ...material import KnownViolation, Sample, binding, method
from ...ops import Direction, Mode, Scalar, Spectrum
from . import _openpbr_derived as derived
from . import _openpbr_lobes as lobes
from . import _openpbr_sampling as sampling
from . import _openpbr_tables as tables
from ._openpbr_derived import Between
from ._openpbr_slabs import _OpenPBR

MOST_RAYS = 1 << 18  # for which what is derived is kept, a hundred numbers each: it halves what is compiled


class OpenPBR(_OpenPBR):
    """OpenPBR 1.1 (OpenPBR2025): a base of metal, glass or a glossy diffuse body under a thin film, a coat and fuzz.

    f = opacity {F f_fuzz + (1 - F E_fuzz) [C f_coat + (1 - C + C T W D) f_base]} + the light that goes straight on
    f_base = M f_metal + (1 - M) {f_glossy + (1 - E_o) (1 - E_i) / (1 - E_avg) f_diffuse}, where opaque

    with the weights F, C, M of fuzz, coat and metal, E the albedo of a rough dielectric, T what the coat's colour
    leaves on both ways, D the darkening by light that bounces under it. W is what the coat's surface lets through: by
    `layering`, (1 - E_coat(wo)), as the specification reduces layers to lobes, or a product of one factor for each
    direction that keeps all light of a white base (docs/openpbr.md). f_diffuse is `eon`, f_fuzz `sheen`, metals are
    F82 with what they scatter twice, glass refracts as `dielectric` and keeps what it scatters twice.

    The parameters are the specification's. Below a roughness of .01 base and coat are mirrors. Indices run from 1 to 5.
    Subsurface scattering is local: with `geometry_thin_walled` as specified, else a diffuse lobe of its colour, the
    limit of radius 0, with a warning. Scattering inside, dispersion and emission are errors, as they are no matter of
    a surface. transmission_depth > 0 gives absorption inside, which Gonio's integrators follow.
    """

    name: ClassVar[str] = "openpbr"
    reads_wavelengths: ClassVar[bool] = True

    def derive(self) -> Between:
        """Widths and indices, means over the hemisphere, and what facets scatter twice."""
        return derived.derive(self)

    def _with_derived(self) -> Self:
        """A copy that holds what is derived, where that differs from ray to ray: it is asked for in many places."""
        if self._derived is not None:
            return self
        derived = binding.evaluate_derived(self, MOST_RAYS) if self.wavelengths is None else None
        return binding.with_derived(self, self.derive() if derived is None else derived)

    def prepare(self) -> None:
        """Find the tables, before a loop is recorded."""
        tables.prepare(self.masking)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The sum of all lobes times |cos theta_i|; mirrors and the light that goes straight on are delta lobes."""
        return self.times_opacity(lobes.surface(self._with_derived(), wo, wi, mode))

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The mixture of the lobes' densities."""
        model = self._with_derived()
        return self.times_opacity(sampling.density_of(model, sampling.shares_at(model, wo), wo, wi))

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u1 picks the lobe."""
        return sampling.drawn(self._with_derived(), wo, u, mode)

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "reciprocity": KnownViolation(
            "fuzz is a table of the viewer's direction alone, and so is a coat where layering is albedo",
            lambda model: 4.0 if model.has("fuzz_weight") or model.by_albedo() else 0.0,
            certain=False,
        ),
        "energy": KnownViolation(
            "tables of what layers let through are interpolated, and are of one width, which stands for two",
            lambda model: 0.15 if model.any_anisotropic else 0.01,
            certain=False,
        ),
        "linearity": KnownViolation(
            "colours of layers multiply, and light that bounces takes them more than once", 10.0, certain=False
        ),
    }
