"""A failure of a Mitsuba plugin as a short program for the plugin's authors, which needs only Mitsuba.

As long as the defect exists, the program ends with an AssertionError that states the measured value.

    script("energy", subject, finding)     "" if the BSDF is not one of Mitsuba's plugins, or the law has no program
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from .. import directions
from ..figures import SampleCells
from ..laws.base import where_found
from ..subject import Subject
from ..verdict import Finding
from . import crowding

HEAD = """import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
bsdf = mi.load_dict({plugin})
n = 1 << 24
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = {wo}
"""
# a grid of directions, finer toward the horizon, and the solid angle of each
GRID = """i = dr.arange(mi.UInt32, n)
t, phi = (mi.Float(i >> 12) + 0.5) / 2048 - 1, (mi.Float(i & 4095) + 0.5) * (dr.pi / 2048)
z = t * dr.abs(t)
wo, area = mi.Vector3f(*(dr.sqrt(1 - z * z) * v for v in (dr.cos(phi), dr.sin(phi))), z), 8 * dr.pi * dr.abs(t) / n
"""
SAMPLE = "bs, weight = bsdf.sample(ctx, si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))\n"
# the same, with random numbers that are often at the ends of their range
SAMPLE_ENDS = """def number():
    u, v = rng.next_float32(), rng.next_float32()
    return dr.select(v < 0.2, 0, dr.select(v < 0.4, 0.99999994, u))
bs, weight = bsdf.sample(ctx, si, number(), mi.Point2f(number(), number()))
"""


def script(law: str, subject: Subject, finding: Finding) -> str:
    """The program for a finding of a law; "" if there is none."""
    make = MAKERS.get(law)
    subject = where_found(subject, finding)
    if make is None or getattr(subject.model, "plugin", None) is None:
        return ""
    return make(subject, finding)


def _head(subject: Subject, wo: np.ndarray) -> str:
    return _registered(subject, HEAD.format(plugin=_literal(subject.model.plugin), wo=_vector(wo)))


def _registered(subject: Subject, head: str) -> str:
    """The first lines of a program, which also run the file that registers the plugin, if there is one."""
    file, _, name = subject.target.rpartition(":")
    if not (name and file.endswith(".py")):
        return head
    run = f"import runpy\nrunpy.run_path({str(Path(file).expanduser().resolve())!r})  # registers the plugin\nbsdf ="
    return head.replace("bsdf =", run, 1)


def _vector(w: np.ndarray) -> str:
    return f"mi.Vector3f({', '.join(f'{x:.9g}' for x in np.asarray(w, float))})"


def _literal(value: object) -> str:
    """A property of a plugin as a Python literal."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(name)}: {_literal(one)}" for name, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_literal(one) for one in value) + "]"
    if isinstance(value, float | int | str):
        return json.dumps(value) if isinstance(value, str) else f"{value!r}"
    if type(value).__name__ == "Bitmap":
        pixels = np.asarray(value, dtype=np.float32)
        numbers = ", ".join(f"{float(x):.4g}" for x in pixels.ravel())
        return f"mi.Bitmap(mi.TensorXf([{numbers}], {pixels.shape}))"
    return str(value)


# --------------------------------------------------------------------------- one per law


def _energy(subject: Subject, finding: Finding) -> str:
    """A program that computes the albedo on a grid of directions and, if there is no gain, compares it with that of the
    samples."""
    from ..laws.energy import lossless_variant

    mode = "ctx.mode = mi.TransportMode.Importance  # power, without the factor eta^2 of radiance\n"
    curves = finding.evidence
    wo, gain = curves.wo, curves.quadrature.max(1)  # type: ignore[union-attr]
    if finding.figure > finding.tolerance:
        white = lossless_variant(subject) if finding.worst.startswith("white furnace") else None
        furnace = curves.furnace.max(1) if white is not None else gain  # type: ignore[union-attr]
        row = int(np.argmax(furnace))
        text = _head(white or subject, wo[row]) + (mode if subject.transmits else "")
        if subject.model.delta == "never":
            text += GRID + "albedo = dr.max(dr.sum(bsdf.eval(ctx, si, wo) * area, axis=1))\n"
        else:  # a delta lobe has no values
            text += SAMPLE + "albedo = dr.max(dr.mean(weight, axis=1))\n"
        return text + (
            f'assert albedo < {1.0 + 0.5 * (furnace[row] - 1.0):.5g}, f"reflects {{albedo}} times the incident light"\n'
        )
    off = np.abs(curves.quadrature - curves.sampling).mean(1)  # type: ignore[union-attr]
    row = int(np.argmax(off))
    text = _head(subject, wo[row]) + (mode if subject.transmits else "") + GRID + SAMPLE
    return text + (
        "values, samples = dr.sum(bsdf.eval(ctx, si, wo) * area, axis=1), dr.mean(weight, axis=1)\n"
        f"assert dr.all(dr.abs(values - samples) < {0.5 * off[row]:.2g}), "
        'f"albedo {values} by eval, {samples} by sample"\n'
    )


