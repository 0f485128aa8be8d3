# mitsuba:mask: calls. Mitsuba 3.9.1, 2026-11-28.
import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
bsdf = mi.load_dict({"type": "mask", "opacity": 0.5, "bsdf": {"type": "diffuse"}})
n = 1 << 16
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = mi.Vector3f(0.469846, 0.17101, dr.select(rng.next_float32() > 0.5, 0.866025, -0.866025))
wo = mi.warp.square_to_uniform_sphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
total, parts, sampled = bsdf.eval(ctx, si, wo), mi.Color3f(0), {}
for ctx.component in range(bsdf.component_count()):
    parts += bsdf.eval(ctx, si, wo)
    bs, weight = bsdf.sample(ctx, si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))
    got = dr.select(dr.any(weight > 0), bs.sampled_component, ctx.component)
    sampled[ctx.component] = (dr.min(got)[0], dr.max(got)[0])
parts, total = dr.mean(parts, axis=None), dr.mean(total, axis=None)
assert all(pair == (k, k) for k, pair in sampled.items()) and dr.allclose(parts, total, 1e-3), f"with one component enabled, samples are of {sampled}; values sum to {parts}, but eval is {total}"
