"""Store what the collection's own C++ says of the published fits, and compare the models with it.

    python tests/catalog/oracle/make_published.py PROGRAM          # published.cpp, compiled as README.md says
    python tests/catalog/oracle/make_published.py PROGRAM --compare 1024

Without --compare it writes published.npz: f of every fit at 8 pairs of directions, float32. With it nothing is written:
the models are held against the program at as many pairs.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import gonio as go
import numpy as np

HERE = Path(__file__).parent
FIGURES = HERE.parents[2] / "src/gonio/catalog/published"
# in the order in which published.cpp reads them
ORDER = {
    "NganLafortune": ["albedo", "Cxy", "Cz", "sharpness"],
    "NganCookTorrance": ["albedo", "eta", "roughness"],
    "NganAshikhminShirley": ["albedo", "fresnelReflectance", "sharpness"],
    "NganHe": ["albedo", "autocorrelation", "roughness", "eta"],
    "LowAshikhminShirley": ["albedo", "sharpness", "fresnelReflectance"],
    "LowCookTorrance": ["albedo", "roughness", "eta"],
    "LowMicrofacetFit": ["A", "B", "C", "eta"],
    "LowSmooth": ["A", "B", "C", "eta"],
    "Bagher": ["albedo", "alpha", "p", "eta", "K", "Lambda", "c", "k", "theta0"],
    "NganWard": ["albedo", "roughness"],
    "NganWardDuer": ["albedo", "roughness"],
    "NganBlinnPhong": ["albedo", "sharpness"],
}


def printed() -> Iterator[tuple[str, str, str, dict[str, np.ndarray]]]:
    """(FILE/FIT, material, model, figures) of every fit."""
    for file in ("bagher2012", "low2012", "ngan2005"):
        for fit, one in json.loads((FIGURES / f"{file}.json").read_text())["fits"].items():
            shapes = {name: tuple(shape) for name, shape in one["parameters"].items()}
            ends = np.cumsum([int(np.prod(shape)) for shape in shapes.values()])
            for material, numbers in one["materials"].items():
                yield (
                    f"{file}/{fit}",
                    material,
                    one["model"],
                    dict(zip(shapes, np.split(numbers, ends[:-1]), strict=True)),
                )


def line(model: str, figures: dict[str, np.ndarray]) -> str:
    """A fit as published.cpp reads it."""
    if model == "NganLafortune":  # over the largest C first, or both powers are 0
        largest = max(abs(figures["Cxy"]), abs(figures["Cz"]))
        figures = {**figures, "Cxy": figures["Cxy"] / largest, "Cz": figures["Cz"] / largest}
    numbers = np.concatenate([np.ravel(figures[name]) for name in ["diffuse", *ORDER[model]]])
    return " ".join([model, *(repr(float(x)) for x in numbers)])


def directions(count: int) -> tuple[np.ndarray, np.ndarray]:
    """(wo, wi), half of them near a mirror's pair, from 1e-4 off on."""
    rng = np.random.default_rng(20120901)
    z, phi = rng.uniform(0.002, 1.0, (2, count)), rng.uniform(0.0, 2.0 * np.pi, (2, count))
    s = np.sqrt(1.0 - z * z)
    wo, wi = np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)
    near = count // 2
    off = 10.0 ** rng.uniform(-4.0, 0.0, near)
    wi[:near] = wo[:near] * [-1.0, -1.0, 1.0] + 0.5 * off[:, None] * rng.normal(size=(near, 3))
    wi[:, 2] = np.maximum(np.abs(wi[:, 2]), 1e-3)
    return wo, wi / np.linalg.norm(wi, axis=1, keepdims=True)


def values(program: str, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """f of every fit, (fits, pairs, 3)."""
    lines = "".join(line(model, figures) + "\n" for _, _, model, figures in printed())
    with tempfile.NamedTemporaryFile() as file:
        np.concatenate([wi, wo], 1).astype("<f8").tofile(file.name)
        done = subprocess.run([program, file.name], input=lines.encode(), capture_output=True, check=True)
    return np.frombuffer(done.stdout, "<f8").reshape(-1, len(wo), 3)


def main() -> None:
    if "--compare" not in sys.argv:
        wo, wi = directions(8)
        stored = values(sys.argv[1], wo, wi).astype(np.float32)
        np.savez_compressed(HERE / "published.npz", wo=wo, wi=wi, f=stored)
        return
    wo, wi = directions(int(sys.argv[-1]))
    worst: dict[str, float] = {}
    for (fit, material, _, _), expected in zip(printed(), values(sys.argv[1], wo, wi), strict=True):
        value = go.material(material, fit).f(wo, wi, precision="float64")
        worst[fit] = max(worst.get(fit, 0.0), float(np.max(np.abs(value - expected) / np.maximum(expected, 1e-12))))
    for fit, size in worst.items():
        print(f"{fit:30} {size:.1e}")


if __name__ == "__main__":
    main()