def _pdf(subject: Subject, finding: Finding) -> str:
    """A program that compares the fraction of samples that the pdf predicts in a region with the observed fraction."""
    cells = finding.evidence
    if not isinstance(cells, SampleCells) or cells.wo is None:
        return ""
    claimed, drawn = cells.expected / cells.drawn, cells.observed / cells.drawn
    sides = [(f"{{}}.z {'>' if side > 0 else '<'} 0", k) for k, side in enumerate(cells.sides)]
    places = {"True": float(claimed.sum() - drawn.sum())}
    places |= {where: float(claimed[k].sum() - drawn[k].sum()) for where, k in sides}
    where, off = max(places.items(), key=lambda item: abs(item[1]))
    held = crowding.blocks(cells)
    if held is not None and abs(off) < 2e-3:  # no difference in total: the cap with the largest one
        expected = held.joined(held.expected) / held.drawn
        middle = np.stack([held.joined(held.wi[:, k] * held.expected) for k in range(3)], -1)
        middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-12)
        for cosine in (0.9999, 0.999, 0.99, 0.95, 0.8):
            missing = (middle @ middle.T > cosine) @ (expected - held.observed / held.drawn)
            row = int(np.argmax(np.abs(missing)))
            if abs(missing[row]) > 1.2 * abs(off):
                where, off = f"dr.dot({{}}, {_vector(middle[row])}) > {cosine}", float(missing[row])
    text = _head(subject, cells.wo) + GRID + SAMPLE
    inside = "mi.Bool(True)" if where == "True" else where
    return text + (
        f"claimed = dr.sum(dr.select({inside.format('wo')}, bsdf.pdf(ctx, si, wo) * area, 0))\n"
        f"drawn = dr.mean(dr.select(dr.any(weight > 0) & ({inside.format('bs.wo')}), 1.0, 0.0))\n"
        f"assert dr.abs(claimed - drawn) < {0.5 * abs(off):.2g}, "
        'f"the pdf integrates to {claimed}, but the fraction of samples is {drawn}"\n'
    )


def _weight(subject: Subject, finding: Finding) -> str:
    if finding.at is None:
        return ""
    text = _head(subject, finding.at[0]) + SAMPLE_ENDS
    return text + (
        "values, samples = bsdf.eval(ctx, si, bs.wo), weight * bs.pdf\n"
        "wrong = dr.any(dr.abs(values - samples) > 0.01 * dr.maximum(values, samples)) & dr.any(weight > 0)\n"
        'assert dr.count(wrong) < 1e-3 * n, f"{dr.count(wrong)} of {n} weights are not eval / pdf"\n'
    )


def _reciprocity(subject: Subject, finding: Finding) -> str:
    if finding.at is None:
        return ""
    wo, wi = finding.at
    return _head(subject, wo).replace("1 << 24", "1") + (
        f"wo = {_vector(wi)}\n"
        "there = bsdf.eval(ctx, si, wo) / dr.abs(wo.z)\n"
        "ctx.mode = mi.TransportMode.Importance  # the same path in the other direction\n"
        "si.wi, wo = wo, mi.Vector3f(si.wi)\n"
        "back = bsdf.eval(ctx, si, wo) / dr.abs(wo.z)\n"
        f"assert dr.all(dr.abs(there - back) <= {0.5 * min(finding.figure, 1.0):.2g} * dr.maximum(there, back)), "
        'f"{there} in one direction, {back} in the other"\n'
    )


def _positivity(subject: Subject, finding: Finding) -> str:
    if finding.at is None or "gradient" in finding.problems[0]:
        return ""
    wo, wi = finding.at
    return _head(subject, wo) + (
        f"wo = {_vector(wi)}\n"
        + SAMPLE_ENDS
        + "values = bsdf.eval(ctx, si, wo), bsdf.pdf(ctx, si, wo), weight, bs.pdf\n"
        "good = [dr.all(dr.isfinite(v) & (v >= 0), axis=None) for v in values]\n"
        "good.append(dr.all(dr.isfinite(bs.wo), axis=None))\n"
        'assert dr.all(good, axis=None), f"valid eval, pdf, weight, pdf and direction of the sample: {good}"\n'
    )


def _isotropy(subject: Subject, finding: Finding) -> str:
    if finding.at is None:
        return ""
    wo, wi = finding.at
    # Dr.Jit has no rotation of plain vectors about an axis
    return _head(subject, wo).replace("1 << 24", "24") + (
        "turn = dr.arange(mi.Float, n) * (2 * dr.pi / n)\n"
        "(s, c), rotated = dr.sincos(turn), lambda w: mi.Vector3f(c * w.x - s * w.y, s * w.x + c * w.y, w.z)\n"
        "si.wi = rotated(si.wi)\n"
        f"value = bsdf.eval(ctx, si, rotated({_vector(wi)}))[0]\n"
        'assert dr.max(value) < 1.05 * dr.min(value), f"{dr.min(value)} to {dr.max(value)} as both directions rotate"\n'
    )


