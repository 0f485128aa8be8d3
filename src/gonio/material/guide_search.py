"""Finding a guide (`gonio.material.guide`): `eval` on a grid, in the chart that fits it best.

Each chart that may fit is tried: the density that it leads to is held against `eval` at angles of wo half-way between
its slices, where it fits worst, and the one of least variance is taken, together with the share of samples that follow
the cosine which makes that variance least. It takes some tenths of a second, and is kept with the material.
"""

from __future__ import annotations

import hashlib
import itertools
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..errors import InputError
from ..ops import Scalar, Table, backend, fetch
from . import tree
from .guide import Axis, Guide, Lobe
from .parameters import Material, Parameter, Value, pair_of

Grid: TypeAlias = "NDArray[np.float64]"

ANGLES = 33  # of wo, from the normal to the horizon: steps of 2.8 degrees
FEWER = 17  # where there are slices along more than the angle
ROWS, COLUMNS = 64, 17  # nodes of s, and of the azimuth over half a turn
AZIMUTHS, ROUND = 16, 33  # of wo, and nodes of a full turn, where `eval` turns with the surface
REFINEMENTS = 4  # of the tables toward least variance; more gain nothing
JUDGED = 4  # of so many azimuths of wo one is judged
FINE = 2  # points at which `eval` is asked, for each step between nodes, along both
HORIZON = np.radians(89.7)  # stands for 90 degrees, where nothing is seen
COSINES = (0.0005, 0.002, 0.01, 0.03, 0.1, 0.3, 0.6)  # shares of samples that may follow the cosine
NARROWEST = 1e-10  # of q: lobes 1e-5 wide
WIDTH_ANGLES = (0.12, 0.45, 0.75)  # of wo, as shares of 90 degrees, at which that is looked at
PEAKS, ZOOMS = 801, 3  # directions in the plane of wo among which a lobe's peak is looked for, ever closer to it
WIDTH_SHARE = 0.2  # of a lobe's light that lies within q0
VARYING = 9  # slices along a parameter that varies over the surface, and of two such:
VARYING_TWO = 5
MIDDLING = 0.01  # q0 where lobes of any width are compared
DIFFERENT = 0.05  # share of the light that must move for a varying parameter to get slices of its own
SMALLEST = 1.0 / 64.0  # where the range of a width that varies starts at 0
SAME = 0.02  # relative difference under which two sides, or two azimuths, are alike
PROBES = 768
LEAST_LEFT = 0.25  # of the mean about a node that the refinement leaves: `eval` may be more between the points
MIN_LIGHT = 1e-20  # light of a slice that counts as none
KEPT = 16  # guides in memory, of each class
CHARTS = ("half", "normal", "centre")


class Guided(Protocol):
    """What is asked of a material here."""

    @property
    def transmits(self) -> bool: ...

    def eval(self, wo: Any, wi: Any) -> Any: ...


def guide_of(material: Material) -> Guide:
    """The guide of a material as it was made, found once and kept; raises InputError while Dr.Jit records a loop."""
    own = vars(material).get("_guide")
    if own is None:
        plain = plain_values(material)
        guides = _kept(type(material))
        if plain not in guides:
            guides[plain] = find(plain)
            while len(guides) > KEPT:
                guides.popitem(last=False)
        vars(material)["_guide"] = own = guides[plain]
    return own


def _kept(cls: type) -> OrderedDict[Material, Guide]:
    """The guides of a class's materials, by content; on the class, and gone with it when a user's file is run anew."""
    if "_guides" not in vars(cls):
        cls._guides = OrderedDict()  # type: ignore[attr-defined]
    guides: OrderedDict[Material, Guide] = vars(cls)["_guides"]
    return guides


def prepare(material: Material) -> None:
    """Find what all materials in a tree need before a loop is recorded: guides of those that have no sampling of
    their own, and tables."""
    for _, one in tree.walk(material):
        if one.guided:
            guide_of(one)
        one.prepare()


