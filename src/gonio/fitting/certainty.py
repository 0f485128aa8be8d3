"""Uncertainty of fitted values: the sandwich estimator over runs of neighboring values, and undetermined directions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..measure.tables.base import Floats
from .solver import BLOCK, Linearized

NULL = 1e-8  # eigenvalue that counts as 0, relative to the largest: float32 derivatives have relative errors of 1e-6
PART = 1e-3  # squared component of a unit vector above which a parameter always belongs to the direction
LEAST = 1e-6  # squared component below which it never does
ROUNDED = 1e-6  # relative error of J^T J


def undetermined_groups(hessian: Floats) -> list[list[int]]:
    """Groups of indices of undetermined parameters, from J^T J (K, K): single parameters, or several of which the data
    determine only a combination.

    They have components in the null space of J^T J, with parameters scaled to a unit diagonal; an eigenvalue counts as
    0 if it is within the rounding error of float32 derivatives. The error also rotates the null space, by an angle that
    is its ratio to the next eigenvalue: a component within this angle, or below LEAST, counts as 0.
    """
    size = np.sqrt(np.maximum(np.diag(hessian), 0.0))
    s = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(hessian / np.outer(s, s))
    largest = max(float(values.max(initial=0.0)), 1e-300)
    empty = values < NULL * largest
    angle = ROUNDED * largest / float(values[~empty].min(initial=largest))
    projector = vectors[:, empty] @ vectors[:, empty].T
    return connected(np.abs(projector) > min(PART, max(LEAST, angle**2)))


def connected(joined: NDArray[np.bool_]) -> list[list[int]]:
    """Groups of indices connected by a symmetric relation (K, K), directly or through others, from those with a true
    diagonal."""
    left = set(np.flatnonzero(np.diag(joined)).tolist())
    groups: list[list[int]] = []
    while left:
        group: set[int] = set()
        more = {min(left)}
        while more:
            group |= more
            more = {j for i in more for j in np.flatnonzero(joined[i]).tolist()} & left - group
        groups.append(sorted(group))
        left -= group
    return groups


@dataclass(frozen=True)
class Certainty:
    """Uncertainty of fitted parameters.

    covariance    (K, K); parameters in the null space have infinite variance
    undetermined  groups of parameter indices: one without effect, or several of which only a combination is determined
    inverse       pseudoinverse of J^T J, (K, K)
    """

    covariance: Floats
    undetermined: list[list[int]]
    inverse: Floats

    @property
    def errors(self) -> Floats:
        """Standard errors, (K,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Floats:
        """Correlation matrix, (K, K); 0 for undetermined parameters."""
        return _correlation(self.covariance)

    @property
    def coupling(self) -> Floats:
        """Correlation matrix for independent errors of equal size, (K, K), a measure of how well the data distinguish
        parameters. A misfit that affects several parameters correlates their values but does not change this matrix.
        Entries of undetermined parameters are 0, because their entries in the pseudoinverse are rounding errors."""
        return _correlation(np.where(np.isfinite(np.diag(self.covariance)), self.inverse, 0.0))


def _correlation(covariance: Floats) -> Floats:
    variance = np.diag(covariance)
    told = np.isfinite(variance) & (variance > 0.0)
    size = np.sqrt(np.where(told, variance, 1.0))
    matrix = np.where(np.outer(told, told), covariance, 0.0) / np.outer(size, size)
    np.fill_diagonal(matrix, 1.0)
    return np.asarray(matrix)


def information(parts: Sequence[Linearized], rows: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:
    """(J^T J (K, K), scores J^T r of each run (R, K)) for residuals that are given in parts.

    rows   index of the run of neighbors that each residual belongs to
    count  number of parameters K
    """
    runs = int(rows.max()) + 1 if len(rows) else 1
    hessian, scores = np.zeros((count, count)), np.zeros((runs, count))
    for residual, jacobian, which in parts:
        for column, number in enumerate(which):
            scores[:, number] += np.bincount(rows, weights=residual * jacobian[:, column], minlength=runs)
        for start in range(0, len(residual), BLOCK):
            j = jacobian[start : start + BLOCK].astype(np.float64)
            hessian[np.ix_(which, which)] += j.T @ j
    return hessian, scores


def degrees_of_freedom(parts: Sequence[Linearized], rows: NDArray[np.int64], inverse: Floats) -> Floats:
    """Effective degrees of freedom of the standard errors of `certainty`, (K,): the number of runs that determine a
    parameter.

    The variance of a parameter is estimated by a sum over runs. Each term is approximately e_g times a chi^2 variable
    with one degree of freedom, where e_g is the run's contribution to the variance for independent errors of equal
    size. The sum is approximately chi^2 with (sum e_g)^2 / sum e_g^2 degrees of freedom (Satterthwaite1946).

    rows     index of the run of neighbors that each residual belongs to
    inverse  inverse of J^T J, (K, K)
    """
    runs = int(rows.max()) + 1 if len(rows) else 1
    shares = np.zeros((len(inverse), runs))
    for _, jacobian, which in parts:
        for start in range(0, len(jacobian), BLOCK):
            effect = jacobian[start : start + BLOCK].astype(np.float64) @ inverse[which]
            row = rows[start : start + BLOCK]
            for share, column in zip(shares, effect.T, strict=True):
                share += np.bincount(row, column**2, runs)
    squares = np.sum(shares**2, axis=1)
    return np.asarray(np.where(squares > 0.0, np.sum(shares, axis=1) ** 2 / np.maximum(squares, 1e-300), np.inf))


def certainty(hessian: Floats, scores: Floats) -> Certainty:
    """Sandwich estimate of the covariance, valid for errors of any size that are correlated within a run (Liang1986).

    Every parameter along an undetermined direction has infinite variance. The pseudoinverse, which is 0 along that
    direction, would yield the variance of some combination instead.

    hessian  J^T J, (K, K)
    scores   J^T r of each run, (R, K)
    """
    scale = np.sqrt(np.diag(hessian))
    s = np.where(scale > 0.0, scale, 1.0)
    inverse = np.linalg.pinv(hessian / np.outer(s, s), rcond=NULL) / np.outer(s, s)
    matrix = inverse @ np.einsum("ni,nj->ij", scores, scores) @ inverse
    undetermined = undetermined_groups(hessian)
    for number in [one for group in undetermined for one in group]:
        matrix[number, :] = matrix[:, number] = 0.0
        matrix[number, number] = np.inf
    return Certainty(matrix, undetermined, inverse)
