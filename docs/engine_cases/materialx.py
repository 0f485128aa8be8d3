"""MaterialX: furnaces of its generated GLSL, its fit of E, and causes."""

from __future__ import annotations

from pathlib import Path

from .base import Engine, Furnace, furnace, material, single_scattering

PLACES = ((0.25, 1.0), (0.5, 1.0), (0.5, 0.25), (0.75, 0.5), (1.0, 1.0), (1.0, 0.5), (1.0, 0.05))

INTRO = """This card tests the GLSL that `GlslShaderGenerator` writes for `open_pbr_surface` and `standard_surface`, lit
by one directional light. Inputs have their default values except for color 1, roughness 0.5 and the inputs that the
heading of a table names. Environments, transmission and subsurface scattering are not tested.
`DIRECTIONAL_ALBEDO_METHOD` is 0, the generator's default, so that albedos are computed from fits."""


def trials(folder: Path) -> dict[str, float]:
    """White metal of open_pbr_surface, E of its lobe, and the fit of E that the quotient of both is."""
    figures = {}
    for rough, cosine in PLACES:
        key = f"{rough:g}_{cosine:g}"
        exact = single_scattering(rough, (cosine,))[0]
        shader = furnace(material(folder, "open-pbr-surface", rough=rough, metalness=1.0), (cosine,))[0]
        figures |= {f"exact_{key}": exact, f"shader_{key}": shader, f"fit_{key}": exact / shader}
    return figures


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The fit against the integral."""
    last = list(figures.values())[-1]
    rows = "\n".join(
        f"| {rough:g} | {cosine:g} | "
        + " | ".join(f"{last[f'{what}_{rough:g}_{cosine:g}']:.3f}" for what in ("exact", "fit", "shader"))
        + " |"
        for rough, cosine in PLACES
    )
    return f"""## The fit behind the energy compensation

`mx_ggx_energy_compensation` multiplies the lobe by 1 + F (1 - E) / E, with E from `mx_ggx_dir_albedo_analytic`, a
rational function. The albedo of white metal is E of the integral divided by E of the fit:

| roughness | n.v | E (integral) | E of the fit | white metal |
|---|---|---|---|---|
{rows}

E of the fit is computed from the other two columns."""


_LAYERS = (
    "`mx_layer_bsdf` weights the base by 1 - E(n.v) of the layer, and `mx_ggx_energy_compensation` evaluates E at "
    "n.v: both depend only on the view direction. This keeps the albedo in white furnaces close to 1 and is deliberate "
    "in a rasterizer."
)
_GLOSS = (
    "`mx_dielectric_bsdf` reflects light by the exact Fresnel term, but reduces its base by the fit of E for Schlick's "
    "approximation, `mx_ggx_dir_albedo(n.v, alpha, F0, 1)`: see the white-furnace results for the white dielectric. "
    "Remedy: a fit of E for the exact term."
)
CAUSES = {
    ("open-pbr-surface", "reciprocity"): _LAYERS,
    ("standard-surface", "reciprocity"): _LAYERS,
    ("open-pbr-surface", "energy"): _GLOSS,
    ("standard-surface", "energy"): _GLOSS,
}

ENGINE = Engine(
    package="MaterialX",
    page="materialx",
    title="MaterialX",
    home="https://github.com/AcademySoftwareFoundation/MaterialX",
    intro=INTRO,
    materials=("open-pbr-surface", "standard-surface"),
    furnaces=(
        Furnace("White metal, OpenPBR", "open-pbr-surface", lambda r: {"rough": r, "metalness": 1.0}),
        Furnace("White dielectric, OpenPBR", "open-pbr-surface", lambda r: {"rough": r}),
        Furnace(
            "Coat of this roughness, OpenPBR",
            "open-pbr-surface",
            lambda r: {"coat": 1.0, "coatRough": r},
            "White dielectric with a coat, OpenPBR; roughness of the coat varies",
        ),
        Furnace(
            "Fuzz of this roughness, OpenPBR",
            "open-pbr-surface",
            lambda r: {"fuzz": 1.0, "fuzzRough": r},
            "White dielectric with fuzz, OpenPBR; roughness of the fuzz varies",
        ),
        Furnace("White metal, Standard Surface", "standard-surface", lambda r: {"rough": r, "metalness": 1.0}),
        Furnace("White dielectric, Standard Surface", "standard-surface", lambda r: {"rough": r}),
    ),
    remarks={
        "White metal, OpenPBR": "The deviations are those of [the fit](#the-fit-behind-the-energy-compensation), which "
        "are largest for narrow lobes at grazing angles.",
        "White metal, Standard Surface": "`mx_artistic_ior` clamps the reflectivity to 0.99, so that white metal loses "
        "about 1 % more light than that of OpenPBR.",
    },
    trials=trials,
    sections=sections,
    causes=CAUSES,
    programs=(),
    origin="PyPI",
    again="pip install MaterialX=={version}\npython docs/report-cards/engines/programs/materialx_generate.py materialx",
    made=True,
    laws=("positivity", "reciprocity", "energy"),
)
