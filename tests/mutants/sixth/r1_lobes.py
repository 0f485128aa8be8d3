"""Lobes whose density q(wo, wi) over the sphere is symmetric, as f = q / max(cos_o, cos_i): the albedo is at most 1."""

import gonio as go
from gonio import ops
from gonio.optics import frame
from gonio.optics.special import exprel
from gonio.optics.warp import square_to_cosine_hemisphere, to_frame


def lit(wo, wi):
    """Whether both directions are above the surface."""
    return (wo.z > 0.0) & (wi.z > 0.0)


def drawn(material, wo, wi, mode):
    """The sample for a direction whose density is the material's pdf."""
    pdf = material.pdf(wo, wi)
    weight = material.eval(wo, wi, mode) * ops.safe_div(1.0, pdf)
    return go.Sample(wi, weight, pdf, go.never(pdf), 1.0 + 0.0 * pdf)


def tilted(wo, wi):
    """cos_i / max(cos_o, cos_i)."""
    return ops.maximum(wi.z, 0.0) / ops.maximum(ops.maximum(wo.z, wi.z), 1e-9)


def versine(a, b):
    """1 - cos of the angle between two directions."""
    off = a - b
    return 0.5 * ops.dot(off, off)


def vmf(v, kappa):
    """Von Mises and Fisher's density on the sphere, of the versine."""
    return ops.exp(-kappa * v) / (4.0 * ops.pi * exprel(-2.0 * kappa))


def about(v, u):
    """The direction at a versine from z, at the azimuth 2 pi u."""
    sin = ops.safe_sqrt(v * (2.0 - v))
    s, c = ops.sincos(2.0 * ops.pi * u)
    return ops.vec3(sin * c, sin * s, 1.0 - v)


def vmf_direction(u1, u2, kappa):
    """A direction about z with density vmf."""
    inside = ops.maximum(1.0 - u1 * (2.0 * kappa * exprel(-2.0 * kappa)), 5e-8)
    return about(ops.clamp(-ops.log(inside) / kappa, 0.0, 2.0), u2)


class R1VmfMirror(go.BSDF):
    """Von Mises and Fisher's lobe about the mirrored direction, from almost uniform to very narrow."""

    ks: go.Colour = go.spectrum((1.0, 0.8, 0.3), "reflectance", low=0.0, high=1.0)
    kappa: go.Number = go.number(300.0, "concentration", low=0.1, high=1e5)

    def eval(self, wo, wi, mode="radiance"):
        q = vmf(versine(wi, frame.mirror(wo)), self.kappa)
        return self.ks * ops.where(lit(wo, wi), q * tilted(wo, wi), 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), vmf(versine(wi, frame.mirror(wo)), self.kappa), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, to_frame(frame.mirror(wo), vmf_direction(u.y, u.z, self.kappa)), mode)


