"""Delta-only retrace: a sample that first hits glass is traced a second time through mirrors and glass alone.

Particles do not cover lamps that the camera sees directly through mirrors and glass, and only one path in a thousand
hits a lamp behind two reflections within a glass ball. The path of such a sample is therefore traced again from the
camera, with reflection and refraction equally likely, until it hits a lamp or ends. Each of the two traces is weighted
by its probability of sampling that chain of reflections and refractions (power heuristic).

The binary digits of one random number make all choices of a retrace, so the chains of several retraces are stratified.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType

import drjit as dr
import numpy as np

from ..bridge.types import BSDFContext, BSDFSample, Float, Mask, Shape, UInt

FIRST, DUE, RETRACING = 0, 1, 2  # `Retrace.phase`: the first trace, one after which a retrace follows, and the retrace

COSINES = (-1.0, -0.9, -0.5, -0.1, 0.1, 0.5, 0.9, 1.0)  # cosines at which the lobe selection of materials is tested
STEPS = 65  # random numbers tested per cosine
MAX_ODDS = 1e12  # keeps the square of the odds finite
END = 2.0**-20  # END and 1 - END select the lobes at the two ends of [0, 1]; no lobe has a lower probability


@dataclass
class Retrace:
    """State that a path carries for its retrace.

    phase   FIRST, DUE or RETRACING
    odds    probability that a retrace takes the chain from the camera so far, divided by that of a first trace
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
        """MIS weight of the light at the end of the chain from the camera."""
        by_retrace = dr.select(self.odds == 1, 0, dr.rcp(1 + dr.rcp(dr.square(self.odds))))  # 1: no vertex had a choice
        return dr.select(self.retracing, by_retrace, 1 - by_retrace)

    def lobe(self, u: Float) -> Float:
        """The random number that selects a lobe: `u`, or in a retrace one that follows the next digit of `number`."""
        return dr.select(self.retracing, dr.select(self.number < 0.5, END, 1 - END), u)

    def after(self, bs: BSDFSample, delta: Mask, two_ways: Mask, here: Mask) -> tuple[Retrace, Float, Mask]:
        """(state after a vertex, weight of the path beyond it, whether the path continues).

        two_ways  whether the surface only reflects as a mirror and transmits
        here      lanes whose path has hit nothing but mirrors and glass
        """
        # A retrace takes two delta lobes with equal probability, a single one always, and stops at anything else.
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
        """The initial state of a path; on the lanes `retraced`, that of the retrace that was due."""
        return replace(self, phase=dr.select(retraced, type(self.phase)(RETRACING), self.phase), number=number)


def reflects_and_transmits(mi: ModuleType, flags: UInt) -> Mask:
    """Whether a surface has a mirror reflection, a straight or refracted transmission, and no other lobe."""
    kinds = mi.BSDFFlags
    through = mi.has_flag(flags, kinds.DeltaTransmission) ^ mi.has_flag(flags, kinds.Null)
    return mi.has_flag(flags, kinds.DeltaReflection) & through & ~mi.has_flag(flags, kinds.Smooth)


def is_possible(mi: ModuleType, context: BSDFContext, smooth: list[Shape]) -> bool:
    """Whether the scene has surfaces with two delta lobes, each selected by one end of the lobe's random number.

    Materials may be user-defined, so this is tested by sampling them; False if the lobe of any of them changes more
    than once as the number increases.
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
        first = first == first[:, :1]  # where the lobe is that of the smallest number; `likely` is its probability
        likely = np.array(mi.Float(bs.pdf) + 0 * cosine).reshape(shape)[:, 0]
        changes = np.sum(first[:, 1:] != first[:, :-1], axis=1)
        if np.any(changes > 1) or not np.all(abs(first.mean(1) - likely) < 2 / STEPS):
            return False
    return bool(asked)
