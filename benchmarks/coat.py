"""A coat compared with a random walk between its two interfaces: the error of the albedo.

    python benchmarks/coat.py [--walks 1000000]

The walk samples the coat's surface as rough or smooth glass from either side, and the base by its own `sample`, and
weights each crossing by Beer's law, until it leaves. Light lost by rough glass in single scattering is restored
(KullaConty), as in `coat`. Furnaces: white bases, no absorption, at 12 angles.
"""

from __future__ import annotations

import argparse

import gonio as go
import numpy as np

Coat, Eon = go.model("coat"), go.model("eon")
MU = (0.1, 0.3, 0.6, 0.95)
NEVER = 400  # bounces after which almost no walks are left


def walked(coat: go.BSDF, mu: float, walks: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """(albedo, standard error) at the viewing cosine mu, (3,) each."""
    rng = np.random.default_rng(seed)
    glass = go.Dielectric(coat.index, coat.alpha, ndf=coat.ndf, masking=coat.masking)
    surface = glass if glass.delta == "always" else go.KullaConty(glass)
    absorption = np.broadcast_to(np.asarray(coat.absorption, float), 3) * float(coat.depth)
    wo = np.tile([np.sqrt(1.0 - mu * mu), 0.0, mu], (walks, 1))
    weight, left = np.ones((walks, 3)), np.zeros((walks, 3))
    index = np.arange(walks)
    for _ in range(NEVER):
        drawn = surface.sample(wo, rng.random((len(wo), 3)), mode="importance")
        weight = weight * np.where(drawn.pdf > 0.0, 1.0, 0.0)[:, None] * drawn.weight
        up = drawn.wi[:, 2] > 0.0
        left[index[up]] += weight[up]
        alive = ~up & (weight.max(1) > 0.0)
        index, weight, down = index[alive], weight[alive], -drawn.wi[alive].astype(float)
        if not len(index):
            break
        hit = coat.base.sample(down, rng.random((len(down), 3)))
        weight = weight * np.where(hit.pdf > 0.0, 1.0, 0.0)[:, None] * hit.weight
        path = 1.0 / np.maximum(down[:, 2], 1e-6) + 1.0 / np.maximum(hit.wi[:, 2], 1e-6)
        weight = weight * np.exp(-absorption * path[:, None])
        # Russian roulette: walks of small weight end, and the others compensate
        keep = np.minimum(weight.max(1) * 4.0, 1.0)
        alive = rng.random(len(keep)) < keep
        index, weight = index[alive], weight[alive] / keep[alive, None]
        wo = -hit.wi[alive].astype(float)
        if not len(index):
            break
    return left.mean(0), left.std(0) / np.sqrt(walks)


def cases() -> dict[str, go.BSDF]:
    gold = {"eta": np.array([0.143, 0.375, 1.442]) / 1.5, "k": np.array([3.983, 2.386, 1.603]) / 1.5}
    bases = {
        "lambert": go.Lambert((0.9, 0.5, 0.1)),
        "eon": Eon((0.9, 0.5, 0.1), 1.0),
        "gold, alpha .05": go.Conductor(**gold, alpha=0.05),
        "gold, alpha .3": go.Conductor(**gold, alpha=0.3),
        "gold, alpha .6": go.Conductor(**gold, alpha=0.6),
        "gold, polished": go.Conductor(**gold, alpha=0.0),
    }
    found = {}
    for name, base in bases.items():
        found[name] = Coat(base)
        if base.delta == "never":
            found[f"{name}; coat alpha .2"] = Coat(base, alpha=0.2)
            found[f"{name}; coat alpha .5"] = Coat(base, alpha=0.5)
        found[f"{name}; coloured"] = Coat(base, absorption=(0.05, 0.3, 1.0))
    return found


def furnaces() -> dict[str, go.BSDF]:
    white = go.Conductor(fresnel="one", alpha=0.5)
    bases = {"lambert": go.Lambert(1.0), "eon": Eon(1.0, 1.0), "metal, given back": go.KullaConty(white)}
    widths = (0.0, 0.1, 0.3, 0.6, 1.0)
    return {f"{name}; coat alpha {a:g}": Coat(base, alpha=a) for name, base in bases.items() for a in widths}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--walks", type=int, default=1_000_000)
    options = parser.parse_args()
    worst = 0.0
    print("albedo, in red and blue at mu = .6; largest error over mu = .1, .3, .6, .95 and channels, of the albedo")
    for name, coat in cases().items():
        off, noise, shown = 0.0, 0.0, ""
        for mu in MU:
            right, error = walked(coat, mu, options.walks)
            found = go.albedo(coat, mu=mu, method="sampling", samples=1 << 19).value[0]
            size = np.abs(found - right) / right
            if size.max() > off:
                off, noise = float(size.max()), float((error / right)[np.argmax(size)])
            if mu == 0.6:
                shown = f"walk {right[0]:.4f} {right[2]:.4f}, coat {found[0]:.4f} {found[2]:.4f}"
        worst = max(worst, off)
        print(f"{name:28} {shown}   off by {100 * off:.2f} %, noise {100 * noise:.2f} %", flush=True)
    print(f"worst: {100 * worst:.2f} %")
    mu = np.linspace(0.05, 1.0, 12)
    for name, coat in furnaces().items():
        value = go.albedo(coat, mu=mu, method="sampling", samples=1 << 18).value[:, 0]
        print(f"white furnace, {name:34} {value.min():.4f} to {value.max():.4f}", flush=True)


if __name__ == "__main__":
    main()
