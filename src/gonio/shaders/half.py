"""The measured effect of half-precision tables and parameters on a material's values."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from ..material import BSDF
from ..ops import graph
from .bundle import Bundle
from .manifest import Json
from .read_back import Array, parameters, recorded, values_of
from .vectors import pairs

PAIRS = 65_536
BATCH = 4_096  # rows per evaluation, because evaluating a recording may need one array per operation
UNCHANGED = 1e-9  # errors below this are rounding errors of double precision
DIM = 1e-6  # errors of smaller values are relative to this value
SEED = 0

Errors: TypeAlias = dict[str, dict[str, float]]


def bounded(made: Bundle, models: Sequence[BSDF]) -> Bundle:
    """The shader with half-precision tables, whose manifest and header state the errors of half precision."""
    manifests = made.manifest.get("materials", [made.manifest])
    lines = []
    for manifest, model in zip(manifests, models, strict=True):
        manifest["half"] = errors(model, manifest)
        lines += ["//", *(f"// {line}" for line in textwrap.wrap(described(manifest), 105))]
    head, _, rest = made.text.partition("\n\n")
    return replace(made, text="\n".join([head, *lines]) + "\n\n" + rest)


def errors(model: BSDF, manifest: Mapping[str, Json]) -> dict[str, Json]:
    """The largest and the mean relative error of `eval` and `pdf` if tables or single parameters are rounded to half
    precision; all arithmetic is in double precision.

    The errors are measured for 65,536 pairs from `vectors.pairs`, half of them with random parameter values
    (`read_back.parameters`). The error of a pair is the largest error of its channels, divided by the largest channel
    of the pair, or by 1e-6 if that is larger.
    Returns {"pairs": 65536, "tables": {"eval": {"max", "mean"}, ...} or None if there are no tables, "parameters": the
    same by path, for tables in single precision}.
    """
    names = [name for name in ("eval", "pdf") if name in manifest["functions"]]
    wo, wi = pairs(np.random.default_rng(SEED), PAIRS, bool(model.transmits))
    given = {"wo": wo.T, "wi": wi.T, "u": np.zeros((3, PAIRS))}
    fields = parameters(manifest, PAIRS, SEED)

    def values(made: graph.Graph, columns: Mapping[str, Array]) -> dict[str, Array]:
        parts = []
        for start in range(0, PAIRS, BATCH):
            rows = slice(start, start + BATCH)
            directions = {name: column[:, rows] for name, column in given.items()}
            batch = {path: column[..., rows] for path, column in columns.items()}
            parts.append(values_of(made, names, directions, batch))
        return {name: np.concatenate([_stacked(part[name]) for part in parts], axis=1) for name in names}

    off = [one["path"] for one in manifest["parameters"] if one["off"] is not None and one["field"] is None]
    exact = recorded(model, names, without=off)
    reference = values(exact, fields)
    tables = _errors(reference, values(recorded(model, names, 16, off), fields)) if manifest["textures"] else None
    single = {path: _errors(reference, values(exact, {**fields, path: _half(fields[path])})) for path in fields}
    return {"pairs": PAIRS, "tables": tables, "parameters": single}


def _half(numbers: Array) -> Array:
    with np.errstate(over="ignore"):
        return numbers.astype(np.float16).astype(float)


def _stacked(channels: Sequence[Array]) -> Array:
    return np.stack([np.broadcast_to(one, BATCH) for one in channels])


def _errors(reference: Mapping[str, Array], changed: Mapping[str, Array]) -> Errors:
    """The largest and the mean error of each function, over pairs for which the reference is finite."""
    result = {}
    for name, exact in reference.items():
        error = np.abs(changed[name] - exact).max(0) / np.maximum(np.abs(exact).max(0), DIM)
        error = error[np.isfinite(exact).all(0)]
        result[name] = {"max": float(error.max()), "mean": float(error.mean())}
    return result


def described(manifest: Mapping[str, Json]) -> str:
    """A sentence for the shader's header that states the errors."""
    half = manifest["half"]

    def listed(of: Errors) -> str:
        return ", ".join(f"{name} {one['max']:.1e} (mean {one['mean']:.1e})" for name, one in of.items())

    parts = [f"tables (as here) {listed(half['tables'])}"] if half["tables"] else []
    single = half["parameters"]
    changing = [path for path, of in single.items() if max((one["max"] for one in of.values()), default=0) > UNCHANGED]
    parts += [f"{path} {listed(single[path])}" for path in changing]
    if len(changing) < len(single):
        parts.append("other parameters none")
    return (
        f"Largest errors of {manifest['title']} over {half['pairs']:,} pairs caused by 16-bit storage: "
        + "; ".join(parts)
        + ". All arithmetic requires 32 bits."
    )
