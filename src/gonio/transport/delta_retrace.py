"""Delta-only retrace: a sample that first hits glass is traced a second time, only through mirrors and glass.

Particles do not sample lamps that the camera sees directly through mirrors and glass, and only one path in a thousand
hits a lamp after two reflections inside a glass ball. The path of such a sample is therefore traced again from the
camera, with equal probabilities of reflection and refraction, until it hits a lamp or ends. The two paths are weighted
by their probabilities of sampling the chain of reflections and refractions (power heuristic).

The binary digits of one random number determine all choices of a retrace, so the chains of several retraces are
stratified.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType

import drjit as dr
import numpy as np

from ..bridge.types import BSDFContext, BSDFSample, Float, Mask, Shape, UInt

FIRST, DUE, RETRACING = 0, 1, 2  # `Retrace.phase`: the first path, a first path that will be retraced, and the retrace

COSINES = (-1.0, -0.9, -0.5, -0.1, 0.1, 0.5, 0.9, 1.0)  # cosines at which the lobe selection of materials is tested
STEPS = 65  # random numbers tested per cosine
MAX_ODDS = 1e12  # keeps the square of the odds finite
END = 2.0**-20  # END and 1 - END select the lobes at the two ends of [0, 1]; no lobe has a lower probability


@dataclass
class Retrace:
    """The state of a path for its retrace.

    phase   FIRST, DUE or RETRACING
    odds    probability that a retrace samples the current chain from the camera, divided by that of a first path
    number  a number in [0, 1) whose binary digits are the remaining choices of a retrace
    """

    phase: UInt
    odds: Float
    number: Float

    @staticmethod
    def none(mi: ModuleType) -> Retrace:
        """The initial state of a sample."""
        return Retrace(mi.UInt32(FIRST), mi.Float(1), mi.Float(0))

    @property
    def retracing(self) -> Mask:
        return self.phase == RETRACING

    def weight(self) -> Float:
        """The MIS weight of the light at the end of the chain from the camera."""
        # the odds are 1 if no vertex had a choice
        by_retrace = dr.select(self.odds == 1, 0, dr.rcp(1 + dr.rcp(dr.square(self.odds))))
        return dr.select(self.retracing, by_retrace, 1 - by_retrace)

    def lobe(self, u: Float) -> Float:
        """The random number that selects a lobe: `u`, or, in a retrace, one given by the next digit of `number`."""
        return dr.select(self.retracing, dr.select(self.number < 0.5, END, 1 - END), u)

    def after(self, bs: BSDFSample, delta: Mask, two_ways: Mask, here: Mask) -> tuple[Retrace, Float, Mask]:
        """The state after a vertex, the weight of the rest of the path, and whether the path continues.

        two_ways  whether the surface has only two delta lobes, a mirror reflection and a transmission
        here      lanes whose path has hit only mirrors and glass
        """
        # A retrace selects one of two delta lobes with equal probability, always follows a single delta lobe, and ends
        # at any other surface.
        sole = delta & (bs.pdf > 1 - END)
        fork = here & delta & two_ways & ~sole
        odds = self.odds * dr.select(here & ~sole, dr.select(fork & (bs.pdf > END), 0.5 / bs.pdf, 0), 1)
        odds = dr.minimum(odds, MAX_ODDS)
        due = fork & (self.phase == FIRST) & (self.odds > 0)
        after = Retrace(
            dr.select(due, type(self.phase)(DUE), self.phase),
            odds,
            dr.select(fork, 2 * self.number - dr.floor(2 * self.number), self.number),
        )
        weight = dr.select(fork & self.retracing, 2 * bs.pdf, 1)
        return after, weight, ~self.retracing | (odds > 0)

    def begin(self, retraced: Mask, number: Float) -> Retrace:
        """The initial state of the next path; on the lanes `retraced`, that of the retrace."""
        return replace(self, phase=dr.select(retraced, type(self.phase)(RETRACING), self.phase), number=number)


def reflects_and_transmits(mi: ModuleType, flags: UInt) -> Mask:
    """Whether a surface has exactly two lobes, a mirror reflection and a straight or refracted transmission."""
    kinds = mi.BSDFFlags
    through = mi.has_flag(flags, kinds.DeltaTransmission) ^ mi.has_flag(flags, kinds.Null)
    return mi.has_flag(flags, kinds.DeltaReflection) & through & ~mi.has_flag(flags, kinds.Smooth)


def is_possible(mi: ModuleType, context: BSDFContext, smooth: list[Shape]) -> bool:
    """Whether the scene has surfaces with two delta lobes that are selected by low and by high random numbers.

    Materials may be user-defined, so this is tested by sampling them. The result is False if, for any material, the
    lobe changes more than once as the random number increases.
    """
    plugins = {id(plugin): plugin for plugin in (shape.bsdf() for shape in smooth)}.values()
    asked = [plugin for plugin in plugins if reflects_and_transmits(mi, mi.UInt32(+plugin.flags()))[0]]
    shape = len(COSINES), STEPS
    lane = dr.arange(mi.UInt32, shape[0] * shape[1])
    si = dr.zeros(mi.SurfaceInteraction3f, len(lane))
    si.n, si.dp_du, si.dp_dv = mi.Normal3f(0, 0, 1), mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
    si.sh_frame = mi.Frame3f(si.n)
    cosine = dr.gather(mi.Float, mi.Float(COSINES), lane // STEPS)
    si.wi = mi.Vector3f(dr.safe_sqrt(1 - dr.square(cosine)), 0, cosine)
    si.wavelengths = type(si.wavelengths)(*[550] * dr.size_v(si.wavelengths))  # nm, in spectral variants
    u = dr.lerp(END, 1 - END, mi.Float(lane % STEPS) / (STEPS - 1))
    for plugin in asked:
        bs, _ = plugin.sample(context, si, u, mi.Point2f(0.5))
        first = np.array(mi.Float(bs.wo.z * cosine)).reshape(shape) < 0
        first = first == first[:, :1]  # whether the lobe is that of the smallest number; `likely` is its probability
        likely = np.array(mi.Float(bs.pdf) + 0 * cosine).reshape(shape)[:, 0]
        changes = np.sum(first[:, 1:] != first[:, :-1], axis=1)
        if np.any(changes > 1) or not np.all(abs(first.mean(1) - likely) < 2 / STEPS):
            return False
    return bool(asked)
