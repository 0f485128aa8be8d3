"""Approximations of a material within a budget of operations, with their measured errors; split-sum code."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from ..energy.tables import bake as baking
from ..energy.tables import curves as fits
from ..errors import InputError
from ..material import BSDF, Microsurface, tree
from ..ops import Scalar, Spectrum, Table, function, lookup, vec2
from ..ops.table import read_in_numpy
from ..optics.lattice import r_sequence
from .bundle import Bundle
from .curves import written
from .functions import Functions, functions_bundle
from .operations import operations
from .placement import Placement
from .program import Program

TERMS = ("fresnel", "masking")  # choices for which less expensive options exist
MAX_VARIANTS = 64
PAIRS = 4096
TABLE = 64
ORDERS = ("2/0", "3/0", "2", "3", "4")
LOCATION = "emit: budget"


class Tier(NamedTuple):
    """The cost and the error of one form of a material or of `dfg`.

    name   description, such as "fresnel = schlick"
    cost   number of operations of one call
    error  largest error
    mean   mean error
    """

    name: str
    cost: int
    error: float
    mean: float

    def __str__(self) -> str:
        return f"{self.name}: {self.cost} operations, largest error {self.error:.1e}, mean {self.mean:.1e}"


def cheapest(model: BSDF, budget: int) -> tuple[BSDF, list[Tier]]:
    """(the form of a material with the most accurate `eval` within a number of operations, all forms that were tried).

    The forms differ in the choices of `TERMS`. Errors are those of `eval` for 4096 random pairs of directions, relative
    to the largest channel of each pair, or to 1e-3 of the mean if that is larger. The chosen form comes first.

    budget  number of operations
    Raises InputError if no form is within the budget.
    """
    wo, wi = _pairs(bool(model.transmits))
    reference = np.asarray(model.eval(wo, wi), float)
    tiers: list[tuple[Tier, BSDF]] = []
    for name, variant in _variants(model):
        program = Program(variant, ("eval",))
        called = [routine for method, routine in program.entries.items() if method == "eval"]
        value = np.asarray(variant.eval(wo, wi), float)
        size = np.maximum(np.abs(reference).max(-1), 1e-3 * np.abs(reference).mean())
        error = np.abs(value - reference).max(-1) / size
        cost = sum(sum(operations(routine).values()) for routine in called)
        tiers.append((Tier(name, cost, float(error.max()), float(error.mean())), variant))
    within = [pair for pair in tiers if pair[0].cost <= budget]
    if not within:
        least = min(tier.cost for tier, _ in tiers)
        what = f"{budget} operations given, but the cheapest form of {type(model).__name__} takes {least}"
        raise InputError(what, LOCATION, f"give {least} or more")
    best = min(within, key=lambda pair: (pair[0].mean, pair[0].cost))
    return best[1], [best[0], *(tier for tier, _ in tiers if tier is not best[0])]


def _variants(model: BSDF) -> Iterator[tuple[str, BSDF]]:
    """(description, material) of each combination of less expensive terms, the material itself first."""
    leaves = [leaf for leaf in tree.leaves(model) if leaf.path.rpartition(".")[2] in TERMS and leaf.parameter.choices]
    options = [[leaf.value, *(c for c in leaf.parameter.choices if c != leaf.value)] for leaf in leaves]
    for values in itertools.islice(itertools.product(*options), MAX_VARIANTS):
        pairs = [(leaf.path, value) for leaf, value in zip(leaves, values, strict=True) if value != leaf.value]
        name = ", ".join(f"{path} = {value}" for path, value in pairs)
        yield name or "the material itself", tree.replace(model, dict(pairs)) if pairs else model


def _pairs(below: bool) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions, half of which are close to the mirror direction.

    below  whether half of the directions wi are mirrored to the other side, for a material that transmits
    """
    u = r_sequence(PAIRS, 4, 0.5)
    z = np.sqrt(u[:, [0, 2]])
    phi = 2.0 * np.pi * u[:, [1, 3]]
    sine = np.sqrt(1.0 - z**2)
    both = np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=-1)
    wo, wi = both[:, 0], both[:, 1].copy()
    near = wo[::2] * (-1.0, -1.0, 1.0) + 0.3 * wi[::2]
    wi[::2] = near / np.linalg.norm(near, axis=1, keepdims=True)
    if below:
        wi[np.arange(PAIRS) % 4 >= 2, 2] *= -1.0
    return wo, wi


