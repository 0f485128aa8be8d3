"""Random walks on the facets (Heitz2016): the reference for every compensation.

The microsurface is a random height field with GGX slopes and heights uniform in [-1, 1] (their distribution does not
affect the results). A walker at height h that moves along w hits the surface after a distance whose distribution
follows from Smith's masking:

    it escapes upward with probability G1(w, h) = C(h)^Lambda(w),  C(h) = (h + 1) / 2,
    otherwise the next height is given by C(h') = C(h) (1 - u)^(-1 / Lambda(w)), for both upward and downward
    directions.

At that height, it hits a facet with a normal visible from -w, and is reflected with weight F (metal), or reflected or
refracted with probabilities F and 1 - F (glass). A refracted walker continues in the mirrored frame, in which its own
medium is above. Each hit adds the direct contribution along the target direction, which is the phase function times G1
(next-event estimation), so the estimate is unbiased.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...ops import Direction, Pair, Scalar, backend, dot, maximum, ones_like, sqrt, vec3, where, zeros_like
from ...ops.backend import Array
from ...ops.graph import Node, RecordingError
from ...optics import frame, fresnel
from ...optics.ndf import distribution
from ...optics.roughness import widths

MAX_BOUNCES = 128  # at alpha = 1, less than 1e-9 of the light remains after this number of bounces
FLAT = 1e-6  # value of |w.z| below which a walker remains at its height


def signed_lambda(w: Direction, alpha: Pair) -> Scalar:
    """Smith's Lambda for directions above and below the horizon: Lambda(-w) = -1 - Lambda(w)."""
    above = distribution("ggx").Lambda(w, alpha)
    return where(w.z > 0.0, above, -1.0 - above)


def raised(base: Array, power: Scalar) -> Array:
    """base^power, with its logarithm limited to +-80, because Dr.Jit's float64 power is NaN if it underflows."""
    dr = backend.drjit()
    return dr.exp(dr.clip(power * dr.log(base), -80.0, 80.0))


def escape(w: Direction, height: Array, alpha: Pair) -> Array:
    """G1(w, h), the probability of escape along w from the height with C(h) = `height`; 0 for downward directions."""
    dr = backend.drjit()
    power = maximum(distribution("ggx").Lambda(w, alpha), 0.0)
    return where(w.z > 0.0, raised(dr.clip(height, 1e-12, 1.0), power), 0.0)


def meet(w: Direction, height: Array, u: Array, alpha: Pair) -> tuple[Array, Array]:
    """C(h') at the next hit, and whether the walker escapes without another hit.

    height  C(h)
    u       random number in [0, 1)
    """
    dr = backend.drjit()
    leaves = u > 1.0 - escape(w, height, alpha)
    bend = signed_lambda(w, alpha)
    rest = dr.maximum(1.0 - u, 1e-12)
    steep = w.z < -0.9999
    power = -1.0 / where(dr.abs(bend) < 1e-9, 1e-9, bend)
    there = where(steep, u, raised(rest, power)) * height
    there = where(dr.abs(w.z) < FLAT, height, there)
    return dr.clip(there, 1e-12, 1.0), leaves


def visible_density(v: Direction, m: Direction, alpha: Pair) -> Scalar:
    """Density of visible normals for v above or below the horizon, max(v.m, 0) D(m) / projected area (Heitz2016)."""
    slant = sqrt(v.z * v.z + (alpha.x * v.x) * (alpha.x * v.x) + (alpha.y * v.y) * (alpha.y * v.y))
    # v.z + slant suffers from cancellation for v.z < 0; slant^2 - v.z^2 does not
    tangential = (alpha.x * v.x) * (alpha.x * v.x) + (alpha.y * v.y) * (alpha.y * v.y)
    area = 0.5 * where(v.z > 0.0, v.z + slant, tangential / maximum(slant - v.z, 1e-20))
    return maximum(dot(v, m), 0.0) * distribution("ggx").D(m, alpha) / maximum(area, 1e-20)


class Left(NamedTuple):
    """The end of a walk: the direction, the weight (a spectrum) and the number of hits."""

    w: Array
    weight: Array
    bounces: Array