def _linearity(subject: Subject, finding: Finding) -> str:
    name = finding.worst.partition(":")[0]
    if finding.at is None or name == "mix":
        return ""
    wo, wi = finding.at
    at = {v: subject.replace(**{name: v}).model.plugin for v in (0.125, 0.3125, 0.875)}
    head = HEAD.format(plugin=_literal(at[0.125]), wo=_vector(wo)).replace("1 << 24", "1")
    head = _registered(subject, head).replace(
        f"bsdf = mi.load_dict({_literal(at[0.125])})", f"plugin = {_literal(at[0.125])}"
    )
    return head + (
        f"wo, values = {_vector(wi)}, []\n"
        "for v in (0.125, 0.3125, 0.875):\n"
        f'    plugin["{name}"]["value"] = [v, v, v]\n'
        "    values.append(mi.load_dict(plugin).eval(ctx, si, wo))\n"
        "between = 0.75 * values[0] + 0.25 * values[2]\n"
        f"assert dr.all(dr.abs(values[1] - between) <= {0.5 * finding.figure:.2g} * between), "
        f'f"{{values[1]}} instead of {{between}}, with {name} between two other values"\n'
    )


def _calls(subject: Subject, finding: Finding) -> str:
    wrong = {answer.what: answer for answer in finding.details}  # type: ignore[attr-defined]
    above = directions.at(30.0, 20.0)
    for what, body in CALLS.items():
        if what in wrong:
            x, y, z = (f"{v:.6g}" for v in above)
            both = f"mi.Vector3f({x}, {y}, dr.select(rng.next_float32() > 0.5, {z}, -{z}))"
            text = _head(subject, above).replace("1 << 24", "1 << 16")
            return (text.replace(_vector(above), both) if -1 in subject.sides else text) + body
    return ""


CALLS = {
    "eval_pdf": "wo = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))\n"
    "value, pdf = bsdf.eval_pdf(ctx, si, wo)\n"
    "wrong = dr.any(value != bsdf.eval(ctx, si, wo)) | (pdf != bsdf.pdf(ctx, si, wo))\n"
    'assert dr.count(wrong) < 0.01 * n, f"eval_pdf is not eval and pdf for {dr.count(wrong)} of {n} pairs"\n',
    "shading frame": "u, v = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())\n"
    "first = bsdf.sample(ctx, si, u, v)[1]\n"
    "s, t, up = mi.Vector3f(0.48, 0.64, -0.6), mi.Vector3f(-0.8, 0.6, 0), mi.Vector3f(0.36, 0.48, 0.8)\n"
    "si.sh_frame, si.n, si.dp_du, si.dp_dv = mi.Frame3f(s, t, up), up, s, t\n"
    "wrong = dr.any(dr.abs(bsdf.sample(ctx, si, u, v)[1] - first) > 1e-3 * first)\n"
    'assert dr.count(wrong) < 0.01 * n, f"rotation changes the weight of {dr.count(wrong)} of {n} samples"\n',
    "flags": SAMPLE + "last = dr.max(dr.select(dr.any(weight > 0), bs.sampled_component, 0))\n"
    "count, kinds = bsdf.component_count(), [bsdf.flags(k) for k in range(bsdf.component_count())]\n"
    'assert dr.all(last < count), f"sampled_component is {last}, but there are {count} components: {kinds}"\n',
    "components": "wo = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))\n"
    "total, parts, sampled = bsdf.eval(ctx, si, wo), mi.Color3f(0), {}\n"
    "for ctx.component in range(bsdf.component_count()):\n"
    "    parts += bsdf.eval(ctx, si, wo)\n"
    "    " + SAMPLE + "    got = dr.select(dr.any(weight > 0), bs.sampled_component, ctx.component)\n"
    "    sampled[ctx.component] = (dr.min(got)[0], dr.max(got)[0])\n"
    "parts, total = dr.mean(parts, axis=None), dr.mean(total, axis=None)\n"
    "assert all(pair == (k, k) for k, pair in sampled.items()) and dr.allclose(parts, total, 1e-3), "
    'f"with one component enabled, samples are of {sampled}; values sum to {parts}, but eval is {total}"\n',
    "types": "wo = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))\n"
    "total, parts = bsdf.eval(ctx, si, wo), mi.Color3f(0)\n"
    "for kind in (mi.BSDFFlags.Reflection, mi.BSDFFlags.Transmission):\n"
    "    ctx.type_mask = int(kind)\n"
    "    parts += bsdf.eval(ctx, si, wo)\n"
    "parts, total = dr.mean(parts, axis=None), dr.mean(total, axis=None)\n"
    'assert dr.allclose(parts, total, 1e-3), f"reflection and transmission sum to {parts}, but eval is {total}"\n',
    "eval_diffuse_reflectance": "value = bsdf.eval_diffuse_reflectance(si)\n"
    "least, most = dr.min(value, axis=None), dr.max(value, axis=None)\n"
    'assert 0 <= least and most <= 1, f"the reflectance ranges from {least} to {most}"\n',
}

MAKERS: dict[str, Callable[[Subject, Finding], str]] = {
    "energy": _energy,
    "pdf": _pdf,
    "weight": _weight,
    "reciprocity": _reciprocity,
    "positivity": _positivity,
    "isotropy": _isotropy,
    "linearity": _linearity,
    "calls": _calls,
}
