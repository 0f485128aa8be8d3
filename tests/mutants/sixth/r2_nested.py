"""Materials made of other materials, and such with choices and flags."""

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame, warp

BELOW_ONE = 0.99999994


def _flip(w):
    return ops.vec3(w.x, w.y, -w.z)


def _with_x(u, x):
    return ops.vec3(ops.clamp(x, 0.0, BELOW_ONE), u.y, u.z)


def _all(value, wanted):
    return bool(np.all(np.asarray(value, float) == wanted))


class R2Triptych(go.BSDF):
    """Three materials side by side, too fine to see: shares (1 - b) (1 - c), b and (1 - b) c."""

    first: go.BSDF = go.bsdf("the material where both shares are 0", go.Lambert(albedo=(0.9, 0.1, 0.1)))
    second: go.BSDF = go.bsdf("the material of share b", go.Conductor(alpha=0.3))
    third: go.BSDF = go.bsdf("the material of share c of the rest", go.ThinDielectric())
    b: go.Number = go.number(0.3, "share of the second", low=0.0, high=1.0)
    c: go.Number = go.number(0.5, "share of the third in the rest", low=0.0, high=1.0)

    def _shares(self):
        rest = 1.0 - self.b
        return rest * (1.0 - self.c), self.b, rest * self.c

    def _inner(self):
        return self.first, self.second, self.third

    def eval(self, wo, wi, mode="radiance"):
        one, two, three = (m.eval(wo, wi, mode) * s for m, s in zip(self._inner(), self._shares()))
        return one + two + three

    def pdf(self, wo, wi):
        one, two, three = (m.pdf(wo, wi) * s for m, s in zip(self._inner(), self._shares()))
        return one + two + three

    def sample(self, wo, u, mode="radiance"):
        p, q, r = self._shares()
        s = self.first.sample(wo, _with_x(u, ops.safe_div(u.x, p)), mode)
        t = self.second.sample(wo, _with_x(u, ops.safe_div(u.x - p, q)), mode)
        v = self.third.sample(wo, _with_x(u, ops.safe_div(u.x - p - q, r)), mode)
        one, two = u.x < p, u.x < p + q

        def chosen(a, b, c):
            return ops.where(one, a, ops.where(two, b, c))

        wi, delta = chosen(s.wi, t.wi, v.wi), chosen(s.delta, t.delta, v.delta)
        own = chosen(s.pdf * p, t.pdf * q, v.pdf * r)
        valid = own > 0.0
        pdf = ops.where(valid, ops.where(delta, own, self.pdf(wo, wi)), 0.0)
        smooth = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        weight = ops.where(valid, ops.where(delta, chosen(s.weight, t.weight, v.weight), smooth), 0.0)
        return go.Sample(wi, weight, pdf, delta & valid, chosen(s.eta, t.eta, v.eta))

    @property
    def transmits(self):
        return any(m.transmits for m in self._inner())

    @property
    def isotropic(self):
        return all(m.isotropic for m in self._inner())

    @property
    def two_sided(self):
        return all(m.two_sided for m in self._inner())

    @property
    def back_differs(self):
        return not self.two_sided and any(m.two_sided or m.back_differs for m in self._inner())

    @property
    def delta(self):
        kinds = {m.delta for m in self._inner()}
        return kinds.pop() if len(kinds) == 1 else "maybe"


class R2Pierced(go.BSDF):
    """A material with holes, whose visible share may depend on the angle: light that does not meet it passes."""

    base: go.BSDF = go.bsdf("the material where there is one", go.TwoSided(base=go.Lambert(albedo=(0.1, 0.9, 0.2))))
    opacity: go.Number = go.number(0.4, "covered share along the normal", low=0.0, high=1.0)
    shape: str = go.choice(
        "rim",
        "how the covered share depends on the angle",
        {
            "even": "the same at every angle",
            "rim": "more at grazing angles, as for a thick net",
            "core": "less at grazing angles, by the cosine",
        },
    )

    def _covered(self, w):
        cos = ops.minimum(ops.abs(w.z), 1.0)
        if self.shape == "even":
            return self.opacity + 0.0 * cos
        if self.shape == "core":
            return self.opacity * cos
        return 1.0 - ops.pow(1.0 - self.opacity, 1.0 / ops.maximum(cos, 1e-3))

    def eval(self, wo, wi, mode="radiance"):
        return self.base.eval(wo, wi, mode) * (self._covered(wo) * self._covered(wi))

    def pdf(self, wo, wi):
        return self.base.pdf(wo, wi) * self._covered(wo)

    def sample(self, wo, u, mode="radiance"):
        covered = self._covered(wo)
        meets = u.x < covered
        s = self.base.sample(wo, _with_x(u, ops.safe_div(u.x, covered)), mode)
        weight = ops.where(meets, s.weight * self._covered(s.wi), 1.0)
        pdf = ops.where(meets, s.pdf * covered, 1.0 - covered)
        return go.Sample(
            ops.where(meets, s.wi, -wo), weight, pdf, (s.delta & meets) | ~meets, ops.where(meets, s.eta, 1.0)
        )

    @property
    def transmits(self):
        return True

    @property
    def isotropic(self):
        return self.base.isotropic

    @property
    def delta(self):
        if self.shape != "core" and _all(self.plain.opacity, 1.0):
            return self.base.delta
        return "always" if self.base.delta == "always" or _all(self.plain.opacity, 0.0) else "maybe"


