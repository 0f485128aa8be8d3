"""The models that are fitted: a named material or a sum of materials, and its free parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..catalog import notation, texts
from ..catalog.material import MaterialLike
from ..catalog.material import material as named
from ..errors import InputError
from ..material import BSDF, tree
from ..materials.combined.sum import Sum
from ..measure.tables.base import Floats
from .certainty import undetermined_groups
from .data import Data
from .parameters import Free, free_of, start_of
from .solver import Problem, normal_equations
from .starts import random_starts

FIXED = {"ggx": ("k",), "beckmann": ("k",)}
AT_LEAST = {"ggx": {"eta": 1.0}, "beckmann": {"eta": 1.0}}  # eta and 1 / eta have the same reflectance
GENERIC = 512  # number of directions at which the effects of parameters are compared


class Model(NamedTuple):
    """A material, the paths of its fixed parameters, and lower bounds of other parameters."""

    material: BSDF
    fixed: tuple[str, ...] = ()
    least: Mapping[str, float] = {}


def modeled(text: str, lobes: int = 1) -> Model:
    """A model by name: "conductor", "lambert+ggx", "oren-nayar(sigma=0.2)".

    lobes  number of copies of the last term of the sum
    "ggx" and "beckmann" are microfacet lobes with this distribution of normals, with Schlick's Fresnel term and k = 0,
    so only eta determines the color.
    """
    if lobes < 1:
        raise InputError(f"{lobes} lobes given, at least 1 expected", "lobes")
    parts = texts.terms(text)
    if not all(parts):
        raise InputError(f"'{text}' is not a sum of materials", "model", 'such as "lambert+ggx"')
    parts += parts[-1:] * (lobes - 1)
    made: list[Model] = []
    for part in parts:
        head = part.partition("(")[0]
        material, stated = notation.named(texts.expanded(part))[0], texts.assignments(notation.split(part)[1])
        paths = {leaf.path for leaf in tree.leaves(material)}
        given = [path for path in stated if path in paths]  # not a preset: its values are the starting point
        own = Model(material, (*FIXED.get(head, ()), *given), AT_LEAST.get(head, {}))
        for path, value in stated.items():
            if isinstance(getattr(material, path, None), BSDF):  # an inner material, as in coat(base=lambert+ggx)
                own = _with_constraints(own, path, modeled(value))
        made.append(own)
    combined = made[0]
    for other in made[1:]:
        both = Model(Sum(combined.material, other.material))
        combined = _with_constraints(_with_constraints(both, "a", combined), "b", other)
    return combined


def _with_constraints(model: Model, path: str, inner: Model) -> Model:
    """A model whose material at `path` has the fixed parameters and lower bounds of another model."""
    fixed = (*model.fixed, *(f"{path}.{one}" for one in inner.fixed))
    return Model(model.material, fixed, {**model.least, **{f"{path}.{one}": low for one, low in inner.least.items()}})


def moving_of(
    model: MaterialLike, lobes: int = 1, fixed: Mapping[str, object] | None = None, free: Sequence[str] = ()
) -> tuple[BSDF, list[Free]]:
    """A model with the values of `fixed` set, and its free parameters; for the arguments, see `fit`."""
    return moving_with_notes(model, lobes, fixed, free)[:2]


def moving_with_notes(
    model: MaterialLike, lobes: int, fixed: Mapping[str, object] | None, free: Sequence[str]
) -> tuple[BSDF, list[Free], list[str]]:
    """Like `moving_of`, with notes for the reader of the result."""
    material, stays, least = modeled(str(model), lobes) if isinstance(model, str | Path) else Model(named(model))
    given = {notation.path_of(material, path): value for path, value in (fixed or {}).items()}
    if given:
        written = {path: value for path, value in given.items() if isinstance(value, str)}
        others = {path: value for path, value in given.items() if path not in written}
        material = tree.replace(notation.changed(material, written), others)
    free = [notation.path_of(material, path) for path in free]
    moving = free_of(material, {**given, **dict.fromkeys(stays)}, tuple(free))
    moving = [replace(one, low=max(one.low, least.get(one.path, one.low))) for one in moving]
    return without_duplicates(material, moving, tuple(free))


def without_duplicates(
    material: BSDF, moving: list[Free], wanted: Sequence[str] = ()
) -> tuple[BSDF, list[Free], list[str]]:
    """(material, free parameters, notes) without redundant parameters.

    If parameters of several parts have the same effect, such as the albedos of two Lambert parts, one of them stays
    free, or those in `wanted`. The others are fixed at 0 if the first has the same effect without them, else at their
    current values. Redundancy is detected by the null space of the derivatives at random parameter values and random
    directions, where it can only be a property of the model.
    """
    parts = {one.path.rpartition(".")[0] for one in moving}
    if len(parts) < 2:
        return material, moving, []
    owner = [one for one in moving for _ in range(one.count)]
    numbers = random_starts(start_of(material, moving), moving)[0]
    notes: list[str] = []
    for group in undetermined_groups(_generic(material, moving, numbers)):
        same = list(dict.fromkeys(owner[k].path for k in group))
        retained = next((path for path in same if path in wanted), same[0])
        for path in same:
            one = next((one for one in moving if one.path == path), None)
            if (
                path == retained
                or path in wanted
                or one is None
                or path.rpartition(".")[0] == retained.rpartition(".")[0]
            ):
                continue
            zero = (0.0, 0.0, 0.0) if one.count > 1 else 0.0
            without = tree.replace(material, {path: zero}) if one.low == 0.0 and one.kind != "alpha" else None
            rest = [other for other in moving if other.path != path]
            if without is not None and _moves(without, rest, retained):
                material = without
                notes.append(f"{path} is fixed at 0: {retained} has the same effect")
            else:
                notes.append(f"{path} is fixed at its value: {retained} has the same effect")
            moving = rest
    return material, moving, notes


def _moves(material: BSDF, moving: list[Free], path: str) -> bool:
    """Whether a parameter affects the values of the material."""
    numbers = random_starts(start_of(material, moving), moving)[0]
    diagonal = np.diag(_generic(material, moving, numbers))
    own = [one.path == path for one in moving for _ in range(one.count)]
    return bool(np.all(diagonal[own] > 0.0))


def _generic(material: BSDF, moving: list[Free], numbers: Floats) -> Floats:
    """J^T J of the values of a material at random directions."""
    w = np.random.default_rng(7).normal(size=(2, GENERIC, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.1
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    data = Data(w[0], w[1], np.ones((GENERIC, 3)), np.zeros(GENERIC, np.int64))
    return normal_equations(Problem(material, moving, data, "linear"), numbers)[2]
