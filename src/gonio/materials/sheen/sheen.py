"""Sheen of upright fibers on a surface, including multiple scattering."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...material.bsdf import BSDF, InnerAlbedo, KnownViolation
from ...material.calling import method
from ...material.parameters import Colour, Number, number, spectrum
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, dot, function, inv_pi, maximum, safe_div, sqr, vec3, where
from ...ops.table import read_in_numpy
from ...optics import frame
from ...optics.warp import square_to_cosine_hemisphere


class Layer(NamedTuple):
    """The transformed cosine for one wo, which M^-1 = ((A, 0, B), (0, A, 0), (0, 0, 1)) maps back to the cosine.

    A, B  entries of M^-1
    R     albedo of the layer for wo
    """

    A: Scalar
    B: Scalar
    R: Scalar


class Sheen(BSDF):
    """Sheen of a thin layer of upright fibers: f cos theta_i = albedo R(wo) D(wo, wi) (Zeltner2022).

    D is a linearly transformed cosine (Heitz2016a) that was fitted to random walks in a layer of lossless microflakes
    of unit density and thickness; it includes all orders of scattering. R is the albedo of the layer; the remaining
    light reaches the surface below, which is not part of this model. `albedo` is only a scale factor, although
    absorbing fibers would tint later bounces more strongly. Sampling is exact: every sample has the weight albedo R.

    The model is not reciprocal, because the fit depends on wo only. The fit is a table of 32 x 32 nodes that is
    interpolated linearly.
    """

    albedo: Colour = spectrum(default=1.0, doc="scale factor for reflected light", low=0.0, high=1.0, soft_high=True)
    roughness: Number = number(
        default=0.5,
        doc="square root of the flakes' cross section: 0 for fibers along the normal, 1 for random directions",
        low=0.0,
        high=1.0,
    )

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "reciprocity": KnownViolation("the table of lobes depends on the view direction only", 2.0)
    }

    @function
    def _lobe(self, wo: Direction) -> Layer:
        """The interpolated entry of the table."""
        table = _table()
        rows, columns = table.shape
        return Layer(*ops.lookup(table, ops.inset(self.roughness, rows), ops.inset(wo.z, columns)))

    @function
    def _density(self, lobe: Layer, wo: Direction, wi: Direction) -> Scalar:
        """cos(h) / pi A^2 / |h|^4 with h = M^-1 wi: the cosine's density times the Jacobian of the map."""
        w = frame.rotate(wi, frame.azimuth(wo))
        h = vec3(lobe.A * w.x + lobe.B * w.z, lobe.A * w.y, w.z)
        density = maximum(w.z, 0.0) * inv_pi * sqr(safe_div(lobe.A, dot(h, h)))
        return where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """albedo R D, the density of the lobe times its albedo."""
        lobe = self._lobe(wo)
        return self.albedo * (lobe.R * self._density(lobe, wo, wi))

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """D, the density of the transformed cosine."""
        return self._density(self._lobe(wo), wo, wi)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """M applied to a cosine-weighted direction; every weight is albedo R."""
        lobe = self._lobe(wo)
        h = square_to_cosine_hemisphere(u.y, u.z)
        wi = vec3(h.x - lobe.B * h.z, h.y, lobe.A * h.z)
        wi = frame.rotate_back(wi * ops.rsqrt(maximum(dot(wi, wi), frame.TINY)), frame.azimuth(wo))
        pdf = self._density(lobe, wo, wi)
        weight = self.albedo * where(pdf > 0.0, lobe.R, 0.0)
        return Sample.of_density(wi, weight, pdf)

    def tint(self, wo: Direction) -> Spectrum:
        """The directional albedo for wo: albedo times R."""
        return self.albedo * self._lobe(wo).R

    def known_albedo(
        self, mu: NDArray[np.float64], phi: NDArray[np.float64], inner: InnerAlbedo, nodes: int | None
    ) -> NDArray[np.float64]:
        """albedo R for wo above the surface."""
        alpha = np.full(len(mu), float(self.roughness))  # type: ignore[arg-type]
        rows, columns = _table().shape
        R = read_in_numpy(_table(), ops.inset(alpha, rows), ops.inset(np.maximum(mu, 0.0), columns))[2]
        return np.where(mu > 0.0, R, 0.0)[:, None] * np.broadcast_to(np.asarray(self.albedo, float), (len(mu), 3))


@lru_cache(maxsize=1)
def _table() -> ops.Table:
    """The table of A, B and R as functions of roughness and mu."""
    text = Path(__file__).with_name("zeltner2022.json").read_text()
    return ops.Table("sheen", np.array(json.loads(text)["coefficients"]))
