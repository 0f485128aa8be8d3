# mitsuba:principled: linearity. Mitsuba 3.9.1, 2026-11-28.
import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
plugin = {"type": "principled", "roughness": 0.571954001703399, "anisotropic": 0.11841732634754099, "spec_trans": 0.9601579750376608, "spec_tint": 0.4270352014775808, "sheen": 0.7148155837874357, "sheen_tint": 0.32247589468874205, "flatness": 0.9880130314083888, "metallic": 0.7203665426621867, "clearcoat": 0.5313129611614217, "clearcoat_gloss": 0.5210994633939052, "base_color": {"type": "rgb", "value": [0.125, 0.125, 0.125]}}
n = 1
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = mi.Vector3f(0.800220847, 0.599705398, 0.000132609857)
wo, values = mi.Vector3f(-0.352606475, -0.935769796, -0.0018864501), []
for v in (0.125, 0.3125, 0.875):
    plugin["base_color"]["value"] = [v, v, v]
    values.append(mi.load_dict(plugin).eval(ctx, si, wo))
between = 0.75 * values[0] + 0.25 * values[2]
assert dr.all(dr.abs(values[1] - between) <= 0.054 * between), f"{values[1]} instead of {between}, with base_color between two other values"
