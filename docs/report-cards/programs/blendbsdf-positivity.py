# mitsuba:blendbsdf: positivity. Mitsuba 3.9.1, 2026-11-28.
import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
bsdf = mi.load_dict({"type": "blendbsdf", "weight": 0.5, "a": {"type": "diffuse"}, "b": {"type": "roughconductor"}})
n = 1 << 24
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = mi.Vector3f(0.939692616, 0.342020154, 0)
wo = mi.Vector3f(0, 0, 0)
def number():
    u, v = rng.next_float32(), rng.next_float32()
    return dr.select(v < 0.2, 0, dr.select(v < 0.4, 0.99999994, u))
bs, weight = bsdf.sample(ctx, si, number(), mi.Point2f(number(), number()))
values = bsdf.eval(ctx, si, wo), bsdf.pdf(ctx, si, wo), weight, bs.pdf
good = [dr.all(dr.isfinite(v) & (v >= 0), axis=None) for v in values]
good.append(dr.all(dr.isfinite(bs.wo), axis=None))
assert dr.all(good, axis=None), f"valid eval, pdf, weight, pdf and direction of the sample: {good}"
