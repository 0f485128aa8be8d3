"""How sure the numbers of a fit are: the sandwich over runs of neighbors, and what the data do not tell at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..measure.tables.base import Floats
from .solver import BLOCK, Linearized

NULL = 1e-8  # of the largest eigenvalue: derivatives in float32 are right to 1e-6 of themselves, the square of it less
PART = 1e-3  # of a unit vector's square, from which on a number is part of a direction


def null_space(hessian: Floats) -> Floats:
    """Projector onto what J^T J does not tell, (K, K), in numbers scaled to its unit diagonal: of the eigenvectors
    whose eigenvalue is 0 but for the rounding of derivatives in float32."""
    size = np.sqrt(np.maximum(np.diag(hessian), 0.0))
    told = size > 0.0
    s = np.where(told, size, 1.0)
    values, vectors = np.linalg.eigh(hessian / np.outer(s, s))
    empty = vectors[:, values < NULL * max(float(values.max(initial=0.0)), 1e-300)]
    return np.asarray(empty @ empty.T)


def groups_of(projector: Floats) -> list[list[int]]:
    """Numbers that no data tell, those together of which a combination is told; from the projector of `null_space`."""
    tied = np.abs(projector) > PART
    left = set(np.flatnonzero(np.diag(projector) > PART).tolist())
    groups: list[list[int]] = []
    while left:
        group: set[int] = set()
        more = {min(left)}
        while more:
            group |= more
            more = {j for i in more for j in np.flatnonzero(tied[i]).tolist()} & left - group
        groups.append(sorted(group))
        left -= group
    return groups


@dataclass(frozen=True)
class Certainty:
    """How sure numbers are.

    covariance  (K, K); infinite variances of numbers that a direction of the null space holds
    untold      groups of numbers: one alone that moves nothing, several of which only a combination is told
    """

    covariance: Floats
    untold: list[list[int]]

    @property
    def errors(self) -> Floats:
        """Standard errors, (K,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Floats:
        """(K, K); 0 for numbers that are not told."""
        told = np.isfinite(self.errors) & (self.errors > 0.0)
        size = np.where(told, self.errors, 1.0)
        found = np.where(np.outer(told, told), self.covariance, 0.0) / np.outer(size, size)
        np.fill_diagonal(found, 1.0)
        return np.asarray(found)


def information(parts: Sequence[Linearized], rows: NDArray[np.int64], count: int) -> tuple[Floats, Floats]:
    """(J^T J (K, K), pushes J^T r of each run (R, K)) of residuals in parts, all of the same runs `rows`."""
    runs = int(rows.max()) + 1 if len(rows) else 1
    hessian, pushes = np.zeros((count, count)), np.zeros((runs, count))
    for residual, jacobian, which in parts:
        for column, number in enumerate(which):
            pushes[:, number] += np.bincount(rows, weights=residual * jacobian[:, column], minlength=runs)
        for start in range(0, len(residual), BLOCK):
            j = jacobian[start : start + BLOCK].astype(np.float64)
            hessian[np.ix_(which, which)] += j.T @ j
    return hessian, pushes


def certainty(hessian: Floats, pushes: Floats) -> Certainty:
    """The sandwich, which holds for errors of any size that are alike within a run (Liang1986). Where the data do not
    tell a direction, none of the numbers along it has a finite variance: the inverse that is 0 along it (pinv) would
    give that of some combination of them.

    hessian  J^T J, (K, K); pushes  J^T r of each run, (R, K)
    """
    scale = np.sqrt(np.diag(hessian))
    s = np.where(scale > 0.0, scale, 1.0)
    inverse = np.linalg.pinv(hessian / np.outer(s, s), rcond=NULL) / np.outer(s, s)
    matrix = inverse @ (pushes.T @ pushes) @ inverse
    untold = groups_of(null_space(hessian))
    for number in [one for group in untold for one in group]:
        matrix[number, :] = matrix[:, number] = 0.0
        matrix[number, number] = np.inf
    return Certainty(matrix, untold)
