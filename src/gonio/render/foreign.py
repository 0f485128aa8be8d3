"""Any of Mitsuba's BSDFs, built in or of a user's plugin, under Gonio's protocol.

    rough = foreign.load({"type": "roughplastic", "alpha": 0.2})
    rough.eval(wo, wi)

Mitsuba's `wi` is Gonio's `wo`, and the other way round; its BSDFs see a surface interaction whose shading frame is the
local frame, at uv = (0.5, 0.5). Values are float32: the wheel has no 64-bit variant.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..errors import InputError, did_you_mean
from ..models import Breach, Parameter, Sample
from ..models.parameters import ColourParameter, NumberParameter
from ..ops import backend
from . import adapter, engine

# Albedo-like properties of Mitsuba's own plugins, [0, 1]; others are read from the plugin as they are
ALBEDOS = ("reflectance", "diffuse_reflectance", "specular_reflectance", "specular_transmittance", "base_color")


class ForeignBSDF:
    """A Mitsuba BSDF that answers as a Gonio material does: NumPy rows or Dr.Jit vectors in, the same kind out."""

    precisions: ClassVar[tuple[str, ...]] = ("float32",)
    stochastic = False
    lossless = None

    def __init__(self, description: dict[str, Any] | None, bsdf: Any) -> None:
        import mitsuba as mi

        self.description, self.bsdf, self._mi = description, bsdf, mi
        flags, kinds = int(bsdf.flags()), mi.BSDFFlags
        self.transmits = bool(flags & (int(kinds.Transmission) | int(kinds.Null)))
        self.isotropic = not flags & int(kinds.Anisotropic)
        smooth, ideal = bool(flags & int(kinds.Smooth)), bool(flags & (int(kinds.Delta) | int(kinds.Null)))
        self.delta = "maybe" if smooth and ideal else "always" if ideal else "never"

    def parameters(self) -> dict[str, Parameter]:
        """Numbers and albedos among the plugin's properties, as Gonio declares them; those that `replace` can set."""
        if self.description is None:
            return {}
        found: dict[str, Parameter] = {}
        for name, value in self.description.items():
            if isinstance(value, int | float) and not isinstance(value, bool):
                kind = ColourParameter if name in ALBEDOS else NumberParameter
                # widths of 0 are refused or are another plugin
                low, high = (0.0, 1.0) if name in ALBEDOS or name.startswith("alpha") else (-np.inf, np.inf)
                found[name] = kind(name, value, "a property of the plugin", low, high)
        for name in _declared(self.bsdf, self._mi):
            if name not in found and name in ALBEDOS:
                found[name] = ColourParameter(name, 0.5, "a property of the plugin", 0.0, 1.0)
        return found

    def replace(self, **values: Any) -> ForeignBSDF:
        """The plugin built anew with other properties."""
        if self.description is None:
            raise InputError("a BSDF that was read from a file cannot be changed", "mitsuba")
        changed = dict(self.description)
        for name, value in values.items():
            if name in ALBEDOS:
                color = [float(c) for c in np.broadcast_to(np.asarray(value, float), 3)]
                changed[name] = {"type": "rgb", "value": color}
            else:
                changed[name] = value
        return load(changed)

    def white(self) -> ForeignBSDF:
        """The plugin with every albedo 1; itself where it has none."""
        albedos = [name for name in self.parameters() if name in ALBEDOS]
        return self.replace(**dict.fromkeys(albedos, 1.0)) if albedos else self

    def breaches(self) -> dict[str, Breach]:
        return {}

    # ------------------------------------------------------------------ the protocol

    def eval(self, wo: Any, wi: Any, mode: str = "radiance", precision: str | None = None) -> Any:
        """f |cos theta_i|; rows (N, 3) give (N, channels)."""
        a, b, count = self._both(wo, wi)
        value = self.bsdf.eval(self._context(mode), self._at(a), self._mi.Vector3f(b), True)
        return value if count is None else backend.to_numpy(value, count)

    def pdf(self, wo: Any, wi: Any, precision: str | None = None) -> Any:
        """Density of `sample`."""
        a, b, count = self._both(wo, wi)
        value = self.bsdf.pdf(self._context("radiance"), self._at(a), self._mi.Vector3f(b), True)
        return value if count is None else backend.to_numpy(value, count)

    def sample(self, wo: Any, u: Any, mode: str = "radiance", precision: str | None = None) -> Sample:
        """A direction; null interactions, which go straight on, count as delta lobes."""
        a, b, count = self._both(wo, u)
        mi = self._mi
        bs, weight = self.bsdf.sample(self._context(mode), self._at(a), b[0], mi.Point2f(b[1], b[2]), True)
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta) | mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
        # Mitsuba tells of a failed sample by its weight, 0, and leaves any pdf: so reads its own chi-square test
        import drjit as dr

        failed = dr.all(weight == 0.0)
        found = Sample(bs.wo, weight, dr.select(failed, 0.0, bs.pdf), delta & ~failed, bs.eta)
        return found if count is None else type(found)._make(backend.to_numpy(value, count) for value in found)

    def _context(self, mode: str) -> Any:
        modes = self._mi.TransportMode
        return self._mi.BSDFContext(modes.Radiance if mode == "radiance" else modes.Importance)

    def _at(self, wo: Any) -> Any:
        import drjit as dr

        mi = self._mi
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wo))
        si.wi = mi.Vector3f(wo)
        si.t = 1.0
        si.n = mi.Normal3f(0.0, 0.0, 1.0)
        si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
        si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
        si.uv = mi.Point2f(0.5, 0.5)
        # a BSDF that knows it is lit on a visible surface (`null`, `mask`) asks whether there is one
        si.prim_index = mi.UInt32(0)
        return si

    def _both(self, a: Any, b: Any) -> tuple[Any, Any, int | None]:
        if backend.is_drjit(a):
            return a, b, None
        kind = backend.types("float32")
        rows = [np.asarray(v, float) for v in (a, b)]
        count = max(len(v) if v.ndim == 2 else 1 for v in rows)
        return backend.vector_of(rows[0], 3, kind), backend.vector_of(rows[1], 3, kind), count


