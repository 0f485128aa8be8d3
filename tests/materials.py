"""The materials that the laws are tested on: every model, every choice of its parts.

`SMALL` has each kind once, of the historic models some, `ALL` every distribution with every masking, both Fresnel
forms, every way of sampling, widths from .01 to 1, two widths with a rotation, and glass thin and dense. `COMPENSATED`
has every way to give lost light back that can be recorded, and `COMPOSED` models of many layers with all of them on:
energy's own tests judge them, recording and shaders look at them too. Of `ALL` the quick run takes `EACH`: every model,
distribution, masking, Fresnel form and way of sampling once, and the extreme widths (`each`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import gonio as go
import pytest

NDFS = ("ggx", "beckmann", "student-t")
MASKINGS = ("smith-correlated", "smith-separable", "smith-separable-exact", "schlick-direct", "schlick-ibl", "v-groove")

DIFFUSE = {
    "lambert": go.Lambert((0.2, 0.5, 0.9)),
    "oren-nayar": go.OrenNayar(0.8, 0.4),
    "phong": go.Phong((0.3, 0.4, 0.5), 0.3, 20.0),
    "blinn-phong": go.BlinnPhong(0.2, (0.4, 0.5, 0.6), 60.0),
    "modified-phong": go.model("modified-phong")((0.3, 0.4, 0.5), 0.4, 25.0),
    "disney": go.model("disney")((0.8, 0.4, 0.2), 0.3, 0.2, 0.6, 0.5, 0.4, 0.7, 0.3, 0.5, 0.6, 0.8, 0.4),
    "eon": go.model("eon")((0.9, 0.6, 0.3), 0.8),
    "eon-fit": go.model("eon")((0.2, 1.0, 0.7), 0.5, energy="fit"),
    "sheen": go.model("sheen")((0.9, 0.5, 0.7), 0.4),
    "sheen-charlie": go.model("sheen-charlie")((0.9, 0.5, 0.7), 0.4),
}
HISTORIC = {
    "ward": go.Ward((0.1, 0.2, 0.3), (0.4, 0.3, 0.2), (0.1, 0.3), rotation=0.5),
    "ward-duer": go.WardDuer(0.2, (0.4, 0.3, 0.2), 0.2),
    "ward-duer-bounded": go.WardDuer(0.2, 0.3, (0.3, 0.1), bounded=True),
    "lafortune": go.Lafortune((0.3, 0.2, 0.1), 0.4, -0.9, -1.0, 0.8, 30.0),
    "ashikhmin-shirley": go.AshikhminShirley((0.1, 0.3, 0.2), 0.8, (20.0, 300.0), rotation=-0.4, eta=(1.5, 2.0, 3.0)),
    "ashikhmin-shirley-coupled": go.AshikhminShirley(0.8, 0.5, 60.0, eta=2.0, fresnel="exact", coupled=True),
    "cook-torrance": go.CookTorrance((0.1, 0.2, 0.1), (0.2, 0.25, 0.1), (0.3, 0.15), eta=(2.0, 3.0, 1.5)),
    "he-torrance": go.HeTorrance(0.1, (0.9, 0.8, 0.7), 150.0, 2500.0, 2.0),
    "low-smooth": go.LowSmooth((0.1, 0.2, 0.3), 20.0, 500.0, 1.2, 1.6),
    "low-microfacet": go.LowMicrofacet((0.3, 0.2, 0.1), (8.0, 6.0, 5.0), 200.0, 1.4, 1.6),
    "shifted-gamma": go.material("brass"),
}
IDEAL = {
    "mirror": go.Mirror(0.9),
    "smooth-metal": go.Conductor.preset("Cu", alpha=0.0),
    "smooth-glass": go.Dielectric(1.5, 0.0),
    "pane": go.ThinDielectric(1.5, albedo=(0.9, 0.95, 1.0)),
    "matched-glass": go.Dielectric(1.0, 0.3),
}
NESTED = {
    "mix": go.mix(go.Lambert(0.5), go.Conductor.preset("Au", alpha=0.3), 0.3),
    "mix-with-mirror": go.mix(go.Mirror(), go.OrenNayar(0.7, 0.2), 0.6),
    "mix-with-glass": go.mix(go.Dielectric(1.4, 0.3), go.Lambert(0.5), 0.4),
    "opacity": go.model("opacity")(go.Dielectric(1.5, 0.3), 0.7),
    "normal-map": go.model("normal-map")(go.Conductor.preset("Au", alpha=0.3), 0.4, -0.2),
    "two-sided": go.two_sided(go.Conductor.preset("Fe", alpha=(0.2, 0.5), rotation=0.4)),
}


def _rough() -> dict[str, go.BSDF]:
    found: dict[str, go.BSDF] = {}
    for ndf in NDFS:
        for masking in MASKINGS:
            found[f"metal-{ndf}-{masking}"] = go.Conductor.preset(
                "Au", alpha=(0.15, 0.4), rotation=0.5, ndf=ndf, masking=masking
            )
            found[f"glass-{ndf}-{masking}"] = go.Dielectric(1.5, 0.3, ndf=ndf, masking=masking)
        for alpha in (0.01, 0.1, 0.5, 1.0):
            found[f"metal-{ndf}-alpha-{alpha}"] = go.Conductor.preset("Ag", alpha=alpha, ndf=ndf)
            found[f"glass-{ndf}-alpha-{alpha}"] = go.Dielectric(1.5, alpha, ndf=ndf)
        for sampling in ("bounded", "normals"):
            found[f"metal-{ndf}-{sampling}"] = go.Conductor(alpha=0.4, ndf=ndf, sampling=sampling)
            found[f"glass-{ndf}-{sampling}"] = go.Dielectric(1.5, 0.4, ndf=ndf, sampling=sampling)
        found[f"metal-{ndf}-schlick"] = go.Conductor.preset("Cu", alpha=0.3, ndf=ndf, fresnel="schlick")
        found[f"glass-{ndf}-schlick"] = go.Dielectric(1.5, 0.3, ndf=ndf, fresnel="schlick")
        found[f"metal-{ndf}-one"] = go.Conductor(alpha=0.6, ndf=ndf, fresnel="one")
        found[f"metal-{ndf}-f82"] = go.Conductor.preset("Au", alpha=0.3, ndf=ndf, fresnel="f82")
    found["metal-by-colours"] = go.Metal((1.0, 0.8, 0.4), (0.9, 1.0, 0.7), alpha=(0.1, 0.4), rotation=0.5)
    found["glass-f82"] = go.Dielectric(1.5, 0.3, fresnel="f82")
    found["film-on-metal"] = go.FilmConductor.preset(
        "Cr", alpha=(0.1, 0.4), rotation=0.5, thickness=420.0, form="belcour-barla"
    )
    found["film-on-gold"] = go.FilmConductor.preset("Au", alpha=0.3, thickness=650.0, film_eta=1.6)
    found["film-on-glass"] = go.FilmDielectric(1.5, 0.3, thickness=350.0, film_eta=2.0)
    found["film-bubble"] = go.FilmDielectric(1.2, 0.2, thickness=500.0, film_eta=1.33, form="belcour-barla")
    found["glass-turned"] = go.Dielectric(1.33, (0.1, 0.5), rotation=-0.7)
    found["glass-dense"] = go.Dielectric(2.42, 0.2)
    found["glass-bubble"] = go.Dielectric(0.7, 0.2)
    found["glass-reflects-only"] = go.Dielectric(1.5, 0.2, transmission=False)
    found["glass-tinted"] = go.Dielectric(1.5, 0.2, albedo=(0.9, 0.5, 0.2))
    found["metal-bounded-turned"] = go.Conductor.preset("Al", alpha=(0.1, 0.6), rotation=1.0, sampling="bounded")
    return found


ROUGH = _rough()
ALL = {**DIFFUSE, **HISTORIC, **IDEAL, **NESTED, **ROUGH}
FINITE = {**DIFFUSE, **HISTORIC, **NESTED, **ROUGH}  # those that have a density somewhere
COMPENSATED = {
    "kulla-conty-metal": go.KullaConty(go.Conductor.preset("Au", alpha=0.4)),
    "kulla-conty-sheet": go.KullaConty(go.Conductor.preset("Cu", alpha=0.7), color="sheet", average="imageworks"),
    "kulla-conty-beckmann": go.KullaConty(
        go.Conductor.preset("Ag", alpha=0.3, ndf="beckmann", masking="smith-separable")
    ),
    "kulla-conty-schlick": go.KullaConty(go.Conductor(alpha=0.5, masking="schlick-direct", fresnel="schlick")),
    "kulla-conty-turned": go.KullaConty(go.Conductor.preset("Fe", alpha=(0.2, 0.6), rotation=0.4)),
    "kulla-conty-glass": go.KullaConty(go.Dielectric(1.5, 0.3, albedo=(0.9, 0.8, 0.7))),
    "kulla-conty-bubble": go.KullaConty(go.Dielectric(0.7, (0.2, 0.5), rotation=-0.3)),
    "kulla-conty-coat": go.KullaConty(go.Dielectric(1.5, 0.5, transmission=False)),
    "kulla-conty-inside": go.mix(go.Lambert(0.5), go.KullaConty(go.Conductor.preset("Au", alpha=0.6)), 0.3),
    "turquin": go.Turquin(go.Conductor.preset("Au", alpha=0.5)),
    "turquin-turned": go.Turquin(go.Conductor.preset("Au", alpha=(0.7, 0.2))),
    "fdez-aguera": go.FdezAguera(go.Conductor.preset("Cu", alpha=0.5)),
    "fdez-aguera-coat": go.FdezAguera(go.Dielectric(1.5, 0.4, transmission=False)),
}
EVERY_SLAB = {
    "base_diffuse_roughness": 0.5,
    "base_metalness": 0.3,
    "specular_roughness": 0.0,
    "specular_roughness_anisotropy": 0.3,
    "transmission_weight": 0.4,
    "subsurface_weight": 0.4,
    "subsurface_radius": 0.0,
    "coat_weight": 0.7,
    "coat_roughness": 0.0,  # here and below, as what might be a mirror has code of its own
    "fuzz_weight": 0.5,
    "thin_film_weight": 0.6,
    "geometry_opacity": 0.8,
}
COMPOSED = {
    "openpbr": go.OpenPBR(**EVERY_SLAB),
    "openpbr-thin": go.OpenPBR(**EVERY_SLAB, geometry_thin_walled=True),
    "openpbr-by-albedo": go.OpenPBR(**EVERY_SLAB, layering="albedo"),
    "disney2015": go.model("disney2015")(0.5, 0.3, 0.0, 0.4, 0.2, spec_trans=0.4, sheen=0.5, clearcoat=0.6),
    "disney2015-thin": go.model("disney2015")(0.5, 0.3, 0.0, spec_trans=0.4, sheen=0.5, clearcoat=0.6, thin=True),
}
SMALL = {
    **DIFFUSE,
    **{name: HISTORIC[name] for name in ("ashikhmin-shirley", "cook-torrance", "lafortune", "ward-duer-bounded")},
    **IDEAL,
    **NESTED,
    **{name: ROUGH[name] for name in ("glass-turned", "glass-bubble", "metal-bounded-turned", "metal-by-colours")},
    **{name: ROUGH[name] for name in ("film-on-metal", "film-on-glass")},
    **{
        f"{kind}-{ndf}-smith-correlated": ROUGH[f"{kind}-{ndf}-smith-correlated"]
        for kind in ("metal", "glass")
        for ndf in NDFS
    },
}

EACH = {
    **SMALL,
    **{n: m for n, m in HISTORIC.items() if n not in ("ward-duer", "ashikhmin-shirley-coupled")},
    # of what shapes the code of rough metal and glass each once, of either the half
    **{
        name: ROUGH[name]
        for name in (
            "glass-ggx-smith-separable", "metal-beckmann-smith-separable-exact", "metal-ggx-schlick-direct",
            "glass-beckmann-schlick-ibl", "metal-student-t-v-groove", "glass-ggx-v-groove",
            "metal-ggx-alpha-0.01", "glass-ggx-alpha-0.01", "metal-beckmann-alpha-1.0", "glass-student-t-alpha-1.0",
            "metal-ggx-bounded", "glass-ggx-bounded", "metal-beckmann-normals", "glass-ggx-normals",
            "metal-ggx-schlick", "glass-ggx-schlick", "metal-student-t-one", "metal-ggx-f82", "glass-f82",
            "glass-reflects-only", "glass-tinted",
        )
    },
}  # fmt: skip


def each(names: Iterable[str], quick: Collection[str] = EACH) -> list[Any]:
    """The names as cases of a test, all but the quick ones marked slow."""
    return [pytest.param(name, marks=() if name in quick else pytest.mark.slow) for name in names]
