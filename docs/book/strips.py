"""A strip of five balls for each model, with its main parameter from low to high.

All other parameters are those of the contact sheet in examples/all-models.
"""

from __future__ import annotations

import io
import sys
import warnings
from pathlib import Path
from typing import Any

import gonio as go
import matplotlib.image
import numpy as np
from gonio.pictures import images
from gonio.viewer import stage

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples" / "all-models"))
import all_models  # noqa: E402

SCENE = ROOT / "examples" / "conductor-ggx" / "print.json"
SIZE = (800, 210)
# models for which the row in `gonio view` has only one ball, or varies a parameter with less visible effect
CHOSEN: dict[str, tuple[str, tuple[float, ...]]] = {
    "ashikhmin-shirley": ("exponent", (10.0, 40.0, 160.0, 640.0, 2560.0)),
    "disney": ("roughness", (0.1, 0.3, 0.5, 0.7, 0.9)),
    "disney2015": ("roughness", (0.1, 0.3, 0.5, 0.7, 0.9)),
    "lafortune": ("exponent", (2.0, 6.0, 18.0, 54.0, 162.0)),
    "openpbr": ("specular_roughness", (0.1, 0.3, 0.5, 0.7, 0.9)),
    "thin-dielectric": ("eta", (1.1, 1.3, 1.5, 1.8, 2.4)),
    "ward": ("alpha", (0.05, 0.1, 0.2, 0.3, 0.5)),
    "ward-duer": ("alpha", (0.05, 0.1, 0.2, 0.3, 0.5)),
}


def pages() -> dict[str, str | bytes]:
    """A picture for each model that has a main parameter."""
    return {f"reference/strips/strips/{name}.jpg": jpg(strip(balls)) for name, balls in all_series().items()}


def all_series() -> dict[str, list[tuple[str, go.BSDF]]]:
    """Label and material of each ball, by model; models without a main parameter are omitted."""
    found = {name: series(all_models.material(name)) for name in go.models()}
    return {name: balls for name, balls in found.items() if len(balls) > 1}


def series(material: go.BSDF) -> list[tuple[str, go.BSDF]]:
    """The balls in the first row of `gonio view`, or those of `CHOSEN`."""
    if material.name in CHOSEN:
        parameter, values = CHOSEN[material.name]
        return [(f"{parameter} {value:g}", stage.replaced(material, {parameter: value})) for value in values]
    balls = stage.of_models([material]).rows[0].balls
    return [(ball.label, stage.replaced(material, ball.values)) for ball in balls]


def labels(name: str) -> list[str]:
    """The labels of the balls in a strip."""
    return [label for label, _ in series(all_models.material(name))]


def strip(balls: list[tuple[str, go.BSDF]], size: tuple[int, int] = SIZE, spp: int = 16) -> np.ndarray:
    """The rendered picture of five balls in a row, in linear values."""
    changes: dict[str, Any] = {f"shapes.{number}.material": material for number, (_, material) in enumerate(balls)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", go.GonioWarning)  # highlights clip
        return go.render(SCENE, overrides=changes, size=size, spp=spp, denoise=spp > 4)


def jpg(picture: np.ndarray) -> bytes:
    written = io.BytesIO()
    options = {"quality": 85, "optimize": True, "progressive": True}
    matplotlib.image.imsave(written, images.to_screen(picture), format="jpg", pil_kwargs=options)
    return written.getvalue()
