"""The compensations side by side: what each loses, how far it is from the random walk, what it breaks and costs."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ...errors import InputError
from ...models import BSDF
from ...models.conductor import Conductor
from ...models.dielectric import Dielectric
from ...ops import backend
from ..albedo import albedo, walk
from ..albedo.directional import direction
from ..materials.fdez_aguera import FdezAguera
from ..materials.kulla_conty import KullaConty
from ..materials.random_walk import RandomWalk
from ..materials.turquin import Turquin

METHODS = {
    "plain": "single scattering only",
    "kulla-conty sheet": "Kulla-Conty, the homework's colour",
    "kulla-conty bounce": "Kulla-Conty, second and later bounces",
    "turquin": "Turquin 2019",
    "fdez-aguera": "Fdez-Aguera 2019",
    "random walk": "Heitz et al. 2016, the referee",
}
MATERIALS = ("white", "gold", "copper", "glass")


def material(name: str, alpha: float) -> BSDF:
    """A base of the comparison."""
    if name == "white":
        return Conductor(alpha=alpha, fresnel="one")
    if name == "glass":
        return Dielectric(1.5, alpha)
    return Conductor.preset(name, alpha=alpha)


def compensated(method: str, base: BSDF) -> BSDF | None:
    """The base under a method, None where the method does not take it."""
    if method == "plain":
        return base
    if method == "random walk":
        return RandomWalk(base)
    if base.transmits and method in ("turquin", "fdez-aguera", "kulla-conty sheet"):
        return None  # one colour only: at albedo 1 both are the same
    if method.startswith("kulla-conty"):
        return KullaConty(base, color=method.split()[1])
    return Turquin(base) if method == "turquin" else FdezAguera(base)


def compare(
    roughness: Any = (0.2, 0.4, 0.6, 0.8, 1.0),
    mu: Any = (0.05, 0.2, 0.4, 0.6, 0.8, 1.0),
    walks: int = 200_000,
    pairs: int = 1 << 20,
    seed: int = 0,
) -> dict[str, Any]:
    """Albedos of every material under every method over roughness x mu, and what follows from them.

    Returns a dict that JSON can hold: axes; `albedo` [material][method] (roughness, mu, 3); `rms` to the walk;
    `furnace`, the largest |1 - albedo| of what should be 1; `reciprocity`, the largest relative breach on gold;
    `cost`, time of one evaluation over that of the plain metal.
    """
    if walks < 1000 or pairs < 1024:
        raise InputError(f"{walks} walks, {pairs} pairs", "compensation", "give 1000 walks and 1024 pairs or more")
    roughness, mu = np.asarray(roughness, float), np.asarray(mu, float)
    found: dict[str, dict[str, np.ndarray]] = {name: {} for name in MATERIALS}
    for name in MATERIALS:
        for method in METHODS:
            rows: list[Any] = []
            for r in roughness:
                base = material(name, r * r)
                if method == "random walk":
                    rows.append([walk.albedo(base, float(m), walks, seed)[0] for m in mu])
                elif (model := compensated(method, base)) is not None:
                    rows.append(albedo(model, mu).value)
            if rows:
                found[name][method] = np.array(rows)
    rms = {
        name: {
            method: float(np.sqrt(np.mean((values - by_method["random walk"]) ** 2)))
            for method, values in by_method.items()
            if method != "random walk"
        }
        for name, by_method in found.items()
    }
    lossless = {name: found[name] for name in ("white", "glass")}
    furnace = {n: {m: float(np.abs(1.0 - v).max()) for m, v in by.items()} for n, by in lossless.items()}
    return {
        "roughness": roughness.tolist(),
        "mu": mu.tolist(),
        "walks": walks,
        "albedo": {n: {m: v.tolist() for m, v in by.items()} for n, by in found.items()},
        "rms": rms,
        "furnace": furnace,
        "reciprocity": {m: breach(m, seed) for m in METHODS if m != "random walk"},
        "cost": _costs(pairs),
    }


def breach(method: str, seed: int) -> float:
    """Largest |f(o, i) - f(i, o)| over the larger of the two, gold of roughness .7, 2000 pairs."""
    model = compensated(method, material("gold", 0.49))
    rng = np.random.default_rng(seed)
    o, i = (direction(rng.uniform(0.02, 1.0, 2000), rng.uniform(0, 2 * np.pi, 2000)) for _ in range(2))
    forth, back = (model.f(*pair, precision="float64") for pair in ((o, i), (i, o)))  # type: ignore[union-attr]
    return float((np.abs(forth - back) / np.maximum(forth, back)).max())


def _costs(pairs: int) -> dict[str, float]:
    """Time of `eval` over that of the plain metal: gold of alpha .36, pairs above the surface, best of many turns."""
    dr = backend.drjit()
    kind = backend.types("float32")
    rng = np.random.default_rng(1)
    o, i = (
        backend.vector_of(direction(rng.uniform(0.02, 1.0, pairs), rng.uniform(0, 2 * np.pi, pairs)), 3, kind)
        for _ in range(2)
    )
    dr.eval(o, i)
    models = {m: compensated(m, material("gold", 0.36)) for m in METHODS}
    times: dict[str, list[float]] = {m: [] for m in METHODS}
    for turn in range(25):
        for method, model in models.items():
            dr.sync_thread()
            start = time.perf_counter()
            dr.eval(model.eval(o, i))  # type: ignore[union-attr]
            dr.sync_thread()
            if turn:
                times[method].append(time.perf_counter() - start)
    return {m: float(min(t) / min(times["plain"])) for m, t in times.items()}
