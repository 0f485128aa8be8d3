"""Details of a surface that are too small for its geometry: its normal leans."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from .. import ops
from ..ops import Direction, Mode, Scalar, Spectrum, dot, function, maximum, minimum, safe_div, sqr, vec3, where
from .calling import method
from .material import BSDF, Breach, Delta
from .mix import ALMOST_ONE
from .parameters import Number, bsdf, number
from .sample import Sample

STEEPEST = 20.0  # lean of a normal to which a map's are held, 87 degrees
LEAST = 0.01  # cosine under which a leaning glass is not seen, unless the surface is
DIGITS = 4096.0  # of the number that picks a lobe, the digits behind decide on masking


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

    Over a base that reflects the surface is one of facets (Schuessler2017): with n' lies the base, and a vertical
    mirror, turned away from it, closes the surface, so that its mean normal is the surface's. A view that meets the
    mirror goes on to the base, light that leaves toward it is reflected there: nothing turns black where light grazes,
    and no light is made. With areas a = (w.n') / n'.n and (w.t) sin / n'.n of the two as w sees them, 0 from behind,

    f cos theta_i = p(o) s(o, i) + (1 - p(o)) s(o', i)
    s(o, i) = b(o, i) G(i) + b(o, i') (1 - G(i')) + b(o, -i)
    p = a_base / (a_base + a_mirror),  G = min(1, cos theta / (a_base + a_mirror)),  w' mirrored at t

    b is the base's value in the leaning frame, -i the direction below i. The paper lets go of what meets the mirror
    twice and of what the base sends below the surface, half of 1 - n'.n of matt white; here neighbours send that up
    again, so that a white base is white however it leans. A base that transmits is seen in the leaning frame itself,
    which is bent toward the view where that would lie behind it; what leaves on the wrong side is lost. Not reciprocal.
    Polarization is lost.
    """

    base: BSDF = bsdf("the material")
    lean_x: Number = number(default=0.0, doc="tilt of the normal along x", low=-STEEPEST, high=STEEPEST)
    lean_y: Number = number(default=0.0, doc="tilt of the normal along y", low=-STEEPEST, high=STEEPEST)

    breaks: ClassVar[Mapping[str, Breach]] = {
        "reciprocity": Breach(
            "what leaves toward the mirror is reflected whole, what comes from there in parts",
            lambda model: 2.0 if model.leans else 0.0,
            certain=False,
        ),
    }

    # ------------------------------------------------------------------ facets

    def _leans(self) -> tuple[Scalar, Scalar]:
        return self.lean_x, self.lean_y

    def _normal(self) -> Direction:
        x, y = self._leans()
        over = ops.rsqrt(1.0 + sqr(x) + sqr(y))
        n_x, n_y = x * over, y * over
        return vec3(n_x, n_y, over)

    def _frame(self, n: Direction) -> _Frame:
        """n's tangents, x' as near to x as it can be, from its slopes: 1 - n.x^2 would cancel where it lies low."""
        a, b = n.x / n.z, n.y / n.z
        x = vec3(1.0 + sqr(b), -(a * b), -a)
        x = x * ops.rsqrt((1.0 + sqr(b)) * (1.0 + sqr(a) + sqr(b)))
        return _Frame(x, vec3(n.y * x.z - n.z * x.y, n.z * x.x - n.x * x.z, n.x * x.y - n.y * x.x), n)

    @function
    def _mirrored(self, w: Direction, n: Direction) -> Direction:
        """w' at the vertical facet, whose normal is against n's lean; w itself where nothing leans."""
        sin2 = sqr(n.x) + sqr(n.y)
        level = w.x * n.x + w.y * n.y
        along = 2.0 * level * where(sin2 > 1e-12, safe_div(1.0, sin2), 0.0)
        return vec3(w.x - along * n.x, w.y - along * n.y, w.z)

    def _areas(self, w: Direction, n: Direction) -> tuple[Scalar, Scalar]:
        """What w sees of base and mirror, over the surface's area; both over n'.n less."""
        level = w.x * n.x + w.y * n.y
        return maximum(dot(w, n), 0.0), maximum(-level, 0.0)

    @function
    def _base_share(self, w: Direction, n: Direction) -> Scalar:
        """p."""
        base, mirror = self._areas(w, n)
        return where(base > 0.0, safe_div(base, base + mirror), 0.0 * base)

    @function
    def _unmasked(self, w: Direction, n: Direction) -> Scalar:
        """G; 0 below the surface."""
        base, mirror = self._areas(w, n)
        return minimum(safe_div(maximum(w.z, 0.0) * n.z, base + mirror), 1.0)

    # ------------------------------------------------------------------ formulas

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The three ways of the light, or the base in the bent frame."""
        if self.base.transmits:
            frame, valid = self._bent(wo)
            o, i = frame.local(wo), frame.local(wi)
            return self.base.eval(o, i, mode) * where(valid & (i.z * wi.z > 0.0), 1.0, 0.0)
        n = self._normal()
        frame = self._frame(n)
        share, again = self._base_share(wo, n), self._mirrored(wi, n)
        covered = 1.0 - self._unmasked(again, n)

        def seen(o: Direction) -> Spectrum:
            straight = self.base.eval(o, frame.local(wi), mode) * self._unmasked(wi, n)
            masked = self.base.eval(o, frame.local(again), mode) * covered
            return straight + masked + self.base.eval(o, frame.local(_turned(wi)), mode)

        value = seen(frame.local(wo)) * share + seen(frame.local(self._mirrored(wo, n))) * (1.0 - share)
        return where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The same ways with the base's density."""
        if self.base.transmits:
            frame, valid = self._bent(wo)
            o, i = frame.local(wo), frame.local(wi)
            return where(valid & (i.z * wi.z > 0.0), self.base.pdf(o, i), 0.0)
        n = self._normal()
        frame = self._frame(n)
        share, again = self._base_share(wo, n), self._mirrored(wi, n)
        covered = 1.0 - self._unmasked(again, n)

        def seen(o: Direction) -> Scalar:
            straight = self.base.pdf(o, frame.local(wi)) * self._unmasked(wi, n)
            masked = self.base.pdf(o, frame.local(again)) * covered
            return straight + masked + self.base.pdf(o, frame.local(_turned(wi)))

        density = share * seen(frame.local(wo)) + (1.0 - share) * seen(frame.local(self._mirrored(wo, n)))
        return where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u1 picks what wo sees, and its last digits whether what the base sends out is masked."""
        if self.base.transmits:
            frame, valid = self._bent(wo)
            s = self.base.sample(frame.local(wo), u, mode)
            wi = frame.back(s.wi)
            valid = valid & (wi.z * s.wi.z > 0.0) & (s.pdf > 0.0)
            return Sample(wi, where(valid, s.weight, 0.0), where(valid, s.pdf, 0.0), s.delta & valid, s.eta)
        n = self._normal()
        frame, share = self._frame(n), self._base_share(wo, n)
        straight = u.x < share
        rest = where(straight, safe_div(u.x, share), safe_div(u.x - share, 1.0 - share))
        rest = minimum(maximum(rest, 0.0), ALMOST_ONE)
        digits = rest * DIGITS
        digits = digits - ops.floor(digits)
        start = where(straight, wo, self._mirrored(wo, n))
        s = self.base.sample(frame.local(start), vec3(rest, u.y, u.z), mode)
        sent = frame.back(s.wi)
        clear = self._unmasked(sent, n)
        below = sent.z < 0.0
        masked = ~below & ~(digits < clear)
        wi = where(below, _turned(sent), where(masked, self._mirrored(sent, n), sent))
        valid = (wo.z > 0.0) & (wi.z > 0.0) & (s.pdf > 0.0)
        chance = where(straight, share, 1.0 - share) * where(below, 1.0, where(masked, 1.0 - clear, clear))
        density = self.pdf(wo, wi)
        pdf = where(valid, where(s.delta, chance * s.pdf, density), 0.0)
        smooth = self.eval(wo, wi, mode) * safe_div(1.0, density)
        weight = where(pdf > 0.0, where(s.delta, s.weight, smooth), 0.0)
        return Sample(wi, weight, pdf, s.delta & (pdf > 0.0), s.eta)

    def _bent(self, wo: Direction) -> tuple[_Frame, ops.Mask]:
        """The leaning frame, bent until wo lies on its own side; whether it does."""
        n = self._normal()
        side = where(wo.z < 0.0, -1.0, 1.0 + 0.0 * wo.z)
        lacking = maximum(minimum(wo.z * side, LEAST) - dot(wo, n) * side, 0.0)
        n = n + wo * (side * lacking)
        n = n * ops.rsqrt(dot(n, n))
        return self._frame(n), dot(wo, n) * side > 0.0

    # ------------------------------------------------------------------ facts

    def tint(self, wo: Direction) -> Spectrum:
        """The base's, as wo sees it."""
        n = self._normal()
        seen = where(dot(wo, n) * wo.z > 0.0, wo, self._mirrored(wo, n))
        return self.base.tint(self._frame(n).local(seen))

    @property
    def leans(self) -> bool:
        """Whether its normal is another than the surface's, as far as plain numbers tell."""
        values = [getattr(self.plain, name) for name in ("lean_x", "lean_y")]
        return not all(isinstance(value, int | float) and value == 0 for value in values)

    @property
    def transmits(self) -> bool:
        return self.base.transmits

    @property
    def isotropic(self) -> bool:
        return not self.leans and self.base.isotropic

    @property
    def delta(self) -> Delta:
        return self.base.delta

    @property
    def two_sided(self) -> bool:
        return self.base.two_sided

    @property
    def ambient(self) -> Spectrum | None:
        """The base's."""
        return self.base.ambient


def _turned(w: Direction) -> Direction:
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

    def _leans(self) -> tuple[Scalar, Scalar]:
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
