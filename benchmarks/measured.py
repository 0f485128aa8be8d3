"""Limits for measured materials: comparison with Mitsuba, round trips, conversions, time in a render, sampling.

python benchmarks/measured.py [rgl|merl|convert|render|sampling ...]      --data FOLDER ($GONIO_SHARED/data)

`rgl`: Mitsuba's plugin computes in float32 throughout; no variant uses float64. Where it differs from Gonio's float64
by more than 1e-4, the difference is compared with the effect of float32: with the range of the values when the
directions are rounded once, and when in addition the half vector's point in the unit square, and the position in the
table, are off by up to 8 float32 ulps of 1. Such ranges are large where a lobe ends, since the position is near 1 and
values vanish with 1 - position, and next to a node at which D is 0, since values vanish with the distance from it.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

import gonio as go
import numpy as np
from gonio import ops
from gonio.measure import compare, read
from gonio.measure.colours import LUMINANCE
from gonio.measure.formats.base import Format
from gonio.measure.tables import adaptive, half_difference
from gonio.measure.tables.base import Measurement
from gonio.ops import Direction, Spectrum, backend, vec3

DATA = Path(os.environ.get("GONIO_SHARED", ".")) / "data"
COUNT = 100_000
ROUNDING = 2.0**-24
PLACES = 8.0  # float32 ulps of 1 by which a position may be off, after two sums and their quotient
TRIES = 400  # random choices of rounding errors
TURNS = 24  # repetitions of a timed render
VIEWS = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)


def files() -> list[str]:
    """Every shared measurement file."""
    networks = DATA / "nbrdf" / "merl.npz"
    names = Format.family.get("networks").items(networks.read_bytes(), str(networks))
    plain = [str(path) for path in (*sorted((DATA / "rgl").glob("*.bsdf")), *sorted((DATA / "cornell").glob("*.brdf")))]
    return [*plain, *(f"{networks}:{name}" for name in names)]


def directions(rng: np.random.Generator, count: int) -> np.ndarray:
    """Directions above the surface that float32 represents exactly."""
    z, phi = rng.uniform(0.0, 1.0, count), rng.uniform(0.0, 2.0 * np.pi, count)
    sin = np.sqrt(1.0 - z * z)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), z], -1).astype(np.float32).astype(float)


def rgl() -> None:
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    print(f"RGL against Mitsuba's `measured`, {COUNT} directions, half of them drawn: share within 1e-4; of the others")
    print(
        "the worst plainly, beyond one rounding of directions, beyond those of the places (how many); Gonio's float32"
    )
    for path in sorted((DATA / "rgl").glob("*.bsdf")):
        rng = np.random.default_rng(0)
        model = go.Measured(str(path))
        wo, wi = directions(rng, COUNT), directions(rng, COUNT)
        drawn = model.sample(wo[::2], rng.random((COUNT // 2, 3)))
        wi[::2] = np.where(drawn.pdf[:, None] > 0.0, drawn.wi, wi[::2])
        theirs = mi.load_dict({"type": "measured", "filename": str(path)})
        si = mi.SurfaceInteraction3f()
        si.wi, light = (mi.Vector3f(*w.T.astype(np.float32)) for w in (wo, wi))
        others = [
            np.array(part(mi.BSDFContext(), si, light)).T.reshape(COUNT, -1) for part in (theirs.eval, theirs.pdf)
        ]
        own = [part(wo, wi, precision="float64").reshape(COUNT, -1) for part in (model.eval, model.pdf)]
        plain = [_relative(a - b, b) * (a != 0.0) for a, b in zip(own, others, strict=True)]
        far = np.flatnonzero(np.maximum(*(one.max(axis=1) for one in plain)) > 1e-4)
        by_directions, by_places = rounded(model, wo[far], wi[far], rng)
        single = [part(wo[far], wi[far], precision="float32").reshape(len(far), -1) for part in (model.eval, model.pdf)]
        text = []
        for index in range(2):
            a, b = own[index][far], others[index][far]
            left = [
                _relative(np.maximum(low - b, 0.0) + np.maximum(b - high, 0.0), b) * (a != 0.0)
                for low, high in (by_directions[index], by_places[index])
            ]
            mine = _relative(single[index] - a, a)
            within = 1.0 - np.mean(plain[index].max(axis=1) > 1e-4)
            text.append(
                f"{within:8.3%} {plain[index].max():8.1e} {left[0].max():8.1e} {left[1].max():8.1e} "
                f"({np.sum(left[1].max(axis=1) > 1e-4)}) {mine.max():8.1e}"
            )
        print(f"  {path.stem:26} eval {text[0]}   pdf {text[1]}", flush=True)


def _relative(difference: np.ndarray, value: np.ndarray) -> np.ndarray:
    """|difference| / |value|, 0 where the value is 0."""
    return np.divide(np.abs(difference), np.abs(value), out=np.zeros(value.shape), where=value != 0.0)


Ranges = list[tuple[np.ndarray, np.ndarray]]  # (lowest, highest) of eval, then of pdf


def rounded(model: go.BSDF, wo: np.ndarray, wi: np.ndarray, rng: np.random.Generator) -> tuple[Ranges, Ranges]:
    """The ranges of eval and pdf with rounded directions, and with rounded directions and positions in the table."""
    table, types = model.table, backend.types("float64")
    found: list[tuple[Ranges, float]] = [([], 0.0), ([], PLACES)]
    for ranges, reach in found:
        low: list[np.ndarray] = []
        high: list[np.ndarray] = []
        for turn in range(TRIES):
            # at most half a unit in the last place of 1 each; none in the first try
            shake = 0.0 if turn == 0 else ROUNDING
            o, i = (backend.vector_of(w + shake * rng.choice([-1.0, 0.0, 1.0], w.shape), 3, types) for w in (wo, wi))
            u, s = (
                [backend.float_of(reach * ROUNDING * rng.choice([-1.0, 0.0, 1.0], len(wo)), types) for _ in range(2)]
                for _ in range(2)
            )
            slices, phi = table._slices(o)
            m = ops.normalize(o + i)
            x, y = (a + b for a, b in zip(table._square(m, phi), u, strict=True))
            place = table._visible.invert(slices, x, y)
            at = [a + b for a, b in zip(place[:2], s, strict=True)]
            colour = vec3(*adaptive.bilinear(table._colours, *at, slices)[:3]) * table._factor(o, x, y, phi)
            density = place.pdf * table._bright.pdf(slices, *at) / adaptive._jacobian(x, m, i)
            now = [backend.to_numpy(value, len(wo)).reshape(len(wo), -1) for value in (colour, density)]
            low = [np.minimum(a, b) for a, b in zip(low or now, now, strict=True)]
            high = [np.maximum(a, b) for a, b in zip(high or now, now, strict=True)]
        ranges += list(zip(low, high, strict=True))
    return found[0][0], found[1][0]


class Stand(Measurement):
    """A material that takes the place of a measurement, to be tabulated."""

    def __init__(self, model: go.BSDF) -> None:
        super().__init__()
        self.model = model

    def value(self, wo: Direction, wi: Direction) -> Spectrum:
        return self.model.eval(wo, wi)


def merl() -> None:
    print("model -> .binary -> Measured: worst relative difference at cell centres; mean between cells, over samples")
    form = Format.family.get("merl")
    for alpha in (0.05, 0.1, 0.2, 0.5, 1.0):
        model = go.Conductor.preset("Au", alpha=alpha)
        table = form.read(form.write(form.resampled(Stand(model))), "gold")
        rng = np.random.default_rng(0)
        wo, wi = half_difference.centres((90, 90, 180))
        pick = rng.choice(np.flatnonzero(np.minimum(wo[:, 2], wi[:, 2]) > 1e-9), COUNT)
        expected = model.eval(wo[pick], wi[pick], precision="float64")
        exact = np.max(np.abs(table.rgb(wo[pick], wi[pick]) - expected) / expected)
        wo = directions(rng, COUNT)
        drawn = model.sample(wo, rng.random((COUNT, 3)), precision="float64")
        kept = (drawn.pdf > 0.0) & (drawn.wi[:, 2] > 0.01) & (wo[:, 2] > 0.01)
        expected = model.eval(wo[kept], drawn.wi[kept], precision="float64")
        between = np.mean(np.abs(table.rgb(wo[kept], drawn.wi[kept]) - expected) / expected)
        print(f"  alpha {alpha:<5} {exact:.1e}   {between:.3%}")


def convert() -> None:
    print("each file to each format and back: said / measured with other pairs, worst of both ways")
    worst = 1.0
    written = {name: one for name, one in Format.family.all().items() if one.writes}
    with tempfile.TemporaryDirectory() as folder:
        for source in files():
            row = []
            own = read(source).name
            for name, one in written.items():
                there = Path(folder) / f"there{one.suffixes[0]}"
                back = Path(folder) / f"back{next(w.suffixes[0] for w in written.values() if w.writes == own)}"
                steps = [source, str(there), str(back)]
                said = [compare.convert(a, b).error for a, b in pairwise(steps)]
                again = [compare.difference(read(a), read(b), seed=7) for a, b in pairwise(steps)]
                ratios = [
                    max(s, a) / max(min(s, a), 1e-12) for s, a in zip(said, again, strict=True) if max(s, a) > 1e-6
                ]
                worst = max([worst, *ratios])
                row.append(f"{name} {said[0]:.1%}/{said[1]:.1%} {max(ratios, default=1.0):.2f}")
            print(f"  {Path(source).name[:32]:32} {'  '.join(row)}", flush=True)
    print(f"  worst ratio {worst:.3f} (bar 1.25)")


def render() -> None:
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    import gonio.mitsuba  # noqa: F401

    table = Path(tempfile.gettempdir()) / "gonio-benchmark.binary"
    form = Format.family.get("merl")
    table.write_bytes(form.write(form.resampled(Stand(go.Conductor.preset("Au", alpha=0.2)))))

    def scene(bsdf: dict[str, object]) -> object:
        look = mi.ScalarTransform4f().look_at([0, -5, 2], [0, 0, 0], [0, 0, 1])
        film = {"type": "hdrfilm", "width": 256, "height": 256}
        return mi.load_dict({
            "type": "scene", "ball": {"type": "sphere", "bsdf": bsdf}, "sky": {"type": "constant"},
            "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, 0, -1]).scale(8)},
            "lamp": {"type": "point", "position": [3, 3, 5], "intensity": 40.0},
            "sensor": {"type": "perspective", "fov": 26, "film": film, "to_world": look},
            "integrator": {"type": "path", "max_depth": 5},
        })  # fmt: skip

    scenes = {
        "GGX": scene({"type": "gonio_conductor", "preset": "Au", "alpha": 0.2}),
        "MERL-size table": scene({"type": "gonio_measured", "file": str(table)}),
        "RGL table": scene({"type": "gonio_measured", "file": str(sorted((DATA / "rgl").glob("*.bsdf"))[0])}),
    }
    best = dict.fromkeys(scenes, np.inf)
    for turn in range(TURNS):  # the first compiles
        for name, one in scenes.items():
            dr.sync_thread()
            start = time.process_time()
            dr.eval(mi.render(one, spp=64, seed=turn))
            dr.sync_thread()
            best[name] = min(best[name], time.process_time() - start) if turn else np.inf
    print(f"path tracing a ball that fills the picture, 64 spp, 256 x 256, least CPU seconds of {TURNS - 1}")
    for name, seconds in best.items():
        print(f"  {name:16} {seconds:.3f} s   {seconds / best['GGX']:.2f} x GGX")


def sampling() -> None:
    print(
        "variance of eval / pdf (luminance) against cosine sampling at equal samples, over views from 0 to 85 degrees"
    )
    ratios = []
    for source in files():
        if source.endswith(".brdf"):
            continue
        model, rng = go.Measured(source), np.random.default_rng(1)
        own, flat = [], []
        for angle in np.radians(VIEWS):
            wo = np.tile([np.sin(angle), 0.0, np.cos(angle)], (COUNT, 1))
            u = rng.random((COUNT, 3))
            own.append(np.var(model.sample(wo, u).weight @ LUMINANCE))
            radius, turn = np.sqrt(u[:, 1]), 2.0 * np.pi * u[:, 2]
            wi = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - u[:, 1])], -1)
            flat.append(np.var(model.eval(wo, wi) @ LUMINANCE * np.pi / np.maximum(wi[:, 2], 1e-9)))
        ratios.append(np.mean(flat) / np.mean(own))
        name = source.rpartition("/")[2].removeprefix("merl.npz:")
        print(f"  {name:28} {ratios[-1]:10.3g} times less", flush=True)
    print(f"  least {min(ratios):.3g}, median {np.median(ratios):.3g}")


def main() -> None:
    global DATA
    words = sys.argv[1:]
    if "--data" in words:
        at = words.index("--data")
        DATA = Path(words[at + 1])
        del words[at : at + 2]
    if not DATA.is_dir() and words != ["merl"]:
        sys.exit(f"no folder {DATA}: --data FOLDER, or GONIO_SHARED, names the one with rgl/, nbrdf/ and cornell/")
    known = {"rgl": rgl, "merl": merl, "convert": convert, "render": render, "sampling": sampling}
    for name in words or known:
        known[name]()


if __name__ == "__main__":
    main()
