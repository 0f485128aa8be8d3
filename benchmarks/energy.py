"""The measured values in docs/energy.md: tables, furnaces, the random walk, the cost of compensation, the ten balls.

    python benchmarks/energy.py [--pairs 16] [--walks 10] [--spp 64] [--only tables,furnaces]

Prints one line per value, with its limit. Times are the minimum of several runs, ratios are of alternating runs.
"""

from __future__ import annotations

import argparse
import copy
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import gonio as go
import numpy as np
from gonio.energy.albedo import monte_carlo, quadrature, walk
from gonio.energy.albedo.monte_carlo import Sampling
from gonio.energy.tables import bake
from gonio.materials.compensated import comparison
from gonio.ops import backend

ROOT = Path(__file__).resolve().parents[1]
CENTRES = (np.arange(128) + 0.5) / 128
MU, ROUGHNESS = np.meshgrid(CENTRES, CENTRES)
NDFS = ("ggx", "beckmann", "student-t")
MASKINGS = ("smith-correlated", "smith-separable", "smith-separable-exact", "schlick-direct", "schlick-ibl")
STEEP = np.array([0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.985, 1.0])


def figure(what: str, value: float, bar: float | None = None, form: str = ".1e", at_least: bool = False) -> None:
    """Print one value, and whether it is within its limit."""
    text = f"  {what:72} {value:{form}}"
    if bar is not None:
        met = value >= bar if at_least else value <= bar
        text += f"   bar {'>=' if at_least else '<='} {bar:g}: {'met' if met else 'MISSED'}"
    print(text, flush=True)


def within(what: str, values: object, low: float | None = None, high: float = 0.0) -> None:
    """Print a range of values, and whether it is within its limits."""
    a, b = float(np.min(values)), float(np.max(values))  # type: ignore[arg-type]
    met = "" if low is None else f"   bar {low:g} .. {high:g}: {'met' if low <= a and b <= high else 'MISSED'}"
    print(f"  {what:60} {a:.5f} .. {b:.5f}{met}", flush=True)


def best(job, rounds: int = 5) -> float:
    """Seconds of the fastest of several runs, after one that compiles."""
    job()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        job()
        times.append(time.perf_counter() - start)
    return min(times)


def independent(ndf: str, masking: str, mu: float, alpha: float, nodes: tuple[int, int] = (240, 240)) -> float:
    """E by other formulas in other variables, in NumPy: angle gamma and azimuth beta of the light about the mirror
    direction.

    A great circle from the mirror direction r with tangent t meets the horizon at tan(gamma) = -r_z / t_z. This jumps
    where t_z = 0, toward which the nodes of beta are graded; those of gamma are graded toward the peak, whose width is
    about 2 alpha.
    """
    x, w = np.polynomial.legendre.leggauss(nodes[0])
    s, ds = 0.5 * (x + 1.0), 0.5 * w
    near, weight = 0.5 * np.pi * s**4, 0.5 * np.pi * 4.0 * s**3 * ds  # away from beta = 90 degrees
    beta = np.concatenate([0.5 * np.pi - near, 0.5 * np.pi + near])[:, None]
    weight = 2.0 * np.concatenate([weight, weight])[:, None]  # the two halves are equal
    sin_o = np.sqrt(1.0 - mu * mu)
    o, r = np.array([sin_o, 0.0, mu]), np.array([-sin_o, 0.0, mu])
    t = np.cos(beta)[..., None] * np.array([mu, 0.0, sin_o]) + np.sin(beta)[..., None] * np.array([0.0, 1.0, 0.0])
    last = np.arctan2(r[2], -t[..., 2])
    x, w = np.polynomial.legendre.leggauss(nodes[1])
    a = np.arcsinh(last / alpha)
    place = 0.5 * (x + 1.0)[None]
    gamma = alpha * np.sinh(a * place)
    weight = weight * 0.5 * w[None] * alpha * a * np.cosh(a * place) * np.sin(gamma)
    i = np.cos(gamma)[..., None] * r + np.sin(gamma)[..., None] * t
    h = o + i
    h /= np.linalg.norm(h, axis=-1)[..., None]
    z2 = h[..., 2] ** 2
    tan2 = np.maximum(1.0 - z2, 0.0) / z2 / alpha**2
    d = ((1.0 + tan2) ** -2 if ndf == "ggx" else np.exp(-tan2)) / (np.pi * alpha**2 * z2**2)
    g = [_smith(ndf, masking, c, alpha) for c in (np.array(mu), np.maximum(i[..., 2], 1e-12))]
    both = 1.0 / (1.0 / g[0] + 1.0 / g[1] - 1.0) if masking == "smith-correlated" else g[0] * g[1]
    return float((d * both * weight).sum() / (4.0 * mu))


