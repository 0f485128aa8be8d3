"""A clear or colored coat over any material that reflects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Self

from ... import ops
from ...errors import InputError
from ...material import (
    BSDF,
    Colour,
    KnownViolation,
    Limit,
    Member,
    Number,
    Sample,
    Width,
    binding,
    bsdf,
    choice,
    method,
    number,
    spectrum,
    tree,
)
from ...material import width as width_parameter
from ...material.bsdf import Delta
from ...material.parameters import has_two_values
from ...ops import Direction, Mode, Pair, Scalar, Spectrum, clamp, exp, function, inv_pi, maximum, mean, sqr, where
from ...optics import frame, fresnel
from ...optics.fresnel import exact
from ...optics.roughness import widths
from ...optics.warp import square_to_cosine_hemisphere
from ..microfacet import microfacet  # fmt: skip
from ..microfacet.dielectric import Dielectric
from .interior import LayerTables, colour_of, colour_place, left_place, tables_of

BOUNCES = {
    "coloured": "the base color is applied at each bounce, so the result is darker and more saturated than the base",
    "white": "the base color is applied once, as in most renderers, and is the color of the coated material",
}
ALMOST_ONE = 0.99999994  # the largest float32 below 1


class Coat(BSDF):
    """A dielectric layer over a base. Light is reflected at the top surface, or it is refracted, absorbed along its
    slanted path through the layer, scattered by the base, and reflected between base and top surface until it leaves.

    f = f_top + T(o) T(i) t(o') t(i') / eta^2 g f_base(o', i') + rest(o) rest(i) / norm

    f_top is the BRDF of the top surface, R its albedo, and T = 1 - R its transmittance; o' and i' are the directions
    refracted into the coat; t = exp(-absorption depth / cos) is the transmittance of one crossing along these
    directions; and 1 / eta^2, with eta = `index`, accounts for the change of solid angle. Light that bounces more than
    once is represented by a factor g on the lobe of the base and by the separable lobe rest(o) rest(i) / norm (see
    `interior.py`). This is exact over a Lambertian base; over a metal, the albedo of each channel is exact. The model
    is reciprocal, and a clear coat on a white base loses no light.

    With `bounces="white"`, g and rest are those of a white base: the coated material reflects R plus (1 - R) times the
    color of the base, which therefore becomes neither darker nor more saturated.

    The base is embedded in the coat, so its refractive index is relative to that of the coat. A rough top surface
    reflects like rough glass, with albedo R, but does not blur refracted light. g and rest are read from tables that
    are computed on first use. If the top surface is anisotropic and the lobe of the base is narrow, the albedo may be 2
    % too large. The colors of the base and the absorption and depth of the coat may vary over the surface, because they
    are axes of the tables. All other parameters must be uniform, and derivatives with respect to them omit the change
    of the tables.
    """

    limits: ClassVar[tuple[Limit, ...]] = (Limit({"index": 1.0, "absorption": 0.0}, equals=lambda one: one.base),)
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": KnownViolation(
            "the reflectance and transmittance of a rough top are tabulated from samples, with limited accuracy",
            lambda model: _gain(model),
            certain=False,
        ),
    }
    base: BSDF = bsdf("the material under the coat; it must not transmit")
    index: Number = number(default=1.5, doc="refractive index of the coat, relative to the outside", low=1.0, high=3.0)
    alpha: Width = width_parameter(
        default=0.0, doc="width of the microfacet distribution of the top surface; 0 is smooth"
    )
    absorption: Colour = spectrum(
        default=0.0, doc="absorption coefficient; a crossing transmits exp(-absorption depth)", low=0.0
    )
    depth: Number = number(default=1.0, doc="thickness of the coat", low=0.0)
    ndf: Member = microfacet.ndf_choice()
    masking: Member = microfacet.masking_choice()
    bounces: str = choice("coloured", "how light that bounces between coat and base is colored", BOUNCES)

    def __post_init__(self) -> None:
        super().__post_init__()
        name = type(self.base).__name__
        if self.base.transmits:
            raise InputError(f"{name} transmits, a material that only reflects expected", "Coat.base")
        base = tree.plain_values(self.base)  # a width may be a Dr.Jit number, which facts do not read
        if base.delta == "maybe" or base.stochastic:
            why = "is a mirror in places" if base.delta == "maybe" else "is random"
            hint = "give it a width everywhere, or make all of it a mirror"
            raise InputError(f"{name} {why}, one finite lobe or one mirror expected", "Coat.base", hint)
        if base.delta == "always" and microfacet.delta_of(self.alpha) != "always":
            hint = "a narrow base, alpha = 0.01, under a rough coat; or a smooth coat"
            raise InputError("a rough coat over a perfect mirror, which it would blur", "Coat.alpha", hint)
        fixed = self.fixed
        for leaf in tree.leaves(self):
            if leaf.path in fixed and leaf.value is not None and leaf.parameter.rows(leaf.value) > 1:
                what = f"{leaf.path} varies from ray to ray, but tables are computed from it once"
                hint = "colors of the base may vary, and the coat's own absorption and depth"
                raise InputError(what, f"Coat.{leaf.path}", hint)

    # ------------------------------------------------------------------ properties of the interior

    def prepare(self) -> None:
        """Compute the tables, before a loop is recorded."""
        tables_of(self.plain)

    @property
    def _tables(self) -> LayerTables:
        return tables_of(self.plain)

    @property
    def _mirror(self) -> bool:
        """Whether the base is a mirror, for which the series has a closed form."""
        return self.plain.base.delta == "always"

    @property
    def _top(self) -> Dielectric:
        """The outer interface, as glass that only reflects."""
        kind = Dielectric(transmission=False, ndf=self.ndf, masking=self.masking)
        one = ops.ones_like(self.absorption)
        return binding.bound_copy(kind, {"eta": self.index, "alpha": self.alpha, "rotation": None, "albedo": one})

    # ------------------------------------------------------------------ formulas

    @function
    def _through(self, w: Direction) -> Scalar:
        """The top's factor on the base's lobe for one direction: T by Fresnel's equations, or from the table if it is
        rough."""
        _, smooth = widths(self.alpha)
        return where(smooth, self._sharp(w), self._at(w)[2])

    @function
    def _sharp(self, w: Direction) -> Scalar:
        """T of a smooth top, by Fresnel's equations; 1 - R would lose all digits at grazing angles."""
        cos = ops.abs(w.z)
        cos_t = fresnel.cos_transmitted(cos, self.index)
        return exact.transmittance(cos, cos_t, self.index)

    def _at(self, w: Direction) -> tuple[Scalar, ...]:
        """The entry of the coat's table for a direction outside."""
        table = self._tables.coat
        at = ops.inset(ops.sqrt(ops.abs(w.z)), table.shape[0])
        return ops.lookup(table, at)

    @function
    def _inside(self, w: Direction) -> Direction:
        """The refracted direction, pointing away from the base."""
        over = 1.0 / self.index
        return ops.vec3(w.x * over, w.y * over, ops.safe_sqrt(1.0 - frame.sin2(w) * sqr(over)))

    @function
    def _crossed(self) -> Spectrum:
        """u: transmittance of one crossing at normal incidence."""
        return exp(self.absorption * (-self.depth))

    @function
    def _left(self, inner: Direction) -> Spectrum:
        """t: transmittance of a crossing along a direction inside."""
        return exp(self.absorption * (-self.depth / maximum(inner.z, 1e-4)))

    def _colour(self, w: Direction) -> Spectrum:
        """a: the color applied to the base's light at each bounce."""
        white = ops.ones_like(self.absorption)
        up = ops.vec3(ops.zeros_like(w.z), ops.zeros_like(w.z), ops.ones_like(w.z))
        return clamp(colour_of(self.base, up) * white, 0.0, 1.0)

    def _bounced_again(self, a: Spectrum, wo: Direction, wi: Direction) -> tuple[Spectrum, Spectrum]:
        """The factor g on the base's lobe, and the separable lobe, for bounces between the coat and a base of color
        a."""
        bounce_color = ops.ones_like(a) if self.bounces == "white" else a
        u = self._crossed() + ops.zeros_like(a)
        tables, ends = self._tables, [ops.sqrt(ops.abs(w.z)) for w in (wo, wi)]
        factors, rests = [], []
        for colour, left in zip(ops.channels(colour_place(bounce_color)), ops.channels(left_place(u)), strict=True):
            place = [ops.inset(x, n) for x, n in zip((colour, left), tables.bounced.shape, strict=True)]
            over_factor, norm = ops.lookup(tables.bounced, *place)
            factors.append(1.0 / over_factor)
            if tables.rest is not None:
                at_o, at_i = (ops.lookup(tables.rest, ops.inset(end, tables.rest.shape[0]), *place)[0] for end in ends)
                rests.append(at_o * at_i * ops.safe_div(1.0, norm))
        rest = ops.of_channels(a, rests) * a * sqr(u) if rests else ops.zeros_like(a)
        return ops.of_channels(a, factors), rest

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """The top's lobe and the base's light, times cos theta_i."""
        if self._mirror:
            return self._top.eval(wo, wi, mode)
        above = (wo.z > 0.0) & (wi.z > 0.0)
        top = self._top.eval(wo, wi, mode) + self._at(wo)[3] * self._at(wi)[3] * wi.z
        o, i = self._inside(wo), self._inside(wi)
        factor, rest = self._bounced_again(self._colour(wo), wo, wi)
        crossed = self._left(o) * self._left(i) * (self._through(wo) * self._through(wi) / sqr(self.index))
        lobe = self.base.eval(o, i, mode) * (wi.z / maximum(i.z, frame.TINY))
        return where(above, top + lobe * crossed * factor + rest * wi.z, 0.0)

    @function
    def _shares(self, wo: Direction) -> Pair:
        """The probability of sampling light from below the top and, in this case, that of sampling the cosine. The
        cosine samples the separable lobe and replaces samples of the base that would fail because of total
        reflection."""
        reflected, even, _, beyond = self._at(wo)
        _, smooth = widths(self.alpha)
        cos = ops.abs(wo.z)
        sharp = fresnel.kind("exact").dielectric(cos, fresnel.cos_transmitted(cos, self.index), self.index)
        through = where(smooth, self._sharp(wo), 1.0 - reflected)
        reflected = where(smooth, sharp, reflected)
        inner = self._inside(wo)
        tint = clamp(self.base.tint(inner) * ops.ones_like(self.absorption), 0.0, 1.0)
        below = through * mean(self._left(inner) * tint) + 2.0 * beyond
        under = clamp((below + 1e-3) / (reflected + below + 1e-3), 0.02, 0.98)  # continuous at a black base
        cosine = ops.zeros_like(even) if self._mirror else even
        return ops.vec2(under, cosine)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The mixture of the top's lobe, the cosine, and the base's refracted density."""
        shares = self._shares(wo)
        above = (wo.z > 0.0) & (wi.z > 0.0)
        top = self._top.pdf(wo, wi)
        if self._mirror:
            return ops.zeros_like(top)
        o, i = self._inside(wo), self._inside(wi)
        base = self.base.pdf(o, i) * wi.z / (sqr(self.index) * maximum(i.z, frame.TINY))
        below = shares.y * wi.z * inv_pi + (1.0 - shares.y) * base
        return where(above, (1.0 - shares.x) * top + shares.x * below, 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """u.x selects the top, the cosine or the base; a base sample that is totally reflected is a failed sample."""
        shares = self._shares(wo)
        over, by_base = 1.0 - shares.x, 1.0 - shares.y
        on_top = u.x >= shares.x
        first = ops.minimum(ops.safe_div(u.x, shares.x), ALMOST_ONE)
        by_cosine = first < shares.y
        second = ops.minimum(ops.safe_div(first - shares.y, by_base), ALMOST_ONE)
        o = self._inside(wo)
        s_top = self._top.sample(wo, u, mode)
        s_base = self.base.sample(where(wo.z > 0.0, o, -o), ops.vec3(maximum(second, 0.0), u.y, u.z), mode)
        # out of the coat: tangential components are multiplied by eta
        x, y = s_base.wi.x * self.index, s_base.wi.y * self.index
        height2 = 1.0 - (sqr(x) + sqr(y))
        leaves = (height2 > 0.0) & (s_base.wi.z > 0.0) & (s_base.pdf > 0.0)
        refracted = ops.vec3(where(leaves, x, 0.0), where(leaves, y, 0.0), where(leaves, ops.safe_sqrt(height2), -1.0))
        if self._mirror:
            refracted, leaves = frame.mirror(wo), s_base.pdf > 0.0
        cosine = square_to_cosine_hemisphere(u.y, u.z)
        wi = where(on_top, s_top.wi, where(by_cosine, cosine, refracted))
        from_top = on_top & s_top.delta
        from_base = ~on_top & ~by_cosine & s_base.delta & leaves
        delta = from_top | from_base
        density = self.pdf(wo, wi)
        weight = self.eval(wo, wi, mode) * ops.safe_div(1.0, density)
        weight = where(from_top, s_top.weight / over, weight)
        ideal = where(from_top, over * s_top.pdf, shares.x * by_base * s_base.pdf)
        if self._mirror:
            weight = where(from_base, s_base.weight * self._bounced(wo, o), weight)
            weight = where(from_base, weight * ops.safe_div(1.0, shares.x), weight)
        pdf = where((wo.z > 0.0) & (wi.z > 0.0), where(delta, ideal, density), 0.0)
        return Sample(wi, where(pdf > 0.0, weight, 0.0), pdf, delta & (pdf > 0.0), ops.ones_like(pdf))

    @function
    def _bounced(self, wo: Direction, inner: Direction) -> Spectrum:
        """T^2 t^2 / (1 - a k) for a mirror of color a, with k = (1 - T) t^2."""
        through, left2 = self._through(wo), sqr(self._left(inner))
        k = (1.0 - through) * left2
        tint = self.base.tint(inner)
        return sqr(through) * left2 / (1.0 - (k if self.bounces == "white" else k * tint))

    def lossless(self) -> Self:
        """The coat over the lossless variant of the base, without absorption."""
        white = self.base.lossless()
        values = {"base": white, "absorption": self.absorption * 0.0 if self.is_bound else 0.0}
        return binding.bound_copy(self, values) if self.is_bound else tree.rebuild(self, values)

    @property
    def fixed(self) -> frozenset[str]:
        """The parameters on which the tables depend: all but colors of the base and the coat's absorption and depth."""
        numeric = [leaf for leaf in tree.leaves(self.plain.base) if leaf.parameter.numeric]
        return frozenset({"index", "alpha"} | {f"base.{leaf.path}" for leaf in numeric if leaf.parameter.white is None})

    def tint(self, wo: Direction) -> Spectrum:
        """R plus the tint of the base, attenuated by the coat."""
        through = self._through(wo)
        return (1.0 - through) + through * sqr(self._left(self._inside(wo))) * self.base.tint(self._inside(wo))

    @property
    def delta(self) -> Delta:
        top = microfacet.delta_of(self.plain.alpha)
        return "always" if self._mirror else "never" if top == "never" else "maybe"


def _gain(model: Coat) -> float:
    """The largest gain in a white furnace. For an anisotropic top, it is the gain measured at 15 random settings (index
    from 1.1 to 2.5, widths of the top from 0.0015 to 0.5, width of the base below 0.02) plus a third of it."""
    if microfacet.delta_of(model.alpha) == "always":
        return 0.0
    return 0.03 if has_two_values(model.alpha) else 0.004
