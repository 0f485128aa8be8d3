"""Tables of E, E_avg and the split sum as arrays with a manifest: what `gonio bake` writes and `gonio info` reads.

    baked = bake("ggx", masking="smith-separable", size=128)
    baked.arrays["E"]            # [roughness, mu]
    baked.manifest["error"]      # {"E": {"max": ..., "rms": ..., "interpolation": ...}, ...}

Layouts of the axes, both N long:
    linear     mu and roughness at texel centres (j + 1/2) / N: what shaders and the homework use
    stretched  nodes at both ends, j / (N - 1), of roughness and of s(mu) / s(1) (`gonio.energy.curves`), in which E is
               smooth: bilinear interpolation then errs by a hundredth of what it does on a linear axis
"""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, did_you_mean
from ..models import BSDF
from ..models.conductor import Conductor
from ..models.dielectric import Dielectric
from ..optics.ndf import distribution, distributions
from . import curves, monte_carlo, quadrature
from .cache import content_hash

LUTS = {
    "E": "directional albedo with F = 1, or the model's own [roughness, mu]",
    "Eavg": "its average over the cosine [roughness]",
    "dfg": "split sum A, B: E = F0 A + B for Schlick's Fresnel [roughness, mu, 2]",
    "glass": "albedo of rough glass from both sides [sqrt(F0), roughness, mu]",
}
LAYOUTS = ("linear", "stretched")
LARGEST = 4096
GLASS_STEPS = 16
SCHEMA = 1
_NAMES = {"Eavg": "E_avg"}


@dataclass(frozen=True)
class Baked:
    """Arrays by name, the axes among them, and the manifest that describes them."""

    arrays: dict[str, np.ndarray]
    manifest: dict[str, Any]

    def npz(self) -> bytes:
        """tables.npz, the manifest inside it, the same bytes for the same content."""
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as file:
            for name, array in {**self.arrays, "manifest": np.array(json.dumps(self.manifest))}.items():
                part = io.BytesIO()
                np.save(part, array, allow_pickle=False)
                file.writestr(zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0)), part.getvalue())
        return stream.getvalue()


