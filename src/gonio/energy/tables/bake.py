"""Bake tables of E, E_avg, the split sum and rough glass: arrays with a manifest, as written by `gonio bake`.

    baked = bake("ggx", masking="smith-separable", size=128)
    baked.arrays["E"]            # [roughness, mu]
    baked.manifest["error"]      # {"E": {"max": ..., "rms": ..., "interpolation": ...}, ...}
    bake("ggx", aspect=0.25)     # anisotropic: E[phi, roughness, mu]

The axes are defined in `axes`; files and the homework's pictures are defined in `baked`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import GonioWarning, InputError, did_you_mean
from ...material import BSDF
from ...material.parameters import pair_of
from ...optics.ndf import distribution
from ...work import parts
from .. import cache
from ..albedo import albedo, monte_carlo, quadrature
from ..albedo.directional import check_uniform
from ..albedo.monte_carlo import Sampling
from ..cache import content_hash
from . import baked
from .axes import LAYOUTS, Axes
from .baked import Baked
from .target import BLOCK, Target, blocks, describe, glass_power, together

LUTS = {
    "E": "directional albedo with F = 1, or the model's own [phi,] [roughness, mu]",
    "Eavg": "its average over the cosine, and over azimuth [roughness]",
    "dfg": "split sum A, B: E = F0 A + B for Schlick's Fresnel [phi,] [roughness, mu, 2]",
    "glass": "power that rough glass reflects and transmits, from both sides [sqrt_f0, roughness, mu, 2]",
}
NAMES = {"E": ("E",), "Eavg": ("E_avg",), "dfg": ("dfg",), "glass": ("E_glass_thin", "E_glass_dense")}
MAX_SIZE = 4096
AZIMUTHS = 24  # in the stretched layout, for alpha_y = alpha_x / 4, the error of linear interpolation is 1.2e-3
LARGEST_ASPECT = 100.0
GLASS_STEPS = 16
MAX_ROOT = 2.0 / 3.0  # (eta - 1) / (eta + 1) for eta = 5
SCHEMA = 2
QUADRATURE = Sampling("quadrature")


def bake(
    target: str | BSDF,
    lut: tuple[str, ...] | list[str] | None = None,
    size: int = 128,
    masking: str | None = None,
    layout: str = "linear",
    aspect: float | None = None,
    azimuths: int = AZIMUTHS,
    sampling: Sampling = QUADRATURE,
) -> Baked:
    """Bake tables of a distribution (at F = 1) or of a material.

    target    the name of a distribution, a Conductor or a Dielectric, for tables with alpha = roughness^2 along an
              axis; the tables of a Dielectric are for light from outside. For any other material, E[mu] and E_avg are
              computed with its own parameters
    lut       names of the tables: "E", "Eavg", "dfg", "glass"; None selects E and Eavg, and for a distribution also dfg
    size      number of nodes of roughness and of mu, 1 to 4096
    masking   masking term for a distribution, by default smith-correlated; a material has its own
    layout    layout of the axes, "linear" or "stretched" (see `axes`)
    aspect    alpha_y / alpha_x of a distribution, whose larger alpha is roughness^2; a value other than 1 adds the axis
              phi, a quarter turn from x. The aspect of a material is the ratio of its alphas; its rotation is ignored
    azimuths  number of nodes of phi
    sampling  the method: quadrature, or random samples; E_avg of a sampled table is integrated from its rows
    Raises InputError for unknown names, for numbers out of range, and for tables that do not exist for the target.
    """
    material = isinstance(target, BSDF)
    lut = lut or (("E", "Eavg") if material else ("E", "Eavg", "dfg"))
    method = sampling.method
    _check(lut, size, layout, sampling)
    _check_options(sampling, {"masking": masking, "aspect": aspect} if material else {})
    if isinstance(target, BSDF) and target.microsurface is None:
        return _any_material(target, lut, size, method, layout)
    asked, axes = _resolved(target, masking, layout, size, aspect, azimuths)
    _check_target(asked, axes, lut, method)

    arrays: dict[str, np.ndarray] = {}
    errors: dict[str, dict[str, float]] = {}
    if {"E", "dfg"} & set(lut) or ("Eavg" in lut and method != "quadrature"):
        tables, figures = _directional(asked, axes, sampling)
        arrays.update({k: v for k, v in tables.items() if k in lut})
        errors.update({k: v for k, v in figures.items() if k in lut})
        if "E" in arrays and size > 1:
            errors["E"]["interpolation"] = _between(lambda *index: asked.exact(axes.at(*index))["E"], axes)
    if "Eavg" in lut:
        sampled = None if method == "quadrature" else _average_of_rows(tables["E"], axes)
        arrays["E_avg"], errors["E_avg"] = _averaged(asked, axes, sampled)
    dims = {"E": list(axes.names), "dfg": list(axes.names), "E_avg": ["roughness"]}
    nodes, text = axes.arrays(), axes.texts()
    if "glass" in lut:
        glass, figures = _glass(axes, asked.model.microsurface.fresnel if asked.model else "exact")
        nodes["sqrt_f0"] = glass.pop("sqrt_f0")
        text["sqrt_f0"] = f"slice j at (eta - 1) / (eta + 1) = (j + 1/2) / {GLASS_STEPS} of 2/3; eta is dense over thin"
        arrays.update(glass)
        errors.update(figures)
        dims |= {name: ["sqrt_f0", *axes.names] for name in glass}
    manifest = {"target": describe(target), **_described(asked, axes, sampling), "axes": text}
    return _sealed(arrays, nodes, dims, errors, manifest)


def _check_options(sampling: Sampling, of_material: Mapping[str, object]) -> None:
    for name, given in of_material.items():
        if given is not None:
            raise InputError(f"{name} given for a material", f"--{name}", "the parameters of the material define it")
    floor, method = sampling.floor, sampling.method
    if floor < 0.0 or (floor > 0.0 and method != "cosine"):
        hint = "give a number of 0 or more with --method cosine; the other methods do not evaluate D"
        raise InputError(f"a floor of {floor:g} with method '{method}'", "--floor", hint)


def _described(asked: Target, axes: Axes, sampling: Sampling) -> dict[str, object]:
    """The entries of the manifest for the target, the method and the axes."""
    options = {name: value for name, value in sampling._asdict().items() if name != "floor" or value}
    return {
        "ndf": asked.ndf,
        "masking": asked.masking,
        **({"method": sampling.method} if sampling.method == "quadrature" else options),
        "size": axes.size,
        "layout": axes.layout,
        "alpha": "roughness^2" + (", the larger of both" if axes.azimuths else ""),
        **({"aspect": axes.aspect} if axes.azimuths else {}),
    }


def cached(target: str | BSDF, **options: Any) -> Baked:
    """`bake`, cached in the user's cache folder (`gonio.energy.cache`).

    options  arguments of `bake`
    Only tables of distributions and of Gonio's microsurfaces are cached, because the formulas of other materials may be
    in any file.
    """
    if isinstance(target, BSDF) and not tabulated(target):
        return bake(target, **options)
    widths_of = None if isinstance(target, str) else _aspect(target, 1.0)
    surface = None if isinstance(target, str) else target.microsurface
    names = (target, options.get("masking") or "smith-correlated") if surface is None else surface[:3]
    key = ("baked", describe(target), widths_of, cache.origin(*names), sorted(options.items()))
    text = repr(key)

    def write(made: Baked) -> bytes:
        return Baked(made.arrays, {**made.manifest, "asked": text}).npz()

    def read(path: Path) -> Baked:
        existing = baked.read(path)
        if existing.manifest.pop("asked", None) != text:
            raise ValueError("not the requested table")
        return existing

    def made() -> Baked:
        with parts.job("bake", text, cache.formulas()) as job:
            if job.found:
                notice = f"continues an unfinished table: {job.found} of its parts are done"
                warnings.warn(notice, GonioWarning, stacklevel=5)
            return bake(target, **options)

    return cache.keep(key, made, write, read)


def _sealed(
    arrays: dict[str, np.ndarray], nodes: dict[str, np.ndarray], dims: dict[str, list[str]],
    errors: dict[str, dict[str, float]], manifest: dict[str, Any],
) -> Baked:  # fmt: skip
    everything = {**arrays, **nodes}
    more = {
        "texels": "linear between nodes along every axis, held at the edges",
        "dims": {name: dims[name] for name in arrays},
        "tables": {name: list(array.shape) for name, array in arrays.items()},
        "error": errors,
        "hash": {name: content_hash(array) for name, array in everything.items()},
    }
    return Baked(everything, {"schema": SCHEMA, **manifest, **more})


def _check(lut: tuple[str, ...] | list[str], size: int, layout: str, sampling: Sampling) -> None:
    """Raise InputError for options that no target supports."""
    for name in lut:
        if name not in LUTS:
            raise InputError(f"unknown table '{name}'", "--lut", did_you_mean(name, [*LUTS, "ltc"]))
    if layout not in LAYOUTS:
        raise InputError(f"unknown layout '{layout}'", "--layout", did_you_mean(layout, [*LAYOUTS, "homework"]))
    if not 1 <= size <= MAX_SIZE:
        raise InputError(f"a table of {size} x {size} requested", "--resolution", f"give 1 to {MAX_SIZE}")
    if sampling.spp < 1:
        raise InputError(f"{sampling.spp} samples requested", "--samples", "give 1 or more")
    if (points := sampling.points) not in monte_carlo.POINTS:
        raise InputError(f"unknown points '{points}'", "--sampler", did_you_mean(points, list(monte_carlo.POINTS)))


def _resolved(
    target: str | BSDF, masking: str | None, layout: str, size: int, aspect: float | None, azimuths: int
) -> tuple[Target, Axes]:
    """The target and its axes."""
    model = None if isinstance(target, str) else target
    surface = None if model is None else model.microsurface
    ndf = distribution(str(target) if surface is None else surface.ndf).name
    masking = quadrature.known_masking(masking or "smith-correlated" if surface is None else surface.masking)
    aspect = _aspect(model, 1.0 if aspect is None else aspect)
    if aspect != 1.0 and not 1 <= azimuths <= MAX_SIZE:
        raise InputError(f"{azimuths} azimuths given", "--azimuths", f"give 1 to {MAX_SIZE}")
    return Target(model, ndf, masking), Axes(layout, ndf, masking, size, aspect, azimuths if aspect != 1.0 else 0)


def _check_target(asked: Target, axes: Axes, lut: tuple[str, ...] | list[str], method: str) -> None:
    """Raise InputError for options that this target does not support."""
    kind = type(asked.model).__name__
    known = ["quadrature", *monte_carlo.methods(asked.ndf)]
    if method not in known:
        raise InputError(f"unknown method '{method}'", "--method", did_you_mean(method, known))
    if method != "quadrature" and asked.model is not None:
        raise InputError(f"{kind} by '{method}'", "--method", "a model is baked by quadrature: leave --method out")
    if "dfg" in lut and asked.model is not None:
        hint = "bake its distribution, such as ggx: that table serves any F0"
        raise InputError("split sum requested for a material", "--lut", hint)
    if "glass" in lut and (axes.azimuths or asked.conducts):
        what = "anisotropic glass requested" if axes.azimuths else f"glass requested for a {kind}"
        raise InputError(what, "--lut", "this table exists for a distribution or a Dielectric, with one alpha")


def _aspect(model: Any, given: float) -> float:
    """alpha_y / alpha_x: the given value, or the ratio of a material's alphas."""
    if model is not None:
        check_uniform(model)
        x, y = map(float, pair_of(model.microsurface.alpha))
        given = 1.0 if x == y else y / x if x > 0.0 else np.inf
    if not 1.0 / LARGEST_ASPECT <= given <= LARGEST_ASPECT:
        hint = f"give {1.0 / LARGEST_ASPECT:g} to {LARGEST_ASPECT:g}"
        raise InputError(f"alpha_y / alpha_x = {given:g}", "--aspect", hint)
    return given