def _smith(ndf: str, masking: str, cos: np.ndarray, alpha: float) -> np.ndarray:
    """G1 at a cosine."""
    if masking.startswith("schlick"):
        k = (np.sqrt(alpha) + 1.0) ** 2 / 8.0 if masking == "schlick-direct" else alpha / 2.0
        return cos / (cos * (1.0 - k) + k)
    slope = cos / (alpha * np.sqrt(1.0 - cos**2) + 1e-300)
    if ndf == "ggx":
        return 2.0 / (1.0 + np.sqrt(1.0 + slope**-2))
    if masking == "smith-separable":
        fit = (3.535 * slope + 2.181 * slope**2) / (1.0 + 2.276 * slope + 2.577 * slope**2)
        return np.where(slope < 1.6, fit, 1.0)
    from scipy.special import erfc

    return 1.0 / (1.0 - 0.5 * erfc(slope) + np.exp(-(slope**2)) / (2.0 * slope * np.sqrt(np.pi)))


def tables() -> None:
    """E and E_avg of every distribution and masking term, against other nodes and other variables."""
    rough = ROUGHNESS >= 0.05
    rng = np.random.default_rng(0)
    texels = [(int(rng.integers(7, 128)), int(128 * rng.random() ** 2)) for _ in range(40)]
    for ndf in NDFS:
        for masking in MASKINGS:
            name = f"{ndf}, {masking}:"
            fine = quadrature.moments(ndf, masking, MU, ROUGHNESS**2, nodes=(110, 90)).white
            found = bake.bake(ndf, ["E"], masking=masking)
            own = found.manifest["error"]["E"]
            figure(f"{name} E at the nodes, roughness >= .05", np.abs(found.arrays["E"] - fine)[rough].max(), 2e-5)
            if ndf != "student-t":
                other = [independent(ndf, masking, CENTRES[c], CENTRES[r] ** 2) for r, c in texels]
                off = [abs(found.arrays["E"][at] - value) for at, value in zip(texels, other, strict=True)]
                figure(f"{name} E in other variables, 40 texels", max(off), 2e-5)
            truth = np.abs(found.arrays["E"] - fine).max()
            if truth > 1e-10:  # smaller values are rounding errors
                factor = max(own["max"] / truth, truth / own["max"])
                figure(f"{name} the manifest's error, factor to the truth", factor, 3, ".2f")
            exact = quadrature.average(ndf, masking, CENTRES**2, nodes=(90, 70), count=96)
            error = np.abs(quadrature.average(ndf, masking, CENTRES**2) - exact).max()
            figure(f"{name} E_avg", error, 1e-5)
            figure(f"{name} between nodes, linear layout", own["interpolation"])
            stretched = bake.bake(ndf, ["E"], masking=masking, layout="stretched").manifest["error"]["E"]
            figure(f"{name} between nodes, stretched layout", stretched["interpolation"], 2e-3)
            seconds = best(lambda ndf=ndf, masking=masking: bake.bake(ndf, ["E"], masking=masking), 3)
            figure(f"{name} seconds, warm, with its own error estimate", seconds, 1.0, ".2f")
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", "from gonio.energy.tables.bake import bake; bake('ggx', ['E'])"], check=True)
    figure("seconds of the first table in a fresh process, imports included", time.perf_counter() - start, 4.0, ".2f")


