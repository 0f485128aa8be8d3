"""Panes, filters, smooth glass and gratings: delta lobes alone."""

import gonio as go
import numpy as np
from gonio import ops
from gonio.optics import frame


def _fresnel(cos_i, cos_t, eta):
    """The mean of R_s and R_p, 1 beyond the critical angle; the differences by Snell's law, so that nothing cancels."""
    contrast = (eta - 1.0) * (eta + 1.0)
    s = contrast / ops.maximum(ops.sqr(cos_i + eta * cos_t), 1e-12)
    across = ops.maximum(ops.sqr(eta * (eta * cos_i + cos_t)), 1e-12)
    p = contrast * ((ops.sqr(eta) + 1.0) * ops.sqr(cos_i) - 1.0) / across
    return ops.where(cos_t > 0.0, ops.minimum(0.5 * (ops.sqr(s) + ops.sqr(p)), 1.0), 1.0)


def _cos_t(cos_i, eta):
    """The cosine on the far side; 0 beyond the critical angle."""
    return ops.safe_sqrt(ops.sqr(cos_i) + (eta - 1.0) * (eta + 1.0)) / eta


def _chosen(wo, u, reflected, passed, through):
    """A sample of two delta lobes, the mirrored direction and `through`, chosen by their mean values."""
    r, t = ops.mean(reflected), ops.mean(passed)
    share = ops.safe_div(r, r + t)
    mirrors = u.x < share
    pdf = ops.where(r + t > 0.0, ops.where(mirrors, share, 1.0 - share), 0.0)
    value = ops.where(mirrors, reflected, passed)
    weight = value * ops.safe_div(1.0, pdf)
    return go.Sample(ops.where(mirrors, frame.mirror(wo), through), weight, pdf, pdf > 0.0, 1.0 + 0.0 * pdf)


class _Delta(go.BSDF):
    """What all of them share: no finite values."""

    def eval(self, wo, wi, mode="radiance"):
        return self.albedo * (0.0 * wo.z)

    def pdf(self, wo, wi):
        return 0.0 * wo.z

    @property
    def delta(self):
        return "always"