def _figures(difference: np.ndarray) -> dict[str, float]:
    return {"max": float(np.max(np.abs(difference))), "rms": float(np.sqrt(np.mean(difference**2)))}


def _directional(
    asked: Target, axes: Axes, sampling: Sampling
) -> tuple[dict[str, np.ndarray], dict[str, dict[str, float]]]:
    exact = asked.exact(axes.nodes())
    if sampling.method == "quadrature":
        # compared at the most difficult columns, near grazing angles and near the normal, and at every fourth column
        n = axes.size
        some = np.unique(np.concatenate([np.arange(min(4, n)), np.arange(0, n, 4), [n - 1]]))
        slices = [np.arange(0, axes.azimuths, 5)] if axes.azimuths else []
        here = np.ix_(*slices, np.arange(n), some)
        judge = asked.exact(axes.at(*here), fine=True)
        return exact, {name: _figures(exact[name][here] - judge[name]) for name in exact}
    at = axes.nodes()
    estimate = monte_carlo.estimate(axes.ndf, axes.masking, at, sampling).value
    return {**exact, "E": estimate}, {"E": _figures(estimate - exact["E"]), "dfg": {"max": 0.0, "rms": 0.0}}


def _averaged(asked: Target, axes: Axes, sampled: np.ndarray | None) -> tuple[np.ndarray, dict[str, float]]:
    """E_avg and its error, from a comparison of the quadrature with a finer one, or of samples with the quadrature."""
    rows = np.arange(axes.size)
    exact = asked.average(axes, rows)
    if sampled is not None:
        return sampled, _figures(sampled - exact)
    some = rows[:: 4 if axes.azimuths else 1]
    return exact, _figures(exact[some] - asked.average(axes, some, fine=True))


