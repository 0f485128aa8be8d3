"""Gradients of the PyTorch and JAX files are those of Dr.Jit, by every parameter and both directions."""

from __future__ import annotations

import functools
from typing import Any

import gonio as go
import drjit as dr
import numpy as np
import pytest
from gonio.ops import backend
from gonio.shaders import bundle
from parity import Draws, bound, draw
from test_python import JUDGED, ROUNDING, _called, _loaded, _moved
from variants import EVERY

COUNT = 2000
MANY = 30  # numbers that go in


@functools.cache
def _smooth_draws(name: str) -> Draws:
    """Draws without those at the ends of a range or along the normal: there a value has a kink, and each side's slope
    is right."""
    draws = draw(EVERY[name], np.random.default_rng(5), COUNT)
    kept = ~np.any([np.all(w[:, :2] == 0.0, axis=1) for w in (draws.wo, draws.wi)], axis=0)
    for column in np.concatenate([draws.wo[:, :0], *draws.fields.values()], axis=1).T:
        if np.ptp(column) > 0.0:
            kept &= (column > column.min()) & (column < column.max())
    fields = {path: rows[kept].astype(float) for path, rows in draws.fields.items()}
    for rows in fields.values():  # nor two equal widths, at which the smaller one changes
        if rows.shape[1] == 2:
            rows[:, 1] *= np.where(rows[:, 0] == rows[:, 1], 0.99, 1.0)
    return Draws(*(x[kept].astype(float) for x in draws[:3]), fields)


def _columns(draws: Draws) -> list[tuple[str, int]]:
    """Every number that goes in: (path, place)."""
    parts = {**draws.fields, "wo": draws.wo, "wi": draws.wi}
    return [(path, place) for path, rows in parts.items() for place in range(rows.shape[1])]


def _by_drjit(model: go.BSDF, every: list[Draws], method: str) -> list[list[np.ndarray]]:
    """The slope of the channels' sum by each column, pair by pair, of each list of draws.

    In reverse mode, as the libraries do it. LLVM takes over ten minutes for that by the 46 numbers of OpenPBR: by so
    many, forward mode with all pairs once for each column, in one kernel.
    """
    kind, inputs = backend.types("float64"), []
    count, columns = len(every[0].wo), _columns(every[0])
    copies = len(columns) if len(columns) > MANY else 1

    def stacked(parts: list[np.ndarray]) -> np.ndarray:
        return np.tile(np.concatenate(parts), (copies, 1))

    fields = {path: stacked([draws.fields[path] for draws in every]) for path in every[0].fields}
    many = Draws(*(stacked([getattr(draws, name) for draws in every]) for name in ("wo", "wi", "u")), fields)

    def column(x: np.ndarray) -> Any:
        inputs.append(kind.float(np.ascontiguousarray(x, dtype=np.float64)))
        dr.enable_grad(inputs[-1])
        if copies > 1:
            tangent = np.zeros((copies, len(every) * count))
            tangent[len(inputs) - 1] = 1.0
            dr.set_grad(inputs[-1], kind.float(tangent.ravel()))
        return inputs[-1]

    of, vector = bound(model, many, column)
    value = getattr(of, method)(vector(many.wo), vector(many.wi))
    summed = dr.sum(value, axis=0) if isinstance(value, kind.vec2 | kind.vec3) else value
    flags = dr.ADFlag.Default | dr.ADFlag.AllowNoGrad
    if copies > 1:
        slopes = [dr.forward_to(summed, flags=flags)]
    else:
        dr.backward(summed, flags)
        slopes = [dr.grad(x) for x in inputs]
    whole = np.array([np.broadcast_to(np.asarray(x), copies * len(every) * count) for x in slopes])
    whole = whole.reshape(len(columns), len(every), count)
    return [list(whole[:, place]) for place in range(len(every))]


def _by_library(text: str, manifest: Any, draws: Draws, method: str, language: str) -> list[np.ndarray]:
    file, given = _loaded(text), {**draws.fields, "wo": draws.wo, "wi": draws.wi}

    def summed(parts: dict[str, Any]) -> Any:
        fields = {path: parts[path] for path in draws.fields}
        held = Draws(parts["wo"], parts["wi"], draws.u, fields)
        return _called(file, manifest, method, held, lambda x: x)[0].sum()

    if language == "torch":
        import torch

        tensors = {path: torch.tensor(rows, requires_grad=True) for path, rows in given.items()}
        total = summed(tensors)
        if total.requires_grad:
            total.backward()
        slopes = {path: torch.zeros_like(x) if x.grad is None else x.grad for path, x in tensors.items()}
    else:
        import jax

        with jax.enable_x64(True):
            slopes = jax.grad(summed)({path: jax.numpy.asarray(rows) for path, rows in given.items()})
    return [np.asarray(slopes[path])[:, place] for path, place in _columns(draws)]


@pytest.mark.parametrize("language", ["torch", "jax"])
@pytest.mark.parametrize("name", JUDGED)
def test_gradients_are_those_of_drjit(name: str, language: str) -> None:
    """Each within 1e-9, or 1e-14 where lobes' slopes cancel; six in seven within 8 roundings, or within 8 times
    what one rounding of the inputs changes.

    A sum of many terms in reverse mode is rounded in another order, so the rest may exceed the second.
    """
    pytest.importorskip(language, reason=f"NOT TRIED: no {language} here (pip: {language})")
    draws, made = _smooth_draws(name), bundle(EVERY[name], language)
    for method in ("eval", "pdf"):
        every = [draws, *(_moved(draws, seed) for seed in (1, 2, 3))]
        truths, *moved = _by_drjit(EVERY[name], every, method)
        found = _by_library(made.text, made.manifest, draws, method, language)
        for column, value, truth, *others in zip(_columns(draws), found, truths, *moved, strict=True):
            size = np.maximum(np.abs(truth), 1e-5)
            change = 8.0 * np.max([np.abs(other - truth) for other in others], axis=0)
            same = (value == truth) | (np.isnan(value) & np.isnan(truth))
            near = same | (np.abs(value - truth) <= np.maximum(1e-9 * size, change))
            close = same | (np.abs(value - truth) <= np.maximum(8.0 * ROUNDING * size, change))
            worst = np.argmin(near)
            assert near.mean() >= 0.998, (method, column, near.mean(), value[worst], truth[worst])
            assert close.mean() >= 0.85, (method, column, close.mean())
