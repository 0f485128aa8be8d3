"""Mistakes that show only for some colors, pairs of widths or random numbers, and right materials that look strange."""

from __future__ import annotations

from typing import Any, ClassVar

import gonio as go
from gonio import ops
from gonio.material import BSDF, number, spectrum
from gonio.material.parameters import Value
from gonio.ops import dot, inv_pi, maximum, minimum, sqr, vec3, where


def lit(wo: Any, wi: Any) -> Any:
    return (wo.z > 0.0) & (wi.z > 0.0)


class Matte(BSDF):
    """albedo / pi, sampled by the cosine."""

    caught_by: ClassVar[str] = ""

    albedo: Value = spectrum(0.7, "albedo", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return self.albedo * where(lit(wo, wi), wi.z * inv_pi, 0.0)

    def pdf(self, wo: Any, wi: Any) -> Any:
        return where(lit(wo, wi), wi.z * inv_pi, 0.0)

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        return self.sample_cosine(wo, u, mode)


# --------------------------------------------------------------------------- colors


class GreenOfTheDifference(Matte):
    """Green gains half the difference of green and red."""

    caught_by = "energy"

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        r, g, b = ops.channels(self.albedo)
        return vec3(r, g + 0.5 * ops.abs(g - r), b) * where(lit(wo, wi), wi.z * inv_pi, 0.0)


class OverRed(Matte):
    """The weight is divided by red and multiplied by it again."""

    caught_by = "positivity"

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        s = self.sample_cosine(wo, u, mode)
        red = ops.channels(self.albedo)[0]
        return s._replace(weight=s.weight * (red / red))


class NoPdfWithoutRed(Matte):
    """Where red is 0, the pdf is."""

    caught_by = "pdf"

    def pdf(self, wo: Any, wi: Any) -> Any:
        return where(lit(wo, wi) & (ops.channels(self.albedo)[0] > 0.0), wi.z * inv_pi, 0.0)


class MeanInTheWeight(Matte):
    """The weight is the mean of the color."""

    caught_by = "weight"

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        s = self.sample_cosine(wo, u, mode)
        return s._replace(weight=where(s.pdf > 0.0, ops.mean(self.albedo), 0.0) * vec3(1.0, 1.0, 1.0))


class MaximumInTheWeight(MeanInTheWeight):
    """The weight is the largest channel."""

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        s = self.sample_cosine(wo, u, mode)
        return s._replace(weight=where(s.pdf > 0.0, ops.max_component(self.albedo), 0.0) * vec3(1.0, 1.0, 1.0))


class RedAndBlueExchangedInSample(MeanInTheWeight):
    """BGR in `sample`, RGB in `eval`."""

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        s = self.sample_cosine(wo, u, mode)
        r, g, b = ops.channels(s.weight)
        return s._replace(weight=vec3(b, g, r))


class SaturationBrightens(GreenOfTheDifference):
    """A boost by the saturation, so that vivid paint glows."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        r, g, b = ops.channels(self.albedo)
        spread = maximum(maximum(r, g), b) - minimum(minimum(r, g), b)
        return self.albedo * (1.0 + 0.3 * spread) * where(lit(wo, wi), wi.z * inv_pi, 0.0)


class NegativeComplement(Matte):
    """A tint that subtracts a tenth of the other channels."""

    caught_by = "positivity"

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        r, g, b = ops.channels(self.albedo)
        color = vec3(r - 0.1 * (g + b) + 0.2 * r, g, b)
        return color * where(lit(wo, wi), wi.z * inv_pi, 0.0) * 0.8


class SheenAlone(Matte):
    """Diffuse and sheen share a budget, which holds where both are white, and is exceeded by sheen alone."""

    caught_by = "energy"

    sheen: Value = spectrum(0.2, "sheen", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        alone = 1.2 * self.sheen * (1.0 - self.albedo)
        total = self.albedo * (1.0 - self.sheen) + alone + self.sheen * self.albedo
        return total * where(lit(wo, wi), wi.z * inv_pi, 0.0)


# --------------------------------------------------------------------------- random numbers


class FirstNumberZero(Matte):
    """u.y = 0 returns density 1."""

    caught_by = "weight"

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        s = self.sample_cosine(wo, u, mode)
        return s._replace(pdf=where((u.y == 0.0) & (s.pdf > 0.0), 1.0, s.pdf))


class LastNumberShort(FirstNumberZero):
    """The last u.x chooses no lobe, and the direction keeps half its length."""

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        s = self.sample_cosine(wo, u, mode)
        return s._replace(wi=where(u.x > 0.9999998, 0.5 * s.wi, s.wi))


class LastAzimuthBright(FirstNumberZero):
    """The last u.z has a weight of 2."""

    def sample(self, wo: Any, u: Any, mode: Any = "radiance") -> Any:
        s = self.sample_cosine(wo, u, mode)
        return s._replace(weight=where(u.z > 0.9999998, 2.0 * s.weight, s.weight))


# --------------------------------------------------------------------------- pairs of widths


class Facets(BSDF):
    """GGX with height-correlated masking, sampled by a guide."""

    caught_by: ClassVar[str] = ""

    alpha: Value = go.width(0.4, "width")

    def _area(self, x: Any, y: Any) -> Any:
        return x * y

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        x, y = maximum(self.alpha.x, 0.02), maximum(self.alpha.y, 0.02)
        m = ops.normalize(wo + wi)
        D = inv_pi / (self._area(x, y) * sqr(sqr(m.x / x) + sqr(m.y / y) + sqr(m.z)))

        def masked(w: Any) -> Any:
            return 0.5 * (ops.safe_sqrt(1.0 + (sqr(x * w.x) + sqr(y * w.y)) / maximum(sqr(w.z), 1e-12)) - 1.0)

        value = D / ((1.0 + masked(wo) + masked(wi)) * 4.0 * maximum(wo.z, 1e-6))
        return vec3(0.9, 0.8, 0.5) * where(lit(wo, wi), value, 0.0)


class AreaOfOneWidth(Facets):
    """D is divided by alpha_y^2, so that it is right for one width only."""

    caught_by = "energy"

    def _area(self, x: Any, y: Any) -> Any:
        return y * y


# --------------------------------------------------------------------------- right ones


class Toon(Matte):
    """Five steps of the cosine of the half vector."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        m = ops.normalize(wo + wi)  # nan at wi = -wo
        return super().eval(wo, wi, mode) * where(m.z > 0.0, -0.2 * ops.floor(-5.0 * ops.clamp(m.z, 0.0, 1.0)), 0.0)


class BlackRing(Matte):
    """Black where the half vector lies in a ring of one degree."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        m = ops.normalize(wo + wi)
        return super().eval(wo, wi, mode) * where((m.z < 0.93667) | (m.z > 0.94264), 1.0, 0.0)


class Sectors(BSDF):
    """Alternate sectors of 45 degrees of the azimuth between the two; only an `eval`."""

    caught_by: ClassVar[str] = ""

    albedo: Value = spectrum(0.7, "albedo", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        cos, sin = wo.x * wi.x + wo.y * wi.y, wo.x * wi.y - wo.y * wi.x
        even = sqr(cos * cos - sin * sin) > sqr(2.0 * cos * sin)
        return self.albedo * where(lit(wo, wi) & even, wi.z * inv_pi, 0.0)


class Sheet(Matte):
    """Red above, blue below."""

    @property
    def back_differs(self) -> bool:
        return True

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        color = where(wo.z > 0.0, vec3(0.9, 0.2, 0.2), vec3(0.2, 0.2, 0.9)) * self.albedo
        return color * where(wo.z * wi.z > 0.0, ops.abs(wi.z) * inv_pi, 0.0)

    def pdf(self, wo: Any, wi: Any) -> Any:
        return where(wo.z * wi.z > 0.0, ops.abs(wi.z) * inv_pi, 0.0)


class Hot(Matte):
    """Retro-reflects a little more; weights by parity of a checkerboard of azimuths."""

    gain: Value = number(0.3, "of the retro-reflection", low=0.0, high=0.4)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        back = maximum(dot(wo, wi), 0.0)
        return super().eval(wo, wi, mode) * (0.6 + self.gain * sqr(sqr(sqr(back))))


class ChannelsApart(Matte):
    """Each channel reflects in another range of half angles."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        z = ops.normalize(wo + wi).z
        bands = vec3(where(z > 0.9, 1.0, 0.1), where((z > 0.7) & (z <= 0.95), 1.0, 0.1), where(z <= 0.8, 1.0, 0.1))
        return super().eval(wo, wi, mode) * bands


class Dimmest(Matte):
    """A thousandth of the light at grazing half angles; nearly black elsewhere."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return super().eval(wo, wi, mode) * (1e-3 + 0.5 * sqr(1.0 - wo.z) * sqr(1.0 - wi.z))


THIRD = [v for v in vars().values() if isinstance(v, type) and issubclass(v, BSDF) and v.__module__ == __name__]