def two_widths() -> None:
    """E[phi, roughness, mu], 24 x 128 x 128, against a quadrature of (200, 120) nodes at some of its entries."""
    for ndf, masking, aspect in (("ggx", "smith-correlated", 0.25), ("ggx", "smith-separable", 0.1)):
        found = bake.bake(ndf, ["E", "Eavg"], masking=masking, aspect=aspect, layout="stretched")
        axes = bake.Axes("stretched", ndf, masking, 128, aspect, 24)
        part = np.ix_(np.arange(0, 24, 5), np.arange(29, 128, 14), np.arange(0, 128, 9))  # roughness >= 0.2
        fine = quadrature.moments(ndf, masking, *axes.at(*part), nodes=(200, 120)).white
        name = f"{ndf}, {masking}, alpha_y / alpha_x = {aspect}:"
        figure(f"{name} E", np.abs(found.arrays["E"][part] - fine).max(), 2e-5)
        figure(f"{name} between nodes", found.manifest["error"]["E"]["interpolation"])


def sampling() -> None:
    """Quadrature against sampling, GGX, smith-correlated; then the homework's layout, before rounding to 8 bits."""
    exact = quadrature.moments("ggx", "smith-correlated", MU, ROUGHNESS**2, nodes=(110, 90)).white
    ways = {
        "quadrature": lambda: quadrature.moments("ggx", "smith-correlated", MU, ROUGHNESS**2).white,
        "normals, 1024 independent samples": lambda: (
            monte_carlo.estimate(
                "ggx", "smith-correlated", quadrature.Points(MU, ROUGHNESS**2), Sampling("ggx", points="independent")
            ).value
        ),
    }
    product = {}
    for name, way in ways.items():
        rms = np.sqrt(np.mean((way() - exact)[ROUGHNESS >= 0.05] ** 2))
        seconds = best(way)
        product[name] = rms**2 * seconds
        print(f"  {name:40} rms {rms:.1e}, {seconds:.3f} s, rms^2 x time {product[name]:.1e}")
    first, second = product.values()
    figure("rms^2 x time, sampling over quadrature", second / first, 1e4, at_least=True)
    part = ROUGHNESS >= 0.1
    for masking in MASKINGS:
        truth = quadrature.moments("ggx", masking, MU, ROUGHNESS**2).white
        for points in ("hammersley", "independent"):
            found = monte_carlo.estimate(
                "ggx", masking, quadrature.Points(MU, ROUGHNESS**2), Sampling("ggx", points=points)
            )
            rms = np.sqrt(np.mean((found.value - truth)[part] ** 2))
            if points == "hammersley":
                figure(
                    f"{masking}: Hammersley, 1024 samples, rms", rms, 0.005 if "schlick" in masking else 0.006, ".4f"
                )
            else:
                ratio = rms / np.sqrt(np.mean(found.standard_error[part] ** 2))
                figure(f"{masking}: independent points, rms over the predicted error", ratio, 1.2, ".2f")
    if "GONIO_SHARED" not in os.environ:
        print("  NOT TRIED: a public solution's pictures; GONIO_SHARED names the folder with reference/kulla-conty")
    else:
        import mitsuba as mi
        from gonio.bridge import engine

        reference = Path(os.environ["GONIO_SHARED"]) / "reference" / "kulla-conty"
        engine.load("cpu")
        truth = quadrature.moments("ggx", "schlick-ibl", MU, ROUGHNESS**2).white[::-1]
        picture = np.array(mi.Bitmap(str(reference / "homework_E_importance_sampled.png")))[..., 0] / 255.0
        rms = np.sqrt(np.mean((picture - truth)[ROUGHNESS[::-1] >= 0.3] ** 2))
        figure("a public solution's E against schlick-ibl, roughness >= .3, rms", rms, 0.004, ".4f")
        average = np.array(mi.Bitmap(str(reference / "homework_Eavg.png")))[:, 0, 0] / 255.0
        off = np.abs(average - quadrature.average("ggx", "schlick-ibl", CENTRES**2)[::-1])
        figure("its E_avg, roughness >= .3", off[CENTRES[::-1] >= 0.3].max(), 0.0065, ".4f")


