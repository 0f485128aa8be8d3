# mitsuba:hair: reciprocity. Mitsuba 3.9.1, 2026-11-28.
import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
bsdf = mi.load_dict({"type": "hair"})
n = 1
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = mi.Vector3f(-0.986088395, -0.0680968314, -0.15163286)
wo = mi.Vector3f(-0.0533513278, -0.998215258, 0.0268315356)
there = bsdf.eval(ctx, si, wo) / dr.abs(wo.z)
ctx.mode = mi.TransportMode.Importance  # the same path in the other direction
si.wi, wo = wo, mi.Vector3f(si.wi)
back = bsdf.eval(ctx, si, wo) / dr.abs(wo.z)
assert dr.all(dr.abs(there - back) <= 0.5 * dr.maximum(there, back)), f"{there} in one direction, {back} in the other"
