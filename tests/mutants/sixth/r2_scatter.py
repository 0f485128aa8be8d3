"""Leaves, cloth, retroreflectors, blinds and other scatterers, some with delta lobes beside a density."""

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame, warp


def _cosine(wo, u, across):
    """A cosine-distributed direction on wo's side, or on the other."""
    w = warp.square_to_cosine_hemisphere(u.y, u.z)
    z = ops.copysign(w.z, wo.z)
    return ops.vec3(w.x, w.y, ops.where(across, -z, z))


def _flat(wi):
    """|cos| / pi."""
    return ops.abs(wi.z) * ops.inv_pi


class R2Louvre(go.BSDF):
    """Black blinds: light passes between slats, straight through, only near the directions along which they lean."""

    albedo: go.Colour = go.spectrum((1.0, 0.95, 0.9), "factor on the light that passes", low=0.0, high=1.0)
    lean: go.Number = go.number(0.5, "tangent of the slats' tilt", low=-3.0, high=3.0)
    depth: go.Number = go.number(0.8, "depth of the slats over their distance", low=0.0, high=10.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        # the same for wo and -wo
        crossed = self.depth * ops.abs(wo.x - self.lean * wo.z) / ops.maximum(ops.abs(wo.z), 1e-6)
        open_ = ops.clamp(1.0 - crossed, 0.0, 1.0)
        passes = u.x < open_
        pdf = ops.where(passes, open_, 0.0)
        weight = self.albedo * ops.where(passes, 1.0 + 0.0 * open_, 0.0)
        return go.Sample(-wo, weight, pdf, passes, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"

    @property
    def isotropic(self):
        return bool(np.all(np.asarray(self.plain.depth) == 0.0))


class R2WireGrid(go.BSDF):
    """A wire-grid polarizer for light whose plane of vibration the direction tells: light tilted along x or y is partly
    reflected, partly absorbed, and the rest passes straight through."""

    along_x: go.Colour = go.spectrum((0.9, 0.6, 0.2), "share of light along x that does not pass", low=0.0, high=1.0)
    along_y: go.Colour = go.spectrum((0.1, 0.0, 0.7), "share of light along y that does not pass", low=0.0, high=1.0)
    gloss: go.Number = go.number(0.6, "reflected share of the light that does not pass", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.along_x * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        stopped = ops.minimum(self.along_x * ops.sqr(wo.x) + self.along_y * ops.sqr(wo.y), 1.0)
        r, t = stopped * self.gloss, 1.0 - stopped
        r_mean, t_mean = ops.mean(r), ops.mean(t)
        share = ops.safe_div(r_mean, r_mean + t_mean)
        mirrors = u.x < share
        pdf = ops.where(r_mean + t_mean > 0.0, ops.where(mirrors, share, 1.0 - share), 0.0)
        weight = ops.where(mirrors, r, t) * ops.safe_div(1.0, pdf)
        return go.Sample(ops.where(mirrors, frame.mirror(wo), -wo), weight, pdf, pdf > 0.0, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"

    @property
    def isotropic(self):
        return bool(np.all(np.asarray(self.plain.along_x) == np.asarray(self.plain.along_y)))


class R2Leaf(go.BSDF):
    """A leaf: matte with different colors above and below, and matte transmission that is the same both ways."""

    above: go.Colour = go.spectrum((0.05, 0.2, 0.03), "albedo from above", low=0.0, high=1.0)
    below: go.Colour = go.spectrum((0.3, 0.4, 0.25), "albedo from below", low=0.0, high=1.0)
    through: go.Colour = go.spectrum(
        (0.2, 0.6, 0.0), "share of what neither side reflects that passes", low=0.0, high=1.0
    )

    def _shares(self, wo):
        reflected = ops.where(wo.z >= 0.0, self.above, self.below)
        passed = self.through * (1.0 - ops.maximum(self.above, self.below))
        return reflected, passed

    def _chance(self, wo):
        r, t = (ops.mean(x) for x in self._shares(wo))
        return ops.where(r + t > 0.0, ops.safe_div(r, r + t), 0.5)

    def eval(self, wo, wi, mode="radiance"):
        reflected, passed = self._shares(wo)
        return ops.where(wo.z * wi.z > 0.0, reflected, passed) * _flat(wi)

    def pdf(self, wo, wi):
        chance = self._chance(wo)
        return ops.where(wo.z * wi.z > 0.0, chance, 1.0 - chance) * _flat(wi)

    def sample(self, wo, u, mode="radiance"):
        wi = _cosine(wo, u, u.x >= self._chance(wo))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True


class R2OpalFace(go.BSDF):
    """The matte face of a dense block of opal: light enters and leaves it by a cosine law, and radiance is scaled by the
    square of the index, as at any interface."""

    albedo: go.Colour = go.spectrum((0.9, 0.8, 0.7), "factor on all light that leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index inside over index outside", low=0.5, high=2.5)
    enters: go.Number = go.number(0.7, "share that crosses toward the denser side", low=0.0, high=1.0)

    def _crossing(self, wo):
        """The share that crosses from wo's side, and the ratio of indices."""
        eta = ops.where(wo.z >= 0.0, self.eta, 1.0 / self.eta)
        return self.enters * ops.minimum(ops.sqr(eta), 1.0), eta

    def eval(self, wo, wi, mode="radiance"):
        crossing, eta = self._crossing(wo)
        passed = crossing / ops.sqr(eta) if mode == "radiance" else crossing
        return self.albedo * (ops.where(wo.z * wi.z > 0.0, 1.0 - crossing, passed) * _flat(wi))

    def pdf(self, wo, wi):
        crossing, _ = self._crossing(wo)
        return ops.where(wo.z * wi.z > 0.0, 1.0 - crossing, crossing) * _flat(wi)

    def sample(self, wo, u, mode="radiance"):
        crossing, eta = self._crossing(wo)
        across = u.x < crossing
        wi = _cosine(wo, u, across)
        pdf = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(across, eta, 1.0))

    @property
    def transmits(self):
        return True


class R2Twill(go.BSDF):
    """Twill: matte, with an anisotropy of the second order that shifts light between azimuths and loses none."""

    kd: go.Colour = go.spectrum((0.8, 0.1, 0.2), "albedo", low=0.0, high=1.0)
    weave: go.Number = go.number(0.9, "strength of the anisotropy", low=-1.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        shift = (ops.sqr(wo.x) - ops.sqr(wo.y)) * (ops.sqr(wi.x) - ops.sqr(wi.y))
        f = ops.maximum(1.0 + self.weave * shift, 0.0) * ops.inv_pi
        return self.kd * ops.where((wo.z > 0.0) & (wi.z > 0.0), f * wi.z, 0.0)

    @property
    def isotropic(self):
        return bool(np.all(np.asarray(self.plain.weave) == 0.0))


class R2Reversible(go.BSDF):
    """A reversible fabric, opaque: matte above, and below a sheen of its own, f = sheen (1 - cos_o) (1 - cos_i)."""

    outside: go.Colour = go.spectrum((0.0, 0.0, 1.0), "albedo above", low=0.0, high=1.0)
    lining: go.Colour = go.spectrum((1.0, 0.0, 0.0), "strength of the sheen below", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        o, i = ops.abs(wo.z), ops.abs(wi.z)
        sheen = self.lining * ((1.0 - o) * (1.0 - i) * 3.0)
        f = ops.where(wo.z > 0.0, self.outside, sheen)
        return ops.where(wo.z * wi.z > 0.0, f * (i * ops.inv_pi), 0.0)

    def pdf(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, _flat(wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        wi = _cosine(wo, u, go.never(wo.z))
        pdf = self.pdf(wo, wi)
        return go.Sample(wi, self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf), pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def back_differs(self):
        return True


class R2RoadSign(go.BSDF):
    """Retroreflecting sheet: a delta lobe back toward the viewer, over a matte color, on both sides."""

    paint: go.Colour = go.spectrum((1.0, 0.8, 0.0), "albedo of the matte part", low=0.0, high=1.0)
    glass: go.Colour = go.spectrum((0.9, 0.9, 0.9), "albedo of the retroreflecting part", low=0.0, high=1.0)
    beads: go.Number = go.number(0.4, "share of the area that retroreflects", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return ops.where(wo.z * wi.z > 0.0, self.paint * ((1.0 - self.beads) * _flat(wi)), 0.0)

    def pdf(self, wo, wi):
        return ops.where(wo.z * wi.z > 0.0, (1.0 - self.beads) * _flat(wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        returns = u.x < self.beads
        wi = ops.where(returns, wo, _cosine(wo, u, go.never(wo.z)))
        density = self.pdf(wo, wi)
        matte = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        pdf = ops.where(returns, self.beads, density)
        return go.Sample(wi, ops.where(returns, self.glass, matte), pdf, returns, 1.0 + 0.0 * density)

    @property
    def two_sided(self):
        return True

    @property
    def delta(self):
        beads = np.asarray(self.plain.beads)
        return "never" if np.all(beads == 0.0) else "always" if np.all(beads == 1.0) else "maybe"


class R2ThreeWays(go.BSDF):
    """Three delta lobes from both sides: mirrored, straight through, and straight back, each with its own color."""

    albedo: go.Colour = go.spectrum(1.0, "factor on all light that leaves", low=0.0, high=1.0)
    mirrored: go.Colour = go.spectrum((0.5, 0.0, 0.2), "share that is mirrored", low=0.0, high=0.5)
    returned: go.Colour = go.spectrum((0.0, 0.3, 0.2), "share that is returned", low=0.0, high=0.5)
    clear: go.Number = go.number(1.0, "share of the rest that passes", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    def sample(self, wo, u, mode="radiance"):
        passed = ops.maximum(1.0 - self.mirrored - self.returned, 0.0) * self.clear
        a, b, c = ops.mean(self.mirrored), ops.mean(self.returned), ops.mean(passed)
        total = a + b + c
        some = total > 0.0
        a, b = ops.safe_div(a, total), ops.safe_div(b, total)
        one, two = u.x < a, u.x < a + b
        chance = ops.where(one, a, ops.where(two, b, 1.0 - a - b))
        pdf = ops.where(some & (chance > 1e-6), chance, 0.0)  # less is the rounding of 1 - a - b
        value = ops.where(one, self.mirrored, ops.where(two, self.returned, passed))
        wi = ops.where(one, frame.mirror(wo), ops.where(two, wo, -wo))
        weight = self.albedo * value * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, pdf > 0.0, 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always"


class R2Gauze(go.BSDF):
    """Gauze: between the threads light passes straight through, less at grazing angles; the threads scatter to both
    sides, f = kd (1 - p(o)) (1 - p(i)) / (2 pi), p = exp(-density / |cos|)."""

    kd: go.Colour = go.spectrum((1.0, 0.9, 0.6), "albedo of the threads", low=0.0, high=1.0)
    density: go.Number = go.number(0.5, "optical depth along the normal", low=0.0, high=20.0)

    def _open(self, w):
        return ops.exp(-self.density / ops.maximum(ops.abs(w.z), 1e-4))

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ((1.0 - self._open(wo)) * (1.0 - self._open(wi)) * 0.5 * _flat(wi))

    def pdf(self, wo, wi):
        return (1.0 - self._open(wo)) * 0.5 * _flat(wi)

    def sample(self, wo, u, mode="radiance"):
        gap = self._open(wo)
        passes = u.x < gap
        across = (u.x - gap) > 0.5 * (1.0 - gap)
        wi = ops.where(passes, -wo, _cosine(wo, u, across))
        density = self.pdf(wo, wi)
        matte = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        weight = ops.where(passes, 1.0, matte)
        return go.Sample(wi, weight, ops.where(passes, gap, density), passes, 1.0 + 0.0 * gap)

    @property
    def transmits(self):
        return True

    @property
    def delta(self):
        return "always" if np.all(np.asarray(self.plain.density) == 0.0) else "maybe"


SOUND = [R2Louvre, R2WireGrid, R2Leaf, R2OpalFace, R2Twill, R2Reversible, R2RoadSign, R2ThreeWays, R2Gauze]
MUTANTS = []