class R2TintedPane(_Delta):
    """A single pane of absorbing glass, with all bounces between its faces."""

    albedo: go.Colour = go.spectrum(1.0, "factor on all light that leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(1.52, "index of the glass", low=1.05, high=3.0)
    depth: go.Colour = go.spectrum((0.9, 0.2, 0.4), "optical depth along the normal", low=0.0, high=50.0)

    def sample(self, wo, u, mode="radiance"):
        cos = ops.abs(wo.z)
        cos_t = _cos_t(cos, self.eta)
        face = _fresnel(cos, cos_t, self.eta)
        once = ops.exp(-self.depth / ops.maximum(cos_t, 1e-3))
        series = 1.0 / ops.maximum(1.0 - ops.sqr(face * once), 1e-9)
        reflected = face + ops.sqr((1.0 - face) * once) * face * series
        passed = once * ops.sqr(1.0 - face) * series
        return _chosen(wo, u, self.albedo * reflected, self.albedo * passed, -wo)

    @property
    def transmits(self):
        return True


class R2DoubleGlazing(_Delta):
    """Two different sheets with air between: it reflects otherwise from behind, and transmits the same both ways."""

    albedo: go.Colour = go.spectrum(1.0, "factor on all light that leaves", low=0.0, high=1.0)
    front: go.Colour = go.spectrum((0.5, 0.3, 0.1), "reflectance of the upper sheet", low=0.0, high=0.95)
    back: go.Colour = go.spectrum((0.05, 0.1, 0.6), "reflectance of the lower sheet", low=0.0, high=0.95)
    smoke: go.Colour = go.spectrum(0.8, "share of the rest that the upper sheet lets pass", low=0.0, high=0.99)

    def sample(self, wo, u, mode="radiance"):
        above = wo.z >= 0.0
        through = (1.0 - self.front) * self.smoke
        other = 1.0 - self.back
        series = 1.0 / (1.0 - self.front * self.back)
        top = self.front + ops.sqr(through) * self.back * series
        bottom = self.back + ops.sqr(other) * self.front * series
        passed = through * other * series
        return _chosen(wo, u, self.albedo * ops.where(above, top, bottom), self.albedo * passed, -wo)

    @property
    def transmits(self):
        return True


class R2Invisible(_Delta):
    """No surface at all: everything passes straight through, unchanged."""

    albedo: go.Colour = go.spectrum(1.0, "factor on the light that passes", low=0.0, high=1.0)

    def sample(self, wo, u, mode="radiance"):
        one = 1.0 + 0.0 * wo.z
        return go.Sample(-wo, self.albedo * one, one, one > 0.0, one)

    @property
    def transmits(self):
        return True


class _Glass(_Delta):
    """A smooth interface of two media; `index()` below over above."""

    def sample(self, wo, u, mode="radiance"):
        index = self.index()
        eta = ops.where(wo.z >= 0.0, index, 1.0 / index)
        cos = ops.abs(wo.z)
        cos_t = _cos_t(cos, eta)
        face = _fresnel(cos, cos_t, eta)
        mirrors = u.x < face
        through = ops.vec3(-wo.x / eta, -wo.y / eta, -ops.copysign(cos_t, wo.z))
        pdf = ops.where(mirrors, face, 1.0 - face)
        passed = self.passed(cos, cos_t, eta)
        if mode == "radiance":
            passed = passed / ops.sqr(eta)
        weight = ops.where(mirrors, self.albedo, self.albedo * passed)
        return go.Sample(
            ops.where(mirrors, frame.mirror(wo), through), weight, pdf, pdf > 0.0, ops.where(mirrors, 1.0, eta)
        )

    def passed(self, cos, cos_t, eta):
        """A factor on refracted light, the same both ways."""
        return 1.0 + 0.0 * cos

    @property
    def transmits(self):
        return True


class R2Bubble(_Glass):
    """The surface of a bubble in a denser medium: an index below 1, with total reflection from above."""

    albedo: go.Colour = go.spectrum(1.0, "factor on all light that leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(0.66, "index inside over index outside", low=0.3, high=0.98)

    def index(self):
        return self.eta


class R2NearlyMatched(_Glass):
    """Glass in a liquid of nearly its index: almost nothing is reflected except at grazing angles."""

    albedo: go.Colour = go.spectrum(1.0, "factor on all light that leaves", low=0.0, high=1.0)
    contrast: go.Number = go.number(0.002, "index inside over index outside, minus 1", low=2e-4, high=0.05)

    def index(self):
        return 1.0 + self.contrast


class R2StainedGlass(_Glass):
    """Glass with a stain on its surface, which absorbs refracted light by its path through the stain."""

    albedo: go.Colour = go.spectrum(1.0, "factor on all light that leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.1, high=3.0)
    stain: go.Colour = go.spectrum((2.0, 0.1, 1.0), "optical depth of the stain along the normal", low=0.0, high=30.0)

    def index(self):
        return self.eta

    def passed(self, cos, cos_t, eta):
        # the stain lies inside, where the cosine is that on the dense side, whichever side wo is on
        dense = ops.where(eta > 1.0, cos_t, cos)
        return ops.exp(-self.stain / ops.maximum(dense, 1e-3))


class R2Dichroic(_Delta):
    """A dichroic beam splitter: what a color does not reflect passes, but for a loss; at grazing angles all reflects."""

    albedo: go.Colour = go.spectrum(1.0, "factor on all light that leaves", low=0.0, high=1.0)
    r0: go.Colour = go.spectrum((1.0, 0.15, 0.0), "reflectance at normal incidence", low=0.0, high=1.0)
    loss: go.Number = go.number(0.05, "share of the rest that is absorbed", low=0.0, high=1.0)

    def sample(self, wo, u, mode="radiance"):
        c = 1.0 - ops.abs(wo.z)
        reflected = self.r0 + (1.0 - self.r0) * ops.pow(c, 5.0)
        passed = (1.0 - reflected) * (1.0 - self.loss)
        return _chosen(wo, u, self.albedo * reflected, self.albedo * passed, -wo)

    @property
    def transmits(self):
        return True


class R2OneSidedMirror(_Delta):
    """A mirror in front, black behind."""

    albedo: go.Colour = go.spectrum((0.95, 0.8, 0.4), "reflectance", low=0.0, high=1.0)

    def sample(self, wo, u, mode="radiance"):
        one = ops.where(wo.z > 0.0, 1.0 + 0.0 * wo.z, 0.0)
        return go.Sample(frame.mirror(wo), self.albedo * one, one, one > 0.0, 1.0 + 0.0 * wo.z)


class R2Grating(_Delta):
    """A reflection grating with orders -1, 0 and 1: three delta lobes, of which those beyond the horizon are lost."""

    albedo: go.Colour = go.spectrum((0.9, 0.9, 0.7), "factor on all light that leaves", low=0.0, high=1.0)
    pitch: go.Number = go.number(0.4, "wavelength over period", low=0.05, high=1.5)
    side: go.Number = go.number(0.3, "share of each of the orders -1 and 1", low=0.0, high=0.5)

    def sample(self, wo, u, mode="radiance"):
        minus, plus = u.x < self.side, u.x >= 1.0 - self.side
        shift = ops.where(minus, -self.pitch, ops.where(plus, self.pitch, 0.0))
        x = shift - wo.x
        z2 = ops.where(minus | plus, 1.0 - ops.sqr(x) - ops.sqr(wo.y), ops.sqr(wo.z))
        valid = (wo.z > 0.0) & (z2 > 0.0)
        wi = ops.where(valid, ops.vec3(x, -wo.y, ops.safe_sqrt(z2)), frame.mirror(wo))
        pdf = ops.where(valid, ops.where(minus | plus, self.side, 1.0 - 2.0 * self.side), 0.0)
        one = ops.where(pdf > 0.0, 1.0 + 0.0 * wo.z, 0.0)
        return go.Sample(wi, self.albedo * one, pdf, pdf > 0.0, 1.0 + 0.0 * wo.z)

    @property
    def isotropic(self):
        return bool(np.all(np.asarray(self.plain.side) == 0.0))


SOUND = [
    R2TintedPane,
    R2DoubleGlazing,
    R2Invisible,
    R2Bubble,
    R2NearlyMatched,
    R2StainedGlass,
    R2Dichroic,
    R2OneSidedMirror,
    R2Grating,
]
MUTANTS = []
