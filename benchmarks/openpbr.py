"""OpenPBR compared with its authors' reference implementation, and the furnaces that its specification lists.

    python benchmarks/openpbr.py --reference DIR --glm DIR [--sets 100] [--directions 10000]
    python benchmarks/openpbr.py --furnace

The comparison needs `g++` and two things that are not part of Gonio: a checkout of github.com/adobe/openpbr-bsdf
(--reference), and the folder that contains `glm/glm.hpp` (--glm). They are compiled in a temporary folder. Sets of
parameters are drawn by kind. Differences are those of f |cos theta_i| without the factor (eta_o/eta_i)^2 of radiance,
divided by the reference value where that is above 1. `albedo` is Gonio's material with the specification's layering and
separable masking, as in the reference; `reciprocal` is Gonio's default.
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import tempfile
import warnings
from pathlib import Path
from typing import ClassVar

import gonio as go
import numpy as np

NAMES = (
    "base_weight", "base_color", "base_diffuse_roughness", "base_metalness", "specular_weight", "specular_color",
    "specular_roughness", "specular_roughness_anisotropy", "specular_ior", "transmission_weight",
    "transmission_color", "subsurface_weight", "subsurface_color", "subsurface_scatter_anisotropy", "coat_weight",
    "coat_color", "coat_roughness", "coat_roughness_anisotropy", "coat_ior", "coat_darkening", "fuzz_weight",
    "fuzz_color", "fuzz_roughness", "thin_film_weight", "thin_film_thickness", "thin_film_ior",
)  # fmt: skip
COLOURS = {name for name in NAMES if name.endswith("color")}


class Separable(go.OpenPBR):
    """OpenPBR with the masking term of the reference."""

    name: ClassVar[str] = "openpbr-separable"
    _masking: ClassVar[str] = "smith-separable"


def source() -> str:
    """C++ source that wraps the reference in a plain C function."""
    lines, place = [], 0
    for name in NAMES:
        if name in COLOURS:
            lines.append(f"in.{name} = vec3(p[{place}], p[{place + 1}], p[{place + 2}]);")
        else:
            lines.append(f"in.{name} = p[{place}];")
        place += 3 if name in COLOURS else 1
    return f"""
