"""Light among the facets, followed one by one (Heitz2016): the referee of every compensation.

The microsurface is a random height field with GGX slopes, heights uniform in [-1, 1] (their distribution drops out of
every result). A walker at height h going along w meets it again after a distance whose law is Smith's masking:

    it escapes upward with probability G1(w, h) = C(h)^Lambda(w),  C(h) = (h + 1) / 2,
    else it stands at C(h') = C(h) (1 - u)^(-1 / Lambda(w)), for directions up and down alike.

There it meets a normal as -w sees them, and is reflected with the weight F (metal), or reflected or refracted with the
chances F and 1 - F (glass). A refracted walker is followed in the mirrored frame, where its own medium is above. At
each meeting the way straight out along the target direction is added, phase function times G1: that makes `value`
unbiased.
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

MOST_BOUNCES = 128  # at alpha = 1 less than 1e-9 of the light is left after these
FLAT = 1e-6  # below this |w.z| a walker stays at its height


def signed_lambda(w: Direction, alpha: Pair) -> Scalar:
    """Smith's Lambda with its sign: Lambda(-w) = -1 - Lambda(w)."""
    above = distribution("ggx").Lambda(w, alpha)
    return where(w.z > 0.0, above, -1.0 - above)


def raised(base: Array, power: Scalar) -> Array:
    """base^power; beyond e^-80 and e^80 those: Dr.Jit's own power of 64 bits is no number where it underflows."""
    dr = backend.drjit()
    return dr.exp(dr.clip(power * dr.log(base), -80.0, 80.0))


def escape(w: Direction, height: Array, alpha: Pair) -> Array:
    """G1(w, h): the chance to leave from C(h) = height along w; 0 downward."""
    dr = backend.drjit()
    power = maximum(distribution("ggx").Lambda(w, alpha), 0.0)
    return where(w.z > 0.0, raised(dr.clip(height, 1e-12, 1.0), power), 0.0)


def meet(w: Direction, height: Array, u: Array, alpha: Pair) -> tuple[Array, Array]:
    """(C(h') where it meets the surface next, whether it leaves)."""
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
    """Density of normals as v sees them, above or below the horizon: max(v.m, 0) D(m) / projected area (Heitz2016)."""
    slant = sqrt(v.z * v.z + (alpha.x * v.x) * (alpha.x * v.x) + (alpha.y * v.y) * (alpha.y * v.y))
    # v.z + slant cancels for v.z < 0; slant^2 - v.z^2 does not
    tangential = (alpha.x * v.x) * (alpha.x * v.x) + (alpha.y * v.y) * (alpha.y * v.y)
    area = 0.5 * where(v.z > 0.0, v.z + slant, tangential / maximum(slant - v.z, 1e-20))
    return maximum(dot(v, m), 0.0) * distribution("ggx").D(m, alpha) / maximum(area, 1e-20)


class Left(NamedTuple):
    """Where a walk ended: direction, weight (a spectrum), meetings."""

    w: Array
    weight: Array
    bounces: Array