def find(material: Any) -> Guide:
    """The guide of a material of plain values; raises InputError while Dr.Jit records a loop."""
    dr = backend.drjit()
    if dr.flag(dr.JitFlag.SymbolicScope):
        what = f"{type(material).__name__} has no `sample`, and how to sample it cannot be found inside a loop"
        raise InputError(what, "sample", "call its `sample` or `pdf` once before the loop")
    varying = _varying(material)
    counts = [VARYING if len(varying) == 1 else VARYING_TWO] * len(varying)
    steps = [np.linspace(0.0, 1.0, count) for count in counts]
    # the first parameter's nodes lie closest together among the slices
    versions = [
        _version(material, {one: float(t) for one, t in zip(varying, reversed(shares), strict=True)})
        for shares in itertools.product(*reversed(steps))
    ]
    return _found(versions, tuple(one.axis(count) for one, count in zip(varying, counts, strict=True)))


def of_values(values: Guided) -> Guide:
    """The guide of anything that has `eval` and `transmits`, and the same values everywhere: a measured table."""
    return _found([values], ())


def _found(versions: list[Any], axes: tuple[Axis, ...]) -> Guide:
    """The guide of a material with one value everywhere, or of several such along axes, the first the fastest."""
    probed = versions[len(versions) // 2]
    above, below = (_probe(probed, side) for side in (1.0, -1.0))
    lit = [side for side, values in ((1.0, above), (-1.0, below)) if np.any(values > 0.0)]
    if not lit:
        return _nothing()
    turns = any(_turns(probed, side) for side in lit)
    behind = len(lit) == 2 and not _alike(above, below)
    slices = _Slices(versions, AZIMUTHS if turns else 1, [1.0, -1.0] if behind else lit[:1])
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
        shares=_named("shares", np.broadcast_to(shares, total.shape)[:, None]),
        cosine=_named("cosine", np.array([[cosine]])),
    )


def _named(stem: str, values: Grid) -> Table:
    """A table under a name of its own, as two guides may stand in one shader."""
    return Table(f"guide_{stem}_{hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()[:8]}", values)


def _nothing() -> Guide:
    none = Table("guide_none", np.zeros((1, 1)))
    return Guide((), 1, 1, False, True, True, (), none, none)


# --------------------------------------------------------------------------- directions, and what eval says of them


def _direction(angle: Grid, azimuth: float, side: float) -> tuple[Grid, Grid, Grid]:
    sine = np.sin(angle)
    return sine * np.cos(azimuth), sine * np.sin(azimuth), side * np.cos(angle)


def _light(material: Guided, wo: tuple[Grid, ...], wi: tuple[Grid, ...]) -> Grid:
    """Mean of |eval| over the colours, 0 where it is not a number."""
    types = backend.types("float32")
    shape = np.broadcast_shapes(*(np.shape(x) for x in (*wo, *wi)))

    def vector(w: tuple[Grid, ...]) -> Any:
        return types.vec3(*(types.float(backend.aligned(np.broadcast_to(x, shape).ravel(), np.float32)) for x in w))

    value = material.eval(vector(wo), vector(wi))
    channels = backend.to_numpy(value, int(np.prod(shape))).astype(float)
    mean = np.abs(channels).mean(-1) if channels.ndim == 2 else np.abs(channels)
    return np.where(np.isfinite(mean), mean, 0.0).reshape(shape)


