"""Search for parameters that explain the values of f in a file without parameters, by least squares."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..catalog import notation
from ..errors import GonioError
from ..material import BSDF, tree
from ..material.parameters import Parameter
from .mistakes import Values, f_of

MOST = 3  # largest number of parameters; with more parameters, almost any values can be explained
_KINDS = ("float", "spectrum", "alpha")
_STARTS = (1.0, 0.25, 4.0, 0.0625, 16.0)  # multiples of the default; lobe widths have a narrow basin of convergence
_LEAST, _LARGEST = 1e-6, 1e4  # bounds of the parameters, which the logarithmic search requires
_DIGITS = (2, 3, 4, 6)  # significant digits of the result, fewest first


def candidates(material: BSDF, wo: Values, wi: Values, f: Values) -> Iterator[BSDF]:
    """The material with the parameters that best fit values of f (N, 1 or 3), rounded to an increasing number of
    digits.

    Yields nothing for a model whose f depends on more than `MOST` parameters.
    """
    names = _free(material, wo, wi)
    if not 0 < len(names) <= MOST:
        return
    gray = f.shape[1] == 1 or bool(np.all(np.ptp(f, axis=1) <= 1e-6 * f.max(axis=1)))
    layout = [(name, 1 if gray or names[name].kind != "spectrum" else 3) for name in names]
    nearest = _nearest(material, names, layout, wo, wi, np.broadcast_to(f, (len(f), 3)))
    for digits in _DIGITS if nearest is not None else ():
        assert nearest is not None
        rounded = np.array([float(f"{value:.{digits}g}") for value in nearest])
        other = _changed(material, layout, rounded)
        if other is not None:
            yield other


def described(material: BSDF) -> str:
    """The parameters of a material as text: "kd=0.25, ks=0.6, p=16"."""
    return ", ".join(f"{name}={notation.written(value)}" for name, value in notation.settings(material).items())


def _free(material: BSDF, wo: Values, wi: Values) -> dict[str, Parameter]:
    """The numeric parameters that f depends on."""
    f = f_of(material, wo, wi)
    free: dict[str, Parameter] = {}
    for name, parameter in type(material).parameters().items():
        if parameter.kind in _KINDS:
            value = np.asarray(getattr(material, name), float)
            other = _changed(material, [(name, 1)], np.atleast_1d(0.9 * value.max() or 0.1))
            if other is not None and np.any(f_of(other, wo, wi) != f):
                free[name] = parameter
    return free


def _nearest(
    material: BSDF, names: dict[str, Parameter], layout: list[tuple[str, int]], wo: Values, wi: Values, f: Values
) -> Values | None:
    """The values of the parameters, concatenated, that minimize the relative differences of f."""
    from scipy.optimize import least_squares  # imported late, because few checks need a search

    size = np.abs(f) + 1e-3 * np.abs(f).max() + 1e-30

    def difference(logs: Values) -> Values:
        other = _changed(material, layout, np.exp(logs))
        return np.full(f.size, 1e3) if other is None else ((f_of(other, wo, wi) - f) / size).ravel()

    high = np.log([min(names[name].high, _LARGEST) for name, count in layout for _ in range(count)])
    low = np.full(len(high), np.log(_LEAST))
    narrow = [names[name].kind != "spectrum" for name, count in layout for _ in range(count)]
    first = [float(np.max(np.asarray(getattr(material, name), float))) for name, n in layout for _ in range(n)]
    best: tuple[float, Values] | None = None
    for factor in _STARTS:
        start = np.log(np.maximum(np.where(narrow, factor, 1.0) * first, 10.0 * _LEAST))
        fit = least_squares(difference, np.clip(start, low + 1e-9, high - 1e-9), bounds=(low, high), max_nfev=40)
        if best is None or fit.cost < best[0]:
            best = (float(fit.cost), np.exp(fit.x))
        if best[0] < 1e-8 * f.size:
            break
    return best[1] if best is not None else None


def _changed(material: BSDF, layout: list[tuple[str, int]], values: Values) -> BSDF | None:
    """The material with other values; None if these values are invalid."""
    changes: dict[str, object] = {}
    at = 0
    for name, count in layout:
        part = [float(value) for value in values[at : at + count]]
        changes[name] = part[0] if count == 1 else tuple(part)
        at += count
    try:
        return tree.replace(material, changes)
    except GonioError:
        return None
