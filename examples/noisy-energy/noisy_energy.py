"""E(mu) by 64 directions per texel, and exact: python examples/noisy-energy/noisy_energy.py writes energy.jpg."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
from matplotlib import colormaps

sys.path.insert(0, str(Path(__file__).parents[1]))
import sheets
from gonio.pictures import images

PICTURE = "energy.jpg"  # in the current folder
RESOLUTION = 96


def table(resolution: int = RESOLUTION, **options: Any) -> np.ndarray:
    """E of GGX at F = 1, (roughness, mu), with the masking term of the homework's figures."""
    return np.asarray(go.bake("ggx", masking="schlick-ibl", resolution=resolution, lut=["E"], **options).arrays["E"])


def shown(values: np.ndarray, low: float, high: float, colors: str) -> np.ndarray:
    """A table as linear colors, smooth at the bottom as in a plot of roughness."""
    scaled = np.clip((values[::-1] - low) / (high - low), 0.0, 1.0)
    return images.from_screen(colormaps[colors](scaled)[..., :3])


def main(resolution: int = RESOLUTION) -> None:
    exact = table(resolution)
    cosine = table(resolution, method="cosine", sampler="independent", samples=64)
    normals = table(resolution, method="ggx", sampler="independent", samples=64)
    many = table(resolution, method="ggx", sampler="independent", samples=1024)
    cells = [
        ("64 cosine-weighted directions", shown(cosine, 0.0, 1.2, "inferno")),
        ("64 GGX normals", shown(normals, 0.0, 1.2, "inferno")),
        ("exact", shown(exact, 0.0, 1.2, "inferno")),
    ]
    for title, values in (("64 directions", cosine), ("64 normals", normals), ("1,024 normals", many)):
        rms = float(np.sqrt(np.mean((values - exact) ** 2)))
        cells.append((f"error of {title}: {rms:.2g} rms", shown(values - exact, -0.3, 0.3, "RdBu_r")))
    print(sheets.draw(PICTURE, cells, 3))


if __name__ == "__main__":
    main()
