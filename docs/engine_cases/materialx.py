"""MaterialX: white furnaces of its generated GLSL, its fit of E, and causes."""

from __future__ import annotations

from pathlib import Path

from .base import Engine, Furnace, furnace, material, single_scattering

PLACES = ((0.25, 1.0), (0.5, 1.0), (0.5, 0.25), (0.75, 0.5), (1.0, 1.0), (1.0, 0.5), (1.0, 0.05))

INTRO = """This card covers the GLSL code that `GlslShaderGenerator` writes for `open_pbr_surface` and
`standard_surface`, under one directional light. The base color is 1 and the specular roughness is 0.5 unless a table
varies it; inputs that are not named in the heading of a table have their default values. Environment maps, transmission
and subsurface scattering are not tested. `DIRECTIONAL_ALBEDO_METHOD` is 0, the generator's default: the shaders compute
directional albedos from analytic fits."""


def trials(folder: Path) -> dict[str, float]:
    """Albedo of white metal in open_pbr_surface, exact E of its lobe, and fitted E, the quotient of the two."""
    figures = {}
    for rough, cosine in PLACES:
        key = f"{rough:g}_{cosine:g}"
        exact = single_scattering(rough, (cosine,))[0]
        shader = furnace(material(folder, "open-pbr-surface", rough=rough, metalness=1.0), (cosine,))[0]
        figures |= {f"exact_{key}": exact, f"shader_{key}": shader, f"fit_{key}": exact / shader}
    return figures


def sections(figures: dict[str, dict[str, float]]) -> str:
    """The comparison of the fit with the exact integral."""
    last = list(figures.values())[-1]
    rows = "\n".join(
        f"| {rough:g} | {cosine:g} | "
        + " | ".join(f"{last[f'{what}_{rough:g}_{cosine:g}']:.3f}" for what in ("exact", "fit", "shader"))
        + " |"
        for rough, cosine in PLACES
    )
    return f"""## The fit behind the energy compensation

`mx_ggx_energy_compensation` multiplies the lobe by 1 + F (1 - E) / E, where E is the directional albedo of the lobe at
F = 1. E is approximated by a rational function, `mx_ggx_dir_albedo_analytic`. The albedo of white metal is therefore
the exact E divided by the fitted E:

| roughness | n.v | exact E | fitted E | albedo of white metal |
|---|---|---|---|---|
{rows}

The fitted E is not evaluated directly: it is the exact E divided by the albedo of white metal."""


_LAYERS = (
    "`mx_layer_bsdf` weights the base by 1 - E(n.v), where E is the albedo of the layer above it, and "
    "`mx_ggx_energy_compensation` evaluates E at n.v. Both factors depend only on the view direction. This deliberate "
    "choice keeps the albedo in white furnaces close to 1, and a rasterizer does not need reciprocity."
)
_GLOSS = (
    "The specular lobe of `mx_dielectric_bsdf` uses the exact Fresnel equations, but its base is attenuated by a "
    "directional albedo that was fitted for Schlick's approximation, `mx_ggx_dir_albedo(n.v, alpha, F0, 1)`: see the "
    "white-furnace results for the white dielectric. Remedy: fit the directional albedo for the exact Fresnel "
    "equations."
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
        "White metal, OpenPBR": "The deviations from 1 are errors of [the "
        "fit](#the-fit-behind-the-energy-compensation). They are largest for narrow lobes at grazing angles.",
        "White metal, Standard Surface": "`mx_artistic_ior` clamps the reflectivity to 0.99. White metal therefore "
        "reflects about 1 % less light than in OpenPBR.",
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