def _average_of_rows(table: np.ndarray, axes: Axes) -> np.ndarray:
    """E_avg of a table from its nodes, each of which represents the interval that extends halfway to its neighbors."""
    nodes = axes.nodes()
    weight = 2.0 * nodes.mu * (np.gradient(nodes.mu, axis=-1) if axes.size > 1 else 1.0)
    if axes.azimuths > 1:
        weight = weight * np.gradient(axes.phi(np.arange(axes.azimuths)))[:, None, None]
    others = tuple(i for i, name in enumerate(axes.names) if name != "roughness")
    return np.sum(table * weight, axis=others) / np.sum(weight, axis=others)


def _between(value: Callable[..., np.ndarray], axes: Axes, extra: int = 0) -> float:
    """The largest error of linear interpolation for roughness >= 0.1, at the midpoints of cells and of their edges.

    value  function that returns E at indices, which are integers or half-integers
    extra  number of nodes of an additional axis that precedes those of `axes`; 0 if there is none
    """
    shape = (*([extra] if extra else []), *axes.shape)
    rows = np.flatnonzero(axes.roughness(np.arange(axes.size))[:-1] >= 0.1)
    if not len(rows):
        return 0.0
    deep = len(shape) > 2
    rows = rows[:: max(1, len(rows) // (8 if deep else 24))]
    last = axes.size - 1
    count = 48 if deep else 128
    # columns are denser toward grazing angles, where E varies most
    columns = np.arange(last) if last < count else np.unique(np.geomspace(1, last, count).astype(int) - 1)
    cells = [np.arange(max(n - 1, 1)) for n in shape[:-2]] + [rows, columns]
    free = [n > 1 for n in shape]
    middles = {tuple(0.5 * f for f in free)}
    middles |= {tuple(0.5 * (i == axis) for i in range(len(shape))) for axis in range(len(shape)) if free[axis]}
    worst = 0.0
    corners = {
        step: value(*np.ix_(*[c + s for c, s in zip(cells, step, strict=True)]))
        for step in product(*[(0, 1) if f else (0,) for f in free])
    }
    for middle in middles:
        straight = sum(
            table * np.prod([part if s else 1.0 - part for s, part in zip(step, middle, strict=True)])
            for step, table in corners.items()
        )
        there = value(*np.ix_(*[c + part for c, part in zip(cells, middle, strict=True)]))
        worst = max(worst, float(np.max(np.abs(straight - there))))
    return worst


def _glass(axes: Axes, fresnel: str) -> tuple[dict[str, np.ndarray], dict[str, dict[str, float]]]:
    """Tables of the reflected and transmitted power, whose sum is E, over (sqrt_f0, roughness, mu), for both sides; and
    their errors."""

    def root(index: Any) -> Any:
        return (index + 0.5) / GLASS_STEPS * MAX_ROOT

    def power(dense: bool, fine: bool, step: Any, *index: Any) -> np.ndarray:
        at = axes.at(*index)
        eta = (1.0 + root(step)) / (1.0 - root(step))
        given = np.broadcast_arrays(at.mu, at.alpha, 1.0 / eta if dense else eta)
        shape, flat = given[0].shape, [values.ravel() for values in given]
        names = (axes.ndf, axes.masking, fresnel)
        arguments = [(*names, *(values[at : at + BLOCK] for values in flat), fine) for at in blocks(shape)]
        return together(glass_power, arguments)["power"].reshape(*shape, 2)

    arrays: dict[str, np.ndarray] = {"sqrt_f0": root(np.arange(GLASS_STEPS))}
    errors = {}
    every = np.ix_(np.arange(GLASS_STEPS), *map(np.arange, axes.shape))
    some = np.ix_(np.arange(0, GLASS_STEPS, 5), *[np.arange(0, n, 7) for n in axes.shape])
    for name, dense in zip(NAMES["glass"], (False, True), strict=True):
        arrays[name] = power(dense, False, *every)
        errors[name] = _figures((arrays[name][some] - power(dense, True, *some)).sum(-1))
        if axes.size > 1:

            def of_grid(*index: Any, dense: bool = dense) -> np.ndarray:
                return power(dense, False, *index).sum(-1)

            errors[name]["interpolation"] = _between(of_grid, axes, GLASS_STEPS)
    return arrays, errors


def _any_material(model: BSDF, lut: tuple[str, ...] | list[str], size: int, method: str, layout: str) -> Baked:
    """E[mu] and E_avg of a material without a roughness axis, for light from above, by `gonio.energy.albedo`."""
    kind = type(model).__name__
    if set(lut) - {"E", "Eavg"}:
        wrong = next(name for name in lut if name not in ("E", "Eavg"))
        raise InputError(f"table '{wrong}' of {kind}", "--lut", "this material has E and Eavg: --lut E,Eavg")
    if layout != "linear" or method != "quadrature":
        raise InputError(f"{kind} by {method}, {layout}", "bake", "this material is baked by quadrature, linear in mu")
    mu = (np.arange(size) + 0.5) / size
    arrays, errors, dims = {}, {}, {"E": ["mu"], "E_avg": []}
    if "E" in lut:
        value = albedo(model, mu)
        arrays["E"], errors["E"] = value.value, _figures(value.error)
    if "Eavg" in lut:
        x, w = quadrature.gauss(24)
        value = albedo(model, x**2)
        arrays["E_avg"] = 4.0 * (w * x**3) @ value.value
        errors["E_avg"] = _figures(4.0 * (w * x**3) @ value.error)
    manifest = {
        "target": describe(model),
        "ndf": getattr(model, "name", kind),
        "masking": "",
        "method": method,
        "size": size,
        "layout": layout,
        "axes": {"mu": "column j at (j + 1/2) / N"},
    }
    return _sealed(arrays, {"mu": mu}, dims, errors, manifest)


def tabulated(model: BSDF) -> bool:
    """Whether tables of a material are cached between runs. Only tables of Gonio's microsurfaces are cached, because
    the formulas of others may be in any file."""
    return model.microsurface is not None and type(model).__module__.startswith("gonio.")
