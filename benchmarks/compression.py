"""Limits for compression: size and error of each method, networks compared with published ones, time in a render.

python benchmarks/compression.py [curve|network|other|render ...]  --data FOLDER ($GONIO_SHARED/data)  --figure FILE.png

Errors are those of a sphere under a lamp and a sky (`measure/compression/sphere.py`): the mean over pixels and channels
of |new - old| / (|old| + 1 % of the mean). "Rebuilt" tables are those of Bagher's fits of the same materials.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

import gonio as go
import numpy as np
from gonio.measure import read
from gonio.measure.compression import sphere
from gonio.measure.compression.base import Method
from gonio.measure.compression.network import trained
from gonio.measure.formats.base import Format
from gonio.measure.formats.npz import arrays
from gonio.measure.formats.own import Own
from gonio.measure.tables.base import Measurement
from gonio.measure.tables.half_difference import sampled
from gonio.measure.tables.network import SHAPES, Network

DATA = Path(os.environ.get("GONIO_SHARED", ".")) / "data"
FIGURE: Path | None = None
SIZES = (16384, 4096, 65536)  # bytes per material, the size of the limit first
GIVEN = (16384, 0.01)  # bytes per material, and the limit of the median error


def names() -> list[str]:
    path = DATA / "nbrdf" / "merl.npz"
    return Format.family.get("networks").items(path.read_bytes(), str(path))


def networks() -> dict[str, Measurement]:
    """The published networks as tables."""
    return {name: read(f"{DATA / 'nbrdf' / 'merl.npz'}:{name}") for name in names()}


def published() -> dict[str, Network]:
    """The published networks themselves."""
    path = DATA / "nbrdf" / "merl.npz"
    parts = arrays(path.read_bytes(), str(path))
    return {name: Network({part: parts[f"{name}/{part}"] for part in SHAPES}, title=name) for name in names()}


def rebuilt(name: str) -> Measurement:
    """The table of Bagher's fit to a material."""
    model = go.material(name)
    return sampled(lambda wo, wi: model.eval(wo, wi, precision="float64"), title=name)


def error(old: Measurement, new: Measurement) -> float:
    return sphere.error(sphere.picture(old.rgb), sphere.picture(new.rgb))


def rgl() -> dict[str, Measurement]:
    return {path.stem.removesuffix("_rgb"): read(path) for path in sorted((DATA / "rgl").glob("*.bsdf"))}


def curve() -> None:
    print("bytes a material of the whole file, and the error on a sphere: median, worst; seconds a material")
    merl, files = networks(), rgl()
    found: dict[str, list[tuple[float, float]]] = {}
    jobs = [("log, RGL", "log", files, size) for size in (*SIZES, 8192)] + [("rgl, RGL", "rgl", files, 0)]
    jobs += [(f"{name}, MERL", name, merl, size) for size in SIZES for name in ("log", "lowrank")]
    pictures = {key: sphere.picture(table.rgb) for key, table in {**merl, **files}.items()}
    for title, method, tables, size in jobs:
        start, one = time.perf_counter(), Method.family.get(method)
        try:
            if one.shared:
                made = one.compress(list(tables.values()), size)
            else:
                made = [one.compress([table], size)[0] for table in tables.values()]
        except go.InputError as refused:
            print(f"  {title:14} {size:7}  {refused.what}", flush=True)
            continue
        seconds = (time.perf_counter() - start) / len(made)
        own = Own()
        if one.shared:
            count = len(own.write_several(dict(zip(tables, made, strict=True)))) / len(made)
        else:
            count = statistics.mean(len(own.write(table)) for table in made)
        errors = [
            sphere.error(pictures[key], sphere.picture(table.rgb)) for key, table in zip(tables, made, strict=True)
        ]
        median = statistics.median(errors)
        found.setdefault(title, []).append((count, median))
        print(f"  {title:14} {count:9.0f}  {median:8.3%}  {max(errors):8.3%}  {seconds:5.1f} s", flush=True)
    if FIGURE is not None:
        draw(found, FIGURE)


