"""E(mu, alpha) by Monte Carlo integration, as in student implementations, for comparison with the quadrature.

The sampling methods are:
cosine   cosine-weighted wi; the weight is f pi. Unbiased, but narrow lobes are rarely hit: below roughness 0.3, most
         texels are far too dark with 1024 samples
ggx, beckmann, ... (the distribution's name)   normals with density D(m) m.n; the weight is (o.m) G / ((o.n) (m.n))
visible  visible normals; the weight is G / G1(o), at most 1 (Heitz2014b)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ... import ops
from ...errors import InputError, did_you_mean
from ...ops import Precision, backend
from ...ops.backend import Array
from ...optics import frame, masking, warp
from ...optics.ndf import NDF, distribution
from .quadrature import Points, known_masking

POINTS = ("hammersley", "independent", "stratified")


class Estimate(NamedTuple):
    """The mean over the samples, and its standard error under the assumption that samples are independent."""

    value: np.ndarray
    standard_error: np.ndarray


def hammersley(count: int) -> np.ndarray:
    """The Hammersley points ((i + 1/2) / n, radical inverse of i in base 2 + 1 / (2 n)), (count, 2)."""
    index = np.arange(count, dtype=np.uint32)
    reverse = np.zeros(count)
    scale = 0.5
    while np.any(index):
        reverse += scale * (index & 1)
        index >>= 1
        scale *= 0.5
    return np.stack([(np.arange(count) + 0.5) / count, reverse + 0.5 / count], axis=1)


def methods(ndf: str) -> tuple[str, ...]:
    """The names of the sampling methods of a distribution."""
    return ("cosine", ndf, "visible")


class Sampling(NamedTuple):
    """The method by which E is estimated from random samples.

    method  "cosine", the distribution's name or "visible"; for a table also "quadrature", without samples
    spp     number of samples per texel, 1 or more
    points  "hammersley" uses the same points for every texel, as in the homework; "independent" uses new points for
            each; "stratified" uses new points for each, one in each cell of a square grid, so `spp` must be a square
            number
    seed    seed of the points, if they are random
    floor   lower bound of the denominator of D in the method "cosine", as in the homework's program: D is then at most
            alpha_x alpha_y / floor; 0 means no bound
    """

    method: str
    spp: int = 1024
    points: str = "hammersley"
    seed: int = 0
    floor: float = 0.0


def estimate(ndf: str, masking_name: str, at: Points, sampling: Sampling, precision: Precision = "float32") -> Estimate:
    """Estimate E from random samples.

    at         the points (mu, alpha, alpha_y, phi) at which E is estimated
    sampling   method and number of samples
    precision  precision of the formulas, "float32" or "float64"
    Returns float64 arrays of the broadcast shape of `at`. Raises InputError for unknown names and for spp < 1.
    """
    method, spp, points, seed, floor = sampling
    known_masking(masking_name)
    _check(ndf, method, points, spp)
    dr = backend.drjit()
    kind = backend.types(precision)
    given = (at.mu, at.alpha, at.alpha if at.alpha_y is None else at.alpha_y, at.phi)
    arrays = np.broadcast_arrays(*[np.asarray(a, float) for a in given])
    shape, count = arrays[0].shape, arrays[0].size
    mu_, along_x, along_y, turn = [backend.float_of(a.ravel(), kind) for a in arrays]
    wo = frame.spherical_direction(dr.sqrt((1.0 - mu_) * (1.0 + mu_)), mu_, turn)
    widths = kind.vec2(along_x, along_y)
    chosen = distribution(ndf)
    first, second = [kind.float(c) for c in (hammersley(spp).T if points == "hammersley" else np.zeros((2, 1)))]
    generator = kind.module.PCG32(size=count, initstate=seed)
    bound = widths.x * widths.y / dr.opaque(kind.float, floor) if floor > 0.0 else None
    strata = dr.opaque(kind.module.UInt32, math.isqrt(spp))

    def body(i: Array, total: Array, squares: Array, rng: Array) -> tuple[Array, Array, Array, Array]:
        if points == "hammersley":
            u1, u2 = dr.gather(kind.float, first, i), dr.gather(kind.float, second, i)
        else:
            double = precision == "float64"
            u1, u2 = [rng.next_float64() if double else rng.next_float32() for _ in range(2)]
            if points == "stratified":
                side = kind.float(strata)
                u1, u2 = (kind.float(i % strata) + u1) / side, (kind.float(i // strata) + u2) / side
        w = _weight(chosen, masking_name, method, wo, widths, u1, u2, bound)
        return i + 1, total + w, squares + w * w, rng

    zero = dr.zeros(kind.float, count)
    _, total, squares, _ = dr.while_loop(
        state=(kind.module.UInt32(0), zero, kind.float(zero), generator),
        cond=lambda i, *_: i < dr.opaque(kind.module.UInt32, spp),
        body=body,
        labels=("i", "total", "squares", "rng"),
    )
    dr.eval(total, squares)  # in one call, because each would otherwise run the loop
    mean = np.asarray(total.numpy(), float) / spp
    variance = np.maximum(np.asarray(squares.numpy(), float) / spp - mean**2, 0.0)
    return Estimate(mean.reshape(shape), np.sqrt(variance / spp).reshape(shape))


def _check(ndf: str, method: str, points: str, spp: int) -> None:
    """Raise InputError for unknown names and for invalid numbers of samples."""
    if method not in methods(ndf):
        raise InputError(f"unknown method '{method}'", "method", did_you_mean(method, [*methods(ndf), "quadrature"]))
    if points not in POINTS:
        raise InputError(f"unknown points '{points}'", "points", did_you_mean(points, list(POINTS)))
    if spp < 1:
        raise InputError(f"{spp} samples given", "--spp", "give 1 or more")
    if points == "stratified" and math.isqrt(spp) ** 2 != spp:
        raise InputError(
            f"{spp} stratified samples given", "--samples", "give the square of a whole number, such as 1024"
        )


def _weight(
    ndf: NDF, masking_name: str, method: str, wo: Array, widths: Array, u1: Array, u2: Array, bound: Array | None
) -> Array:
    """f cos / pdf of one sample at F = 1; `bound` is the largest D in the method "cosine"."""
    dr = backend.drjit()
    if method == "cosine":
        wi = warp.square_to_cosine_hemisphere(u1, u2)
        m = frame.half_vector(wo, wi)
        g = masking.masking_shadowing(masking_name, ndf, wo, wi, m, widths)
        D = ndf.D(m, widths)
        D = D if bound is None else dr.minimum(D, bound)
        return dr.select(wi.z > 0.0, D * g * ops.pi / (4.0 * wo.z * wi.z), 0.0)
    visible = method == "visible"
    m = ndf.sample_visible(wo, u1, u2, widths) if visible else ndf.sample(u1, u2, widths)
    wi = frame.reflect(wo, m)
    g = masking.masking_shadowing(masking_name, ndf, wo, wi, m, widths)
    o_m = ops.dot(wo, m)
    if visible:
        value = ops.safe_div(ndf.D(m, widths) * g * o_m, wo.z * ndf.pdf_visible(wo, m, widths))
    else:
        value = o_m * g / (wo.z * m.z)
    return dr.select((wi.z > 0.0) & (o_m > 0.0), value, 0.0)
