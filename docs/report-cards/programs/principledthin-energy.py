# mitsuba:principledthin: energy. Mitsuba 3.9.1, 2026-11-28.
import glob, os, sys
for library in glob.glob(sys.prefix + "/lib/libLLVM*.so*"):  # LLVM 14 to 16, which a system may have, abort
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
bsdf = mi.load_dict({"type": "principledthin", "base_color": {"type": "rgb", "value": [1.0, 1.0, 1.0]}})
n = 1 << 24
si, ctx, rng = dr.zeros(mi.SurfaceInteraction3f, n), mi.BSDFContext(), mi.PCG32(n)
si.sh_frame, si.n, si.uv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 0, 1], [0.5, 0.5]
si.dp_du, si.dp_dv, si.t, si.prim_index = [1, 0, 0], [0, 1, 0], 1, 0
si.wi = mi.Vector3f(0.786881089, 0.592957437, 0.170937493)
ctx.mode = mi.TransportMode.Importance  # power, without the factor eta^2 of radiance
i = dr.arange(mi.UInt32, n)
t, phi = (mi.Float(i >> 12) + 0.5) / 2048 - 1, (mi.Float(i & 4095) + 0.5) * (dr.pi / 2048)
z = t * dr.abs(t)
wo, area = mi.Vector3f(*(dr.sqrt(1 - z * z) * v for v in (dr.cos(phi), dr.sin(phi))), z), 8 * dr.pi * dr.abs(t) / n
albedo = dr.max(dr.sum(bsdf.eval(ctx, si, wo) * area, axis=1))
assert albedo < 1.0127, f"reflects {albedo} times the incident light"