def draw(found: dict[str, list[tuple[float, float]]], path: Path) -> None:
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(8.5, 5.3), layout="constrained")
    for title, points in found.items():
        x, y = zip(*sorted(points), strict=True)
        axes.loglog(x, [100.0 * value for value in y], "o-" if len(points) > 1 else "s", label=title, markersize=5)
    axes.axvline(GIVEN[0], color="0.7", linewidth=1, zorder=0)
    axes.axhline(100.0 * GIVEN[1], color="0.7", linewidth=1, zorder=0)
    axes.text(GIVEN[0] * 1.06, 0.5, "16 KiB", color="0.4", fontsize=12, transform=axes.get_xaxis_transform())
    axes.text(0.99, 110.0 * GIVEN[1], "1 %", color="0.4", fontsize=12, ha="right", transform=axes.get_yaxis_transform())
    ticks = [4096, 8192, 16384, 32768, 65536, 131072]
    axes.set_xticks(ticks, [f"{tick // 1024} KiB" for tick in ticks], fontsize=11)
    axes.minorticks_off()
    axes.tick_params(labelsize=11)
    axes.set_xlabel("size of a material", fontsize=12)
    axes.set_ylabel("relative error on a sphere, median [%]", fontsize=12)
    axes.set_title("Compressed 13 MERL tables and 9 RGL files", fontsize=13)
    axes.legend(frameon=False, fontsize=12)
    figure.savefig(path, dpi=150)


def network() -> None:
    print("error on a sphere of 675 weights on the published networks' tables: trained here, published; seconds by the")
    print("clock (and of the cores)")
    against({name: (table, published()[name]) for name, table in networks().items()})


def other() -> None:
    print("the same on tables rebuilt from Bagher's fits of these materials, which neither was made from")
    against({name: (rebuilt(name), given) for name, given in published().items()})


def against(pairs: dict[str, tuple[Measurement, Measurement]]) -> None:
    """Train on tables, and print the errors next to those of other networks."""
    errors, seconds = [], []
    for name, (table, given) in pairs.items():
        start, spent = time.perf_counter(), time.process_time()
        made = trained(table)
        seconds.append(time.perf_counter() - start)
        cores = time.process_time() - spent
        errors.append((error(table, made), error(table, given)))
        print(
            f"  {name:24} {errors[-1][0]:7.2%} {errors[-1][1]:7.2%}  {seconds[-1]:5.1f} s ({cores:.0f} s)", flush=True
        )
    here, there = (statistics.median(column) for column in zip(*errors, strict=True))
    print(f"  median {here:.2%} here, {there:.2%} published, ratio {here / there:.3g}; longest {max(seconds):.1f} s")


def render() -> None:
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    import gonio.mitsuba  # noqa: F401

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "network.gonio"
        file.write_bytes(Own().write(published()[names()[0]]))

        def scene(bsdf: dict[str, object]) -> object:
            look = mi.ScalarTransform4f().look_at([0, -5, 2], [0, 0, 0], [0, 0, 1])
            return mi.load_dict({
                "type": "scene", "ball": {"type": "sphere", "bsdf": bsdf}, "sky": {"type": "constant"},
                "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, 0, -1]).scale(8)},
                "lamp": {"type": "point", "position": [3, 3, 5], "intensity": 40.0},
                "sensor": {"type": "perspective", "fov": 26, "to_world": look,
                           "film": {"type": "hdrfilm", "width": 256, "height": 256}},
                "integrator": {"type": "path", "max_depth": 5},
            })  # fmt: skip

        scenes = {
            "GGX": scene({"type": "gonio_conductor", "preset": "Au", "alpha": 0.2}),
            "network": scene({"type": "gonio_measured", "file": str(file)}),
        }
        best = dict.fromkeys(scenes, np.inf)
        for turn in range(16):  # the first compiles
            for name, one in scenes.items():
                dr.sync_thread()
                start = time.process_time()
                dr.eval(mi.render(one, spp=64, seed=turn))
                dr.sync_thread()
                best[name] = min(best[name], time.process_time() - start) if turn else np.inf
    print("path tracing a ball that fills the picture, 64 spp, 256 x 256, least CPU seconds of 15")
    for name, seconds in best.items():
        print(f"  {name:16} {seconds:.3f} s   {seconds / best['GGX']:.2f} x GGX (bar 3)")


def main() -> None:
    global DATA, FIGURE
    words = sys.argv[1:]
    for option in ("--data", "--figure"):
        if option in words:
            at = words.index(option)
            if option == "--data":
                DATA = Path(words[at + 1])
            else:
                FIGURE = Path(words[at + 1])
            del words[at : at + 2]
    if not DATA.is_dir():
        sys.exit(f"no folder {DATA}: --data FOLDER, or GONIO_SHARED, names the one with rgl/ and nbrdf/")
    known = {"curve": curve, "network": network, "other": other, "render": render}
    for name in words or known:
        known[name]()


if __name__ == "__main__":
    main()
