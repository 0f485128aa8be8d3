"""Rough glass by formulas of its own: GGX, separable Smith masking, exact Fresnel, normals sampled by D m_z."""

import gonio as go
from gonio import ops
from gonio.optics import frame


def _reflectance(cos_i, cos_t, eta):
    """The mean of R_s and R_p, 1 beyond the critical angle; the differences by Snell's law, so that nothing cancels."""
    contrast = (eta - 1.0) * (eta + 1.0)
    s = contrast / ops.maximum(ops.sqr(cos_i + eta * cos_t), 1e-12)
    across = ops.maximum(ops.sqr(eta * (eta * cos_i + cos_t)), 1e-12)
    p = contrast * ((ops.sqr(eta) + 1.0) * ops.sqr(cos_i) - 1.0) / across
    return ops.where(cos_t > 0.0, ops.minimum(0.5 * (ops.sqr(s) + ops.sqr(p)), 1.0), 1.0)


def _snell(cos_i, eta):
    """The cosine on the far side; 0 beyond the critical angle."""
    return ops.safe_sqrt(ops.sqr(cos_i) + (eta - 1.0) * (eta + 1.0)) / eta


def _facets(m, a):
    """GGX, a density of normals over |m_z|."""
    stretched = ops.sqr(m.x / a.x) + ops.sqr(m.y / a.y) + ops.sqr(m.z)
    return ops.inv_pi / (a.x * a.y * ops.maximum(ops.sqr(stretched), 1e-20))


def _seen(w, a):
    """G1(w) / |w.z|, which is finite at the horizon."""
    z = ops.abs(w.z)
    return 2.0 / ops.maximum(z + ops.sqrt(ops.sqr(z) + ops.sqr(a.x * w.x) + ops.sqr(a.y * w.y)), 1e-9)


def _normal(u, a):
    """A normal with density D m_z."""
    s, c = ops.sincos(2.0 * ops.pi * u.z)
    slope = ops.sqrt(u.y / ops.maximum(1.0 - u.y, 1e-7))
    return ops.normalize(ops.vec3(a.x * c * slope, a.y * s * slope, 1.0 + 0.0 * slope))


class _Frosted(go.BSDF):
    """A rough interface; `_index()` is the index below over above, `_widths()` a pair, `_turn()` the axes' rotation."""

    def _widths(self):
        return ops.vec2(self.alpha, self.alpha)

    def _index(self):
        return self.eta

    def _turn(self):
        return None

    def _relative(self, wo):
        return ops.where(wo.z >= 0.0, self._index(), 1.0 / self._index())

    def _parts(self, wo, wi):
        """(facing, reflects, m, o.m, i.m, F, dm/dwi over |o.m|...) of a pair, in the frame of the widths."""
        eta = self._relative(wo)
        reflects = wo.z * wi.z > 0.0
        h = wo + wi * ops.where(reflects, 1.0, eta)
        h = h * ops.rsqrt(ops.maximum(ops.dot(h, h), 1e-30))
        m = ops.where(h.z < 0.0, -h, h)
        cos_o, cos_i = ops.dot(wo, m), ops.dot(wi, m)
        lit = (cos_o * wo.z > 0.0) & (cos_i * wi.z > 0.0)
        o, i = ops.abs(cos_o), ops.abs(cos_i)
        face = _reflectance(o, ops.where(reflects, _snell(o, eta), i), eta)
        chance = ops.where(reflects, face, 1.0 - face)
        # (o.m + eta i.m)^2 by Snell's law, accurate near eta = 1
        squeezed = ops.sqr(eta * (o + eta * i) / ((eta - 1.0) * (eta + 1.0)))
        jacobian = ops.where(reflects, 0.25 / ops.maximum(o, 1e-9), i * squeezed)
        return lit, reflects, m, o, chance, jacobian, eta

    def eval(self, wo, wi, mode="radiance"):
        wo, wi = frame.rotate(wo, self._turn()), frame.rotate(wi, self._turn())
        lit, reflects, m, o, chance, jacobian, eta = self._parts(wo, wi)
        a = self._widths()
        value = chance * o * jacobian * _facets(m, a) * _seen(wo, a) * _seen(wi, a) * ops.abs(wi.z)
        if mode == "radiance":
            value = value * ops.where(reflects, 1.0, 1.0 / ops.sqr(eta))
        return self.albedo * ops.where(lit, value, 0.0)

    def pdf(self, wo, wi):
        wo, wi = frame.rotate(wo, self._turn()), frame.rotate(wi, self._turn())
        lit, _, m, _, chance, jacobian, _ = self._parts(wo, wi)
        return ops.where(lit, chance * jacobian * _facets(m, self._widths()) * m.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        local = frame.rotate(wo, self._turn())
        m = _normal(u, self._widths())
        m = ops.where(wo.z < 0.0, -m, m)
        cos = ops.dot(local, m)
        eta = self._relative(wo)
        cos_t = _snell(ops.maximum(cos, 0.0), eta)
        face = _reflectance(ops.maximum(cos, 0.0), cos_t, eta)
        mirrors = u.x < face
        wi = ops.where(mirrors, frame.reflect(local, m), frame.refract(local, m, cos_t, eta))
        wi = frame.rotate_back(ops.normalize(wi), self._turn())
        right = (cos > 0.0) & ops.where(mirrors, wo.z * wi.z > 0.0, wo.z * wi.z < 0.0)
        pdf = ops.where(right, self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), ops.where(mirrors, 1.0, eta))

    @property
    def transmits(self):
        return True