# --------------------------------------------------------------------------- the split sum


def split_sum(model: BSDF, lang: str, placement: Placement | None = None, budget: int = 0) -> tuple[Bundle, list[Tier]]:
    """The code of the split sum for a material's distribution, `dfg` and `image_light`; and the forms of `dfg`, the
    chosen one first.

    budget  number of operations of `dfg`: the most accurate of a table and several fits within this number is written;
            0 selects the table. A lookup counts as its four texels and their interpolation
    Raises InputError for a material without a microsurface, and for an anisotropic one.
    """
    surface = model.microsurface
    if surface is None or not model.isotropic:
        what = f"{type(model).__name__} has no split sum, which requires an isotropic microfacet distribution"
        raise InputError(what, "emit: ibl", "--fit writes the albedo of any material")
    tiers = list(_forms(model, surface, budget))
    within = [(tier, code) for tier, code in tiers if not budget or tier.cost <= budget]
    if not within:
        least = min(tier.cost for tier, _ in tiers)
        raise InputError(f"{budget} operations given, but the cheapest form takes {least}", LOCATION)
    best, dfg = min(within, key=lambda pair: (pair[0].error, pair[0].cost))

    @function
    def image_light(f0: Spectrum, roughness: Scalar, cos_theta: Scalar, radiance: Spectrum) -> Spectrum:
        """Light that the surface reflects from an environment; `radiance` is read from the prefiltered environment."""
        ab = dfg(roughness, cos_theta)
        return (f0 * ab.x + ab.y) * radiance

    types: dict[str, str | None] = {"f0": "vec3", "roughness": "float", "cos_theta": "float", "radiance": "vec3"}
    title = (
        f"The split sum (Karis2013) of {surface.ndf}, {surface.masking}: light = (f0 A + B) radiance, where radiance\n"
        "is read in the mirrored direction from the environment prefiltered for the roughness (gonio bake sky.hdr).\n"
        f"A and B are computed by {best}."
    )
    made: Functions = [(dfg, {"roughness": "float", "cos_theta": "float"}), (image_light, types)]
    bundle = functions_bundle(made, lang, title, placement)
    bundle.manifest["tiers"] = [tier._asdict() for tier, _ in tiers]
    return bundle, [best, *(tier for tier, _ in tiers if tier is not best)]


LOOKUP = 30  # operations of an interpolated lookup of two channels, in addition to its four texels


def _forms(model: BSDF, surface: Microsurface, budget: int) -> Iterator[tuple[Tier, Callable]]:
    """`dfg` from a table and, if a budget is given, from fits of several orders."""
    baked = baking.cached(surface.ndf, lut=("dfg",), masking=surface.masking, size=TABLE)
    table = Table("dfg", baked.arrays["dfg"])

    def dfg(roughness: Scalar, cos_theta: Scalar) -> object:
        """A and B of the split sum: for Schlick's Fresnel term, the albedo is F0 A + B (Karis2013)."""
        return vec2(*lookup(table, roughness, cos_theta))

    samples = fits.sample(model, ("dfg",))
    yield Tier(f"a table of {TABLE} x {TABLE}", LOOKUP + 4, *_table_error(table, samples)), function(dfg)
    for order in ORDERS if budget else ():
        (curve,) = fits.fit(samples, order, ("dfg",))
        code = written(curve)
        counted = functions_bundle([(code, {"roughness": "float", "cos_theta": "float"})], "glsl", "")
        cost = sum(counted.manifest["operations"]["dfg"].values())
        yield Tier(f"a fit of order {order}", cost, curve.error, curve.mean), code


def _table_error(table: Table, samples: fits.Samples) -> tuple[float, float]:
    """(largest, mean) error of lookups between the nodes, in the range of the fits."""
    white, share = np.moveaxis(samples.values["dfg"], -1, 0)
    a, b = read_in_numpy(table, samples.roughness[:, None], samples.mu)
    error = np.maximum(np.abs(a - white * (1.0 - share)), np.abs(b - white * share))
    return float(error.max()), float(error.mean())