def bake(
    target: str | BSDF,
    lut: tuple[str, ...] | list[str] = ("E", "Eavg", "dfg"),
    size: int = 128,
    method: str = "quadrature",
    masking: str = "smith-correlated",
    spp: int = 1024,
    points: str = "hammersley",
    seed: int = 0,
    layout: str = "linear",
) -> Baked:
    """Tables of a distribution by name (F = 1), or of a Conductor or Dielectric; alpha = roughness^2 along the axis.

    method   "quadrature", "cosine", the distribution's name or "visible"; E_avg of a sampled table is integrated from
             its rows
    masking  for a distribution by name; a model brings its own
    Raises InputError for unknown names, sizes outside 1 to 4096 and spp < 1.
    """
    model = None if isinstance(target, str) else target
    if model is not None and not isinstance(model, Conductor | Dielectric):
        raise InputError(f"{type(model).__name__} given", "bake", "a distribution by name, a Conductor or a Dielectric")
    ndf = model.ndf if model is not None else distribution_name(str(target))
    masking = quadrature.known_masking(model.masking if model is not None else masking)
    for name in lut:
        if name not in LUTS:
            raise InputError(f"unknown table '{name}'", "--lut", did_you_mean(name, list(LUTS)))
    if layout not in LAYOUTS:
        raise InputError(f"unknown layout '{layout}'", "--layout", did_you_mean(layout, [*LAYOUTS, "homework"]))
    check_size(size)
    if method != "quadrature" and method not in monte_carlo.methods(ndf):
        known = ["quadrature", *monte_carlo.methods(ndf)]
        raise InputError(f"unknown method '{method}'", "--method", did_you_mean(method, known))
    if method != "quadrature" and (spp < 1 or model is not None):
        what = f"{spp} samples asked for" if spp < 1 else "models are integrated by quadrature only"
        raise InputError(
            what, "--spp" if spp < 1 else "--method", "give 1 or more" if spp < 1 else "leave --method out"
        )

    roughness, mu = axes(layout, ndf, masking, size)
    grid = np.broadcast_to(mu, (size, size)), np.broadcast_to(roughness[:, None] ** 2, (size, size))
    arrays: dict[str, np.ndarray] = {}
    errors: dict[str, dict[str, float]] = {}
    if {"E", "dfg"} & set(lut) or ("Eavg" in lut and method != "quadrature"):
        tables, found = _directional(model, ndf, masking, grid, method, spp, points, seed)
        arrays.update({k: v for k, v in tables.items() if k in lut})
        errors.update({k: v for k, v in found.items() if k in lut})
        if "E" in arrays and size > 1:
            errors["E"]["interpolation"] = _interpolation_error(model, ndf, masking, roughness, layout)
    if "Eavg" in lut:
        exact = _average(model, ndf, masking, roughness)
        if method == "quadrature":
            finer = _average(model, ndf, masking, roughness, fine=True)
            arrays["E_avg"], errors["E_avg"] = exact, _figures(exact - finer)
        else:
            weight = 2.0 * mu * np.gradient(mu) if layout == "stretched" else 2.0 * mu / size
            arrays["E_avg"] = np.sum(tables["E"] * weight, axis=1) / np.sum(weight * np.ones_like(mu), axis=-1)
            errors["E_avg"] = _figures(arrays["E_avg"] - exact)
    if "glass" in lut:
        fresnel = model.fresnel if model is not None else "exact"
        glass, found = _glass(ndf, masking, fresnel, roughness, mu, size)
        arrays.update(glass)
        errors.update(found)
    manifest = {
        "schema": SCHEMA,
        "target": _describe(target),
        "ndf": ndf,
        "masking": masking,
        "method": method,
        **({} if method == "quadrature" else {"spp": spp, "points": points, "seed": seed}),
        "size": size,
        "layout": layout,
        "alpha": "roughness^2",
        "axes": _axes_text(layout, ndf, masking),
        "texels": "bilinear between texel centres at (j + 1/2) / N in texture coordinates, clamped at the edges",
        "tables": {name: list(array.shape) for name, array in arrays.items()},
        "error": errors,
        "hash": {name: content_hash(array) for name, array in arrays.items()},
    }
    return Baked({**arrays, "mu": mu, "roughness": roughness}, manifest)


def distribution_name(name: str) -> str:
    """A distribution's name; InputError where there is none."""
    distribution(name)
    return name


def check_size(size: int) -> None:
    """Raise InputError for a table that cannot be."""
    if not 1 <= size <= LARGEST:
        raise InputError(f"a table of {size} x {size} asked for", "--size", f"give 1 to {LARGEST}")


def axes(layout: str, ndf: str, masking: str, size: int) -> tuple[np.ndarray, np.ndarray]:
    """(roughness (N,), mu (N,) or, where stretched, (N, N) by row)."""
    centres = (np.arange(size) + 0.5) / size
    if layout == "linear":
        return centres, centres
    ends = np.linspace(0.0, 1.0, size) if size > 1 else np.ones(1)
    return ends, stretched_mu(ndf, masking, ends[:, None], ends[None, :])