def walk(base: Any, wo: Array, wi: Array, rng: Array, alpha: Pair, power: bool) -> tuple[Array, Left]:
    """Follow one walker a lane from wo; (light of two meetings or more that goes out along wi, where it went itself).

    base   a conductor or a dielectric, bound
    wi     the target, or None
    power  whether transmission is of power, or of radiance, which carries (eta_o / eta_i)^2
    The value is times |cos theta_i|.
    """
    if isinstance(wo, Node):
        raise RecordingError("a random walk cannot be recorded: it is no straight line", "RandomWalk")
    dr = backend.drjit()
    kind = backend.types_like(type(wo))
    Float, Vector = kind.float, type(wo)
    glass = base.transmits
    metal = base.microsurface.eta is None
    side = dr.select(wo.z >= 0.0, Float(1.0), Float(-1.0))  # +1: the walker's own medium is outside
    w = Vector(-(vec3(wo.x, wo.y, wo.z) * side))
    weight = dr.zeros(type(base.albedo * 1.0), 1) + ones_like(wo.z)
    weight = type(base.albedo)(weight)
    eta_of = (lambda s: dr.select(s > 0.0, base.eta, 1.0 / base.eta)) if not metal else (lambda s: Float(1.0))

    def reflectance(cos: Array, eta: Array) -> Array:
        if metal:
            return base.reflectance(cos)  # a spectrum, albedo included
        return base.reflectance(cos, fresnel.cos_transmitted(cos, eta), eta)

    def uniform(generator: Array) -> Array:
        return generator.next_float64() if kind.float is backend.types("float64").float else generator.next_float32()

    def onward(v: Array, side: Array, height: Array) -> Array:
        """Phase function from v to the target times the chance to leave along it; no albedo for glass."""
        eta = eta_of(side)
        target = vec3(wi.x, wi.y, wi.z) * side
        h = frame.half_vector(v, target)
        f = reflectance(dr.abs(dot(v, h)), eta)
        up = visible_density(v, h, alpha) / dr.maximum(4.0 * dr.abs(dot(v, h)), 1e-12)
        reflected = f * where(target.z > 0.0, up * escape(target, height, alpha), 0.0)
        if not glass:
            return reflected
        m = v + target * eta
        m = m * (1.0 / dr.maximum(dr.norm(m), 1e-12))
        m = where(m.z < 0.0, -m, m)
        o_m, i_m = dot(v, m), dot(target, m)
        spread = dr.square(eta) * dr.maximum(-i_m, 0.0) / dr.maximum(dr.square(o_m + eta * i_m), 1e-20)
        down = (1.0 - reflectance(dr.abs(o_m), eta)) * visible_density(v, m, alpha) * spread
        below = vec3(-target.x, -target.y, -target.z)
        return reflected + where((target.z < 0.0) & (o_m > 0.0), down * escape(below, 1.0 - height, alpha), 0.0)

    def body(
        w: Array, height: Array, side: Array, weight: Array, total: Array, alive: Array, bounces: Array, rng: Array
    ) -> tuple:
        there, leaves = meet(w, height, uniform(rng), alpha)
        alive = alive & ~leaves
        v = vec3(-w.x, -w.y, -w.z)
        bounces = dr.select(alive, bounces + 1, bounces)
        if wi is not None:
            light = onward(v, side, there) * weight * (1.0 if metal else base.albedo)
            total = total + where(alive & (bounces > 1), light, 0.0)
        u1, u2 = uniform(rng), uniform(rng)
        m = distribution("ggx").sample_visible(v, u1, u2, alpha)
        o_m = dr.maximum(dot(v, m), 0.0)
        eta = eta_of(side)
        f = reflectance(o_m, eta)
        mirrored = frame.reflect(v, m)
        if not glass:
            weight = where(alive, weight * f * (1.0 if metal else base.albedo), weight)
            w = where(alive, mirrored, w)
            height = dr.select(alive, there, height)
        else:
            passes = alive & (uniform(rng) >= f)
            through = frame.refract(v, m, fresnel.cos_transmitted(o_m, eta), eta)
            weight = where(alive, weight * base.albedo, weight)
            w = where(alive, where(passes, -through, mirrored), w)
            height = dr.select(alive, dr.select(passes, 1.0 - there, there), height)
            side = dr.select(passes, -side, side)
        alive = alive & (bounces < MOST_BOUNCES)
        return Vector(w), height, side, weight, total, alive, bounces, rng

    total = weight * 0.0
    state = (
        w,
        Float(1.0) + zeros_like(w.z),
        side,
        weight,
        total,
        w.z < 0.0,
        kind.module.UInt32(0) + dr.zeros(kind.module.UInt32, dr.width(w)),
        rng,
    )
    names = ("w", "height", "side", "weight", "total", "alive", "bounces", "rng")
    w, _, end_side, weight, total, _, bounces, _ = dr.while_loop(state, cond=lambda *s: s[5], body=body, labels=names)
    if glass and not power and wi is not None:
        crosses = wo.z * wi.z < 0.0
        total = total * where(crosses, 1.0 / dr.square(eta_of(side)), 1.0)
    return total, Left(w * end_side, weight, bounces)


def generator(wo: Direction, wi: Direction, seed: Array) -> Array:
    """A generator a lane, seeded by the bits of both directions and the seed: new numbers for each pair."""
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
    # equal pairs in one call differ by their lane
    lane = dr.arange(UInt, count) * UInt(0x9E3779B1)
    state = (state ^ lane ^ (lane >> 16)) * UInt(0x85EBCA6B)
    return kind.module.PCG32(size=count, initstate=kind.module.UInt64(state ^ (state >> 13)))


def albedo(base: Any, mu: float, walks: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Mean weight with which walkers from cosine mu come back out, a spectrum, and its standard error.

    base  a Conductor or Dielectric with ndf "ggx"; mu below 0 starts inside glass
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
