# mitsuba:roughconductor: pdf. Mitsuba 3.9.1, 2026-11-28.
import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
bsdf = mi.load_dict({"type": "roughconductor"})
n = 1 << 24
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = mi.Vector3f(-0.34200713, -0.939656854, 0.00872653536)
i = dr.arange(mi.UInt32, n)
t, phi = (mi.Float(i >> 12) + 0.5) / 2048 - 1, (mi.Float(i & 4095) + 0.5) * (dr.pi / 2048)
z = t * dr.abs(t)
wo, area = mi.Vector3f(*(dr.sqrt(1 - z * z) * v for v in (dr.cos(phi), dr.sin(phi))), z), 8 * dr.pi * dr.abs(t) / n
bs, weight = bsdf.sample(ctx, si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))
claimed = dr.sum(dr.select(mi.Bool(True), bsdf.pdf(ctx, si, wo) * area, 0))
drawn = dr.mean(dr.select(dr.any(weight > 0) & (mi.Bool(True)), 1.0, 0.0))
assert dr.abs(claimed - drawn) < 0.0013, f"the pdf integrates to {claimed}, but the fraction of samples is {drawn}"
