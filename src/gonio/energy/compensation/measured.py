"""The energy lost by any other base: E(mu) computed with its own `sample`, and the lobe that restores the lost energy.

`KullaConty` accepts any base that only reflects. To separate the loss of single scattering from intended absorption, E
is computed for the lossless variant of the base, in which F and every color that is a fraction of the light (a spectrum
whose range ends at 1, such as an albedo) are 1, also in inner materials. Then, with maxima over the channels,

    M(mu) = 1 - max E_white(mu), at least 0,        F_avg = E_avg / max E_avg,white,

so that F_avg is the color of light after one bounce. A material with neither F nor such a color (Phong's kd and ks are
scale factors, not fractions) is its own lossless variant: the light that its brightest channel does not reflect counts
as lost.

Where a base reflects more light than it receives, no energy is lost and nothing is added; the gain is not corrected.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...material import BSDF, Parameter, binding
from ...ops import (
    Node,
    RecordingError,
    atan2,
    backend,
    clamp,
    max_component,
    maximum,
    ones_like,
    safe_div,
    sqrt,
    vec3,
    where,
)
from ...ops import pi as PI
from ...ops.backend import Array
from ...ops.types import Direction, Mode, Scalar, Spectrum
from ...optics.frame import spherical_direction
from ...optics.lattice import r_sequence
from ...optics.special import gauss
from . import lobe

# nodes of M at equal steps of x, where mu = sin^2(pi x / 2), with linear interpolation: E behaves like sqrt(mu) at
# grazing angles and, if it depends on sin(theta) as for Oren-Nayar, like sqrt(1 - mu) at the normal
NODES = 65
POINTS = 1 << 16  # samples per node; furnace errors are 1e-4 for Phong and Oren-Nayar, and 4e-4 for mixtures
LOBE_NODES = 256  # as `curves.LOBE_NODES`
SMALLEST_MU = 1e-4


class Measured(NamedTuple):
    """M at nodes, between which it is interpolated linearly.

    missing  M at equal steps of x, where mu = sin^2(pi x / 2)
    inverse  mu^2 at equal quantiles of the density M mu
    scale    1 / (pi M_avg); 0 if no energy is lost
    average  M_avg
    F_avg    the color of light after one bounce
    """

    missing: Scalar
    inverse: Scalar
    scale: Scalar
    average: Scalar
    F_avg: Spectrum

    @property
    def factor(self) -> float:
        return 1.0

    def at(self, w: Direction) -> Scalar:
        """M for a direction above the surface."""
        _check_computed(w.z)
        mu = clamp(w.z, 0.0, 1.0)
        return _read(self.missing, atan2(sqrt(mu), sqrt(1.0 - mu)) * (2.0 / PI))

    def over_average(self, w: Direction) -> Scalar:
        return self.scale

    def share(self, wo: Direction, wi: Direction) -> Scalar:
        return where(lobe.above(wo, wi), ones_like(wi.z), 0.0)

    def radiance(self, wo: Direction, wi: Direction, mode: Mode) -> float:
        return 1.0

    def given(self, wo: Direction) -> Scalar:
        return where((self.scale > 0.0) & (wo.z > 0.0), self.at(wo), 0.0)

    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The density of the lobe, M(mu_i) mu_i / (pi M_avg), 1/sr."""
        return self.at(wi) * maximum(wi.z, 0.0) * self.scale

    def sample(self, wo: Direction, u: Direction) -> Direction:
        """A direction with the density `pdf`: mu^2 from the table of its inverse, and a uniform azimuth."""
        return lobe.from_square(_read(self.inverse, u.y), u.z)

    def eta(self, wo: Direction, wi: Direction) -> Scalar:
        return ones_like(wo.z)


def measured(base: BSDF) -> Measured:
    """The energy lost by a bound base that only reflects, from the albedos of the base and its lossless variant."""
    base = _uniform(base)
    dr = backend.drjit()
    types = _types(base)
    of_white, of_base = _albedos(base, base.lossless(), types)
    weight = types.float(_averaging())
    lost = maximum(1.0 - max_component(of_white), 0.0)
    average = dr.sum(lost * weight)
    mean_albedo = type(of_base)(*[dr.sum(channel * weight) for channel in of_base])
    return Measured(
        missing=lost,
        inverse=types.float(_inverse(np.asarray(dr.detach(lost).numpy(), float))),
        scale=lobe.over_pi(average),
        average=average,
        F_avg=clamp(mean_albedo / maximum(1.0 - average, 1e-6), 0.0, 1.0),  # undefined for a black base
    )