class _Facets:
    """The scattering of a walker by one facet of a bound base."""

    def __init__(self, base: Any, alpha: Pair) -> None:
        self.base, self.alpha = base, alpha
        self.glass = base.transmits
        self.metal = base.microsurface.eta is None
        self.albedo = 1.0 if self.metal else base.albedo  # the reflectance of a metal includes its albedo

    def eta(self, side: Array) -> Array:
        """Index on the far side divided by the index of the walker's own medium."""
        if self.metal:
            return type(side)(1.0)
        return backend.drjit().select(side > 0.0, self.base.eta, 1.0 / self.base.eta)

    def reflectance(self, cos: Array, eta: Array) -> Array:
        if self.metal:
            return self.base.reflectance(cos)
        return self.base.reflectance(cos, fresnel.cos_transmitted(cos, eta), eta)

    def onward(self, v: Array, wi: Array, side: Array, height: Array) -> Array:
        """The phase function from v to the target wi times the probability of escape along wi, without the albedo of
        glass.

        side    1 if the walker's own medium is outside, else -1
        height  C(h) of the facet
        """
        dr, alpha = backend.drjit(), self.alpha
        eta = self.eta(side)
        target = vec3(wi.x, wi.y, wi.z) * side
        h = frame.half_vector(v, target)
        f = self.reflectance(dr.abs(dot(v, h)), eta)
        up = visible_density(v, h, alpha) / dr.maximum(4.0 * dr.abs(dot(v, h)), 1e-12)
        reflected = f * where(target.z > 0.0, up * escape(target, height, alpha), 0.0)
        if not self.glass:
            return reflected
        m = v + target * eta
        m = m * (1.0 / dr.maximum(dr.norm(m), 1e-12))
        m = where(m.z < 0.0, -m, m)
        o_m, i_m = dot(v, m), dot(target, m)
        spread = dr.square(eta) * dr.maximum(-i_m, 0.0) / dr.maximum(dr.square(o_m + eta * i_m), 1e-20)
        down = (1.0 - self.reflectance(dr.abs(o_m), eta)) * visible_density(v, m, alpha) * spread
        below = vec3(-target.x, -target.y, -target.z)
        return reflected + where((target.z < 0.0) & (o_m > 0.0), down * escape(below, 1.0 - height, alpha), 0.0)


