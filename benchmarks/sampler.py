"""A sampling guide learned from `eval` compared with hand-written sampling: variance at equal sample counts.

    python benchmarks/sampler.py [--samples 32] [--pictures 12] [--only conductor,mix]

The materials are Gonio's own, with `pdf` and `sample` hidden. For each, PICTURES pictures of SAMPLES samples are
rendered with independent random numbers. Printed is the variance of a pixel among the pictures, averaged over the ball:
guided, relative to hand-written sampling. "furnace" is a ball under a white sky, lit by BSDF sampling only; "lit" is
the ball of `gonio render MATERIAL` with its three lamps, by path tracing. Parentheses give the relative variance of
hand-written sampling. A variance below FLOOR counts as FLOOR: at one sample per pixel, such noise is less than a step
of an 8-bit picture.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
import time
from pathlib import Path

import gonio as go
import numpy as np
from gonio.material import guide_search

FLOOR = 1e-4  # relative variance of one sample: a deviation of 1 %, about one 8-bit step
SIZE = 96


def hidden(material: go.BSDF) -> go.BSDF:
    """The material without its own pdf and sample."""
    cls = type(material)
    own = {"pdf": go.BSDF.pdf, "sample": go.BSDF.sample, "__module__": __name__}
    return type("Hidden" + cls.__name__, (cls,), own)(**{n: getattr(material, n) for n in material.parameters()})


def materials() -> dict[str, go.BSDF]:
    """The materials of the comparison."""
    gold = go.Conductor.preset
    return {
        **{f"conductor {alpha:g}": gold("Au", alpha=alpha) for alpha in (0.05, 0.1, 0.2, 0.5, 1.0)},
        "conductor beckmann .3": gold("Au", alpha=0.3, ndf="beckmann"),
        "conductor .1 x .4": gold("Au", alpha=(0.1, 0.4)),
        **{f"phong {p:g}": go.Phong(p=p) for p in (8.0, 64.0, 512.0)},
        **{f"oren-nayar {s:g}": go.OrenNayar(sigma=s) for s in (0.2, 0.6)},
        "kulla-conty .5": go.KullaConty(gold("Au", alpha=0.5)),
        "mix metal lambert": go.Mix(gold("Au", alpha=0.1), go.Lambert(0.5)),
        "mix phong metal": go.Mix(go.Phong(p=200.0), gold("Cu", alpha=0.4)),
    }


def furnace(material: go.BSDF, seed: int, samples: int, folder: Path) -> np.ndarray:
    """A ball under a white sky that fills the picture."""
    scene = {
        "output": {"filename": "furnace.exr"},
        "sampler": {"type": "independent", "samples": samples},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 0, 6], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
            "verticalFov": 13.5,
            "film": {"size": [SIZE, SIZE]},
        },
        "integrator": {"type": "directSampleBSDF"},
        "scene": {
            "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": {"type": "matte"}}],
            "lights": [{"type": "environmentLight", "radiance": [1.0, 1.0, 1.0]}],
        },
    }
    path = folder / "furnace.json"
    path.write_text(json.dumps(scene))
    return go.render(path, seed=seed, spp=samples, overrides={"shapes.0.material": material})


def lit(material: go.BSDF, seed: int, samples: int, folder: Path) -> np.ndarray:
    """The shading ball of `gonio render MATERIAL`, close up."""
    closer = {"/camera/transform/position": [0, 1.6, 3.6], "/camera/verticalFov": 34}
    return go.render(material, seed=seed, spp=samples, size=(SIZE, SIZE), sampler="independent", overrides=closer)


def variance(material: go.BSDF, picture: object, pictures: int, samples: int, folder: Path) -> float:
    """Variance of one sample divided by the squared mean, over the ball's disk."""
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    disc = x * x + y * y < (0.33 * SIZE) ** 2  # inside the silhouette, where only the ball is visible
    made = np.array([picture(material, seed, samples, folder)[disc].mean(-1) for seed in range(1, pictures + 1)])  # type: ignore[operator]
    return float(made.var(0, ddof=1).mean() * samples / made.mean() ** 2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--pictures", type=int, default=12)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    ratios = []
    with tempfile.TemporaryDirectory() as name:
        for title, material in materials().items():
            if not any(part in title for part in options.only.split(",")):
                continue
            guided = hidden(material)
            start = time.perf_counter()
            chart = ", ".join(lobe.chart for lobe in guide_search.guide_of(guided).lobes)
            text = f"{title:22} found in {time.perf_counter() - start:4.2f} s, {chart:7}"
            for scene in (furnace, lit):
                by_hand, by_guide = (
                    variance(m, scene, options.pictures, options.samples, Path(name)) for m in (material, guided)
                )
                ratio = max(by_guide, FLOOR) / max(by_hand, FLOOR)
                ratios.append(ratio)
                text += f"   {scene.__name__} {ratio:6.3f} ({by_hand:.2g})"
            print(text, flush=True)
    print(f"guided over by hand: median {statistics.median(ratios):.3f}, at most {max(ratios):.3f}")


if __name__ == "__main__":
    sys.exit(main())
