# mitsuba:roughdielectric, distribution = ggx: weight. Mitsuba 3.9.1, 2026-11-28.
import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
bsdf = mi.load_dict({"type": "roughdielectric", "distribution": "ggx"})
n = 1 << 24
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = mi.Vector3f(0.768284976, -0.424271613, 0.47930342)
def number():
    u, v = rng.next_float32(), rng.next_float32()
    return dr.select(v < 0.2, 0, dr.select(v < 0.4, 0.99999994, u))
bs, weight = bsdf.sample(ctx, si, number(), mi.Point2f(number(), number()))
values, samples = bsdf.eval(ctx, si, bs.wo), weight * bs.pdf
wrong = dr.any(dr.abs(values - samples) > 0.01 * dr.maximum(values, samples)) & dr.any(weight > 0)
assert dr.count(wrong) < 1e-3 * n, f"{dr.count(wrong)} of {n} weights are not eval / pdf"
