"""Kernels over the projected directions p = (x, y): f = K(p_o, p_i), symmetric, and its integral over the disk is at most 1."""

import gonio as go
from gonio import ops
from gonio.optics import frame, warp


def lit(wo, wi):
    """Whether both directions are above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    """The sample for a direction whose density is the material's pdf."""
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


def raised(x, y):
    """The direction above (x, y); straight down if that is outside the disk: a failed sample."""
    left = 1.0 - x * x - y * y
    inside = left > 0.0
    return ops.vec3(ops.where(inside, x, 0.0), ops.where(inside, y, 0.0), ops.where(inside, ops.safe_sqrt(left), -1.0))


def gauss(x, y, sigma):
    """A round Gaussian's density in the plane."""
    return ops.exp(-0.5 * (ops.sqr(x / sigma) + ops.sqr(y / sigma))) * (0.5 * ops.inv_pi) / ops.sqr(sigma)


class R1Grating(go.BSDF):
    """A blazed grating: five blurred orders, p_o + p_i = m g, of unequal strength; what would leave the disk is lost."""

    middle: go.Colour = go.spectrum((0.9, 0.9, 0.9), "color of order 0", low=0.0, high=1.0)
    right: go.Colour = go.spectrum((1.0, 0.2, 0.0), "color of the positive orders", low=0.0, high=1.0)
    left: go.Colour = go.spectrum((0.0, 0.1, 1.0), "color of the negative orders", low=0.0, high=1.0)
    step: go.Number = go.number(0.28, "g", low=-0.9, high=0.9)
    blur: go.Number = go.number(0.03, "standard deviation of an order", low=0.01, high=0.5)
    rotation: go.Angle = go.angle(0.7, "of the grating")

    @property
    def isotropic(self):
        return False

    def order(self, wo, wi, m):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        return gauss(o.x + i.x - m * self.step, o.y + i.y, self.blur)

    def orders(self, wo, wi):
        left = 0.05 * self.order(wo, wi, -2.0) + 0.15 * self.order(wo, wi, -1.0)
        right = 0.25 * self.order(wo, wi, 1.0) + 0.10 * self.order(wo, wi, 2.0)
        return left, 0.45 * self.order(wo, wi, 0.0), right

    def eval(self, wo, wi, mode="radiance"):
        left, middle, right = self.orders(wo, wi)
        f = self.left * left + self.middle * middle + self.right * right
        return ops.where(lit(wo, wi), f * wi.z, 0.0)

    def pdf(self, wo, wi):
        left, middle, right = self.orders(wo, wi)
        return ops.where(lit(wo, wi), (left + middle + right) * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        m = 0.0 * u.x - 2.0
        for start in (0.05, 0.20, 0.65, 0.90):
            m = m + ops.where(u.x < start, 0.0, 1.0)
        radius = self.blur * ops.safe_sqrt(-2.0 * ops.log(ops.maximum(1.0 - u.y, 5e-8)))
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        o = frame.rotate(wo, self.rotation)
        wi = raised(m * self.step - o.x + radius * c, radius * s - o.y)
        return drawn(self, wo, frame.rotate_back(wi, self.rotation), mode)


class R1SquareHighlight(go.BSDF):
    """A highlight with the shape of a square."""

    ks: go.Colour = go.spectrum((0.8, 1.0, 0.0), "reflectance", low=0.0, high=1.0)
    side: go.Number = go.number(0.2, "side of the square", low=0.01, high=3.0)
    rotation: go.Angle = go.angle(0.3, "of the square")

    @property
    def isotropic(self):
        return False

    def square(self, wo, wi):
        p = frame.rotate(wo + wi, self.rotation)
        inside = ops.maximum(ops.abs(p.x), ops.abs(p.y)) < 0.5 * self.side
        return ops.where(inside, 1.0 / ops.sqr(self.side), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * ops.where(lit(wo, wi), self.square(wo, wi) * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.square(wo, wi) * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        o = frame.rotate(wo, self.rotation)
        wi = raised(self.side * (u.y - 0.5) - o.x, self.side * (u.z - 0.5) - o.y)
        return drawn(self, wo, frame.rotate_back(wi, self.rotation), mode)


class R1CellRetro(go.BSDF):
    """Light returns somewhere into the square cell that it comes from, and into no other."""

    ks: go.Colour = go.spectrum((1.0, 0.5, 0.5), "reflectance", low=0.0, high=1.0)
    cell: go.Number = go.number(0.31, "side of a cell", low=0.05, high=2.0)
    rotation: go.Angle = go.angle(0.0, "of the cells")

    @property
    def isotropic(self):
        return False

    def row(self, x):
        return ops.floor(x / self.cell + 0.37)

    def same(self, wo, wi):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        apart = ops.abs(self.row(o.x) - self.row(i.x)) + ops.abs(self.row(o.y) - self.row(i.y))
        return ops.where(apart < 0.5, 1.0 / ops.sqr(self.cell), 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * ops.where(lit(wo, wi), self.same(wo, wi) * wi.z, 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.same(wo, wi) * wi.z, 0.0)

    def sample(self, wo, u, mode="radiance"):
        o = frame.rotate(wo, self.rotation)
        wi = raised((self.row(o.x) + u.y - 0.37) * self.cell, (self.row(o.y) + u.z - 0.37) * self.cell)
        return drawn(self, wo, frame.rotate_back(wi, self.rotation), mode)


class R1SectorSwap(go.BSDF):
    """Light leaves through the sector opposite to its own, in the same of three rings: albedo kd everywhere."""

    kd: go.Colour = go.spectrum((1.0, 1.0, 0.5), "albedo", low=0.0, high=1.0)
    sectors: str = go.choice("6", "number of sectors", {"4": "quadrants", "6": "sextants", "10": "tenths"})

    @property
    def isotropic(self):
        return False

    def sector(self, w):
        phi = ops.atan2(w.y, ops.where(frame.sin2(w) < 1e-12, 1.0, w.x)) * (0.5 * ops.inv_pi) + 0.037
        count = float(self.sectors)
        return ops.minimum(ops.floor(count * (phi - ops.floor(phi))), count - 1.0)

    def ring(self, w):
        return ops.minimum(ops.floor(3.0 * frame.sin2(w)), 2.0)

    def eval(self, wo, wi, mode="radiance"):
        count = float(self.sectors)
        apart = ops.abs(ops.abs(self.sector(wo) - self.sector(wi)) - 0.5 * count)
        joined = apart + ops.abs(self.ring(wo) - self.ring(wi)) < 0.5
        f = ops.where(joined, 3.0 * count * ops.inv_pi + 0.0 * wi.z, 0.0)
        return self.kd * ops.where(lit(wo, wi), f * wi.z, 0.0)


class R1ZernikeFurnace(go.BSDF):
    """Albedo kd for every viewer, though f varies: Lambert plus products of polynomials with mean 0."""

    kd: go.Colour = go.spectrum(1.0, "albedo", low=0.0, high=1.0)
    defocus: go.Number = go.number(-0.6, "amount of (2 r^2 - 1)(2 r^2 - 1)", low=-0.6, high=0.6)
    tilt: go.Number = go.number(0.37, "amount of p_o . p_i", low=-0.37, high=0.37)

    def eval(self, wo, wi, mode="radiance"):
        bowl = (2.0 * frame.sin2(wo) - 1.0) * (2.0 * frame.sin2(wi) - 1.0)
        slope = wo.x * wi.x + wo.y * wi.y
        f = ops.maximum(1.0 + self.defocus * bowl + self.tilt * slope, 0.0) * ops.inv_pi
        return self.kd * ops.where(lit(wo, wi), f * wi.z, 0.0)


class R1QuadrantFurnace(go.BSDF):
    """Albedo kd for every viewer: light prefers, or avoids, the pair of quadrants that it came from."""

    kd: go.Colour = go.spectrum((1.0, 0.999, 0.9), "albedo", low=0.0, high=1.0)
    preference: go.Number = go.number(-1.0, "1: only the own pair, -1: only the other pair", low=-1.0, high=1.0)

    @property
    def isotropic(self):
        return False

    def pair(self, w):
        return ops.where(w.x * w.y > 0.0, 1.0, -1.0)

    def density(self, wo, wi):
        return (1.0 + self.preference * self.pair(wo) * self.pair(wi)) * (ops.inv_pi * wi.z)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), self.density(wo, wi), 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.density(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        w = warp.square_to_cosine_hemisphere(u.y, u.z)
        own = self.pair(wo)
        wanted = ops.where(u.x < 0.5 * (1.0 + self.preference), own, -own)
        x = ops.where(self.pair(w) * wanted > 0.0, w.x, -w.x)
        return drawn(self, wo, ops.vec3(x, w.y, w.z), mode)


class R1RingExchange(go.BSDF):
    """Steep light leaves flat and flat light steep: rings of equal area are exchanged, albedo kd everywhere."""

    kd: go.Colour = go.spectrum((0.3, 1.0, 0.3), "albedo", low=0.0, high=1.0)
    rings: str = go.choice("5", "number of rings", {"3": "three rings", "5": "five rings", "7": "seven rings"})

    def ring(self, w):
        count = float(self.rings)
        return ops.minimum(ops.floor(count * frame.sin2(w)), count - 1.0)

    def density(self, wo, wi):
        count = float(self.rings)
        joined = ops.abs(self.ring(wo) + self.ring(wi) - (count - 1.0)) < 0.5
        return ops.where(joined, count * ops.inv_pi * wi.z, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * ops.where(lit(wo, wi), self.density(wo, wi), 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.density(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        count = float(self.rings)
        r2 = (count - 1.0 - self.ring(wo) + u.y) * (1.0 / count)
        r = ops.safe_sqrt(r2)
        s, c = ops.sincos(2.0 * ops.pi * u.z)
        return drawn(self, wo, ops.vec3(r * c, r * s, ops.safe_sqrt(1.0 - r2)), mode)


class R1LineScatter(go.BSDF):
    """Scratches: a long cusp across them and a narrow Gaussian along them."""

    ks: go.Colour = go.spectrum((0.9, 0.85, 0.7), "reflectance", low=0.0, high=1.0)
    across: go.Number = go.number(0.5, "length of the cusp", low=0.05, high=20.0)
    along: go.Number = go.number(0.03, "standard deviation of the Gaussian", low=0.01, high=0.2)
    rotation: go.Angle = go.angle(-2.5, "of the scratches")

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        p = frame.rotate(wo + wi, self.rotation)
        cusp = ops.exp(-ops.abs(p.x) / self.across) / (2.0 * self.across)
        line = ops.exp(-0.5 * ops.sqr(p.y / self.along)) * 0.3989422804 / self.along
        return self.ks * ops.where(lit(wo, wi), cusp * line * wi.z, 0.0)


class R1RetroGauss(go.BSDF):
    """An anisotropic, rotated Gaussian about the direction back to the viewer."""

    ks: go.Colour = go.spectrum((1.0, 0.95, 0.2), "reflectance", low=0.0, high=1.0)
    alpha: go.Width = go.width((0.05, 0.4), "widths of the Gaussian", low=0.02, high=1.0)
    rotation: go.Angle = go.angle(0.9, "of the Gaussian")

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        p = frame.rotate(wo - wi, self.rotation)
        height = ops.exp(-(ops.sqr(p.x / self.alpha.x) + ops.sqr(p.y / self.alpha.y)))
        height = height * ops.inv_pi / (self.alpha.x * self.alpha.y)
        return self.ks * ops.where(lit(wo, wi), height * wi.z, 0.0)


SOUND = [
    R1Grating, R1SquareHighlight, R1CellRetro, R1SectorSwap, R1ZernikeFurnace, R1QuadrantFurnace, R1RingExchange,
    R1LineScatter, R1RetroGauss,
]  # fmt: skip
