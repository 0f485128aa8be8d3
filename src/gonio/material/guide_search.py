"""Computation of a guide (`gonio.material.guide`): `eval` on a grid, in the chart that fits it best.

Each suitable chart is tried: the resulting density is compared with `eval` at angles of wo midway between its slices,
where it fits worst. The chart of smallest variance is chosen, together with the fraction of cosine-distributed samples
that minimizes its variance. The search takes a few tenths of a second; the guide is cached with the material.
"""

from __future__ import annotations

import itertools
from collections import OrderedDict
from typing import Any

import numpy as np

from ..errors import InputError
from ..ops import Table, backend
from . import tree
from .guide import Axis, Guide
from .guide_charts import MIN_LIGHT, Slices, named
from .guide_probe import Guided, alike, depends_on_azimuth, probe
from .guide_versions import varying_parameters, version
from .parameters import Material

AZIMUTHS = 16  # number of azimuths of wo, if `eval` is not invariant under rotation
VARYING = 9  # number of slices along a parameter that varies over the surface
VARYING_TWO = 5  # number of slices along each of two such parameters
CACHED = 16  # maximum number of guides in memory, per class


def guide_of(material: Material) -> Guide:
    """The guide of an unbound material, from the cache if possible.

    Raises InputError if it must be computed while Dr.Jit records a loop.
    """
    own = vars(material).get("_guide")
    if own is None:
        plain = tree.plain_values(material)
        guides = _cached(type(material))
        if plain not in guides:
            guides[plain] = find(plain)
            while len(guides) > CACHED:
                guides.popitem(last=False)
        vars(material)["_guide"] = own = guides[plain]
    return own


def lend(material: Material, other: Material) -> None:
    """Make another material use this material's guide for sampling. The samples are correct for any values, but noisier
    than with the other material's own guide."""
    if material.guided:
        vars(other)["_guide"] = guide_of(material)


def _cached(cls: type) -> OrderedDict[Material, Guide]:
    """The guides of a class's materials, by content; stored on the class, so that they are discarded with it."""
    if "_guides" not in vars(cls):
        cls._guides = OrderedDict()  # type: ignore[attr-defined]
    guides: OrderedDict[Material, Guide] = vars(cls)["_guides"]
    return guides


def prepare(material: Material) -> None:
    """Compute everything that the materials of a tree need before a loop is recorded: tables, and guides for materials
    that define only `eval`."""
    for _, one in tree.walk(material):
        if one.guided:
            guide_of(one)
        one.prepare()


def find(material: Any) -> Guide:
    """Compute the guide of a material with plain values. Raises InputError while Dr.Jit records a loop."""
    dr = backend.drjit()
    if dr.flag(dr.JitFlag.SymbolicScope):
        what = f"{type(material).__name__} has no `sample`, and its guide cannot be computed while a loop is recorded"
        raise InputError(what, "sample", "call its `sample` or `pdf` once before the loop")
    varying = varying_parameters(material)
    counts = [VARYING if len(varying) == 1 else VARYING_TWO] * len(varying)
    steps = [np.linspace(0.0, 1.0, count) for count in counts]
    # the slices of the first parameter's nodes are contiguous
    versions = [
        version(material, {one: float(t) for one, t in zip(varying, reversed(shares), strict=True)})
        for shares in itertools.product(*reversed(steps))
    ]
    return _search(versions, tuple(one.axis(count) for one, count in zip(varying, counts, strict=True)))


def of_values(values: Guided) -> Guide:
    """Compute the guide of a uniform object with `eval` and `transmits`, such as a measured table."""
    return _search([values], ())


def _search(versions: list[Any], axes: tuple[Axis, ...]) -> Guide:
    """Compute the guide of a uniform material, or of versions of one along axes, the first of which varies fastest."""
    probed = versions[len(versions) // 2]
    above, below = (probe(probed, side) for side in (1.0, -1.0))
    lit = [side for side, values in ((1.0, above), (-1.0, below)) if np.any(values > 0.0)]
    if not lit:
        return _nothing()
    turns = any(depends_on_azimuth(probed, side) for side in lit)
    behind = len(lit) == 2 and not alike(above, below)
    slices = Slices(versions, AZIMUTHS if turns else 1, [1.0, -1.0] if behind else lit[:1])
    sides = (False, True) if probed.transmits else (False,)
    candidates = [best for across in sides if (best := slices.best(across)) is not None]
    if not candidates:
        return _nothing()
    total = np.sum([best.light for best in candidates], axis=0)
    shares = sum(best.light for best in candidates if best.across) / np.maximum(total, MIN_LIGHT)
    light = float(np.sum(total))
    cosine = sum(best.cosine * float(np.sum(best.light)) for best in candidates) / light
    return Guide(
        lobes=tuple(best.lobe() for best in candidates),
        angles=len(slices.angles),
        azimuths=slices.azimuths,
        behind=behind,
        above=1.0 in lit,
        below=-1.0 in lit,
        axes=axes,
        shares=named("shares", np.broadcast_to(shares, total.shape)[:, None]),
        cosine=named("cosine", np.array([[cosine]])),
    )


def _nothing() -> Guide:
    none = Table("guide_none", np.zeros((1, 1)))
    return Guide((), 1, 1, False, True, True, (), none, none)
