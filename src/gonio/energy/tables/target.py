"""The target of a baked table, with its E at points of the axes and its E_avg, which are computed in parts."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...ops import backend
from ...work import executor, parts
from .. import cache
from ..albedo import quadrature
from ..albedo.quadrature import Points
from .axes import Axes

BLOCK = 1024  # points per part; a part takes about 0.1 s, and 1 s with the reference quadrature


@dataclasses.dataclass(frozen=True)
class Target:
    """A target whose tables have an axis for roughness: a distribution at F = 1, or a Conductor or Dielectric.

    model         the material; None for a distribution
    ndf, masking  names of the distribution and the masking term
    """

    model: Any
    ndf: str
    masking: str

    def exact(self, points: Points, fine: bool = False) -> dict[str, np.ndarray]:
        """E at points and, for a distribution, dfg, computed by quadrature in parts.

        fine  whether to use the finer quadrature, which is the reference for errors
        """
        shape = np.shape(points.mu)
        given = [np.broadcast_to(v, shape).ravel() if v is not None else None for v in points]
        arguments = [(self, *(v if v is None else v[at : at + BLOCK] for v in given), fine) for at in blocks(shape)]
        tables = together(_exact, arguments)
        return {name: values.reshape(*shape, *values.shape[1:]) for name, values in tables.items()}

    def at(self, points: Points, fine: bool) -> dict[str, np.ndarray]:
        """Evaluate `exact` in one pass, without splitting the input."""
        judge = quadrature.JUDGE if points.alpha_y is None else quadrature.TURNED_JUDGE
        nodes = judge if fine else None
        if self.model is None:
            moments = quadrature.moments(self.ndf, self.masking, *points, nodes=nodes)
            return {"E": moments.white, "dfg": np.stack([moments.white - moments.schlick, moments.schlick], -1)}
        surface = self.model.microsurface
        if surface.eta is None:
            reflectance = self.model.bind(backend.types("float64")).reflectance
            return {"E": quadrature.reflected(self.ndf, self.masking, reflectance, *points, nodes=nodes)}
        glass_nodes = quadrature.GLASS_JUDGE if fine else quadrature.GLASS_NODES
        eta, fresnel = float(surface.eta), surface.fresnel
        power = quadrature.glass(self.ndf, self.masking, fresnel, points, eta, glass_nodes)
        total = power.reflected + (power.transmitted if surface.transmits else 0.0)
        return {"E": total[..., None] * np.broadcast_to(np.asarray(surface.albedo, float), 3)}

    @property
    def conducts(self) -> bool:
        """Whether the target is a metal; other targets have an index that can vary along an axis."""
        return self.model is not None and self.model.microsurface.eta is None

    def average(self, axes: Axes, rows: np.ndarray, fine: bool = False) -> np.ndarray:
        """E_avg at rows of roughness, by a Gauss-Legendre rule in sqrt(mu) and equal steps of azimuth in a quarter
        turn."""
        x, w = quadrature.gauss(48 if fine else 32)
        roughness = axes.roughness(rows)
        if not axes.azimuths:
            mu, alpha = np.broadcast_arrays(x**2, roughness[:, None] ** 2)
            return np.einsum("rm...,m->r...", self.exact(Points(mu, alpha, None, 0.0), fine)["E"], 4.0 * w * x**3)
        # equal steps of the mean of the azimuths of directions and of their slopes, so that both ends are resolved
        turn = (np.arange(count := 48 if fine else 24) + 0.5) / count * 0.5 * np.pi
        k = np.sqrt(axes.aspect)
        phi = np.arctan2(np.sin(turn), k * np.cos(turn))[:, None, None]
        share = k / (np.sin(turn) ** 2 + (k * np.cos(turn)) ** 2) / count
        along_x, along_y = axes.widths(roughness[:, None])
        values = self.exact(Points(*np.broadcast_arrays(x**2, along_x, along_y, phi)), fine)["E"]
        return np.einsum("prm...,m,p->r...", values, 4.0 * w * x**3, share)


def blocks(shape: tuple[int, ...]) -> range:
    """The starting indices of the parts into which points of this shape are divided."""
    return range(0, int(np.prod(shape)), BLOCK)


def _exact(
    asked: Target, mu: np.ndarray, alpha: np.ndarray, alpha_y: np.ndarray | None, phi: np.ndarray, fine: bool
) -> dict[str, np.ndarray]:
    """One part of `Target.exact`."""
    return asked.at(Points(mu, alpha, alpha_y, phi), fine)


def glass_power(
    ndf: str, masking: str, fresnel: str, mu: np.ndarray, alpha: np.ndarray, eta: np.ndarray, fine: bool
) -> dict[str, np.ndarray]:
    """One part of `_glass`: the reflected and the transmitted power."""
    nodes = quadrature.GLASS_JUDGE if fine else quadrature.GLASS_NODES
    return {"power": np.stack(quadrature.glass(ndf, masking, fresnel, Points(mu, alpha), eta, nodes), -1)}


def together(function: executor.Function, arguments: list[tuple[Any, ...]]) -> dict[str, np.ndarray]:
    """The concatenated results of all parts.

    arguments  arguments of the function for each part
    """
    keys = [parts.key_of(function.__name__, *map(_content, given), cache.formulas()) for given in arguments]
    done = {index: values for index, values in executor.each(function, arguments, keys) if index >= 0}
    return {name: np.concatenate([done[i][name] for i in range(len(arguments))]) for name in done[0]}


def _content(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, Target):
        names = (value.ndf, value.masking) + (value.model.microsurface[2:3] if value.model is not None else ())
        model = None if value.model is None else describe(value.model)
        return repr((model, value.ndf, value.masking, cache.origin(*names)))
    return value


def describe(target: Any) -> Any:
    """The entry of the manifest for a target; parameters that vary along an axis are omitted."""
    if isinstance(target, str):
        return target
    surface = target.microsurface
    swept = ("alpha", "rotation", "sampling") if surface is not None else ()
    described: dict[str, Any] = {"model": target.name}
    for name, parameter in target.parameters().items():
        if name not in swept:
            value = getattr(target, name)
            described[name] = describe(value) if parameter.inner else np.asarray(value).tolist()
    return described