class R2Backed(go.BSDF):
    """An opaque sheet with one material above and another below."""

    front: go.BSDF = go.bsdf("the material above, which must not transmit", go.Conductor(alpha=0.3))
    back: go.BSDF = go.bsdf("the material below, which must not transmit", go.Lambert(albedo=(0.0, 0.3, 1.0)))

    def __post_init__(self):
        super().__post_init__()
        for name in ("front", "back"):
            if getattr(self, name).transmits:
                raise go.InputError("a material that transmits", f"R2Backed.{name}", "give an opaque one")

    def eval(self, wo, wi, mode="radiance"):
        above = self.front.eval(wo, wi, mode)
        below = self.back.eval(_flip(wo), _flip(wi), mode)
        return ops.where(wo.z * wi.z > 0.0, ops.where(wo.z > 0.0, above, below), 0.0)

    def pdf(self, wo, wi):
        above, below = self.front.pdf(wo, wi), self.back.pdf(_flip(wo), _flip(wi))
        return ops.where(wo.z * wi.z > 0.0, ops.where(wo.z > 0.0, above, below), 0.0)

    def sample(self, wo, u, mode="radiance"):
        s, t = self.front.sample(wo, u, mode), self.back.sample(_flip(wo), u, mode)
        up = wo.z > 0.0
        wi = ops.where(up, s.wi, _flip(t.wi))
        pdf = ops.where(up, s.pdf, t.pdf)
        good = (pdf > 0.0) & (wo.z * wi.z > 0.0)
        weight = ops.where(good, ops.where(up, s.weight, t.weight), 0.0)
        return go.Sample(wi, weight, ops.where(good, pdf, 0.0), ops.where(up, s.delta, t.delta) & good, 1.0 + 0.0 * pdf)

    @property
    def isotropic(self):
        return self.front.isotropic and self.back.isotropic

    @property
    def back_differs(self):
        return True

    @property
    def delta(self):
        return self.front.delta if self.front.delta == self.back.delta else "maybe"


class R2Lacquer(go.BSDF):
    """A base under a colored lacquer of index 1, which light crosses twice: exp(-depth / |cos|) each time."""

    base: go.BSDF = go.bsdf("the material below the lacquer", go.Mix(go.Mirror(), go.Lambert(albedo=1.0), weight=0.6))
    depth: go.Colour = go.spectrum((0.0, 0.5, 4.0), "optical depth along the normal", low=0.0, high=100.0)

    def _left(self, w):
        return ops.exp(-self.depth / ops.maximum(ops.abs(w.z), 1e-4))

    def eval(self, wo, wi, mode="radiance"):
        return self.base.eval(wo, wi, mode) * self._left(wo) * self._left(wi)

    def pdf(self, wo, wi):
        return self.base.pdf(wo, wi)

    def sample(self, wo, u, mode="radiance"):
        s = self.base.sample(wo, u, mode)
        return go.Sample(s.wi, s.weight * self._left(wo) * self._left(s.wi), s.pdf, s.delta, s.eta)

    @property
    def transmits(self):
        return self.base.transmits

    @property
    def isotropic(self):
        return self.base.isotropic

    @property
    def two_sided(self):
        return self.base.two_sided

    @property
    def delta(self):
        return self.base.delta


class R2Underside(go.BSDF):
    """An opaque material turned over: what it shows from above it now shows from below."""

    base: go.BSDF = go.bsdf("the material, which must not transmit", go.Lambert(albedo=(1.0, 0.5, 0.0)))

    def __post_init__(self):
        super().__post_init__()
        if self.base.transmits:
            raise go.InputError("a material that transmits", "R2Underside.base", "give an opaque one")

    def eval(self, wo, wi, mode="radiance"):
        return self.base.eval(_flip(wo), _flip(wi), mode)

    def pdf(self, wo, wi):
        return self.base.pdf(_flip(wo), _flip(wi))

    def sample(self, wo, u, mode="radiance"):
        s = self.base.sample(_flip(wo), u, mode)
        return go.Sample(_flip(s.wi), s.weight, s.pdf, s.delta, s.eta)

    @property
    def isotropic(self):
        return self.base.isotropic

    @property
    def two_sided(self):
        return self.base.two_sided

    @property
    def back_differs(self):
        return not self.base.two_sided

    @property
    def delta(self):
        return self.base.delta