class R1FlatCap(go.BSDF):
    """A disk of constant density about the mirrored direction, over a matte base: a cartoon's highlight."""

    ks: go.Colour = go.spectrum((1.0, 1.0, 0.9), "reflectance of the disk", low=0.0, high=1.0)
    kd: go.Colour = go.spectrum((0.1, 0.0, 0.6), "albedo of the base", low=0.0, high=1.0)
    share: go.Number = go.number(0.35, "share of the disk", low=0.0, high=1.0)
    size: go.Number = go.number(0.03, "1 - cosine of the disk's radius", low=0.005, high=1.0)

    def cap(self, wo, wi):
        v = versine(wi, frame.mirror(wo))
        return ops.where(v < self.size, 0.5 * ops.inv_pi / self.size, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        disk = self.ks * (self.share * self.cap(wo, wi) * tilted(wo, wi))
        return ops.where(lit(wo, wi), disk + self.kd * ((1.0 - self.share) * wi.z * ops.inv_pi), 0.0)

    def pdf(self, wo, wi):
        density = self.share * self.cap(wo, wi) + (1.0 - self.share) * wi.z * ops.inv_pi
        return ops.where(lit(wo, wi), density, 0.0)

    def sample(self, wo, u, mode="radiance"):
        disk = to_frame(frame.mirror(wo), about(self.size * u.y, u.z))
        return drawn(self, wo, ops.where(u.x < self.share, disk, square_to_cosine_hemisphere(u.y, u.z)), mode)


class R1Halo(go.BSDF):
    """A ring around the mirrored direction with sharp edges and nothing inside."""

    ks: go.Colour = go.spectrum((0.6, 1.0, 0.9), "reflectance", low=0.0, high=1.0)
    inner: go.Number = go.number(0.07, "1 - cosine of the inner radius", low=0.0, high=0.4)
    thickness: go.Number = go.number(0.04, "difference of the cosines of both radii", low=0.02, high=1.0)

    def ring(self, wo, wi):
        v = versine(wi, frame.mirror(wo)) - self.inner
        return ops.where((v >= 0.0) & (v <= self.thickness), 0.5 * ops.inv_pi / self.thickness, 0.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * ops.where(lit(wo, wi), self.ring(wo, wi) * tilted(wo, wi), 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.ring(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        return drawn(self, wo, to_frame(frame.mirror(wo), about(self.inner + self.thickness * u.y, u.z)), mode)


class R1TiltedFacets(go.BSDF):
    """Roof tiles: all facets lean by one angle toward one azimuth, and each has a lobe."""

    ks: go.Colour = go.spectrum((0.9, 0.3, 0.2), "reflectance", low=0.0, high=1.0)
    tilt: go.Number = go.number(0.25, "angle between the facets' normal and the surface's", low=-0.7, high=0.7)
    kappa: go.Number = go.number(80.0, "concentration of the lobe", low=0.5, high=2e4)
    rotation: go.Angle = go.angle(1.1, "azimuth toward which the facets lean")

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        s, c = ops.sincos(self.tilt)
        normal = ops.vec3(s, 0.0 * s, c)
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        q = vmf(versine(i, frame.reflect(o, normal)), self.kappa)
        return self.ks * ops.where(lit(wo, wi), q * tilted(wo, wi), 0.0)


class R1RidgeMirror(go.BSDF):
    """Right-angled ridges: a mirror across them sends light back, along them it is a mirror."""

    ks: go.Colour = go.spectrum((0.7, 0.7, 1.0), "reflectance", low=0.0, high=1.0)
    kappa: go.Number = go.number(150.0, "concentration of the lobe", low=0.5, high=2e4)
    rotation: go.Angle = go.angle(-0.6, "of the ridges")

    @property
    def isotropic(self):
        return False

    def eval(self, wo, wi, mode="radiance"):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        q = vmf(versine(i, ops.vec3(-o.x, o.y, o.z)), self.kappa)
        return self.ks * ops.where(lit(wo, wi), q * tilted(wo, wi), 0.0)


class R1HenyeyLobe(go.BSDF):
    """Henyey and Greenstein's function about the mirrored direction; at negative g it goes mostly into the ground."""

    ks: go.Colour = go.spectrum((0.2, 1.0, 0.4), "reflectance", low=0.0, high=1.0)
    g: go.Number = go.number(0.8, "mean cosine", low=-0.95, high=0.97)

    def eval(self, wo, wi, mode="radiance"):
        off = ops.sqr(1.0 - self.g) + 2.0 * self.g * versine(wi, frame.mirror(wo))  # 1 + g^2 - 2 g cos
        q = 0.25 * ops.inv_pi * (1.0 - ops.sqr(self.g)) * ops.pow(ops.maximum(off, 1e-6), -1.5)
        return self.ks * ops.where(lit(wo, wi), q * tilted(wo, wi), 0.0)


class R1Kaleidoscope(go.BSDF):
    """Four lobes, at the directions (+-x, +-y, z) of the viewer: mirror, retroreflector and two between."""

    a: go.Colour = go.spectrum((1.0, 0.0, 0.0), "color of the mirror and the retroreflector", low=0.0, high=1.0)
    b: go.Colour = go.spectrum((0.0, 0.0, 1.0), "color of the two others", low=0.0, high=1.0)
    first: go.Number = go.number(400.0, "weight of the mirror, relative", low=1.0, high=1e6)
    second: go.Number = go.number(100.0, "weight of the retroreflector, relative", low=0.0, high=1e6)
    third: go.Number = go.number(50.0, "weight of each other, relative", low=0.0, high=1e6)
    kappa: go.Number = go.number(60.0, "concentration of the lobes", low=1.0, high=1e4)

    @property
    def isotropic(self):
        return False

    def weights(self):
        total = self.first + self.second + 2.0 * self.third
        return self.first / total, self.second / total, self.third / total

    def lobes(self, wo, wi):
        def lobe(x, y):
            return vmf(versine(wi, ops.vec3(x * wo.x, y * wo.y, wo.z)), self.kappa)

        w1, w2, w3 = self.weights()
        straight = w1 * lobe(-1.0, -1.0) + w2 * lobe(1.0, 1.0)
        return straight, w3 * (lobe(-1.0, 1.0) + lobe(1.0, -1.0))

    def eval(self, wo, wi, mode="radiance"):
        straight, crossed = self.lobes(wo, wi)
        return ops.where(lit(wo, wi), (self.a * straight + self.b * crossed) * tilted(wo, wi), 0.0)

    def pdf(self, wo, wi):
        straight, crossed = self.lobes(wo, wi)
        return ops.where(lit(wo, wi), straight + crossed, 0.0)

    def sample(self, wo, u, mode="radiance"):
        w1, w2, w3 = self.weights()
        x = ops.where((u.x < w1) | ((u.x >= w1 + w2) & (u.x < w1 + w2 + w3)), -wo.x, wo.x)
        y = ops.where((u.x < w1) | (u.x >= w1 + w2 + w3), -wo.y, wo.y)
        return drawn(self, wo, to_frame(ops.vec3(x, y, wo.z), vmf_direction(u.y, u.z, self.kappa)), mode)


class R1Fan(go.BSDF):
    """A fan of seven facets in one plane, each with a narrow lobe, in two colors by turns."""

    a: go.Colour = go.spectrum((1.0, 0.9, 0.0), "color of four facets", low=0.0, high=1.0)
    b: go.Colour = go.spectrum((0.0, 0.4, 1.0), "color of three facets", low=0.0, high=1.0)
    spread: go.Number = go.number(0.12, "angle between two facets", low=0.0, high=0.3)
    kappa: go.Number = go.number(900.0, "concentration of the lobes", low=2.0, high=2e4)
    rotation: go.Angle = go.angle(0.0, "of the fan")

    @property
    def isotropic(self):
        return False

    def facet(self, k):
        s, c = ops.sincos(self.spread * k)
        return ops.vec3(s, 0.0 * s, c)

    def lobes(self, wo, wi):
        o, i = frame.rotate(wo, self.rotation), frame.rotate(wi, self.rotation)
        even, uneven = 0.0, 0.0
        for k in range(7):
            q = vmf(versine(i, frame.reflect(o, self.facet(k - 3.0))), self.kappa) * (1.0 / 7.0)
            even, uneven = (even + q, uneven) if k % 2 == 0 else (even, uneven + q)
        return even, uneven

    def eval(self, wo, wi, mode="radiance"):
        even, uneven = self.lobes(wo, wi)
        return ops.where(lit(wo, wi), (self.a * even + self.b * uneven) * tilted(wo, wi), 0.0)

    def pdf(self, wo, wi):
        even, uneven = self.lobes(wo, wi)
        return ops.where(lit(wo, wi), even + uneven, 0.0)

    def sample(self, wo, u, mode="radiance"):
        k = ops.minimum(ops.floor(7.0 * u.x), 6.0) - 3.0
        axis = frame.reflect(frame.rotate(wo, self.rotation), self.facet(k))
        wi = frame.rotate_back(to_frame(axis, vmf_direction(u.y, u.z, self.kappa)), self.rotation)
        return drawn(self, wo, wi, mode)


class R1HeavyTail(go.BSDF):
    """A lobe about the mirrored direction that is needle-sharp and has a tail over the whole sphere: (1 + s v)^-2."""

    ks: go.Colour = go.spectrum(1.0, "reflectance", low=0.0, high=1.0)
    sharpness: go.Number = go.number(5e3, "s", low=1e-3, high=1e5)

    def density(self, wo, wi):
        v = versine(wi, frame.mirror(wo))
        return (1.0 + 2.0 * self.sharpness) * (0.25 * ops.inv_pi) / ops.sqr(1.0 + self.sharpness * v)

    def eval(self, wo, wi, mode="radiance"):
        return self.ks * ops.where(lit(wo, wi), self.density(wo, wi) * tilted(wo, wi), 0.0)

    def pdf(self, wo, wi):
        return ops.where(lit(wo, wi), self.density(wo, wi), 0.0)

    def sample(self, wo, u, mode="radiance"):
        v = ops.minimum(2.0 * u.y / (1.0 + 2.0 * self.sharpness * (1.0 - u.y)), 2.0)
        return drawn(self, wo, to_frame(frame.mirror(wo), about(v, u.z)), mode)


SOUND = [
    R1VmfMirror, R1FlatCap, R1Halo, R1TiltedFacets, R1RidgeMirror, R1HenyeyLobe, R1Kaleidoscope, R1Fan, R1HeavyTail,
]  # fmt: skip