def _uniform(base: BSDF) -> BSDF:
    """The bound base with one entry per value. Raises an error if the albedo of the base cannot be computed: during the
    recording of the base or of a Dr.Jit loop, or if its values vary from ray to ray."""
    _check_computed(*binding.values(base))
    dr = backend.drjit()
    name = type(base).__name__
    hint = "give numbers and plain colors; a Conductor or a Dielectric inside accepts textures and arrays"

    def one(parameter: Parameter, value: Array) -> object:
        if value is None or dr.width(value) == 1:
            return value
        parts = list(value) if dr.is_vector_v(value) else [value]
        if any(not bool(dr.all(p == dr.gather(type(p), p, 0))[0]) for p in map(dr.detach, parts)):
            what = f"{name}.{parameter.name} varies, but its energy is measured once"
            raise InputError(what, "KullaConty.base", hint)
        return type(value)(*map(dr.mean, parts))

    if dr.flag(dr.JitFlag.SymbolicScope):
        raise InputError(f"{name} has values that vary, but its energy is measured once", "KullaConty.base", hint)
    return binding.bind(base, one)


def _check_computed(*values: object) -> None:
    if any(isinstance(value, Node) for value in values):
        what = "a base whose energy is measured by sampling cannot be recorded"
        raise RecordingError(what, "KullaConty.base", "a Conductor or a Dielectric can")


def _types(base: BSDF) -> backend.Types:
    for value in binding.values(base):
        return backend.types_like(type(value))
    return backend.types(None)


def _albedos(base: BSDF, white: BSDF, kind: backend.Types) -> tuple[Array, Array]:
    """E of the lossless base and of the base itself at each node, averaged over azimuth: spectra with NODES entries.

    Directions are generated by `sample` from the same POINTS of a lattice at every node, so the error is smooth in mu.
    Directions and densities are treated as constants when the values are differentiated.
    """
    dr = backend.drjit()
    UInt = kind.module.UInt32
    lattice = r_sequence(POINTS, 4, shift=0.5)
    columns = [kind.float(np.minimum(c, 1.0 - 2.0**-24)) for c in lattice.T]
    index = dr.arange(UInt, NODES * POINTS)
    u = [dr.gather(kind.float, c, index % POINTS) for c in columns]
    s = dr.sin(kind.float(index // POINTS) * (0.5 * PI / (NODES - 1.0)))
    mu = clamp(s * s, SMALLEST_MU, 1.0)
    wo = spherical_direction(dr.safe_sqrt(1.0 - mu * mu), mu, (2.0 * PI) * u[3])
    drawn = base.sample(wo, vec3(*u[:3]))
    wi, pdf = dr.detach(drawn.wi), dr.detach(drawn.pdf)
    share = where(pdf > 0.0, safe_div(1.0 / POINTS, pdf), 0.0)

    def albedo(model: BSDF) -> Array:
        value = model.eval(wo, wi)
        parts = [channel * share for channel in value]
        dr.eval(parts)  # in one call, because each reduction would otherwise evaluate the base again
        return type(value)(*[dr.block_sum(part, POINTS) for part in parts])

    albedos = albedo(white), albedo(base)
    dr.eval(albedos)
    return albedos


def _averaging() -> np.ndarray:
    """Weights w_j such that sum w_j E_j = 2 int E mu dmu = pi int E sin^2(pi x / 2) sin(pi x) dx, where E is linear
    between the nodes."""
    place, w = gauss(4)
    step = 1.0 / (NODES - 1)
    weights = np.zeros(NODES)
    for j in range(NODES - 1):
        x = (j + place) * step
        density = PI * w * step * np.sin(0.5 * PI * x) ** 2 * np.sin(PI * x)
        weights[j] += density @ (1.0 - place)
        weights[j + 1] += density @ place
    return weights


def _inverse(lost: np.ndarray) -> np.ndarray:
    """mu^2 at equal quantiles of the density M mu."""
    grid = np.linspace(0.0, 1.0, 4097)  # values of mu^2, in which the density is M / M_avg
    x = np.arcsin(grid**0.25) * (2.0 / PI)
    density = np.interp(x, np.linspace(0.0, 1.0, NODES), lost) + 1e-9
    below = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.interp(np.linspace(0.0, 1.0, LOBE_NODES), below / below[-1], grid)


def _read(table: Array, x: Array) -> Array:
    """The value at x of an array with nodes at both ends of [0, 1], interpolated linearly."""
    dr = backend.drjit()
    kind = backend.types_like(type(x))
    last = dr.width(table) - 1
    at = clamp(x, 0.0, 1.0) * float(last)
    cell = dr.minimum(kind.module.UInt32(at), last - 1)
    low, high = [kind.float(dr.gather(type(table), table, cell + step)) for step in (0, 1)]
    return low + (high - low) * (at - kind.float(cell))