def furnaces() -> None:
    """White furnaces, mu 0.05 to 1: metal of roughness 0.05 to 1, glass of alpha 0.05 to 1 from both sides, others."""
    for masking in ("smith-correlated", "smith-separable"):
        for ndf in NDFS:
            values = [
                go.albedo(
                    go.KullaConty(go.Conductor(alpha=r * r, ndf=ndf, masking=masking, fresnel="one")), STEEP
                ).value
                for r in np.linspace(0.05, 1.0, 20)
            ]
            within(f"metal, {ndf}, {masking}", values, 0.999, 1.001)
    for eta in (1.5, 1 / 1.5, 1.33, 2.4, 1.1, 1.02):
        for masking in ("smith-correlated", "smith-separable"):
            values = [
                go.albedo(go.KullaConty(go.Dielectric(eta, a, masking=masking)), np.concatenate([STEEP, -STEEP])).value
                for a in np.linspace(0.05, 1.0, 12)
            ]
            bar = (0.995, 1.002) if eta in (1.5, 1 / 1.5) else ()
            within(f"glass, eta {eta:.4g}, {masking}", values, *bar)
    bases = {
        "Oren-Nayar, sigma .5": go.OrenNayar(1.0, 0.5),
        "Phong, p = 30": go.Phong(0.1, 0.4, 30.0),
        "Blinn-Phong, p = 60": go.BlinnPhong(0.1, 0.2, 60.0),
        "mix of two metals": go.mix(
            go.Conductor(alpha=0.1, fresnel="one"), go.Conductor(alpha=0.6, fresnel="one"), 0.3
        ),
        "mix of Lambert and metal": go.mix(go.Lambert(1.0), go.Conductor(alpha=0.3, fresnel="one"), 0.6),
    }
    for name, base in bases.items():
        within(f"measured base, {name}", go.albedo(go.KullaConty(base), STEEP).value, 0.999, 1.001)
    figure(
        "reciprocity of Kulla-Conty, gold, largest relative breach",
        comparison.breach(comparison.METHODS["kulla-conty bounce"], 0),
        1e-6,
    )