class R2Varnish(go.BSDF):
    """A smooth varnish over an opaque base, seen from above: a mirror of Schlick's F, and the base with 1 - F twice."""

    base: go.BSDF = go.bsdf("the material below, which must not transmit", go.Lambert(albedo=(0.9, 0.8, 0.7)))
    r0: go.Colour = go.spectrum((0.04, 0.2, 0.9), "reflectance at normal incidence", low=0.0, high=1.0)

    def __post_init__(self):
        super().__post_init__()
        if self.base.transmits:
            raise go.InputError("a material that transmits", "R2Varnish.base", "give an opaque one")

    def _face(self, w):
        return self.r0 + (1.0 - self.r0) * ops.pow(1.0 - ops.abs(w.z), 5.0)

    def eval(self, wo, wi, mode="radiance"):
        value = self.base.eval(wo, wi, mode) * (1.0 - self._face(wo)) * (1.0 - self._face(wi))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), value, 0.0)

    def pdf(self, wo, wi):
        density = self.base.pdf(wo, wi) * (1.0 - ops.mean(self._face(wo)))
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        face = self._face(wo)
        share = ops.mean(face)
        mirrors = u.x < share
        left = 1.0 - share
        s = self.base.sample(wo, _with_x(u, ops.safe_div(u.x - share, left)), mode)
        wi = ops.where(mirrors, frame.mirror(wo), s.wi)
        pdf = ops.where(mirrors, share, s.pdf * left)
        good = (wo.z > 0.0) & (wi.z > 0.0) & (pdf > 0.0)
        below = s.weight * ((1.0 - face) * (1.0 - self._face(s.wi)) * ops.safe_div(1.0, left))
        weight = ops.where(mirrors, face * ops.safe_div(1.0, share), below)
        return go.Sample(
            wi, ops.where(good, weight, 0.0), ops.where(good, pdf, 0.0), (mirrors | s.delta) & good, 1.0 + 0.0 * pdf
        )

    @property
    def isotropic(self):
        return self.base.isotropic

    @property
    def back_differs(self):
        return False

    @property
    def delta(self):
        return "always" if self.base.delta == "always" else "maybe"


class R2Finish(go.BSDF):
    """A sheet whose finish is chosen; backlit, it is seen from both sides, and lets half of the light pass."""

    kd: go.Colour = go.spectrum((0.0, 1.0, 0.0), "factor on all light that leaves", low=0.0, high=1.0)
    finish: str = go.choice(
        "satin",
        "the finish",
        {"matte": "matte", "polished": "light is mirrored, or passes straight through", "satin": "half of each"},
    )
    backlit: bool = go.flag(True, "whether light passes")

    def _matte(self):
        return {"matte": 1.0, "polished": 0.0, "satin": 0.5}[self.finish]

    def _shown(self, wo, wi):
        """The share that goes to wi's side."""
        if self.backlit:
            return ops.where(wo.z * wi.z != 0.0, 0.5 + 0.0 * wi.z, 0.0)
        return ops.where((wo.z > 0.0) & (wi.z > 0.0), 1.0 + 0.0 * wi.z, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * self.pdf(wo, wi)

    def pdf(self, wo, wi):
        return self._shown(wo, wi) * (self._matte() * ops.inv_pi) * ops.abs(wi.z)

    def sample(self, wo, u, mode="radiance"):
        matte = self._matte()
        smooth = u.x >= matte
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        if self.backlit:
            across = ops.where(smooth, (u.x - matte) >= 0.5 * (1.0 - matte), u.x < 0.5 * matte)
        else:
            across = go.never(wo.z)
        z = ops.copysign(w.z, wo.z)
        rough = ops.vec3(w.x, w.y, ops.where(across, -z, z))
        mirror = frame.mirror(wo)
        wi = ops.where(smooth, ops.where(across, -wo, mirror), rough)
        chance = (1.0 - matte) * (0.5 if self.backlit else 1.0)
        pdf = ops.where(smooth, chance, self.pdf(wo, wi))
        if not self.backlit:
            pdf = ops.where(wo.z > 0.0, pdf, 0.0)
        good = pdf > 0.0
        return go.Sample(wi, self.kd * ops.where(good, 1.0 + 0.0 * pdf, 0.0), pdf, smooth & good, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return self.backlit

    @property
    def delta(self):
        return {"matte": "never", "polished": "always", "satin": "maybe"}[self.finish]


SOUND = [R2Triptych, R2Pierced, R2Backed, R2Lacquer, R2Underside, R2Varnish, R2Finish]
MUTANTS = []