def walk(base: Any, wo: Array, wi: Array, rng: Array, alpha: Pair, power: bool) -> tuple[Array, Left]:
    """For one walker per lane: (light scattered along wi after two or more hits, times |cos theta_i|; end of the walk).

    base   a bound conductor or dielectric
    wi     the target direction; None estimates no light
    rng    random number generators, one per lane
    power  whether transmission is measured as power; else as radiance, which includes the factor (eta_o / eta_i)^2
    """
    if isinstance(wo, Node):
        raise RecordingError("a random walk cannot be recorded: its number of steps depends on values", "RandomWalk")
    dr = backend.drjit()
    kind = backend.types_like(type(wo))
    Float, Vector = kind.float, type(wo)
    facets = _Facets(base, alpha)
    side = dr.select(wo.z >= 0.0, Float(1.0), Float(-1.0))  # +1: the walker's own medium is outside
    w = Vector(-(vec3(wo.x, wo.y, wo.z) * side))
    weight = dr.zeros(type(base.albedo * 1.0), 1) + ones_like(wo.z)
    weight = type(base.albedo)(weight)

    def uniform(generator: Array) -> Array:
        return generator.next_float64() if kind.float is backend.types("float64").float else generator.next_float32()

    def body(
        w: Array, height: Array, side: Array, weight: Array, total: Array, alive: Array, bounces: Array, rng: Array
    ) -> tuple:
        there, leaves = meet(w, height, uniform(rng), alpha)
        alive = alive & ~leaves
        v = vec3(-w.x, -w.y, -w.z)
        bounces = dr.select(alive, bounces + 1, bounces)
        if wi is not None:
            light = facets.onward(v, wi, side, there) * weight * facets.albedo
            total = total + where(alive & (bounces > 1), light, 0.0)
        u1, u2 = uniform(rng), uniform(rng)
        m = distribution("ggx").sample_visible(v, u1, u2, alpha)
        o_m = dr.maximum(dot(v, m), 0.0)
        eta = facets.eta(side)
        f = facets.reflectance(o_m, eta)
        mirrored = frame.reflect(v, m)
        if not facets.glass:
            weight = where(alive, weight * f * facets.albedo, weight)
            w = where(alive, mirrored, w)
            height = dr.select(alive, there, height)
        else:
            passes = alive & (uniform(rng) >= f)
            through = frame.refract(v, m, fresnel.cos_transmitted(o_m, eta), eta)
            weight = where(alive, weight * base.albedo, weight)
            w = where(alive, where(passes, -through, mirrored), w)
            height = dr.select(alive, dr.select(passes, 1.0 - there, there), height)
            side = dr.select(passes, -side, side)
        alive = alive & (bounces < MAX_BOUNCES)
        return Vector(w), height, side, weight, total, alive, bounces, rng

    bounces = kind.module.UInt32(0) + dr.zeros(kind.module.UInt32, dr.width(w))
    state = (w, Float(1.0) + zeros_like(w.z), side, weight, weight * 0.0, w.z < 0.0, bounces, rng)
    names = ("w", "height", "side", "weight", "total", "alive", "bounces", "rng")
    w, _, end_side, weight, total, _, bounces, _ = dr.while_loop(state, cond=lambda *s: s[5], body=body, labels=names)
    if facets.glass and not power and wi is not None:
        crosses = wo.z * wi.z < 0.0
        total = total * where(crosses, 1.0 / dr.square(facets.eta(side)), 1.0)
    return total, Left(w * end_side, weight, bounces)


def generator(wo: Direction, wi: Direction, seed: Array) -> Array:
    """One random number generator per lane, seeded by the bits of the two directions and the seed, so that each pair
    has its own numbers."""
    dr = backend.drjit()
    kind = backend.types_like(type(wo))
    UInt = kind.module.UInt32
    state: Array = UInt(0x9E3779B9)
    for value in (*(wo[i] for i in range(3)), *(wi[i] for i in range(3)), seed):
        bits = dr.reinterpret_array(UInt, kind.module.Float(value))
        state = (state ^ bits) * UInt(0x85EBCA6B)
        state = (state ^ (state >> 15)) * UInt(0xC2B2AE35)
        state = state ^ (state >> 13)
    count = dr.width(state)
    # equal pairs in one call differ in their lane
    lane = dr.arange(UInt, count) * UInt(0x9E3779B1)
    state = (state ^ lane ^ (lane >> 16)) * UInt(0x85EBCA6B)
    return kind.module.PCG32(size=count, initstate=kind.module.UInt64(state ^ (state >> 13)))


def albedo(base: Any, mu: float, walks: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Estimate the albedo, a spectrum, as the mean weight of the walkers that leave the surface. Returns it with its
    standard error.

    base   a Conductor or Dielectric with ndf "ggx"
    mu     cosine of the angle between wo and the normal; if it is negative, walks start inside the glass
    walks  number of walkers
    seed   seed of the walks
    """
    dr = backend.drjit()
    kind = backend.types("float32")
    bound = base.bind(kind)
    alpha, _ = widths(bound.alpha)
    sums, squares, done = 0.0, 0.0, 0
    while done < walks:
        count = min(walks - done, 1 << 21)
        wo = kind.vec3(float(np.sqrt(1.0 - mu * mu)), 0.0, mu) + dr.zeros(kind.float, count)
        rng = kind.module.PCG32(size=count, initstate=seed * 1_000_003 + done)
        _, left = walk(bound, wo, None, rng, alpha, True)
        values = np.asarray(type(bound.albedo)(left.weight).numpy(), float)
        sums, squares, done = sums + values.sum(1), squares + (values**2).sum(1), done + count
    mean = np.asarray(sums / walks)
    return mean, np.sqrt(np.maximum(np.asarray(squares / walks) - mean**2, 0.0) / walks)
