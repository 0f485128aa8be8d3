# mitsuba:bumpmap: isotropy. Mitsuba 3.9.1, 2026-11-28.
import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
bsdf = mi.load_dict({"type": "bumpmap", "bsdf": {"type": "diffuse"}, "texture": {"type": "bitmap", "bitmap": mi.Bitmap(mi.TensorXf([0, 0.01333, 0.02667, 0.04, 0.05333, 0.06667, 0.08, 0.09333, 0.1067, 0.12, 0.1333, 0.1467, 0.16, 0.1733, 0.1867, 0.2], (1, 16))), "raw": True}})
n = 24
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = mi.Vector3f(0.403586626, -0.88089478, 0.247269586)
turn = dr.arange(mi.Float, n) * (2 * dr.pi / n)
(s, c), rotated = dr.sincos(turn), lambda w: mi.Vector3f(c * w.x - s * w.y, s * w.x + c * w.y, w.z)
si.wi = rotated(si.wi)
value = bsdf.eval(ctx, si, rotated(mi.Vector3f(-0.975860119, 0.113810554, 0.186397865)))[0]
assert dr.max(value) < 1.05 * dr.min(value), f"{dr.min(value)} to {dr.max(value)} as both directions rotate"
