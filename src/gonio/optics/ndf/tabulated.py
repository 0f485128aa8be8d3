"""What follows from D alone: Smith's Lambda and samples of the normals, from tables that are found once.

With the length of slope s = tan theta_m, P(s) ds = 2 pi s D cos^4 theta_m ds is the share of the surface with such a
slope. A direction v sees the area

    int D(m) max(0, v.m) dm = int P(s) a(s) ds,   a(s) = int max(0, |v.z| + s sin theta_v cos phi) dphi / (2 pi),

with a in closed form, so one quadrature over s is enough (trapezoidal in log s; Heitz2014, sec. 3 and 4). Slopes are
counted in units of w, twice the area that a grazing direction sees: of GGX that is alpha. The area over |v'|, with
v' = (w v.x, w v.y, v.z), is then a smooth function of sqrt(1 - v'.z / |v'|) at any width. With 256 nodes 1 + Lambda is
within 1e-5 of the closed forms of GGX, Beckmann and Student-T, and within 1e-4 where the shape changes with the width,
as GTR's does.

Normals are drawn by tables of the inverse of int P ds, and of int s P ds for the slopes that a grazing direction sees.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import ClassVar, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import GonioWarning, InputError, summary, user_line
from ...ops import Direction, Pair, Scalar, Table, inset, lookup, sqrt, vec2

Floats: TypeAlias = NDArray[np.float64]
Density: TypeAlias = Callable[[Floats, Floats], Floats]

NODES = 256  # of the projected area over v'.z / |v'|, and of the inverse functions
ROWS, FINE = 96, 1024  # widths, at equal steps of their fourth root; those at which w is kept
LEAST, STEEPEST = 0.1, 1e6  # fourth root of the smallest width; largest slope: beyond, D / 1e6 is left of the area
STEP, LOWEST, HIGHEST = 0.01, -16.0, 30.0  # of log s
SAME = 1e-4  # share of the surface on which two densities may differ and count as one
PAIRS = ((0.1, 0.4), (0.6, 0.2), (0.05, 0.9))  # unequal widths at which D is looked at
AZIMUTHS = np.arange(7) * (2.0 * np.pi / 7.0) + 0.35  # no multiples of a quarter turn, at which lobes may be alike
AREA, ALL, GRAZING = range(3)  # columns


class Tables(NamedTuple):
    """What is found from D, once for all widths.

    values   over (fourth root of the width, node), or over nodes alone where all widths are one surface, stretched:
             the area over |v'|; tau = s / (1 + s), s in units of w, by g(share of the normals), and by g(share of the
             area that a grazing direction sees). g(u) = sqrt(u) / (sqrt(u) + sqrt(1 - u)) spreads both ends
    scale    w / alpha, over the same widths; a plain number where it is one for all
    widths   what two widths mean: "stretched" along x and y, "first" where alpha_y is ignored, "equal" where nothing
             else is known
    """

    values: Table
    scale: Table | float
    widths: str

    def pair(self, alpha: Pair) -> Pair:
        """The widths along x and y, times w / alpha."""
        own = alpha if self.widths == "stretched" else vec2(alpha.x, alpha.x)
        if isinstance(self.scale, float):
            return own * self.scale
        (scale,) = lookup(self.scale, _row_of(alpha, FINE))
        return own * scale

    def read(self, column: int, alpha: Pair, x: Scalar) -> Scalar:
        """A column of `values` at x in [0, 1]."""
        along = inset(x, NODES)
        found = (
            lookup(self.values, along)
            if len(self.values.shape) == 1
            else lookup(self.values, _row_of(alpha, ROWS), along)
        )
        return found[column]

    @property
    def long_tailed(self) -> bool:
        """Whether Lambda falls off so slowly that it is seen near the normal: where 0.8 % of the area is masked of
        GGX's slopes, of Gaussian ones it is 1e-6, of Student-T's with gamma = 3 1e-3."""
        near = self.values.values[..., AREA].reshape(-1, NODES)[:, NODES // 8]
        return bool(np.median(near) - (1.0 - (NODES // 8 / (NODES - 1.0)) ** 2) > 4e-3)


def _row_of(alpha: Pair, count: int) -> Scalar:
    return inset((sqrt(sqrt(alpha.x)) - LEAST) * (1.0 / (1.0 - LEAST)), count)


class HasDensity(Protocol):
    """What the tables are found from: a distribution of which D alone is written."""

    name: ClassVar[str]

    def D(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of normals, 1/sr."""
        ...

    def place(self, formula: str) -> str:
        """File and line of a formula, for errors."""
        ...


