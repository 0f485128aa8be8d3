# mitsuba:bumpmap: calls. Mitsuba 3.9.1, 2026-11-28.
import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
bsdf = mi.load_dict({"type": "bumpmap", "bsdf": {"type": "diffuse"}, "texture": {"type": "bitmap", "bitmap": mi.Bitmap(mi.TensorXf([0, 0.01333, 0.02667, 0.04, 0.05333, 0.06667, 0.08, 0.09333, 0.1067, 0.12, 0.1333, 0.1467, 0.16, 0.1733, 0.1867, 0.2], (1, 16))), "raw": True}})
n = 1 << 16
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = mi.Vector3f(0.46984631, 0.171010072, 0.866025404)
u, v = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
first = bsdf.sample(ctx, si, u, v)[1]
s, t, up = mi.Vector3f(0.48, 0.64, -0.6), mi.Vector3f(-0.8, 0.6, 0), mi.Vector3f(0.36, 0.48, 0.8)
si.sh_frame, si.n, si.dp_du, si.dp_dv = mi.Frame3f(s, t, up), up, s, t
wrong = dr.any(dr.abs(bsdf.sample(ctx, si, u, v)[1] - first) > 1e-3 * first)
assert dr.count(wrong) < 0.01 * n, f"rotation changes the weight of {dr.count(wrong)} of {n} samples"
