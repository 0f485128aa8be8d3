"""Details of a surface that are too small for its geometry: its normal leans."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from ... import ops
from ...material.bsdf import BSDF, Delta, KnownViolation
from ...material.calling import method
from ...material.parameters import Number, bsdf, number
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, dot, maximum, minimum, safe_div, sqr, vec3, where

STEEPEST = 20.0  # lean of a normal to which a map's are held, 87 degrees
MIN_COSINE = 0.01  # cosine under which a leaning surface is not seen, unless the level one is


class _Frame(NamedTuple):
    """The leaning normal, and the tangents beside it: x' as near to x as it can be."""

    x: Direction
    y: Direction
    n: Direction

    def local(self, w: Direction) -> Direction:
        """A direction as the base sees it."""
        return vec3(dot(w, self.x), dot(w, self.y), dot(w, self.n))

    def back(self, w: Direction) -> Direction:
        """A direction of the base's as the surface has it."""
        return self.x * w.x + self.y * w.y + self.n * w.z


class NormalMap(BSDF):
    """A base whose normal leans: n' = (lean_x, lean_y, 1), normalized. In scenes an image of normals, `"normalmap"`.

    f cos theta_i = b(o, i) + b(o, -i), b the base's value in the leaning frame, -i the direction below i

    Two things make a leaning normal turn black where light grazes, and both are mended. A view that would see the
    base from behind bends n' toward itself, as little as is needed (Keller2017 does so for the mirrored view). And
    light that the base sends below the surface, half of 1 - n'.n of matt white, is sent up again, as neighbours
    would: so a white base is white however it leans, and no light is made. A base that transmits keeps the bending;
    what leaves it on the wrong side is lost. Not reciprocal, as the view bends the normal. Polarization is lost.

    A surface of two facets (Schuessler2017) conserves light too, yet with a mirror as the second facet matt bumps
    vanish: seen from above, they are n'.n cos theta_i bright whichever way they lean.
    """

    base: BSDF = bsdf("the material")
    lean_x: Number = number(default=0.0, doc="tilt of the normal along x", low=-STEEPEST, high=STEEPEST)
    lean_y: Number = number(default=0.0, doc="tilt of the normal along y", low=-STEEPEST, high=STEEPEST)

    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "reciprocity": KnownViolation(
            "the view bends the normal, and what is sent below the surface goes up again",
            lambda model: 2.0 if model.perturbs_normal else 0.0,
            certain=False,
        ),
    }

    # ------------------------------------------------------------------ facets

    def _slopes(self) -> tuple[Scalar, Scalar]:
        return self.lean_x, self.lean_y

    def _normal(self) -> Direction:
        x, y = self._slopes()
        over = ops.rsqrt(1.0 + sqr(x) + sqr(y))
        n_x, n_y = x * over, y * over
        return vec3(n_x, n_y, over)

    def _frame(self, n: Direction) -> _Frame:
        """n's tangents, x' as near to x as it can be, from its slopes: 1 - n.x^2 would cancel where it lies low."""
        a, b = n.x / n.z, n.y / n.z
        x = vec3(1.0 + sqr(b), -(a * b), -a)
        x = x * ops.rsqrt((1.0 + sqr(b)) * (1.0 + sqr(a) + sqr(b)))
        return _Frame(x, vec3(n.y * x.z - n.z * x.y, n.z * x.x - n.x * x.z, n.x * x.y - n.y * x.x), n)

    # ------------------------------------------------------------------ formulas

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The base in the bent frame, and what it sends below."""
        frame, valid = self._bent(wo)
        o, i = frame.local(wo), frame.local(wi)
        value = self.base.eval(o, i, mode)
        if self.base.transmits:
            return where(valid & (i.z * wi.z > 0.0), value, 0.0)
        value = value + self.base.eval(o, frame.local(_flipped(wi)), mode)
        return where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The base's density, and that of the mirrored samples, as in `eval`."""
        frame, valid = self._bent(wo)
        o, i = frame.local(wo), frame.local(wi)
        density = self.base.pdf(o, i)
        if self.base.transmits:
            return where(valid & (i.z * wi.z > 0.0), density, 0.0)
        density = density + self.base.pdf(o, frame.local(_flipped(wi)))
        return where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """The base's sample, turned up where it points down."""
        frame, valid = self._bent(wo)
        s = self.base.sample(frame.local(wo), u, mode)
        wi = frame.back(s.wi)
        drawn = valid & (s.pdf > 0.0)
        if self.base.transmits:
            drawn = drawn & (wi.z * s.wi.z > 0.0)
            return Sample(wi, where(drawn, s.weight, 0.0), where(drawn, s.pdf, 0.0), s.delta & drawn, s.eta)
        wi = where(wi.z < 0.0, _flipped(wi), wi)
        drawn = drawn & (wo.z > 0.0)
        density = self.pdf(wo, wi)
        smooth = self.eval(wo, wi, mode) * safe_div(1.0, density)
        weight = where(drawn, where(s.delta, s.weight, smooth), 0.0)
        return Sample(wi, weight, where(drawn, where(s.delta, s.pdf, density), 0.0), s.delta & drawn, s.eta)

    def _bent(self, wo: Direction) -> tuple[_Frame, ops.Mask]:
        """The leaning frame, bent until wo lies on its own side; whether it does."""
        n = self._normal()
        side = where(wo.z < 0.0, -1.0, ops.ones_like(wo.z))
        lacking = maximum(minimum(wo.z * side, MIN_COSINE) - dot(wo, n) * side, 0.0)
        n = n + wo * (side * lacking)
        n = n * ops.rsqrt(dot(n, n))
        return self._frame(n), dot(wo, n) * side > 0.0

    # ------------------------------------------------------------------ facts

    def tint(self, wo: Direction) -> Spectrum:
        """The base's, as wo sees it."""
        frame, _ = self._bent(wo)
        return self.base.tint(frame.local(wo))

    @property
    def perturbs_normal(self) -> bool:
        """Whether its normal is another than the surface's, as far as plain numbers tell."""
        values = [getattr(self.plain, name) for name in ("lean_x", "lean_y")]
        return self.base.perturbs_normal or not all(isinstance(value, int | float) and value == 0 for value in values)

    @property
    def transmits(self) -> bool:
        return self.base.transmits

    @property
    def isotropic(self) -> bool:
        if isinstance(self.lean_x, ops.Node):  # a recording's may lean anywhere
            return False
        return not self.perturbs_normal and self.base.isotropic

    @property
    def delta(self) -> Delta:
        return self.base.delta

    @property
    def two_sided(self) -> bool:
        return self.base.two_sided

    @property
    def ambient(self) -> Spectrum | None:
        """The base's factor of ambient light."""
        return self.base.ambient