class R2Frosted(_Frosted):
    """Frosted glass."""

    albedo: go.Colour = go.spectrum(1.0, "factor on all light that leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index inside over index outside", low=1.2, high=3.0)
    alpha: go.Number = go.number(0.35, "width", low=0.05, high=1.0)


class R2FrostedBubble(_Frosted):
    """The rough surface of a bubble in a denser medium: an index below 1."""

    albedo: go.Colour = go.spectrum((0.9, 1.0, 0.4), "factor on all light that leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(0.7, "index inside over index outside", low=0.4, high=0.85)
    alpha: go.Number = go.number(0.4, "width", low=0.1, high=1.0)


class R2Submerged(_Frosted):
    """Rough glass in a liquid of nearly its index: refraction deflects light by a few degrees."""

    albedo: go.Colour = go.spectrum(1.0, "factor on all light that leaves", low=0.0, high=1.0)
    contrast: go.Number = go.number(0.05, "index inside over index outside, minus 1", low=0.02, high=0.15)
    alpha: go.Number = go.number(0.6, "width", low=0.3, high=1.0)

    def _index(self):
        return 1.0 + self.contrast


class R2BrushedGlass(_Frosted):
    """Glass that is rougher across the brush strokes than along them, in any direction."""

    albedo: go.Colour = go.spectrum((1.0, 0.7, 0.5), "factor on all light that leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(1.45, "index inside over index outside", low=1.2, high=3.0)
    alpha: go.Width = go.width((0.15, 0.6), "widths along x and y", low=0.05)
    strokes: go.Angle = go.angle(0.6, "rotation of the strokes")

    def _widths(self):
        return self.alpha

    def _turn(self):
        return self.strokes


class R2GroundPane(go.BSDF):
    """A thin pane, ground on both sides: facets mirror light, or let it pass as if mirrored to the other side."""

    albedo: go.Colour = go.spectrum((0.8, 1.0, 0.9), "factor on all light that leaves", low=0.0, high=1.0)
    eta: go.Number = go.number(1.5, "index of the pane", low=1.05, high=3.0)
    alpha: go.Width = go.width((0.2, 0.5), "widths along x and y", low=0.05)

    def _parts(self, wo, wi):
        side = ops.abs(wo.z) > 0.0
        reflects = wo.z * wi.z > 0.0
        o = ops.vec3(wo.x, wo.y, ops.abs(wo.z))
        i = ops.vec3(wi.x, wi.y, ops.abs(wi.z))
        m = frame.half_vector(o, i)
        cos = ops.dot(o, m)
        once = _reflectance(cos, _snell(cos, self.eta), self.eta)
        both = 2.0 * once / (1.0 + once)
        chance = ops.where(reflects, both, 1.0 - both)
        lit = side & (ops.abs(wi.z) > 0.0) & (cos > 0.0)
        return lit, o, i, m, cos, chance

    def eval(self, wo, wi, mode="radiance"):
        lit, o, i, m, _, chance = self._parts(wo, wi)
        value = 0.25 * chance * _facets(m, self.alpha) * _seen(o, self.alpha) * _seen(i, self.alpha) * i.z
        return self.albedo * ops.where(lit, value, 0.0)

    def pdf(self, wo, wi):
        lit, _, _, m, cos, chance = self._parts(wo, wi)
        density = 0.25 * chance * _facets(m, self.alpha) * m.z / ops.maximum(cos, 1e-9)
        return ops.where(lit, density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        o = ops.vec3(wo.x, wo.y, ops.abs(wo.z))
        m = _normal(u, self.alpha)
        cos = ops.dot(o, m)
        i = frame.reflect(o, m)
        once = _reflectance(ops.maximum(cos, 0.0), _snell(ops.maximum(cos, 0.0), self.eta), self.eta)
        mirrors = u.x < 2.0 * once / (1.0 + once)
        up = ops.where(wo.z < 0.0, -1.0, 1.0 + 0.0 * cos)
        wi = ops.vec3(i.x, i.y, i.z * ops.where(mirrors, up, -up))
        pdf = ops.where((cos > 0.0) & (i.z > 0.0), self.pdf(wo, wi), 0.0)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
        return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)

    @property
    def transmits(self):
        return True


SOUND = [R2Frosted, R2FrostedBubble, R2Submerged, R2BrushedGlass, R2GroundPane]
MUTANTS = []