#define NDEBUG
#include <glm/glm.hpp>
#include "openpbr.h"
extern "C" void values(const float* p, int thin, int count, const float* o, const float* i, float* out) {{
    OpenPBR_ResolvedInputs in = openpbr_make_default_resolved_inputs();
    in.geometry_thin_walled = thin != 0;
    {" ".join(lines)}
    for (int n = 0; n < count; ++n) {{
        const vec3 wo(o[3 * n], o[3 * n + 1], o[3 * n + 2]), wi(i[3 * n], i[3 * n + 1], i[3 * n + 2]);
        const OpenPBR_PreparedBsdf b =
            openpbr_prepare(in, vec3(1.0f), OpenPBR_BaseRgbWavelengths_nm, OpenPBR_VacuumIor, wo);
        const OpenPBR_DiffuseSpecular v = openpbr_eval(b, wi);
        for (int c = 0; c < 3; ++c) out[3 * n + c] = v.diffuse[c] + v.specular[c];
    }}
}}
"""


def compiled(reference: Path, glm: Path, folder: Path) -> ctypes.CDLL:
    (folder / "reference.cpp").write_text(source())
    command = ["g++", "-std=c++17", "-O2", "-w", "-shared", "-fPIC", f"-I{reference}", f"-I{glm}"]
    subprocess.run([*command, str(folder / "reference.cpp"), "-o", str(folder / "reference.so")], check=True)
    return ctypes.CDLL(str(folder / "reference.so"))


def kinds(rng: np.random.Generator) -> dict[str, tuple[int, object]]:
    """Kinds of parameter sets: their number in a hundred, and a function that draws one."""

    def colour(low: float = 0.05) -> tuple[float, ...]:
        return tuple(rng.uniform(low, 1.0, 3))

    def surface(least: float = 0.1) -> dict[str, object]:
        return {
            "base_color": colour(),
            "specular_roughness": rng.uniform(least, 1.0),
            "specular_ior": rng.uniform(1.2, 2.2),
            "specular_weight": rng.uniform(0.2, 1.0),
            "specular_color": colour(),
        }

    def fuzz() -> dict[str, object]:
        return {"fuzz_weight": rng.uniform(), "fuzz_color": colour(), "fuzz_roughness": rng.uniform()}

    def coat(rough: float = 0.0, darkening: float = 0.0) -> dict[str, object]:
        return {
            "coat_weight": 1.0, "coat_color": colour(), "coat_roughness": rough, "coat_darkening": darkening,
            "coat_ior": rng.uniform(1.2, 2.0),
        }  # fmt: skip

    film: dict[str, object] = {"thin_film_weight": 1.0}
    metal: dict[str, object] = {"base_metalness": 1.0}

    def widths() -> dict[str, object]:
        return {"specular_roughness_anisotropy": rng.uniform(0.1, 0.9)}

    def glass(low: float, high: float) -> dict[str, object]:
        rough, index = rng.uniform(low, high), rng.uniform(1.2, 2.2)
        return {"transmission_weight": 1.0, "specular_roughness": rough, "specular_ior": index}

    def paper() -> dict[str, object]:
        sheet: dict[str, object] = {
            "geometry_thin_walled": True,
            "subsurface_weight": 1.0,
            "subsurface_color": colour(),
        }
        return sheet | {"subsurface_scatter_anisotropy": rng.uniform(-1.0, 1.0)}

    return {
        "metal, smooth": (8, lambda: surface() | metal | {"specular_roughness": rng.uniform(0.1, 0.3)}),
        "metal, white, rough": (4, lambda: metal | {"base_color": 1.0, "specular_roughness": rng.uniform(0.3, 1.0)}),
        "metal, coloured, rough": (8, lambda: surface(0.3) | metal),
        "metal, two widths": (6, lambda: surface() | metal | {"specular_roughness": 0.25} | widths()),
        "glossy": (12, surface),
        "glossy, rough diffuse": (8, lambda: surface() | {"base_diffuse_roughness": rng.uniform()}),
        "fuzz over it": (8, lambda: surface() | fuzz()),
        "subsurface, thin wall": (6, lambda: surface() | paper()),
        "clear coat over metal": (8, lambda: surface() | coat(0.1) | metal | {"specular_roughness": 0.3}),
        "coat over glossy": (6, lambda: surface() | coat(0.1)),
        "coat, darkening": (6, lambda: surface() | coat(0.1, 1.0)),
        "rough coat": (4, lambda: surface() | coat(rng.uniform(0.3, 0.8))),
        "glass, smooth": (6, lambda: glass(0.1, 0.3) | {"transmission_color": colour()}),
        "glass, rough": (4, lambda: glass(0.4, 1.0)),
        "pane": (3, lambda: glass(0.1, 0.3) | {"geometry_thin_walled": True}),
        "film on glossy": (3, lambda: surface() | film | {"thin_film_thickness": rng.uniform(0.1, 0.8)}),
    }  # fmt: skip


def directions(rng: np.random.Generator, count: int, below: bool, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """wo over the upper hemisphere, or the sphere if light is transmitted; wi half near the mirror and refracted
    directions, half anywhere."""
    wo = rng.normal(size=(count, 3))
    wi = rng.normal(size=(count, 3))
    half = count // 2
    wo[:, 2] = np.abs(wo[:, 2])
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    wi[:half] = wo[:half] * [-1, -1, 1] + 2.0 * alpha * rng.normal(size=(half, 3))
    wi[:, 2] = np.abs(wi[:, 2])
    if below:
        wi[::2, 2] *= -1.0
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    fine = (wo[:, 2] > 0.02) & (np.abs(wi[:, 2]) > 0.02)
    return wo[fine].astype(np.float32), wi[fine].astype(np.float32)


def compare(reference: Path, glm: Path, share: float, count: int) -> None:
    rng = np.random.default_rng(11)
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(reference, glm, Path(folder))
        print(f"{'kind':26}{'sets':>5}  albedo: median, 99 %, worst          reciprocal: median, 99 %, worst")
        for kind, (sets, draw) in kinds(rng).items():
            off: dict[str, list[np.ndarray]] = {"albedo": [], "reciprocal": []}
            for _ in range(max(1, round(sets * share))):
                values = draw()  # type: ignore[operator]
                model = go.OpenPBR(**values)
                wo, wi = directions(rng, count, model.transmits, model.specular_roughness**2)
                flat = [np.broadcast_to(getattr(model, name), 3 if name in COLOURS else 1) for name in NAMES]
                given = np.concatenate(flat).astype(np.float32)
                right = np.zeros((len(wo), 3), np.float32)
                arrays = [a.ctypes.data_as(ctypes.c_void_p) for a in (given, wo, wi, right)]
                library.values(arrays[0], int(model.geometry_thin_walled), len(wo), *arrays[1:])
                for name, ours in (("albedo", Separable(**values, layering="albedo")), ("reciprocal", model)):
                    got = ours.eval(wo, wi, mode="importance", precision="float64")
                    off[name].append(np.abs(got - right) / np.maximum(right, 1.0))
            words = []
            for found in off.values():
                one = np.concatenate(found).max(1)
                words.append(f"{np.median(one):9.1e} {np.percentile(one, 99):9.1e} {one.max():9.1e}")
            print(f"{kind:26}{max(1, round(sets * share)):5}  {words[0]}        {words[1]}", flush=True)


FURNACE_MU = (0.1, 0.2, 0.3, 0.5, 0.75, 1.0)


def furnaces() -> dict[str, dict[str, object]]:
    """White materials from the specification's list, each at one roughness."""
    sub = {"subsurface_weight": 1.0, "subsurface_color": 1.0, "subsurface_radius": 0.0}
    bases: dict[str, dict[str, object]] = {
        "metal": {"base_metalness": 1.0},
        "diffuse": {},
        "rough diffuse": {"base_diffuse_roughness": 1.0},
        "subsurface": sub,
        "translucent": {"transmission_weight": 1.0},
        "a mix of all": {**sub, "base_metalness": 0.3, "transmission_weight": 0.3, "subsurface_weight": 0.5},
        "thin wall": {**sub, "geometry_thin_walled": True, "transmission_weight": 0.5, "subsurface_weight": 0.5},
    }
    over: dict[str, dict[str, object]] = {
        "bare": {},
        "coat": {"coat_weight": 1.0},
        "rough coat": {"coat_weight": 1.0, "coat_roughness": 0.5},
        "half a coat": {"coat_weight": 0.5, "coat_darkening": 0.5},
        "fuzz": {"fuzz_weight": 1.0},
        "film": {"thin_film_weight": 1.0, "thin_film_ior": 2.0},
        "two widths": {"specular_roughness_anisotropy": 0.7},
    }
    return {f"{base}, {layer}": {**bases[base], **over[layer]} for base in bases for layer in over}


def furnace() -> None:
    print(f"{'white material':28} least and greatest albedo over roughness .05 to 1 and cosines {FURNACE_MU}")
    for name, values in furnaces().items():
        found = []
        for roughness in (0.05, 0.2, 0.4, 0.7, 1.0):
            model = go.OpenPBR(base_color=1.0, specular_roughness=roughness, **values)
            found.append(go.albedo(model, mu=FURNACE_MU, method="sampling", samples=1 << 18).value)
        print(f"{name:28} {np.min(found):.4f} {np.max(found):.4f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--reference", type=Path, help="checkout of github.com/adobe/openpbr-bsdf")
    parser.add_argument("--glm", type=Path, help="folder that holds glm/glm.hpp")
    parser.add_argument("--sets", type=int, default=100)
    parser.add_argument("--directions", type=int, default=10_000)
    parser.add_argument("--furnace", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore", go.GonioWarning)
    if options.furnace:
        furnace()
    elif options.reference and options.glm:
        compare(options.reference, options.glm, options.sets / 100.0, options.directions)
    else:
        parser.error("give --reference and --glm, or --furnace")


if __name__ == "__main__":
    main()
