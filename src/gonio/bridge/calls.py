"""Compare the results of the calls that Mitsuba's integrators make with those of eval, pdf and sample.

Path tracers read the flags, call `eval_pdf` and `eval_pdf_sample`, disable lanes with `active`, and request single
components and types; denoisers call `eval_diffuse_reflectance`. If a plugin implements one of these methods separately,
it may contain an error although the other methods pass every test.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from .answers import Answer
from .types import BSDFContext, BSDFPlugin, BSDFSample, OfVariant, SurfaceInteraction

COUNT = 4096
SAME = 1e-4  # relative tolerance, because of float32 rounding and differently fused kernels
SIGMAS = 6.0  # number of standard deviations beyond which a difference of two means is not due to chance
LEAST = 0.02  # smallest difference of means that is reported
FEW = 0.002  # fraction of rows that rounding errors may move across a discontinuity


def answers(bsdf: BSDFPlugin, si: SurfaceInteraction, seed: int) -> Iterator[Answer]:
    """The result of every call at a surface interaction.

    si    the surface interaction, with COUNT lanes; its `wi` is replaced
    seed  seed of the random directions
    """
    trial = _Trial(bsdf, si, seed)
    for what, asked in (
        ("eval_pdf", trial.eval_pdf),
        ("eval_pdf_sample", trial.eval_pdf_sample),
        ("active", trial.active),
        ("flags", trial.flags),
        ("components", trial.components),
        ("types", trial.types),
        ("shading frame", trial.rotated_frame),
        ("texture coordinates", trial.textured),
        ("eval_null_transmission", trial.null_transmission),
        ("eval_diffuse_reflectance", trial.diffuse_reflectance),
    ):
        trial.difference = None
        wrong = asked()
        if wrong and what in BY_PATH_TRACERS and trial.difference is not None:
            yield trial.difference.answer(what, wrong)
        else:
            yield Answer(what, wrong)


# The calls of path tracers, in which an error changes pictures
BY_PATH_TRACERS = ("eval_pdf", "eval_pdf_sample", "shading frame")


class _Difference(NamedTuple):
    """Two sets of values that should be equal, (N, channels), their names, and the directions, (N, 3)."""

    name: str
    other: str
    got: np.ndarray
    expected: np.ndarray
    wo: np.ndarray
    wi: np.ndarray

    def answer(self, what: str, wrong: str) -> Answer:
        total = float(np.sum(np.abs(self.expected)))
        off = np.nan_to_num(np.abs(self.got - self.expected), nan=0.0)
        share = float(np.sum(off)) / total if total > 0.0 else 1.0
        worst = float(np.max(off / np.maximum(np.abs(self.expected), 1e-3 * np.abs(self.expected).max()), initial=0.0))
        # Mitsuba's wi points toward the viewer
        return Answer(what, wrong, share, worst, (self.name, self.other, self.wi, self.wo, self.got, self.expected))


class _Trial:
    """A plugin and its values at COUNT pairs of directions."""

    def __init__(self, bsdf: BSDFPlugin, si: SurfaceInteraction, seed: int) -> None:
        self.bsdf, self.si, self.ctx = bsdf, si, mi.BSDFContext()
        self.difference: _Difference | None = None
        rng = np.random.default_rng([seed, 111])
        wi, wo = _uniform(rng), _uniform(rng)
        half = COUNT // 2
        wo[:half, 2] = np.copysign(wo[:half, 2], wi[:half, 2])
        u = rng.random((3, COUNT), dtype=np.float32)
        self.wo, self.u = _vector(wo), (mi.Float(u[0]), mi.Point2f(u[1], u[2]))
        si.wi = _vector(wi)
        # In half of the pairs, wo is sampled by the plugin, in order to cover narrow lobes.
        drawn, _ = bsdf.sample(self.ctx, si, *self.u)
        usable = (np.arange(COUNT) % 2 == 0) & (np.abs(np.linalg.norm(_rows(drawn.wo), axis=1) - 1.0) < 1e-3)
        self.wo = _vector(np.where(usable[:, None], _rows(drawn.wo), wo))
        self.value = self.color(bsdf.eval(self.ctx, si, self.wo))
        self.pdf = _rows(bsdf.pdf(self.ctx, si, self.wo))
        self.drawn, weight = bsdf.sample(self.ctx, si, *self.u)
        self.weight = self.color(weight)
        self.lit = np.any(self.weight > 0.0, axis=1)
        self.delta = _is_delta(self.drawn)
        self.noisy = not np.array_equal(self.value, self.color(bsdf.eval(self.ctx, si, self.wo)))

    @staticmethod
    def color(value: object) -> np.ndarray:
        return _rows(mi.unpolarized_spectrum(value))

    # ------------------------------------------------------------------ the calls

    def eval_pdf(self) -> str:
        value, pdf = self.bsdf.eval_pdf(self.ctx, self.si, self.wo)
        return self.unlike("eval_pdf's value", "eval", self.color(value), self.value) or self.unlike(
            "eval_pdf's pdf", "pdf", _rows(pdf), self.pdf
        )

    def eval_pdf_sample(self) -> str:
        value, pdf, bs, weight = self.bsdf.eval_pdf_sample(self.ctx, self.si, self.wo, *self.u)
        pairs = {
            "its value": ("eval", self.color(value), self.value),
            "its pdf": ("pdf", _rows(pdf), self.pdf),
            "its weight": ("sample's", self.color(weight), self.weight),
            "its wo": ("sample's", _rows(bs.wo)[self.lit], _rows(self.drawn.wo)[self.lit]),
            "its sampled pdf": ("sample's", _rows(bs.pdf)[self.lit], _rows(self.drawn.pdf)[self.lit]),
        }
        return next((w for k, (of, a, b) in pairs.items() if (w := self.unlike(k, of, a, b))), "")

    def active(self) -> str:
        live = np.arange(COUNT) % 2 == 0
        mask = mi.Bool(live)
        value, pdf = (self.bsdf.eval(self.ctx, self.si, self.wo, mask), self.bsdf.pdf(self.ctx, self.si, self.wo, mask))
        both = self.bsdf.eval_pdf(self.ctx, self.si, self.wo, mask)
        _, weight = self.bsdf.sample(self.ctx, self.si, *self.u, mask)
        asked = {
            "eval": (self.color(value), self.value),
            "pdf": (_rows(pdf), self.pdf),
            "eval_pdf's value": (self.color(both[0]), self.value),
            "eval_pdf's pdf": (_rows(both[1]), self.pdf),
            "sample's weight": (self.color(weight), self.weight),
        }
        for name, (got, expected) in asked.items():
            # Many of Mitsuba's own plugins do not mask the pdf and weight of inactive lanes; integrators ignore them.
            if name.startswith("eval") and "pdf's pdf" not in name and np.any(got[~live] != 0.0):
                return f"{name} of inactive lanes is {np.abs(got[~live]).max():.4g}, 0 expected"
            wrong = self.unlike(f"{name} of the other lanes", "what it is with all lanes on", got[live], expected[live])
            if wrong:
                return wrong
        return ""

    def flags(self) -> str:
        flags, all_ = mi.BSDFFlags, int(self.bsdf.flags())
        count = self.bsdf.component_count()
        parts = [int(self.bsdf.flags(k)) for k in range(count)]
        kinds = int(flags.All) if hasattr(flags, "All") else 0x1FF
        together = 0
        for part in parts:
            together |= part
        if count and (together & kinds) != (all_ & kinds):
            return f"flags() names {_names(all_)}, its components {_names(together)}"
        sampled = np.broadcast_to(np.asarray(self.drawn.sampled_type.numpy()), COUNT)
        strange = self.lit & ((sampled & (kinds & ~all_)) != 0)
        if strange.any():
            return f"samples of type {_names(int(sampled[strange][0]) & ~all_)}, which flags() does not name"
        if np.any(self.lit & (sampled == 0)):
            return "samples that carry light but have no type"
        eta = np.broadcast_to(np.asarray(self.drawn.eta.numpy()), COUNT)
        if np.any(self.lit & ~(np.isfinite(eta) & (eta > 0.0))):
            return f"a sample's eta is {eta[self.lit].min():.4g}: path tracers multiply radiance by its square"
        component = np.broadcast_to(np.asarray(self.drawn.sampled_component.numpy()), COUNT)
        if count and np.any(self.lit & (component >= count)):
            most = int(component[self.lit].max())
            return f"sampled_component is {most}, which is out of range, since component_count is {count}"
        wi = np.broadcast_to(_rows(self.si.wi)[:, 2], COUNT)
        across = wi * _rows(self.wo)[:, 2] < 0.0
        transmits = all_ & (int(flags.Transmission) | int(flags.Null))
        lit = np.any(self.value > 1e-6 * max(float(self.value.max(initial=0.0)), 1e-6), axis=1)
        if not transmits and np.any(lit & across):
            return "light is transmitted, but no flag declares transmission"
        beyond = wi * _rows(self.drawn.wo)[:, 2] < 0.0
        said = (sampled & (int(flags.Transmission) | int(flags.Null))) > 0
        either = (sampled & int(flags.Reflection)) > 0  # the lobes of hair cover both sides
        strange = self.lit & (said != beyond) & (np.abs(wi) > 1e-3) & ~(said & either)
        if strange.any():
            row = int(np.argmax(strange))
            side = "crosses the surface" if beyond[row] else "stays on its side"
            return f"a sample of type {_names(int(sampled[row]))} {side}"
        smooth = self.lit & ~self.delta
        result = self.bsdf.pdf(self.ctx, self.si, self.drawn.wo)
        if smooth.sum() > 20 and np.mean(_rows(result)[smooth] > 0.0) < 0.5:
            return "samples of a type other than delta, whose pdf is 0"
        if self.delta.any() and (self.delta & self.lit).sum() > 20 and not all_ & (int(flags.Delta) | int(flags.Null)):
            return "delta samples, but no flag declares them"
        if not self.delta.any() and not (self.value > 0.0).any() and all_ & int(flags.Smooth) and self.lit.any():
            return "a flag declares a smooth lobe, but eval is 0 everywhere"
        return ""

    def components(self) -> str:
        count = self.bsdf.component_count()
        if count == 0:
            return "no component is declared"
        contexts = []
        for k in range(count):
            ctx = mi.BSDFContext()
            ctx.component = k
            contexts.append((f"component {k}", ctx, k))
        return self.parts(contexts, "the components")

    def types(self) -> str:
        contexts = []
        flags = mi.BSDFFlags
        for name in ("Reflection", "Transmission"):
            ctx = mi.BSDFContext()
            ctx.type_mask = int(getattr(flags, name))
            contexts.append((name.lower(), ctx, None))
        if int(self.bsdf.flags()) & int(flags.Null):
            return ""  # null interactions are neither
        return self.parts(contexts, "reflection and transmission")

    def rotated_frame(self) -> str:
        """Whether values remain the same if the surface and its tangents are rotated, because directions are local."""
        frame = mi.Frame3f(mi.Vector3f(0.48, 0.6, 0.64), mi.Vector3f(-0.8, 0.6, 0.0), mi.Vector3f(-0.36, -0.48, 0.8))
        frame = mi.Frame3f(dr.normalize(dr.cross(frame.t, frame.n)), frame.t, frame.n)
        si = mi.SurfaceInteraction3f(self.si)
        si.n, si.sh_frame, si.dp_du, si.dp_dv = (mi.Normal3f(frame.n), frame, frame.s, frame.t)
        bs, weight = self.bsdf.sample(self.ctx, si, *self.u)
        value = self.color(self.bsdf.eval(self.ctx, si, self.wo))
        return (
            self.unlike("eval on a rotated surface", "the original eval", value, self.value)
            or self.unlike("pdf on a rotated surface", "pdf", _rows(self.bsdf.pdf(self.ctx, si, self.wo)), self.pdf)
            or self.unlike("the weight on a rotated surface", "the original weight", self.color(weight), self.weight)
            or self.unlike("a sample's wo on a rotated surface", "the original", _rows(bs.wo), _rows(self.drawn.wo))
        )

    def textured(self) -> str:
        """Whether sample, eval and pdf read the same textures at other texture coordinates."""
        si = mi.SurfaceInteraction3f(self.si)
        uv = np.random.default_rng(112).random((2, COUNT), dtype=np.float32)
        si.uv = mi.Point2f(uv[0], uv[1])
        bs, weight = self.bsdf.sample(self.ctx, si, *self.u)
        smooth = ~_is_delta(bs) & np.any(self.color(weight) > 0.0, axis=1)
        if smooth.sum() < 20:
            return ""
        density = _rows(bs.pdf)[smooth]
        value = self.color(self.bsdf.eval(self.ctx, si, bs.wo))[smooth]
        pdf = _rows(self.bsdf.pdf(self.ctx, si, bs.wo))[smooth]
        return self.unlike("a sample's pdf", "pdf with other si.uv", density, pdf) or self.unlike(
            "weight x pdf", "eval with other si.uv", self.color(weight)[smooth] * density, value
        )

    def null_transmission(self) -> str:
        """Whether `eval_null_transmission` equals the contribution of null samples.

        Integrators call it for shadow rays through surfaces. The base class returns 0, and so do plugins that do not
        override it.
        """
        null = self.lit & (
            np.broadcast_to(np.asarray(self.drawn.sampled_type.numpy()), COUNT) & int(mi.BSDFFlags.Null) > 0
        )
        value = self.color(self.bsdf.eval_null_transmission(self.si))
        if null.sum() < 20 or not value.any():
            return ""
        carried = (self.weight * _rows(self.drawn.pdf))[null]
        return self.unlike("eval_null_transmission", "weight x pdf of null samples", value[null], carried)

    def parts(self, contexts: Sequence[tuple[str, BSDFContext, int | None]], words: str) -> str:
        """Whether components requested one by one add up to the total, and samples belong to the requested one."""
        total = np.zeros_like(self.value)
        for name, ctx, number in contexts:
            value = self.color(self.bsdf.eval(ctx, self.si, self.wo))
            both = self.color(self.bsdf.eval_pdf(ctx, self.si, self.wo)[0])
            wrong = self.unlike(f"eval_pdf's value of {name}", "eval's", both, value)
            if wrong:
                return wrong
            total += value
            bs, weight = self.bsdf.sample(ctx, self.si, *self.u)
            lit = np.any(self.color(weight) > 0.0, axis=1)
            component = np.broadcast_to(np.asarray(bs.sampled_component.numpy()), COUNT)
            if number is not None and np.any(lit & (component != number)):
                strange = int(component[lit & (component != number)][0])
                return f"{name} is requested, but sample returns component {strange}"
            wrong = self.shares(name, bs, self.color(weight)) or self.drawn_by_pdf(name, ctx, bs, self.color(weight))
            if wrong:
                return wrong
        if np.any(self.value > 0.0) or np.any(total > 0.0):
            return self.unlike(f"the sum over {words}", "eval", total, self.value)
        return ""

    def shares(self, name: str, bs: BSDFSample, weight: np.ndarray) -> str:
        """Whether weight x pdf of a delta lobe is the same if the lobe is requested alone or sampled among others."""
        delta = _is_delta(bs)
        wo, drawn = _rows(bs.wo), _rows(self.drawn.wo)
        # at grazing angles, reflected and straight directions are close together, on opposite sides of the surface
        same = (np.abs(wo - drawn).max(1) < 1e-3) & (np.sign(wo[:, 2]) == np.sign(drawn[:, 2]))
        both = delta & self.delta & same & self.lit & np.any(weight > 0.0, axis=1)
        if both.sum() < 20:
            return ""
        single, among = (weight * _rows(bs.pdf))[both], (self.weight * _rows(self.drawn.pdf))[both]
        return self.unlike(f"the light of the delta lobe of {name}", "its light among the others", single, among)

    def drawn_by_pdf(self, name: str, ctx: BSDFContext, bs: BSDFSample, weight: np.ndarray) -> str:
        """Whether samples of a requested component have the density that `pdf` returns for this component.

        The means of 1, of the cosine to the mirror direction and of its square, over directions in which the component
        reflects light, must equal those of all samples, weighted by the ratio of the densities.
        """
        if self.delta.any() or _is_delta(bs).any():
            return ""
        other = self.drawn.wo
        density, part = (_rows(self.bsdf.pdf(one, self.si, other))[:, 0] for one in (self.ctx, ctx))
        lit = np.any(self.color(self.bsdf.eval(ctx, self.si, other)) > 0.0, axis=1) & self.lit & (density > 0.0)
        ratio = np.divide(part, density, out=np.zeros(COUNT), where=lit)
        own = np.where(np.any(weight > 0.0, axis=1), 1.0, 0.0)
        mirror = _rows(self.si.wi) * np.array([-1.0, -1.0, 1.0])

        def moments(w: np.ndarray) -> np.ndarray:
            return np.stack([np.ones(COUNT), np.sum(w * mirror, axis=1), w[:, 2] ** 2], axis=1)

        first, second = own[:, None] * moments(_rows(bs.wo)), ratio[:, None] * moments(_rows(other))
        if not (np.isfinite(first).all() and np.isfinite(second).all()):
            return ""
        off = np.abs(first.mean(0) - second.mean(0))
        noise = np.sqrt((first.var(0) + second.var(0)) / COUNT)
        wrong = (off > SIGMAS * noise) & (off > LEAST)
        if wrong.any():
            row = int(np.argmax(np.where(wrong, off / np.maximum(noise, 1e-12), 0.0)))
            of = ("the number of samples", "the mean cosine to the mirror direction", "the mean cos^2")[row]
            means = f"{of} is {first.mean(0)[row]:.3g}, not {second.mean(0)[row]:.3g}"
            return f"samples of {name} alone do not follow its pdf: {means}"
        return ""

    def diffuse_reflectance(self) -> str:
        value = _rows(mi.unpolarized_spectrum(self.bsdf.eval_diffuse_reflectance(self.si)))
        if not np.all(np.isfinite(value)):
            return "not finite"
        up = mi.Vector3f(0.0, 0.0, 1.0)
        # the default of Mitsuba's base class, which exceeds 1 for glossy BSDFs
        default = np.pi * self.color(self.bsdf.eval(self.ctx, self.si, up))
        # Behind the surface, where `eval` may be 0, a plugin that forwards the call to a nested BSDF would seem to
        # implement the method itself.
        front = _rows(self.si.wi)[:, 2] > 0.0
        own = not np.allclose(value[front], default[front], rtol=1e-3, atol=1e-6)
        if own and (np.any(value < -1e-6) or np.any(value > 1.0 + 1e-3)):
            return f"from {value.min():.4g} to {value.max():.4g}, a fraction of the light expected"
        flags = mi.BSDFFlags
        if int(self.bsdf.flags()) & int(flags.All) == int(flags.DiffuseReflection) and not self.noisy:
            wi, wo = _rows(self.si.wi)[:, 2], _rows(self.wo)[:, 2]
            front = (wi > 0.1) & (wo > 0.1)
            f = np.pi * self.value[front] / wo[front, None]
            if front.sum() > 20 and np.ptp(f, axis=0).max() < 1e-3:
                return self.unlike("it", "pi times the diffuse lobe", value[front], f)
        return ""

    def unlike(self, name: str, other: str, got: np.ndarray, expected: np.ndarray) -> str:
        """A description of the difference between two sets of values; "" if there is none."""
        if self.noisy:
            return ""
        got, expected = np.broadcast_arrays(got, expected)
        fine = np.isfinite(expected).all(-1)
        least = 1e-6 * float(np.max(np.abs(expected[fine]), initial=0.0))
        size = np.maximum(np.maximum(np.abs(got), np.abs(expected)), max(least, 1e-12))
        off = np.where(fine[:, None], np.abs(got - expected) / size, 0.0)
        off = np.where(np.isnan(off), np.inf, off).max(-1)
        wrong = off > SAME
        if wrong.mean() <= FEW if len(wrong) else True:
            return ""
        if len(got) == COUNT:
            self.difference = _Difference(name, other, got, expected, _rows(self.wo), _rows(self.si.wi))
        ratio = got[wrong].sum() / max(expected[wrong].sum(), 1e-30)
        part = f"in {wrong.mean():.1%} of the pairs"
        return f"{name} differs from {other}: it is {ratio:.4g} times as large, {part}"


def _is_delta(bs: BSDFSample) -> np.ndarray:
    """Whether each sample belongs to a delta lobe or to a null interaction, (COUNT,)."""
    type_ = np.broadcast_to(np.asarray(bs.sampled_type.numpy()), COUNT)
    return np.asarray((type_ & (int(mi.BSDFFlags.Delta) | int(mi.BSDFFlags.Null))) > 0)


def _uniform(rng: np.random.Generator) -> np.ndarray:
    w = rng.normal(size=(COUNT, 3))
    return w / np.linalg.norm(w, axis=1, keepdims=True)


def _vector(rows: np.ndarray) -> mi.Vector3f:
    return mi.Vector3f(*[mi.Float(np.ascontiguousarray(c, dtype=np.float32)) for c in rows.T])


def _rows(value: OfVariant) -> np.ndarray:
    """Convert a value to a float64 array of shape (COUNT, k)."""
    parts = (
        [np.asarray(c.numpy(), float) for c in value]
        if dr.is_vector_v(value)
        else [np.asarray(mi.Float(value).numpy(), float)]
    )
    return np.stack([np.broadcast_to(part, (COUNT,)) for part in parts], -1)


def _names(flags: int) -> str:
    kinds = ("Null", *(kind + way for kind in ("Diffuse", "Glossy", "Delta") for way in ("Reflection", "Transmission")))
    return " | ".join(k for k in kinds if flags & int(getattr(mi.BSDFFlags, k))) or "nothing"
