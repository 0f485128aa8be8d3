"""Delta-only retrace: a sample that has come to glass first is traced once more, by mirrors and glass alone.

What the camera itself sees of a lamp by mirrors and glass no particle shows, and a lamp behind two reflections within a
glass ball is met by one path in a thousand. So such a sample's path is followed again from the camera, with reflection
and refraction as likely as each other, to the lamp or to nothing. Both are weighted by how likely they go that way
(power heuristic).

All choices of a retrace are the digits of one number: so the ways that several of them make are taken evenly, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType

import drjit as dr
import numpy as np

from ..bridge.types import BSDFContext, BSDFSample, Float, Mask, Shape, UInt

FIRST, DUE, RETRACING = 0, 1, 2  # `Retrace.phase`: the first trace, one after which a retrace follows, and the retrace

COSINES = (-1.0, -0.9, -0.5, -0.1, 0.1, 0.5, 0.9, 1.0)  # at which materials are asked how they choose lobes,
STEPS = 65  # by so many numbers each
MAX_ODDS = 1e12  # so that their square is finite
END = 2.0**-20  # of the numbers that choose a lobe: what chooses the one at each end; no lobe is rarer


@dataclass
class Retrace:
    """What a path carries along.

    phase   FIRST, DUE or RETRACING
    odds    how likely a retrace takes the chain from the camera on, over how likely a first trace does
    number  in [0, 1), by which a retrace chooses
    """

    phase: UInt
    odds: Float
    number: Float

    @staticmethod
    def none(mi: ModuleType) -> Retrace:
        """Of a sample that begins."""
        return Retrace(mi.UInt32(FIRST), mi.Float(1), mi.Float(0))

    @property
    def retracing(self) -> Mask:
        return self.phase == RETRACING

    def weight(self) -> Float:
        """Of the light that the chain from the camera meets."""
        by_retrace = dr.select(self.odds == 1, 0, dr.rcp(1 + dr.rcp(dr.square(self.odds))))  # 1: there was no choice
        return dr.select(self.retracing, by_retrace, 1 - by_retrace)

    def lobe(self, u: Float) -> Float:
        """The number that chooses a lobe, in place of `u`."""
        return dr.select(self.retracing, dr.select(self.number < 0.5, END, 1 - END), u)

    def after(self, bs: BSDFSample, delta: Mask, two_ways: Mask, here: Mask) -> tuple[Retrace, Float, Mask]:
        """(after a vertex, weight of the path beyond it, whether it goes on).

        two_ways  whether the surface reflects as a mirror and lets through, and does nothing else
        here      lanes whose path has met nothing but mirrors and glass
        """
        # Two ways, of which a retrace takes each as often, or a sole one, or what a retrace does not follow.
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
        """Of a path that begins; of the retrace where it is due, on lanes `again`."""
        return replace(self, phase=dr.select(retraced, type(self.phase)(RETRACING), self.phase), number=number)


def reflects_and_transmits(mi: ModuleType, flags: UInt) -> Mask:
    """Whether a surface reflects as a mirror and lets through straight or refracted, and does nothing else."""
    kinds = mi.BSDFFlags
    through = mi.has_flag(flags, kinds.DeltaTransmission) ^ mi.has_flag(flags, kinds.Null)
    return mi.has_flag(flags, kinds.DeltaReflection) & through & ~mi.has_flag(flags, kinds.Smooth)


def is_possible(mi: ModuleType, context: BSDFContext, smooth: list[Shape]) -> bool:
    """Whether there are surfaces with two ways, each of which one end of the numbers that choose a lobe takes.

    The materials themselves are asked, since anybody may write one; those with more than one change of ways along the
    numbers are not retraced.
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
    si.wavelengths = type(si.wavelengths)(*[550] * dr.size_v(si.wavelengths))  # nm, where there are any
    u = dr.lerp(END, 1 - END, mi.Float(lane % STEPS) / (STEPS - 1))
    for plugin in asked:
        bs, _ = plugin.sample(context, si, u, mi.Point2f(0.5))
        first = np.array(mi.Float(bs.wo.z * cosine)).reshape(shape) < 0
        first = first == first[:, :1]  # those that go where the smallest number goes, of which it is so likely:
        likely = np.array(mi.Float(bs.pdf) + 0 * cosine).reshape(shape)[:, 0]
        changes = np.sum(first[:, 1:] != first[:, :-1], axis=1)
        if np.any(changes > 1) or not np.all(abs(first.mean(1) - likely) < 2 / STEPS):
            return False
    return bool(asked)