def load(description: dict[str, Any]) -> ForeignBSDF:
    """The BSDF of a dictionary as `mi.load_dict` takes it; InputError where Mitsuba refuses it."""
    mi = _mitsuba()
    kind = str(description.get("type", ""))
    try:
        bsdf = mi.load_dict(description)
    except Exception as error:
        raise _refused(error, kind) from None
    if not isinstance(bsdf, mi.BSDF):
        raise InputError(f"'{kind}' is a {type(bsdf).__name__}, a BSDF expected", f"mitsuba:{kind}")
    return ForeignBSDF(description, bsdf)


def load_file(path: Path) -> ForeignBSDF:
    """The BSDF of a Mitsuba XML file: its root, or the first in a scene."""
    mi = _mitsuba()
    try:
        found = mi.load_file(str(path))
    except Exception as error:
        raise _refused(error, path.name) from None
    if isinstance(found, mi.BSDF):
        return ForeignBSDF(None, found)
    if isinstance(found, mi.Scene):
        for shape in found.shapes():
            if shape.bsdf() is not None:
                return ForeignBSDF(None, shape.bsdf())
    raise InputError("no BSDF in this file", str(path), "give a file whose root is <bsdf>, or a scene with one")


def plugins() -> list[str]:
    """Names of the BSDF plugins that Mitsuba brings along."""
    return sorted(_NESTS)


# Mitsuba does not tell a plugin's kind without building it; what each needs to be built is written down here
_DIFFUSE = {"type": "diffuse"}
_NESTS: dict[str, dict[str, Any]] = {
    "blendbsdf": {"weight": 0.5, "a": _DIFFUSE, "b": {"type": "roughconductor"}},
    "bumpmap": {"bsdf": _DIFFUSE},
    "circular": {},
    "conductor": {},
    "dielectric": {},
    "diffuse": {},
    "hair": {},
    "mask": {"opacity": 0.5, "bsdf": _DIFFUSE},
    "measured": {},
    "measured_polarized": {},
    "normalmap": {"normalmap": {"type": "rgb", "value": [0.5, 0.5, 1.0]}, "bsdf": _DIFFUSE},
    "null": {},
    "plastic": {},
    "polarizer": {},
    "pplastic": {},
    "principled": {},
    "principledthin": {},
    "retarder": {},
    "roughconductor": {},
    "roughdielectric": {},
    "roughplastic": {},
    "thindielectric": {},
    "twosided": {"bsdf": {"type": "roughconductor"}},
}


def plugin(name: str, properties: dict[str, Any]) -> ForeignBSDF:
    """A plugin by name with the properties given; BSDFs of BSDFs get plain ones inside."""
    more: dict[str, Any] = {}
    if name == "bumpmap" and "texture" not in properties:
        ramp = np.linspace(0.0, 0.2, 16, dtype=np.float32)
        heights = _mitsuba().Bitmap(np.ascontiguousarray(np.broadcast_to(ramp, (16, 16))[..., None]))
        more = {"texture": {"type": "bitmap", "bitmap": heights, "raw": True}}
    return load({"type": name, **_NESTS.get(name, {}), **more, **properties})


def _declared(bsdf: Any, mi: Any) -> list[str]:
    try:
        return [str(key).split(".")[0] for key in mi.traverse(bsdf).keys()]  # noqa: SIM118
    except Exception:
        return []


def _mitsuba() -> Any:
    mi = engine.load()
    if not mi.variant().startswith("llvm_"):
        raise InputError(f"variant {mi.variant()} is set, an LLVM one expected", "mitsuba", "verify in another process")
    adapter.register(mi)
    mi.set_log_level(mi.LogLevel.Error)
    return mi


def _refused(error: Exception, name: str) -> InputError:
    text = " ".join(str(error).split())
    if "not found" in text and ("Plugin" in text or "plugin" in text):
        return InputError(f"Mitsuba has no plugin '{name}'", f"mitsuba:{name}", did_you_mean(name, plugins()))
    # Mitsuba prefixes source lines and the object's description; the last sentence says what it is about
    return InputError(f"Mitsuba refuses it: {text[-200:] if len(text) > 200 else text}", f"mitsuba:{name}")
