"""Render time with a shader as the material, compared with the same native material, in one process.

    python benchmarks/shader_render.py [--rounds 7] [--spp 64] [--language wgsl]

Each material is written by `gonio emit` with eval, pdf and sample, read again and rendered on a ball next to the
original. The two alternate, after a first render of each that compiles. Times are CPU times of this process, since
other programs may be running; the ratio is the median over the rounds.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

import gonio as go
import numpy as np

MATERIALS = {
    "gold": go.Conductor.preset("Au", alpha=0.3),
    "gold of two widths": go.Conductor.preset("Au", alpha=(0.3, 0.1)),
    "disney": go.model("disney")(roughness=0.4, sheen=0.5, clearcoat=0.5),
    "eon": go.model("eon")(0.5, 0.6),
}


def main(rounds: int, spp: int, language: str) -> None:
    """Print one line per material."""
    print(f"{'material':20} {'native, s':>10} {'shader, s':>10} {'ratio':>7} {'range':>15} {'pictures differ by':>19}")
    for name, native in MATERIALS.items():
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"material.{language}"
            file.write_text(go.emit(native, language))
            shader = go.Shader(file, **_values(native))
            pictures = [_rendered(material, spp)[1] for material in (native, shader)]
            times = [[_rendered(material, spp)[0] for material in (native, shader)] for _ in range(rounds)]
        ratios = [second / first for first, second in times]
        least = [min(column) for column in zip(*times, strict=True)]
        difference = np.mean(np.abs(pictures[0] - pictures[1])) / np.mean(pictures[0])
        range_ = f"{min(ratios):.3f} to {max(ratios):.3f}"
        line = f"{name:20} {least[0]:10.2f} {least[1]:10.2f} {statistics.median(ratios):7.3f} {range_:>15}"
        print(f"{line} {difference:19.1e}", flush=True)


def _rendered(material: go.BSDF, spp: int) -> tuple[float, np.ndarray]:
    """(CPU time, picture)."""
    began = time.process_time()
    picture = go.render(material, spp=spp, size=(512, 512), integrator="path")
    return time.process_time() - began, np.asarray(picture)


def _values(native: go.BSDF) -> dict[str, object]:
    """The values of the shader's parameters; vectors are given component by component."""
    from gonio.shaders import bundle

    values: dict[str, object] = {}
    for field in bundle(native, "glsl").manifest["fields"]:
        if field["type"] == "vec2":
            values |= {f"{field['name']}_{axis}": x for axis, x in zip("xy", field["value"], strict=True)}
        else:
            values[field["name"]] = field["value"]
    return values


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--rounds", type=int, default=7)
    options.add_argument("--spp", type=int, default=64)
    options.add_argument("--language", default="wgsl")
    given = options.parse_args()
    main(given.rounds, given.spp, given.language)