def tables_of(ndf: HasDensity) -> Tables:
    """The tables of a distribution, found when they are first asked for and kept with its class, so that they are gone
    when a user's file is run anew. InputError where D is not finite, or has no symmetry that they can have."""
    cls = type(ndf)
    if "_tables" not in vars(cls):
        cls._tables = {}  # type: ignore[attr-defined]
    kept: dict[object, Tables] = vars(cls)["_tables"]
    key = tuple((name, _hashable(value)) for name, value in sorted(vars(ndf).items()))
    if key not in kept:
        kept[key] = _found(ndf)
    return kept[key]


def _hashable(value: object) -> object:
    try:
        hash(value)
    except TypeError:
        return repr(value)
    return value


class _Row(NamedTuple):
    """The surface of one width.

    width   alpha
    w       unit of its slopes
    shares  of the surface by log(s / w), which sum to 1
    whole   int D(m) m.z dm, which should be 1
    """

    width: float
    w: float
    shares: Floats
    whole: float


def _found(ndf: HasDensity) -> Tables:
    density = _density(ndf)
    log_s = np.arange(LOWEST, HIGHEST, STEP)
    widths = np.linspace(LEAST, 1.0, ROWS) ** 4
    rows = [row for width in widths if (row := _row(density, float(width), log_s)) is not None]
    if not rows:
        what = f"D of {type(ndf).__name__} is not finite, or negative, or 0, at every width"
        raise InputError(what, ndf.place("D"), "int D(m) m.z dm = 1 over the normals above the surface")
    middle = rows[len(rows) // 2]
    if abs(middle.whole - 1.0) > 1e-3:
        text = f"int D(m) m.z dm is {middle.whole:.4g} at alpha = {middle.width:.3g} where 1 is expected"
        warnings.warn(f"{ndf.place('D')}: {text}", GonioWarning, stacklevel=3)
    kind = _meaning(ndf, density, [row.width for row in rows[:: max(len(rows) // 4, 1)]])
    scale = middle.w / middle.width
    alike = all(np.abs(row.shares - middle.shares).sum() < SAME for row in rows)
    stem = ndf.name or type(ndf).__name__
    if alike and all(abs(row.w / row.width - scale) < SAME * scale for row in rows):
        return Tables(Table(f"normals_{stem}", _columns(middle.shares[None], log_s)[0]), scale, kind)
    # a width at which D has a gap, such as (alpha^2 - 1) / log(alpha^2) at 1, has its neighbour's shape
    shares = np.stack([min(rows, key=lambda row: abs(row.width - width)).shares for width in widths])
    from scipy.interpolate import CubicSpline  # slow to import, and needed by few

    logs = CubicSpline(np.log([row.width for row in rows]), np.log([row.w / row.width for row in rows]))
    fine = np.exp(logs(np.log(np.clip(np.linspace(LEAST, 1.0, FINE) ** 4, 0.9 * rows[0].width, 1.1 * rows[-1].width))))
    return Tables(Table(f"normals_{stem}", _columns(shares, log_s)), Table(f"widths_{stem}", fine[:, None]), kind)


def _columns(shares: Floats, log_s: Floats) -> Floats:
    """AREA, ALL and GRAZING at each node, for rows of shares."""
    return np.stack([_areas(shares, log_s), _inverses(shares, log_s), _inverses(shares * np.exp(log_s), log_s)], -1)


def _density(ndf: HasDensity) -> Density:
    """D on NumPy arrays, (3, N) and (2, N), in float64: from its recording, so that a loop of Dr.Jit's or a shader that
    is being recorded may ask for the tables."""
    try:
        graph = ops.record(lambda m, alpha: ndf.D(m, alpha), m="vec3", alpha="vec2", name="D")
    except Exception as error:
        what = f"no Lambda from D of {type(ndf).__name__}: {summary(error)}"
        hint = "write D in the words of gonio.ops, or Lambda(self, v, alpha) and sample(self, u1, u2, alpha) too"
        raise InputError(what, user_line(error) or ndf.place("D"), hint) from error
    return lambda m, alpha: np.broadcast_to(graph.evaluate(m=m, alpha=alpha), m.shape[1:])


def _normals(x: Floats, y: Floats) -> Floats:
    """The normals of slopes, (3, N)."""
    return np.stack([x, y, np.ones_like(x)]) / np.sqrt(1.0 + x * x + y * y)


def _shares(density: Density, alpha: tuple[float, float], s: Floats, turn: float) -> Floats:
    """P(s) s d log s at lengths of slope, along one azimuth."""
    m = _normals(s * np.cos(turn), s * np.sin(turn))
    with np.errstate(all="ignore"):
        d = density(m, np.broadcast_to(np.array(alpha)[:, None], (2, len(s))))
    return np.where(s < STEEPEST, 2.0 * np.pi * STEP * np.square(s * m[2] * m[2]) * d, 0.0)


def _row(density: Density, width: float, log_s: Floats) -> _Row | None:
    """The surface of a width; None where D cannot be used there."""
    w = width
    for last in (False, True):
        shares = _shares(density, (width, width), w * np.exp(log_s), float(AZIMUTHS[0]))
        whole = float(shares.sum())
        if not np.all(np.isfinite(shares)) or shares.min() < 0.0 or whole <= 0.0:
            return None
        if not last:
            w *= float(shares @ np.exp(log_s)) / whole * (2.0 / np.pi)
    return _Row(width, w, shares / whole, whole)


def _meaning(ndf: HasDensity, density: Density, widths: list[float]) -> str:
    """What two widths mean to D; see `Tables`."""
    s = np.exp(np.arange(-8.0, 8.0, STEP))
    for width in widths:
        along = np.stack([_shares(density, (width, width), width * s, float(turn)) for turn in AZIMUTHS])
        if np.abs(along - along[0]).sum(1).max() > SAME * along[0].sum():
            what = f"D of {type(ndf).__name__} depends on the azimuth at equal widths: no Lambda follows from it here"
            raise InputError(what, ndf.place("D"), "write Lambda(self, v, alpha) and sample(self, u1, u2, alpha)")
    unit = _shares(density, (0.5, 0.5), 0.5 * s, float(AZIMUTHS[0]))
    stretched, first = True, True
    for x, y in PAIRS:
        one = _shares(density, (x, x), x * s, float(AZIMUTHS[0]))
        for turn in AZIMUTHS:
            c, sin = float(np.cos(turn)), float(np.sin(turn))
            # along that azimuth of the stretched surface a slope is longer, and an element of area larger
            longer = np.hypot(x * c, y * sin)
            there = _shares(density, (x, y), longer * s, float(np.arctan2(y * sin, x * c))) * (x * y / longer**2)
            stretched = stretched and bool(np.abs(there - unit).sum() < SAME * unit.sum())
            same = _shares(density, (x, y), x * s, float(turn))
            first = first and bool(np.abs(same - one).sum() < SAME * one.sum())
    return "stretched" if stretched else "first" if first else "equal"


def _areas(shares: Floats, log_s: Floats) -> Floats:
    """The projected area over |v'| at each node of v'.z / |v'|."""
    x = 1.0 - np.linspace(0.0, 1.0, NODES)[:, None] ** 2
    long = np.exp(log_s) * np.sqrt(1.0 - x * x)
    over = np.maximum(long, np.maximum(x, 1e-300))
    seen = (x * np.arccos(-x / over) + np.sqrt((over - x) * (over + x))) / np.pi
    return np.asarray(shares @ np.where(long > x, seen, x).T)


def _inverses(shares: Floats, log_s: Floats) -> Floats:
    """tau of the slope that a share of the surface stays below, by g."""
    tau = 1.0 / (1.0 + np.exp(-log_s))
    found = []
    for row in shares:
        middle = 0.5 * (row[1:] + row[:-1])
        middle = middle / middle.sum()
        below = np.concatenate([[0.0], np.cumsum(middle)])
        above = np.concatenate([np.cumsum(middle[::-1])[::-1], [0.0]])
        first, last = int(np.argmax(below > 1e-12)) - 1, int(np.argmax(above < 1e-12)) + 1
        low, high = np.sqrt(below[first:last]), np.sqrt(above[first:last])
        found.append(np.interp(np.linspace(0.0, 1.0, NODES), low / (low + high), tau[first:last]))
    return np.stack(found)
