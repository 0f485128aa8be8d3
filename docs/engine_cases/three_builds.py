"""three.js: the TSL build compared with the GLSL, and the causes of the differences."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import NamedTuple

from gonio.catalog.shaders import files

from .base import difference, material

SAME = 1e-5  # largest relative difference between equal formulas: three.js's constants are float32


class Build(NamedTuple):
    """A comparison of the two builds.

    name      key of its value; `title` is the first cell of its row
    material  name without "three-"; `parameters` are the values of its parameters
    why       cause of the difference
    changes   changes to the GLSL after which both builds agree: (file, pattern, replacement)
    """

    name: str
    title: str
    material: str
    parameters: dict[str, float]
    why: str
    changes: tuple[tuple[str, str, str], ...] = ()


_BASE = {"color": 0.7, "rough": 0.8, "metal": 0.3}
_COAT, _SHEEN = {"coat": 1.0, "coatRoughness": 0.3}, {"sheen": 1.0, "sheenWidth": 0.4}
_LIGHTS, _PROGRAM = "ShaderChunk/lights_physical_pars_fragment.glsl.js", "ShaderLib/meshphysical.glsl.js"
_LAST = "#ifdef USE_SHEEN\noutgoingLight += sheenSpecularDirect + sheenSpecularIndirect;\n#endif\n"
BUILDS = (
    Build(
        "plain",
        "standard",
        "standard",
        {},
        "the divisor in `BRDF_GGX_Multiscatter` contains `Favg` in GLSL, but its square in TSL",
        ((_LIGHTS, r"Favg(?= \+ EPS)", "Favg * Favg"),),
    ),
    Build("physical", "physical", "physical", {"index": 1.4}, "same as for the standard material"),
    Build(
        "weight",
        "physical, specularIntensity 0.5",
        "physical",
        {"specularWeight": 0.5},
        "`PhysicalLightingModel.direct` passes 1 as F90, whereas the GLSL passes `specularF90`",
        ((_LIGHTS, r"material\.specularF90(?=;| \* dfg[VL])", "1.0"),),
    ),
    Build("coat", "physical, clear coat", "physical", _COAT, "same as for the standard material"),
    Build(
        "sheen",
        "physical, sheen",
        "physical",
        _SHEEN,
        "TSL lacks the `saturate` of `V_Neubelt`",
        ((_LIGHTS, r"saturate(?=\( 1\.0 / \( 4)", ""),),
    ),
    Build(
        "both",
        "physical, clear coat and sheen",
        "physical",
        {**_COAT, **_SHEEN},
        "`PhysicalLightingModel.finish` adds the sheen after the coat, whereas `meshphysical` adds it before",
        ((_PROGRAM, r" \+ sheenSpecular\w+(?=.*;)", ""), (_PROGRAM, "(?=#include <opaque)", _LAST)),
    ),
    Build("anisotropic", "anisotropic", "anisotropic", {"strength": 0.6}, "same as for the standard material"),
    Build(
        "film",
        "iridescent",
        "iridescent",
        {"filmThickness": 500.0},
        "`XYZ_TO_REC709` was transposed in TSL before [#33984](https://github.com/mrdoob/three.js/pull/33984)",
        (("ShaderChunk/iridescence_fragment.glsl.js", r"XYZ_TO_REC709(?= \*)", "transpose( XYZ_TO_REC709 )"),),
    ),
)


def trials(folder: Path) -> dict[str, float]:
    """Largest relative differences between the two builds, and those that remain after the changes to the GLSL."""
    apart = {one.name: _difference(folder, one) for one in BUILDS}
    (package,) = (Path(one) for one in _includes(folder) if one.endswith("/shaders"))
    changed: dict[Path, str] = {}
    for file, pattern, replacement in (change for one in BUILDS if apart[one.name] > SAME for change in one.changes):
        # beside the shader, where #include looks first: chunks are included without the name of their folder
        beside = folder / (file if file in (_LIGHTS, _PROGRAM) else Path(file).name)
        text = changed.get(beside) or (folder / package / file).read_text(encoding="utf-8")
        changed[beside] = re.sub(pattern, replacement, text)
    try:
        for beside, text in changed.items():
            beside.parent.mkdir(exist_ok=True)
            beside.write_text(text, encoding="utf-8")
        files.forget()
        left = max(_difference(folder, one) for one in BUILDS)
    finally:
        for beside in changed:
            beside.unlink()
        files.forget()
    return {f"tsl_{name}": value for name, value in apart.items()} | {"tsl_left": left}


def _includes(folder: Path) -> list[str]:
    adapter = tomllib.loads((folder / "three-physical.glsl.toml").read_text(encoding="utf-8"))
    return list(adapter["includes"])


def _difference(folder: Path, one: Build) -> float:
    names = (f"three-{one.material}", f"three-tsl-{one.material}")
    return difference(*(material(folder, name, **_BASE | one.parameters) for name in names))


def section(old: str, before: dict[str, float], new: str, after: dict[str, float]) -> str:
    """The section that compares the two builds."""

    def cell(value: float) -> str:
        return f"{value:.2g}" if value > SAME else "equal"

    rows = "\n".join(
        f"| {one.title} | {cell(before[f'tsl_{one.name}'])} | {cell(after[f'tsl_{one.name}'])} | {one.why} |"
        for one in BUILDS
    )
    return f"""## TSL against WebGL

The table gives the largest relative difference between the values of f in the two builds, over 4,000 pairs of
directions up to 89 degrees. Base color is 0.7, roughness is 0.8 and metalness is 0.3; *equal* means a difference of at
most 1e-5.

| material | {old} | {new} | cause |
|---|---|---|---|
{rows}

If these lines of the GLSL are changed to match TSL, all values agree within {before["tsl_left"]:.0e} in {old} and
{after["tsl_left"]:.0e} in {new}. Release {new} itself still contains one of the differences, the order of sheen and
clear coat.
[KHR_materials_sheen](https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_materials_sheen) puts
the clear coat on top of the sheen, as WebGLRenderer does. WebGPURenderer puts the sheen on top, where the coat does not
attenuate it; the last two white furnaces above differ most at grazing angles. Remedy: exchange the two blocks of
`PhysicalLightingModel.finish`."""