def stretched_mu(ndf: str, masking: str, roughness: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The cosine at a place x in [0, 1] of the stretched axis."""
    form = curves.form_of(ndf, masking)
    bend = curves._numpy_knee(form, masking, np.maximum(roughness**2, quadrature.SMALLEST_ALPHA))
    top = curves._numpy_squeeze(form, np.ones(1), bend)
    return np.clip(curves._unsqueeze(form, x * top, bend), 0.0, 1.0)


def _axes_text(layout: str, ndf: str, masking: str) -> dict[str, str]:
    if layout == "linear":
        return {"roughness": "row j at (j + 1/2) / N", "mu": "column j at (j + 1/2) / N"}
    form = {
        "hypot": "sqrt(mu / sqrt(mu^2 + (4 alpha)^2))",
        "wide": "sqrt(mu / (mu + 4 alpha))",
        "root": "sqrt(mu / (mu + 4 k)), k the masking's",
    }[curves.form_of(ndf, masking)]
    return {"roughness": "row j at j / (N - 1)", "mu": f"column j at s(mu) / s(1) = j / (N - 1), s = {form}"}


def _figures(difference: np.ndarray) -> dict[str, float]:
    return {"max": float(np.max(np.abs(difference))), "rms": float(np.sqrt(np.mean(difference**2)))}


def _exact(
    model: BSDF | None, ndf: str, masking: str, mu: np.ndarray, alpha: np.ndarray, fine: bool = False
) -> dict[str, np.ndarray]:
    """E, and dfg of a distribution, by quadrature."""
    if model is None:
        found = quadrature.moments(ndf, masking, mu, alpha, nodes=quadrature.JUDGE if fine else quadrature.NODES)
        return {"E": found.whole, "dfg": np.stack([found.whole - found.schlick, found.schlick], -1)}
    if isinstance(model, Conductor):
        from .albedo import _bound

        nodes = quadrature.JUDGE if fine else quadrature.NODES
        return {"E": quadrature.reflected(ndf, masking, _bound(model).reflectance, mu, alpha, nodes=nodes)}
    nodes = quadrature.GLASS_JUDGE if fine else quadrature.GLASS_NODES
    power = quadrature.glass(ndf, masking, model.fresnel, mu, alpha, float(model.eta), nodes=nodes)  # type: ignore[attr-defined]
    total = power.reflected + (power.transmitted if model.transmits else 0.0)
    return {"E": total * float(np.mean(model.albedo))}  # type: ignore[attr-defined]


def _directional(
    model: BSDF | None, ndf: str, masking: str, grid: tuple[np.ndarray, np.ndarray], method: str, spp: int,
    points: str, seed: int,
) -> tuple[dict[str, np.ndarray], dict[str, dict[str, float]]]:  # fmt: skip
    exact = _exact(model, ndf, masking, *grid)
    if method == "quadrature":
        # judged at the columns where it is hardest, next to grazing and next to the normal, and at every fourth
        n = grid[0].shape[1]
        some = np.unique(np.concatenate([np.arange(min(4, n)), np.arange(0, n, 4), [n - 1]]))
        judge = _exact(model, ndf, masking, grid[0][:, some], grid[1][:, some], fine=True)
        return exact, {name: _figures(exact[name][:, some] - judge[name]) for name in exact}
    estimate = monte_carlo.estimate(ndf, masking, *grid, method, spp, points, seed).value
    return {**exact, "E": estimate}, {"E": _figures(estimate - exact["E"]), "dfg": {"max": 0.0, "rms": 0.0}}


def _average(model: BSDF | None, ndf: str, masking: str, roughness: np.ndarray, fine: bool = False) -> np.ndarray:
    x, w = quadrature.gauss(48 if fine else 32)
    mu, alpha = np.broadcast_arrays(x**2, roughness[:, None] ** 2)
    values = _exact(model, ndf, masking, mu, alpha, fine)["E"]
    return np.einsum("rm...,m->r...", values, 4.0 * w * x**3)


def _interpolation_error(model: BSDF | None, ndf: str, masking: str, roughness: np.ndarray, layout: str) -> float:
    """Largest error of bilinear interpolation for roughness >= 0.1, at the cells' centres and edges' middles."""
    size = len(roughness)
    rows = np.flatnonzero(roughness[:-1] >= 0.1)
    if not len(rows):
        return 0.0
    rows = rows[:: max(1, len(rows) // 24)]
    columns = np.arange(size - 1) if size <= 128 else np.unique(np.geomspace(1, size - 1, 128).astype(int) - 1)
    worst = 0.0
    for row_part, column_part in ((0.5, 0.5), (0.0, 0.5), (0.5, 0.0)):

        def value(a: float, b: float) -> np.ndarray:
            r = roughness[rows] + a * (roughness[rows + 1] - roughness[rows])
            if layout == "linear":
                mu = ((columns + b + 0.5) / size)[None, :]
            else:
                mu = stretched_mu(ndf, masking, r[:, None], ((columns + b) / (size - 1))[None, :])
            mu, alpha = np.broadcast_arrays(mu, r[:, None] ** 2)
            return _exact(model, ndf, masking, mu, alpha)["E"]

        between = sum(
            (row_part if i else 1.0 - row_part) * (column_part if j else 1.0 - column_part) * value(i, j)
            for i in ((0, 1) if row_part else (0,))
            for j in ((0, 1) if column_part else (0,))
        )
        worst = max(worst, float(np.max(np.abs(between - value(row_part, column_part)))))
    return worst


def _glass(
    ndf: str, masking: str, fresnel: str, roughness: np.ndarray, mu: np.ndarray, size: int
) -> tuple[dict[str, np.ndarray], dict[str, dict[str, float]]]:
    root = (np.arange(GLASS_STEPS) + 0.5) / GLASS_STEPS * curves.LARGEST_ROOT
    eta = ((1.0 + root) / (1.0 - root))[:, None, None]
    shape = (GLASS_STEPS, size, size)
    cos, alpha = np.broadcast_to(mu, shape), np.broadcast_to((roughness**2)[:, None], shape)
    arrays: dict[str, np.ndarray] = {"sqrt_f0": root}
    errors = {}
    some = (slice(None, None, 5), slice(None, None, 7), slice(None, None, 7))
    for side, ratio in (("thin", eta), ("dense", 1.0 / eta)):
        ratio = np.broadcast_to(ratio, shape)
        name = f"E_glass_{side}"
        arrays[name] = sum(quadrature.glass(ndf, masking, fresnel, cos, alpha, ratio))  # type: ignore[assignment]
        judge = quadrature.glass(
            ndf, masking, fresnel, cos[some], alpha[some], ratio[some], nodes=quadrature.GLASS_JUDGE
        )
        errors[name] = _figures(arrays[name][some] - sum(judge))
    return arrays, errors


def _describe(target: str | BSDF) -> Any:
    if isinstance(target, str):
        return target
    values = {n: getattr(target, n) for n in target.parameters() if n not in ("alpha", "rotation", "sampling")}
    return {"model": target.name, **{n: np.asarray(v).tolist() for n, v in values.items()}}


# --------------------------------------------------------------------------- reading


def load(path: str | Path) -> Baked:
    """The tables in a folder, or in a tables.npz. InputError where it is not one, or is damaged or altered."""
    path = Path(path)
    file_path = path / "tables.npz" if path.is_dir() else path
    hint = "gonio bake ggx -o DIR writes one"
    if not file_path.is_file():
        raise InputError("no tables.npz here", str(path), hint)
    if file_path.suffix.lower() != ".npz":
        raise InputError(f"a '{file_path.suffix}' given, a folder or a tables.npz expected", str(path), hint)
    try:
        with np.load(file_path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        manifest = json.loads(str(arrays.pop("manifest")))
        hashes = manifest["hash"]
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile) as error:
        raise InputError("damaged, or not written by gonio bake", str(file_path), "bake it again") from error
    altered = [name for name, value in hashes.items() if name not in arrays or content_hash(arrays[name]) != value]
    if altered:
        raise InputError(f"'{altered[0]}' is not what the manifest says", str(file_path), "altered: bake it again")
    return Baked(arrays, manifest)


# --------------------------------------------------------------------------- the homework's pictures


def homework_pictures(baked: Baked, store: str = "E", flip: bool = True) -> dict[str, np.ndarray]:
    """E and E_avg as the homework has them: (N, N, 3) of 8 bits, x = n.v, three equal channels, E_avg along the row.

    store  "E" or "1-E"
    flip   True: the bottom row is the lowest roughness; False: the top row is
    """
    if store not in ("E", "1-E"):
        raise InputError(f"unknown '{store}'", "--store", "E or 1-E")
    size = baked.manifest["size"]
    pictures: dict[str, np.ndarray] = {}
    for name in ("E", "E_avg"):
        if name not in baked.arrays:
            continue
        value = baked.arrays[name]
        value = np.broadcast_to(value[:, None], (size, size)) if value.ndim == 1 else value
        value = np.clip(1.0 - value if store == "1-E" else value, 0.0, 1.0)
        value = value[::-1] if flip else value
        pictures[name] = np.repeat(np.round(value * 255.0).astype(np.uint8)[..., None], 3, axis=-1)
    return pictures


__all__ = ["LUTS", "Baked", "bake", "distributions", "homework_pictures", "load"]
