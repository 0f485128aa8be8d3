"""Pairs of directions with their values in double precision, with which an engine can test its shader."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import ops
from ..catalog.material import MaterialLike, material
from ..errors import InputError
from ..owner import exclusive
from . import program as programs
from .manifest import Json, numbers_of

LIMIT = 1_000_000  # number of pairs, about 300 MB of text


@exclusive
def vectors(
    model: MaterialLike, count: int = 10_000, functions: Sequence[str] = ("eval", "pdf", "sample"), seed: int = 1
) -> dict[str, Json]:
    """Random pairs of directions and the values that a shader should return for them, as plain data for JSON.

    model      anything that `go.material` accepts
    count      number of pairs, at most a million
    functions  a choice of "eval", "pdf", "sample"; other names, such as "terms", are ignored
    seed       seed of the directions and random numbers
    Returns {"model", "seed", "fields": values of the struct by path, "wo", "wi", "u": (count, 3), "eval": (count, 3),
    "pdf": (count,), "sample": {"wi", "weight", "pdf", "delta"}}. Directions and random numbers are float32 numbers, so
    that a shader receives exactly the same values; the results are computed from them in float64. In a tenth of the
    pairs, wi is within 6 degrees of the mirror direction; in another tenth, wo is at a grazing angle. Raises InputError
    for a stochastic material.
    """
    model = material(model)
    asked = programs.check(model, functions, "emit")
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= LIMIT:
        raise InputError(f"{count!r} given, a whole number from 1 to {LIMIT:,} expected", "emit: check")
    fields = dict(numbers_of(model))
    rng = np.random.default_rng(seed)
    wo, wi = pairs(rng, count, bool(model.transmits))
    u = np.minimum(rng.random((count, 3)).astype(np.float32), np.float32(0.99999994)).astype(float)
    made: dict[str, Json] = {"version": 1, "model": model.name, "seed": seed, "fields": fields}
    made |= {"wo": wo.tolist(), "wi": wi.tolist(), "u": u.tolist()}
    before = ops.get_precision()
    ops.set_precision("float64")
    try:
        if "eval" in asked:
            made["eval"] = np.asarray(model.eval(wo, wi)).tolist()
        if "pdf" in asked:
            made["pdf"] = np.asarray(model.pdf(wo, wi)).tolist()
        if "sample" in asked:
            sample = model.sample(wo, u)
            names = ("wi", "weight", "pdf", "delta")
            made["sample"] = {name: np.asarray(getattr(sample, name)).tolist() for name in names}
    finally:
        ops.set_precision(before)
    return made


def pairs(rng: np.random.Generator, count: int, below: bool) -> tuple[np.ndarray, np.ndarray]:
    """`count` pairs of unit directions, rounded to float32.

    below  whether directions may be below the surface, for a material that transmits light
    """
    wo, wi = _unit(rng.normal(size=(2, count, 3)))
    grazes, mirrored = np.arange(count) % 10 == 1, np.arange(count) % 10 == 2
    wo[grazes, 2] *= 0.02
    near = _unit(wo * (-1.0, -1.0, 1.0) + rng.normal(size=wo.shape) * 0.05)
    wi[mirrored] = near[mirrored]
    pair = _unit(np.stack([wo, wi]))
    if not below:
        pair[..., 2] = np.abs(pair[..., 2])
    wo, wi = pair.astype(np.float32).astype(float)
    return wo, wi


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)
