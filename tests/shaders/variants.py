"""The materials that shader code is tested on: those of `materials`, and the compensated ones on several bases."""

from __future__ import annotations

import functools
from typing import Any

import gonio as go
from gonio.shaders import bundle

import materials

GOLD = go.Conductor.preset("Au", alpha=0.3)
TURNED = go.Conductor.preset("Au", alpha=(0.3, 0.1), rotation=0.3)
GLASS = go.Dielectric(1.5, 0.3)

COMPENSATED = {
    "kulla-conty": go.KullaConty(GOLD),
    "kulla-conty-sheet": go.KullaConty(
        go.Conductor(alpha=0.3, ndf="beckmann", masking="smith-separable", fresnel="schlick"), color="sheet"
    ),
    "kulla-conty-imageworks": go.KullaConty(GOLD, average="imageworks"),
    "kulla-conty-turned": go.KullaConty(TURNED),
    "kulla-conty-glass": go.KullaConty(GLASS),
    "kulla-conty-coat": go.KullaConty(go.Dielectric(1.5, 0.3, transmission=False)),
    "fdez-aguera": go.FdezAguera(GOLD),
    "turquin": go.Turquin(GOLD),
    "turquin-turned": go.Turquin(TURNED),
}
COATED = {
    "coat": go.model("coat")(go.Lambert((0.8, 0.4, 0.2)), absorption=(0.1, 0.4, 0.9)),
    "coat-on-metal": go.model("coat")(GOLD, 1.6),
    "coat-on-mirror": go.model("coat")(go.Conductor.preset("Au", alpha=0.0), depth=0.5, absorption=0.3),
}
NESTED = {
    "mix-compensated": go.mix(go.KullaConty(GOLD), go.Conductor.preset("Au", alpha=0.3, ndf="beckmann"), 0.3),
    "two-sided-compensated": go.two_sided(go.KullaConty(GOLD)),
    "mix-of-mixes": go.mix(go.mix(go.Lambert(), go.Mirror(), 0.3), go.OrenNayar(), 0.2),
}

EVERY = {**materials.ALL, **COMPENSATED, **COATED, **NESTED, **materials.COMPOSED}
# each model once, and what shapes its code most
FEW = {
    **materials.SMALL,
    **{name: COMPENSATED[name] for name in COMPENSATED if name not in ("kulla-conty-sheet", "turquin-turned")},
    **COATED,
    **NESTED,
}
# those whose code says the same as another's but for one function that a third has
ALIKE = (
    "kulla-conty-imageworks", "kulla-conty-coat", "mix-compensated", "two-sided-compensated", "mix", "mix-of-mixes",
    "coat-on-metal", "matched-glass", "metal-ggx-smith-correlated", "metal-beckmann-smith-correlated",
    "glass-student-t-smith-correlated", "eon-fit",
)  # fmt: skip
# what the quick run compiles: every model
SHAPES = {
    **{name: material for name, material in FEW.items() if name not in ALIKE},
    **{name: material for name, material in materials.EACH.items() if name in materials.HISTORIC},
    **{name: materials.COMPOSED[name] for name in ("openpbr", "disney2015")},
}
# with few of their layers; of roughness 0, as what might be a mirror has code of its own
SMOOTH = {"specular_roughness": 0.0, "coat_roughness": 0.0}
LEAN = {
    "openpbr": go.OpenPBR(**SMOOTH),
    "openpbr-metal": go.OpenPBR(**SMOOTH, base_metalness=1.0),
    "openpbr-coated": go.OpenPBR(**SMOOTH, coat_weight=0.5),
    "openpbr-glass": go.OpenPBR(**SMOOTH, transmission_weight=0.7),
    "openpbr-film": go.OpenPBR(**SMOOTH, thin_film_weight=0.7),
    "openpbr-fuzz": go.OpenPBR(**SMOOTH, fuzz_weight=0.7),
    "disney2015": go.model("disney2015")(roughness=0.0),
    "disney2015-clearcoat": go.model("disney2015")(roughness=0.0, clearcoat=0.7),
}


@functools.cache
def written(name: str, lang: str = "glsl") -> Any:
    """The shader of one of `EVERY`, written once in a process."""
    return bundle(EVERY[name], lang)