def _pairs(side: float) -> tuple[Grid, Grid]:
    """Pairs of directions to try, wo on one side: anywhere, or near mirrored, turned back and straight on."""
    rng = np.random.default_rng(7)
    wo, wi = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in rng.normal(size=(2, PROBES, 3)))
    wo[:, 2] = side * np.abs(wo[:, 2])
    kind, width = np.arange(PROBES) % 4, 0.3 ** (np.arange(PROBES) // 4 % 6)
    about = np.array([[-1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]])[np.minimum(kind, 2)] * wo
    near = about + width[:, None] * rng.normal(size=(PROBES, 3))
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    return wo, np.where((kind < 3)[:, None], near, wi)


def _probe(material: Guided, side: float) -> Grid:
    """What `eval` says of the pairs; those from below are mirrored ones from above."""
    wo, wi = _pairs(1.0)
    flip = np.array([1.0, 1.0, side])
    return _light(material, tuple((wo * flip).T), tuple((wi * flip).T))


def _differ(a: Grid, b: Grid) -> bool:
    """Whether more than a few of the pairs differ."""
    largest = np.maximum(a, b)
    lit = largest > 1e-6 * float(np.max(largest, initial=0.0))
    return bool(np.mean(np.abs(a - b)[lit] > SAME * largest[lit]) > 0.02) if np.any(lit) else False


def _alike(above: Grid, below: Grid) -> bool:
    return not _differ(above, below)


def _turns(material: Guided, side: float) -> bool:
    """Whether a turn about the normal changes what `eval` says."""
    wo, wi = _pairs(side)
    turn = np.random.default_rng(8).uniform(0.0, 2.0 * np.pi, PROBES)
    cos, sin = np.cos(turn), np.sin(turn)

    def rotated(w: Grid) -> tuple[Grid, ...]:
        return cos * w[:, 0] - sin * w[:, 1], sin * w[:, 0] + cos * w[:, 1], w[:, 2]

    return _differ(_light(material, tuple(wo.T), tuple(wi.T)), _light(material, rotated(wo), rotated(wi)))


# --------------------------------------------------------------------------- parameters that vary over the surface


@dataclass(frozen=True)
class _Varying:
    """A parameter that has not the same value everywhere: its path, kind and range, as one number."""

    path: str
    kind: str
    low: float
    high: float

    def value(self, share: float) -> float:
        """At a place from 0 to 1; widths by equal steps of their root."""
        return self.low + (self.high - self.low) * (share * share if self.kind == "alpha" else share)

    def axis(self, count: int) -> Axis:
        """The slices along it."""
        ends = _named("ends", np.array([[self.low, 1.0 / (self.high - self.low)]]))

        def read(material: Any) -> Scalar:
            given = tree.value_at(material, self.path)
            if self.kind == "alpha":
                given = ops.sqrt(given.x * given.y)
            elif self.kind == "spectrum":
                given = ops.mean(given)
            low, scale = fetch(ends, 0.0 * given)
            share = ops.clamp((given - low) * scale, 0.0, 1.0)
            return ops.sqrt(share) if self.kind == "alpha" else share

        return Axis(read, count)


def plain_values(material: Any) -> Any:
    """The material with NumPy's arrays for Dr.Jit's."""
    values: dict[str, Value] = {}
    for leaf in tree.leaves(material):
        parts = pair_of(leaf.value) if leaf.parameter.kind == "alpha" else (leaf.value,)
        if leaf.parameter.numeric and any(map(backend.is_drjit, parts)):
            columns = [np.asarray(backend.to_numpy(backend.drjit().detach(p), 1)) for p in parts]
            one = [float(c[0]) if c.shape == (1,) else c[0] if c.shape == (1, 3) else c for c in columns]
            values[leaf.path] = one[0] if len(one) == 1 else tuple(one)
    return tree.replace(material, values) if values else material


def _ends(parameter: Parameter, value: Value) -> tuple[float, float] | None:
    """The range of a value that varies from ray to ray, as one number; None of one that does not."""
    if not parameter.numeric or value is None or parameter.rows(value) <= 1:
        return None
    if parameter.kind == "alpha":
        x, y = (np.asarray(v, float).ravel() for v in pair_of(value))
        values = np.sqrt(x * y)
    elif parameter.kind == "spectrum":
        values = np.asarray(value, float).mean(-1)
    else:
        values = np.asarray(value, float).ravel()
    low, high = float(values.min()), float(values.max())
    if parameter.kind == "alpha":
        low = max(low, SMALLEST * high)
    return (low, high) if high > low else (low, low)


def _version(material: Any, places: dict[_Varying, float]) -> Any:
    """The material with one value everywhere: of chosen parameters at a place, of others half-way."""
    values: dict[str, Value] = {}
    for leaf in tree.leaves(material):
        ends = _ends(leaf.parameter, leaf.value)
        if ends is not None:
            values[leaf.path] = 0.5 * (ends[0] + ends[1])
    values |= {one.path: one.value(share) for one, share in places.items()}
    return tree.replace(material, values) if values else material


def _varying(material: Any) -> list[_Varying]:
    """The parameters that vary and move the light most, two at most."""
    moved: list[tuple[float, _Varying]] = []
    for leaf in tree.leaves(material):
        ends = _ends(leaf.parameter, leaf.value)
        if ends is None or ends[0] == ends[1] or leaf.parameter.kind == "angle":
            continue
        one = _Varying(leaf.path, leaf.parameter.kind, *ends)
        low, high = (_version(material, {one: share}) for share in (0.15, 1.0))
        share = _moved(low, high)
        if share > DIFFERENT:
            moved.append((share, one))
    moved.sort(key=lambda pair: -pair[0])
    return [one for _, one in moved[:2]]


def _moved(one: Guided, other: Guided) -> float:
    """The share of the light that goes elsewhere."""
    weights = []
    chart = _Chart("half", False, MIDDLING)
    for material in (one, other):
        light = _Slices([material], 1, [1.0]).fine(chart, material, np.array([0.7]), 0.0, 1.0).light
        weights.append(light / max(float(light.sum()), MIN_LIGHT))
    return 0.5 * float(np.abs(weights[0] - weights[1]).sum())


# --------------------------------------------------------------------------- charts


@dataclass(frozen=True)
class _Chart:
    """As `guide.Lobe` has it: directions from (s, phi), in NumPy."""

    name: str
    across: bool
    q0: float

    @property
    def q_max(self) -> float:
        return 4.0 if self.name == "centre" else 2.0

    @property
    def span(self) -> float:
        """log(1 + q_max / q0)."""
        return float(np.log1p(self.q_max / self.q0))

    def direction(
        self, wo: tuple[Grid, ...], s: Grid, phi: NDArray[np.floating], centre: tuple[Any, Any]
    ) -> tuple[tuple[Grid, ...], Grid]:
        """(wi, dw / (ds dphi)), all above the surface."""
        q = self.q0 * np.expm1(s * self.span)
        jacobian = 0.5 * self.span * (q + self.q0)
        radius = np.sqrt(np.maximum(q * (1.0 - 0.25 * q), 0.0))
        x, y, z = radius * np.cos(phi), radius * np.sin(phi), 1.0 - 0.5 * q
        if self.name == "centre":
            sine, cosine = centre
            x, z = cosine * x + sine * z, cosine * z - sine * x
        if self.name == "half":
            cos = wo[0] * x + wo[1] * y + wo[2] * z
            return tuple(2.0 * cos * m - w for m, w in zip((x, y, z), wo, strict=True)), jacobian * 4.0 * np.maximum(
                cos, 0.0
            )
        return (x, y, z), np.broadcast_to(jacobian, np.broadcast_shapes(jacobian.shape, x.shape))


@dataclass(frozen=True)
class _Fine:
    """`eval` and the cosine's density on the fine grid, as densities over s and phi; (angles, s, phi)."""

    light: Grid
    cosine: Grid


def _steps(count: int, round_: bool) -> tuple[Grid, Grid, Grid]:
    """(fine places in [0, 1], nodes from fine values, fine values from nodes) of an axis of `count` nodes."""
    fine = (np.arange((count - 1) * FINE) + 0.5) / FINE
    hat = np.maximum(1.0 - np.abs(fine[None] - np.arange(count)[:, None]), 0.0)
    gather = hat.copy()
    if round_:  # the last node is the first
        gather[0] = gather[-1] = gather[0] + gather[-1]
    return fine / (count - 1), gather / gather.sum(1, keepdims=True), hat.T


@dataclass(frozen=True)
class _Best:
    """The tables of a side in its best chart."""

    chart: _Chart
    full: bool
    density: Grid
    light: Grid
    centres: Grid
    variance: float
    cosine: float

    @property
    def across(self) -> bool:
        return self.chart.across

    def lobe(self) -> Lobe:
        """For formulas."""
        span = 2.0 * np.pi if self.full else np.pi
        g = self.density
        steps = np.cumsum(0.5 * (g[..., 1:] + g[..., :-1]), axis=-1) * (span / (g.shape[-1] - 1))
        below = np.concatenate([np.zeros_like(g[..., :1]), steps], axis=-1)
        rows = below[..., -1]
        over_s = np.cumsum(0.5 * (rows[:, 1:] + rows[:, :-1]), axis=-1) / (rows.shape[-1] - 1)
        over_s = np.concatenate([np.zeros_like(rows[:, :1]), over_s], axis=-1)
        return Lobe(
            self.across,
            self.chart.name,
            self.chart.q_max,
            self.full,
            _named("density", g[..., None]),
            _named("below", below[..., None]),
            _named("rows", over_s[..., None]),
            _named("scales", np.array([[self.chart.q0, 1.0 / self.chart.span]])),
            _named("centres", self.centres),
        )


class _Slices:
    """All slices: angles of wo, within versions of the material, within azimuths, within sides of the surface."""

    def __init__(self, versions: list[Any], azimuths: int, sides: list[float]) -> None:
        self.versions, self.azimuths, self.sides = versions, azimuths, sides
        self.full = azimuths > 1
        self.angles = np.linspace(0.0, 0.5 * np.pi, FEWER if self.full or len(versions) > 1 else ANGLES)
        self.s, self._rows, self._from_rows = _steps(ROWS, False)
        phi, self._columns, self._from_columns = _steps(ROUND if self.full else COLUMNS, self.full)
        self.span = 2.0 * np.pi if self.full else np.pi
        # alternating halves: what is not alike in both is at least averaged
        flip = 1.0 if self.full else np.where(np.arange(len(phi)) % 2 == 0, 1.0, -1.0)
        self.phi = phi * self.span * flip
        self.cell = self.span / (len(self.s) * len(phi))

    @property
    def count(self) -> int:
        return len(self.angles) * len(self.versions) * self.azimuths * len(self.sides)

    def groups(self) -> Iterator[tuple[Any, float, float]]:
        """(version, azimuth, side) of each run of slices over the angles of wo."""
        for side in self.sides:
            for azimuth in range(self.azimuths):
                for version in self.versions:
                    yield version, 2.0 * np.pi * azimuth / self.azimuths, side

    def fine(
        self, chart: _Chart, material: Any, angles: Grid, azimuth: float, side: float, centres: Grid | None = None
    ) -> _Fine:
        """`eval` in a chart."""
        wo = tuple(x[..., None, None] for x in _direction(np.minimum(angles, HORIZON), azimuth, 1.0))
        centre = np.array([[0.0, 1.0]]) if centres is None else centres
        wi, jacobian = chart.direction(
            wo, self.s[:, None], self.phi, (centre[:, 0, None, None], centre[:, 1, None, None])
        )
        above = wi[2] > 0.0
        both = 1.0 if self.full else 2.0  # halves of the azimuth
        light = np.where(above, self._seen(material, chart.across, side, wo, wi) * jacobian * both, 0.0)
        cosine = np.where(above, wi[2] * jacobian * (both / np.pi), 0.0)
        shape = (len(angles), len(self.s), len(self.phi))
        return _Fine(np.broadcast_to(light, shape), np.broadcast_to(cosine, shape))

    def best(self, across: bool) -> _Best | None:
        """The chart of least variance, with its tables; None where no light goes there."""
        names = [name for name in CHARTS if not (name == "half" and across) and not (name == "centre" and self.full)]
        tried = [best for name in names if (best := self._in_chart(name, across)) is not None]
        return min(tried, key=lambda best: best.variance, default=None)

    def _in_chart(self, name: str, across: bool) -> _Best | None:
        centres = [self._centres(name, version, across, side) for version, _, side in self.groups()]
        groups = list(zip(self.groups(), centres, strict=True))
        widths = [self._width(name, across, group, own) for group, own in groups]
        known = [width for width in widths if width is not None]
        if not known:
            return None
        chart = _Chart(name, across, min(known))
        nodes, middles = [], []
        step = JUDGED if self.full else 1
        half_way = 0.5 * (self.angles[1:] + self.angles[:-1])
        turn = np.pi / self.azimuths if self.full else 0.0
        for number, ((version, azimuth, side), own) in enumerate(groups):
            nodes.append(self.fine(chart, version, self.angles, azimuth, side, own))
            if number % step:
                continue
            between = own[1:] + own[:-1]
            between = between / np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-6)
            # between slices, what a ray meets at worst
            middles.append(self.fine(chart, version, half_way, azimuth + turn, side, between))
        return self._judged(chart, nodes, middles, np.concatenate(centres))

    def _judged(self, chart: _Chart, nodes: list[_Fine], middles: list[_Fine], centres: Grid) -> _Best:
        """The tables, and the variance that they lead to half-way between slices."""
        light = np.array([fine.light.sum((1, 2)) * self.cell for fine in nodes])
        density = np.array([self._fitted(fine.light) for fine in nodes])
        sums = (_trapezoid(density.shape[-2], 1.0), _trapezoid(density.shape[-1], self.span))
        density /= np.maximum(np.einsum("gakj,k,j->ga", density, *sums), MIN_LIGHT)[..., None, None]
        along = density.reshape(len(self.sides), self.azimuths, len(self.versions), *density.shape[1:])
        mixed = 0.5 * (along[..., 1:, :, :] + along[..., :-1, :, :])
        mixed = 0.5 * (mixed + np.roll(mixed, -1, axis=1)) if self.full else mixed
        mixed = mixed.reshape(len(nodes), *mixed.shape[3:])[:: len(nodes) // len(middles)]
        expected = self._from_rows @ mixed @ self._from_columns.T
        wanted = np.array([fine.light for fine in middles])
        flat = np.array([fine.cosine for fine in middles])
        total = wanted.sum((2, 3)) * self.cell
        lit = total > MIN_LIGHT
        best = (np.inf, COSINES[-1])
        for cosine in COSINES:
            got = (1.0 - cosine) * expected + cosine * flat
            second = np.divide(wanted * wanted, got, out=np.zeros_like(got), where=wanted > 0.0).sum((2, 3)) * self.cell
            variance = float(np.mean(second[lit] / total[lit] ** 2) - 1.0) if np.any(lit) else 0.0
            best = min(best, (variance, cosine))
        shape = (self.count, *density.shape[2:])
        return _Best(chart, self.full, density.reshape(shape), light.ravel(), centres, *best)

    def _fitted(self, light: Grid) -> Grid:
        """Values at the nodes, at first the means around each; then the second moment of light / density is made less.

        Where the integral of light^2 / density is least, the mean of its square about each node is the same, so nodes
        where that is larger are raised: by its root, in steps that keep every value positive.
        """
        means = nodes = self._rows @ light @ self._columns.T
        for _ in range(REFINEMENTS):
            density = self._from_rows @ nodes @ self._from_columns.T
            ratio = np.divide(light, density, out=np.zeros_like(light), where=density > 0.0)
            nodes = np.maximum(nodes * np.sqrt(self._rows @ (ratio * ratio) @ self._columns.T), LEAST_LEFT * means)
        return nodes

    def _width(self, name: str, across: bool, group: tuple[Any, float, float], centres: Grid) -> float | None:
        """q within which lies a small share of the light, from the narrowest lobe up; None where there is no light."""
        material, azimuth, side = group
        chart = _Chart(name, across, NARROWEST)
        q = np.geomspace(NARROWEST, chart.q_max, 320)
        s = np.log1p(q / chart.q0) / chart.span
        phi = (np.arange(12) + 0.5) * (2.0 * np.pi / 12)
        places = []
        for place in (round(share * (len(self.angles) - 1)) for share in WIDTH_ANGLES):
            wo = _direction(self.angles[place], azimuth, 1.0)
            wi, jacobian = chart.direction(wo, s[:, None], phi[None], (centres[place, 0], centres[place, 1]))
            below = np.cumsum(np.where(wi[2] > 0.0, self._seen(material, across, side, wo, wi) * jacobian, 0.0).sum(1))
            if below[-1] > 0.0:
                places.append(q[np.searchsorted(below, WIDTH_SHARE * below[-1])])
        return float(np.exp(np.mean(np.log(places)))) if places else None

    def _centres(self, name: str, material: Any, across: bool, side: float) -> Grid:
        """Sine and cosine of the angle at which a lobe has its peak, in the plane of wo, for each angle of wo."""
        if name != "centre":
            return np.tile([0.0, 1.0], (len(self.angles), 1))
        wo = tuple(x[:, None] for x in _direction(np.minimum(self.angles, HORIZON), 0.0, 1.0))
        reach, middle = 0.5 * np.pi, np.zeros((len(self.angles), 1))
        for _ in range(ZOOMS):
            angle = np.clip(middle + reach * np.linspace(-1.0, 1.0, PEAKS), -HORIZON, HORIZON)
            light = self._seen(material, across, side, wo, (np.sin(angle), 0.0 * angle, np.cos(angle)))
            weight = (light / np.maximum(light.max(1, keepdims=True), MIN_LIGHT)) ** 4
            middle = ((weight * angle).sum(1) / np.maximum(weight.sum(1), MIN_LIGHT))[:, None]
            reach *= 8.0 / PEAKS
        return np.concatenate([np.sin(middle), np.cos(middle)], axis=1)

    def _seen(self, material: Any, across: bool, side: float, wo: tuple[Grid, ...], wi: tuple[Grid, ...]) -> Grid:
        """Light of pairs that are both given above the surface."""
        return _light(material, (wo[0], wo[1], side * wo[2]), (wi[0], wi[1], (-side if across else side) * wi[2]))


def _trapezoid(count: int, length: float) -> Grid:
    """Weights of the nodes of an axis."""
    weights = np.full(count, length / (count - 1))
    weights[[0, -1]] *= 0.5
    return weights
