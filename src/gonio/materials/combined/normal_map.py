"""Surface detail too fine for the geometry, represented by tilted normals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from ... import ops
from ...material.bsdf import BSDF, Delta, KnownViolation, Limit
from ...material.calling import method
from ...material.parameters import Number, bsdf, number
from ...material.sample import Sample
from ...ops import Direction, Mode, Scalar, Spectrum, dot, maximum, minimum, safe_div, sqr, vec3, where

STEEPEST = 20.0  # maximum slope of a map, the tangent of 87 degrees
MIN_COSINE = 0.01  # minimum cosine of wo to the bent normal, unless its cosine to the surface normal is smaller


class _Frame(NamedTuple):
    """The tilted normal n and its tangents x and y; x is as close to the surface's tangent as possible."""

    x: Direction
    y: Direction
    n: Direction

    def local(self, w: Direction) -> Direction:
        """Transform w from the surface's frame to this frame."""
        return vec3(dot(w, self.x), dot(w, self.y), dot(w, self.n))

    def back(self, w: Direction) -> Direction:
        """Transform w from this frame to the surface's frame."""
        return self.x * w.x + self.y * w.y + self.n * w.z


class NormalMap(BSDF):
    """A base material with a tilted shading normal n', which is the normalized vector (lean_x, lean_y, 1).

    In scenes, the normals are read from the image under the key `"normalmap"`.

    f cos theta_i = b(o, i) + b(o, i*), where b is `eval` of the base in the frame of n', and i* = (i_x, i_y, -i_z)

    Surfaces with tilted normals usually turn black at grazing angles for two reasons, both of which are corrected here.
    First, the view direction may lie behind the tilted base; n' is then bent toward the view direction by no more than
    necessary (Keller2017 applies this correction to the mirrored view direction). Second, the base scatters part of the
    light below the surface: the fraction (1 - n'.n) / 2 for a white diffuse base, where n is the surface normal. This
    light is reflected upward again, as if by neighboring facets. A white base therefore remains white at any tilt, and
    no energy is gained. If the base transmits, n' is bent in the same way, but light that leaves on the wrong side is
    lost. The model is not reciprocal, because n' depends on the view direction. The scattered light is unpolarized.

    The microfacet-based normal map of Schuessler2017, which adds a second facet, also conserves energy. If that facet
    is a mirror, however, diffuse bumps become invisible: seen from above, their brightness is n'.n cos theta_i,
    regardless of the direction in which they are tilted.
    """

    base: BSDF = bsdf("the material whose normal is tilted")
    lean_x: Number = number(default=0.0, doc="tilt of the normal along x, n'_x / n'_z", low=-STEEPEST, high=STEEPEST)
    lean_y: Number = number(default=0.0, doc="tilt of the normal along y, n'_y / n'_z", low=-STEEPEST, high=STEEPEST)

    limits: ClassVar[tuple[Limit, ...]] = (Limit({"lean_x": 0.0, "lean_y": 0.0}, equals=lambda one: one.base),)
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "reciprocity": KnownViolation(
            "a normal that faces away from wo is bent toward wo, and light that an opaque base scatters below the "
            "surface is reflected upward",
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
        """The frame of n, computed from the slopes of n, because 1 - n.x^2 would cancel for a steep n."""
        a, b = n.x / n.z, n.y / n.z
        x = vec3(1.0 + sqr(b), -(a * b), -a)
        x = x * ops.rsqrt((1.0 + sqr(b)) * (1.0 + sqr(a) + sqr(b)))
        return _Frame(x, vec3(n.y * x.z - n.z * x.y, n.z * x.x - n.x * x.z, n.x * x.y - n.y * x.x), n)

    # ------------------------------------------------------------------ formulas

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The value of the base in the bent frame, plus the light that the base scatters below the surface."""
        frame, valid = self._bent(wo)
        o, i = frame.local(wo), frame.local(wi)
        value = self.base.eval(o, i, mode)
        if self.base.transmits:
            return where(valid & (i.z * wi.z > 0.0), value, 0.0)
        value = value + self.base.eval(o, frame.local(_flipped(wi)), mode)
        return where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The density of the base, plus that of samples reflected upward, as in `eval`."""
        frame, valid = self._bent(wo)
        o, i = frame.local(wo), frame.local(wi)
        density = self.base.pdf(o, i)
        if self.base.transmits:
            return where(valid & (i.z * wi.z > 0.0), density, 0.0)
        density = density + self.base.pdf(o, frame.local(_flipped(wi)))
        return where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """The base's sample, reflected upward if it points downward."""
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
        """The tilted frame, bent until wo lies on its upper side, and whether wo then lies there."""
        n = self._normal()
        side = where(wo.z < 0.0, -1.0, ops.ones_like(wo.z))
        lacking = maximum(minimum(wo.z * side, MIN_COSINE) - dot(wo, n) * side, 0.0)
        n = n + wo * (side * lacking)
        n = n * ops.rsqrt(dot(n, n))
        return self._frame(n), dot(wo, n) * side > 0.0

    # ------------------------------------------------------------------ facts

    def tint(self, wo: Direction) -> Spectrum:
        """The base's tint in the bent frame."""
        frame, _ = self._bent(wo)
        return self.base.tint(frame.local(wo))

    @property
    def perturbs_normal(self) -> bool:
        """Whether the shading normal, here or in the base, may differ from the surface normal. A tilt given as the
        plain number 0 leaves the normal unchanged."""
        values = [getattr(self.plain, name) for name in ("lean_x", "lean_y")]
        return self.base.perturbs_normal or not all(isinstance(value, int | float) and value == 0 for value in values)

    @property
    def transmits(self) -> bool:
        return self.base.transmits

    @property
    def isotropic(self) -> bool:
        if isinstance(self.lean_x, ops.Node):  # the tilt is unknown in a recording
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
        """The ambient reflectance of the base."""
        return self.base.ambient


def _flipped(w: Direction) -> Direction:
    """The mirror image of w on the other side of the surface."""
    return vec3(w.x, w.y, -w.z)


class Bump(NormalMap):
    """A base material whose shading normal is that of a height field (Blinn1978).

    In scenes, the heights are read from the image under the key `"bump"`.

    The height h(u, v) is in scene units and has the derivatives h_u and h_v. With dp/du = (l, 0) and dp/dv = (s, m) in
    the tangent plane, the gradient of h is g = (h_u / l, (h_v - s h_u / l) / m), and n' is the vector (-g, 1),
    normalized. Outside scenes, where dp/du and dp/dv are unknown, they are taken to be the x and y axes. In all other
    respects, this material is identical to `normal-map`.
    """

    lean_x: Number = number(default=0.0, doc="h_u, the derivative of the height with respect to u", low=-1e6, high=1e6)
    lean_y: Number = number(default=0.0, doc="h_v, the derivative of the height with respect to v", low=-1e6, high=1e6)

    reads_surface: ClassVar[bool] = True

    def _slopes(self) -> tuple[Scalar, Scalar]:
        if self.surface is None:
            return ops.clamp(-self.lean_x, -STEEPEST, STEEPEST), ops.clamp(-self.lean_y, -STEEPEST, STEEPEST)
        length, sheared, across = self.surface
        x = safe_div(self.lean_x, length)
        y = safe_div(self.lean_y - sheared * x, across)
        # steeper slopes are artifacts: dp/dv vanishes at the poles of a sphere
        return ops.clamp(-x, -STEEPEST, STEEPEST), ops.clamp(-y, -STEEPEST, STEEPEST)


def slopes(normals: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """The parameters `lean_x` and `lean_y` of `normal-map`, (..., 2), for normals (..., 3).

    scale  factor by which the slopes are multiplied
    """
    return np.clip(scale * normals[..., :2] / np.maximum(normals[..., 2:], 1.0 / STEEPEST), -STEEPEST, STEEPEST)