def random_walk(millions: float) -> None:
    """Gold of alpha 0.8 against the random walk, over mu and on average; the furnace of the walk itself."""
    gold = go.Conductor.preset("Au", alpha=0.8)
    count = int(millions * 1e6)
    x, w = quadrature.gauss(10)
    weight = 4.0 * w * x**3
    found = [walk.albedo(gold, float(mu), count // 10, seed) for seed, mu in enumerate(x**2)]
    referee, noise = weight @ [v for v, _ in found], np.sqrt(weight**2 @ [e**2 for _, e in found]).max()
    print(f"  mean albedo, gold, alpha .8: walk {np.round(referee, 4)} +- {noise:.0e}")
    away = {}
    for color in ("sheet", "bounce"):
        ours = weight @ go.albedo(go.KullaConty(gold, color=color), x**2).value
        away[color] = np.abs(ours - referee).mean()
        print(f"    Kulla-Conty, {color:6} {np.round(ours, 4)}, off by {away[color]:.4f} in the mean")
    print(f"    plain               {np.round(weight @ go.albedo(gold, x**2).value, 4)}")
    nearer = min(away, key=away.__getitem__)
    default = go.KullaConty(gold).color
    print(f"    nearer: {nearer}; default: {default}: {'met' if nearer == default else 'MISSED'}")
    for base in (go.Conductor(alpha=0.8, fresnel="one"), go.Dielectric(1.5, 0.5)):
        drawn = go.albedo(go.RandomWalk(base), 0.6, method="sampling", samples=count)
        sigma = abs(drawn.value[0, 0] - 1.0) / drawn.error[0, 0]
        print(
            f"  furnace of {base.name}, {count:.0e} walks by eval: {drawn.value[0, 0]:.5f} +- {drawn.error[0, 0]:.0e}"
        )
        figure(f"its distance from 1, {base.name}, in sigma", sigma, 3.0, ".1f")


def costs(millions: float) -> None:
    """Time of eval relative to that of the plain metal, in alternating runs."""
    dr = backend.drjit()
    kind = backend.types("float32")
    count = int(millions * (1 << 20))
    rng = np.random.default_rng(0)

    def directions():
        z, phi = kind.float(rng.random(count, np.float32)), kind.float(6.2831853 * rng.random(count, np.float32))
        r = dr.sqrt(1.0 - z * z)
        w = kind.vec3(r * dr.cos(phi), r * dr.sin(phi), z)
        dr.eval(w)
        return w

    wo, wi = directions(), directions()
    plain = go.Conductor.preset("Au", alpha=0.3)
    ways = {"plain": plain, "Kulla-Conty": go.KullaConty(plain), "Turquin": go.Turquin(plain)}
    times: dict[str, list[float]] = {name: [] for name in ways}
    for turn in range(25):
        for name, model in ways.items():
            dr.sync_thread()
            start = time.perf_counter()
            dr.eval(model.eval(wo, wi))
            dr.sync_thread()
            if turn > 1:
                times[name].append(time.perf_counter() - start)
    print(f"  plain metal: {count / min(times['plain']) / 1e6:.0f} M/s")
    for name in ("Kulla-Conty", "Turquin"):
        median = float(np.median(np.array(times[name]) / np.array(times["plain"])))
        figure(
            f"{name}, {millions:g} M pairs, time over plain, best", min(times[name]) / min(times["plain"]), 1.5, ".2f"
        )
        figure(f"{name}, {millions:g} M pairs, time over plain, median of pairs", median, 1.5, ".2f")


def ten_balls(spp: int) -> None:
    """The shading balls, 1024 x 512, path: ten compensated balls relative to ten plain ones, in alternating runs."""
    from gonio import scene
    from gonio.bridge import engine
    from gonio.transport import integrators

    mi = engine.load("cpu")
    base = json.loads((ROOT / "examples" / "shading-balls" / "scene.json").read_text())
    base["camera"]["film"]["size"] = [1024, 512]
    scenes = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in ("plain", "compensated"):
            description = copy.deepcopy(base)
            for shape in description["scene"]["shapes"]:
                metal = shape["material"].get("base", shape["material"])
                shape["material"] = metal if name == "plain" else {"type": "kulla-conty", "base": metal}
            Path(folder, "scene.json").write_text(json.dumps(description))
            scenes[name] = scene.build(scene.read(folder), mi)
    times: dict[str, list[float]] = {name: [] for name in scenes}
    for turn in range(6):
        for name, built in scenes.items():
            job = integrators.Render(built, integrators.Settings("path", max_depth=5, seed=turn))
            start = time.perf_counter()
            job.advance(spp)
            times[name].append(time.perf_counter() - start)
    ratio = np.median(np.array(times["compensated"][1:]) / np.array(times["plain"][1:]))
    print("  " + ", ".join(f"{name} {min(t[1:]):.2f} s" for name, t in times.items()))
    figure(f"ten balls, {spp} spp, compensated over plain", float(ratio), 1.3, ".2f")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=float, default=16, help="millions of direction pairs")
    parser.add_argument("--walks", type=float, default=10, help="millions of random walks")
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel of the ten balls")
    parser.add_argument("--only", default="", help="parts, by name, with commas between")
    options = parser.parse_args()
    parts = {
        "tables": tables,
        "two-widths": two_widths,
        "sampling": sampling,
        "furnaces": furnaces,
        "walk": lambda: random_walk(options.walks),
        "costs": lambda: costs(options.pairs),
        "balls": lambda: ten_balls(options.spp),
    }
    chosen = options.only.split(",") if options.only else list(parts)
    if unknown := set(chosen) - set(parts):
        parser.error(f"unknown part {', '.join(unknown)}; known: {', '.join(parts)}")
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores")
    for name in chosen:
        about = {"walk": random_walk, "costs": costs, "balls": ten_balls}.get(name, parts[name]).__doc__
        print(f"\n{name}: {about}")
        parts[name]()


if __name__ == "__main__":
    main()
