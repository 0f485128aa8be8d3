"""Comparison of the compensation methods: remaining loss, difference from the random walk, violated laws and cost."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...energy.albedo import albedo, walk
from ...energy.albedo.directional import direction
from ...errors import InputError
from ...material import BSDF, tree
from ...ops import backend
from ..microfacet.conductor import Conductor
from ..microfacet.dielectric import Dielectric
from .fdez_aguera import FdezAguera
from .kulla_conty import KullaConty
from .random_walk import RandomWalk
from .turquin import Turquin

Method = Callable[[BSDF], "BSDF | None"]  # base -> compensated base; None if it is not supported
Base = Callable[[float], BSDF]  # width alpha -> the base


def _for_metals(compensate: Callable[[BSDF], BSDF]) -> Method:
    """A method restricted to bases that only reflect. It either does not support glass or gives the same result for
    glass as another method, because the albedo of glass is 1."""
    return lambda base: None if base.transmits else compensate(base)


METHODS: dict[str, Method] = {
    "plain": lambda base: base,
    "kulla-conty sheet": _for_metals(lambda base: KullaConty(base, color="sheet")),  # the homework's color
    "kulla-conty bounce": lambda base: KullaConty(base, color="bounce"),  # second and later bounces
    "turquin": _for_metals(Turquin),
    "fdez-aguera": _for_metals(FdezAguera),
    "random walk": RandomWalk,  # Heitz2016: the reference
}
BASES: dict[str, Base] = {
    "white": lambda alpha: Conductor(alpha=alpha, fresnel="one"),
    "gold": lambda alpha: Conductor.preset("gold", alpha=alpha),
    "copper": lambda alpha: Conductor.preset("copper", alpha=alpha),
    "glass": lambda alpha: Dielectric(1.5, alpha),
}


def _with(own: Sequence[BSDF]) -> tuple[dict[str, Method], dict[str, Base]]:
    """The methods and bases, including the user's: a material that has a base is a method; any other material is a
    base."""
    methods, bases = dict(METHODS), dict(BASES)
    for material in own:
        if "base" in tree.children(material):
            methods[material.name] = functools.partial(_under, material)
        else:
            KullaConty(material)  # raises if it cannot be compensated
            bases[material.name] = functools.partial(_of_width, material)
    return methods, bases


def _under(method: BSDF, base: BSDF) -> BSDF | None:
    return tree.replace(method, {"base": base})


def _of_width(material: BSDF, alpha: float) -> BSDF:
    """The material with a given width; unchanged if it has no parameter `alpha`."""
    return tree.replace(material, {"alpha": alpha}) if "alpha" in material.parameters() else material


def _model_of(method: Method, base: BSDF) -> BSDF | None:
    """The compensated base; None if the method does not support it."""
    try:
        return method(base)
    except InputError:
        return None


def compare(
    roughness: Any = (0.2, 0.4, 0.6, 0.8, 1.0),
    mu: Any = (0.05, 0.2, 0.4, 0.6, 0.8, 1.0),
    walks: int = 200_000,
    pairs: int = 1 << 20,
    seed: int = 0,
    own: Sequence[BSDF] = (),
) -> dict[str, Any]:
    """Compare all compensation methods for all bases: albedos on a grid of roughness and mu, errors and cost.

    roughness, mu  axes of the grid: roughness (alpha = roughness^2), and mu = cos theta_o
    walks          number of random walks per albedo, 1000 or more
    pairs          number of pairs of directions that are evaluated for `cost`, 1024 or more
    seed           seed of the random walks and of the directions for `reciprocity`
    own            user materials: one that has a base is a method; any other is a base (the walk requires facets)
    Returns a dict that can be stored as JSON. It contains the first three arguments and
    albedo       [base][method], (roughness, mu, 3)
    rms          [base][method], RMS difference of the albedos from those of the random walk
    furnace      [base][method], largest |1 - albedo|, for the lossless bases
    reciprocity  [method], largest relative violation for gold
    cost         [method], time of one evaluation divided by that of the uncompensated metal
    Raises InputError if `walks` or `pairs` is too small.
    """
    if walks < 1000 or pairs < 1024:
        raise InputError(f"{walks} walks, {pairs} pairs", "compensation", "give 1000 walks and 1024 pairs or more")
    roughness, mu = np.asarray(roughness, float), np.asarray(mu, float)
    methods, bases = _with(own)
    albedos_of: dict[str, dict[str, np.ndarray]] = {name: {} for name in bases}
    for name, base_of in bases.items():
        for method, under in methods.items():
            rows: list[Any] = []
            for r in roughness:
                base = base_of(r * r)
                model = _model_of(under, base)
                if model is not None and method == "random walk":
                    rows.append([walk.albedo(base, float(m), walks, seed)[0] for m in mu])
                elif model is not None:
                    rows.append(albedo(model, mu).value)
            if rows:
                albedos_of[name][method] = np.array(rows)
    rms = {
        name: {
            method: float(np.sqrt(np.mean((values - by_method["random walk"]) ** 2)))
            for method, values in by_method.items()
            if method != "random walk" and "random walk" in by_method
        }
        for name, by_method in albedos_of.items()
    }
    lossless = {name: albedos_of[name] for name in ("white", "glass")}
    furnace = {n: {m: float(np.abs(1.0 - v).max()) for m, v in by.items()} for n, by in lossless.items()}
    return {
        "roughness": roughness.tolist(),
        "mu": mu.tolist(),
        "walks": walks,
        "albedo": {n: {m: v.tolist() for m, v in by.items()} for n, by in albedos_of.items()},
        "rms": rms,
        "furnace": furnace,
        "reciprocity": {m: breach(under, seed) for m, under in methods.items() if m != "random walk"},
        "cost": _costs(methods, pairs),
    }


def breach(method: Method, seed: int) -> float:
    """The largest |f(o, i) - f(i, o)|, relative to the larger of the two, for gold of roughness 0.7.

    seed  seed of the 2000 pairs of directions
    """
    model = _on_gold(method, 0.49)
    rng = np.random.default_rng(seed)
    o, i = (direction(rng.uniform(0.02, 1.0, 2000), rng.uniform(0, 2 * np.pi, 2000)) for _ in range(2))
    forth, back = (model.f(*pair, precision="float64") for pair in ((o, i), (i, o)))
    return float((np.abs(forth - back) / np.maximum(forth, back)).max())


def _on_gold(method: Method, alpha: float) -> BSDF:
    model = method(BASES["gold"](alpha))
    if model is None:
        raise InputError("a method that does not support gold cannot be compared", "compensation")
    return model


def _costs(methods: Mapping[str, Method], pairs: int) -> dict[str, float]:
    """The time of `eval` for each method, divided by the time for the uncompensated metal. The base is gold with
    alpha = 0.36, and the pairs of directions are above the surface. Each time is the shortest of 24 runs."""
    dr = backend.drjit()
    kind = backend.types("float32")
    rng = np.random.default_rng(1)
    o, i = (
        backend.vector_of(direction(rng.uniform(0.02, 1.0, pairs), rng.uniform(0, 2 * np.pi, pairs)), 3, kind)
        for _ in range(2)
    )
    dr.eval(o, i)
    models = {m: _on_gold(method, 0.36) for m, method in methods.items()}
    times: dict[str, list[float]] = {m: [] for m in methods}
    for turn in range(25):
        for method, model in models.items():
            dr.sync_thread()
            start = time.perf_counter()
            dr.eval(model.eval(o, i))
            dr.sync_thread()
            if turn:
                times[method].append(time.perf_counter() - start)
    return {m: float(min(t) / min(times["plain"])) for m, t in times.items()}
