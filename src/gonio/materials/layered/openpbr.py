"""OpenPBR, the surface model of the Academy Software Foundation, composed of the lobes of this package."""

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

MAX_RAYS = 1 << 18  # rays with stored derived values (about a hundred numbers each), which halve the compiled code


class OpenPBR(_OpenPBR):
    """OpenPBR 1.1 (OpenPBR2025): a metal, glass or glossy-diffuse base under a thin film, a coat and fuzz.

    f = opacity {F f_fuzz + (1 - F E_fuzz) [C f_coat + (1 - C + C T W D) f_base]} + the light passing straight through
    f_base = M f_metal + (1 - M) {f_glossy + (1 - E_o) (1 - E_i) / (1 - E_avg) f_diffuse} for an opaque base

    F, C and M are the weights of fuzz, coat and metal, `opacity` is `geometry_opacity`, and f_X is the lobe of the
    component X. E_fuzz is the albedo of the fuzz for wo, E_coat is the albedo of the coat's surface, E_o and E_i are
    the albedos of the base's rough dielectric surface for wo and wi, and E_avg is the cosine-weighted mean of E_o. T is
    the color of the coat for the two crossings, along wo and wi, and D is the darkening by interreflection under the
    coat. W is the transmittance of the coat's surface for both crossings. Depending on `layering`, it is
    1 - E_coat(wo), as in the specification's reduction of layers to lobes, or a product of one factor per direction,
    which loses no light over a white base (docs/openpbr.md). f_diffuse is `eon`, f_fuzz is `sheen`, metal is F82 with
    multiple scattering, and glass is `dielectric` with multiple scattering.

    The parameters are those of the specification. A base or coat with a roughness below 0.01 is a mirror. Refractive
    indices range from 1 to 5. Subsurface scattering is local. With `geometry_thin_walled`, it follows the
    specification; otherwise, it is a diffuse lobe with the subsurface color, which is the limit for radius 0, and a
    warning is issued. Volume scattering, dispersion and emission raise InputError, because they are not properties of a
    surface. If `transmission_depth` is above 0, Gonio's integrators apply absorption inside the base.
    """

    name: ClassVar[str] = "openpbr"
    reads_wavelengths: ClassVar[bool] = True

    def derive(self) -> Between:
        """Widths and indices, means over the hemisphere, and multiple scattering between facets."""
        return derived.derive(self)

    def _with_derived(self) -> Self:
        """A copy that stores its derived values even if they differ from ray to ray, because they are used in many
        places."""
        if self._derived is not None:
            return self
        derived = binding.evaluate_derived(self, MAX_RAYS) if self.wavelengths is None else None
        return binding.with_derived(self, self.derive() if derived is None else derived)

    def prepare(self) -> None:
        """Compute the tables, before a loop is recorded."""
        tables.prepare(self.masking)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The sum of all lobes times |cos theta_i|; mirrors and light passing straight through are delta lobes."""
        return self.times_opacity(lobes.surface(self._with_derived(), wo, wi, mode))

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The mixture of the lobes' densities."""
        model = self._with_derived()
        return self.times_opacity(sampling.density_of(model, sampling.shares_at(model, wo), wo, wi))

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """A sample of the lobe that u.x selects."""
        return sampling.drawn(self._with_derived(), wo, u, mode)

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "reciprocity": KnownViolation(
            "the lobe and the attenuation of the fuzz depend on the view direction only, as does the attenuation by a "
            "coat with layering `albedo`",
            lambda model: 4.0 if model.has("fuzz_weight") or model.by_albedo() else 0.0,
            certain=False,
        ),
        "energy": KnownViolation(
            "the transmittance of layers is interpolated in tables for isotropic layers, which only approximate "
            "anisotropic ones",
            lambda model: 0.15 if model.any_anisotropic else 0.01,
            certain=False,
        ),
        "limits": KnownViolation(
            "the table of multiple scattering in metal is coarser for anisotropic and for spatially varying alpha",
            0.02,
            certain=False,
        ),
        "linearity": KnownViolation(
            "the colors of layers are multiplied, more than once for interreflected light", 10.0, certain=False
        ),
    }