def _flipped(w: Direction) -> Direction:
    """Up where it points down."""
    return vec3(w.x, w.y, -w.z)


class Bump(NormalMap):
    """A base whose normal leans as that of a surface of varying height (Blinn1978). In scenes an image, `"bump"`.

    The height h stands in units of the scene, over the surface's coordinates u and v: with dp/du = (l, 0) and dp/dv =
    (s, m) in the surface's plane its gradient is g = (h_u / l, (h_v - s h_u / l) / m), and n' = (-g, 1), normalized.
    Where nothing tells dp/du and dp/dv, outside of scenes, they are x and y. All else is `normal-map`'s.
    """

    lean_x: Number = number(default=0.0, doc="h_u, change of height along u", low=-1e6, high=1e6)
    lean_y: Number = number(default=0.0, doc="h_v, change of height along v", low=-1e6, high=1e6)

    reads_surface: ClassVar[bool] = True

    def _slopes(self) -> tuple[Scalar, Scalar]:
        if self.surface is None:
            return ops.clamp(-self.lean_x, -STEEPEST, STEEPEST), ops.clamp(-self.lean_y, -STEEPEST, STEEPEST)
        length, sheared, across = self.surface
        x = safe_div(self.lean_x, length)
        y = safe_div(self.lean_y - sheared * x, across)
        # steeper ones are none of a picture's: dp/dv vanishes at a sphere's poles
        return ops.clamp(-x, -STEEPEST, STEEPEST), ops.clamp(-y, -STEEPEST, STEEPEST)


def slopes(normals: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """x / z and y / z of normals (..., 3) as `normal-map` takes them, times `scale`."""
    return np.clip(scale * normals[..., :2] / np.maximum(normals[..., 2:], 1.0 / STEEPEST), -STEEPEST, STEEPEST)
