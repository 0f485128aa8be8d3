"""Smith's Lambda and samples of normals from D alone, by tables that are computed once.

With the slope s = tan theta_m, P(s) ds = 2 pi s D cos^4 theta_m ds is the fraction of the surface with slopes from s to
s + ds. The area visible from a direction v is

    int D(m) max(0, v.m) dm = int P(s) a(s) ds,   a(s) = int max(0, |v.z| + s sin theta_v cos phi) dphi / (2 pi),

with a in closed form, so one quadrature over s is enough (trapezoidal in log s; Heitz2014, sec. 3 and 4). Slopes are
measured in units of w, twice the area visible from a grazing direction; for GGX, w = alpha. The area divided by |v'|,
with v' = (w v.x, w v.y, v.z), is then a smooth function of sqrt(1 - v'.z / |v'|) at any width. With 256 nodes,
1 + Lambda is accurate to 1e-5 for GGX, Beckmann and Student-T, which have closed forms, and to 1e-4 for distributions
whose shape depends on the width, such as GTR.

Normals are sampled from tables of the inverse of int P ds and, for the slopes seen at grazing angles, of int s P ds.
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

NODES = 256  # number of nodes of the projected area over v'.z / |v'|, and of the inverse functions
ROWS, FINE = 96, 1024  # widths, at equal steps of their fourth root; finer steps for w
MIN_ROOT, MAX_SLOPE = 0.1, 1e6  # fourth root of the smallest width; larger slopes cover about D / 1e6 of the area
STEEP = 100.0  # slope (89.4 degrees) beyond which a rise of D is due to a clamped cosine, not another lobe
STEP, LOWEST, HIGHEST = 0.01, -16.0, 30.0  # step and range of log s
SAME = 1e-4  # fraction of the surface on which two equal densities may differ
PAIRS = ((0.1, 0.4), (0.6, 0.2), (0.05, 0.9))  # unequal widths at which D is tested
AZIMUTHS = np.arange(7) * (2.0 * np.pi / 7.0) + 0.35  # no multiples of 90 degrees, at which lobes may be equal
AREA, ALL, GRAZING = range(3)  # columns of the tables


class Tables(NamedTuple):
    """The tables of a distribution, for all widths.

    values   three columns over (fourth root of the width, node), or over the nodes alone if the distribution is
             stretch-invariant: the area divided by |v'|; tau = s / (1 + s), with s in units of w, as a function of
             g(fraction of the normals); and tau as a function of g(fraction of the area visible at grazing angles).
             g(u) = sqrt(u) / (sqrt(u) + sqrt(1 - u)) refines both ends
    scale    w / alpha at the same widths; a plain number if it is constant
    widths   the meaning of two widths: "stretched" along x and y, "first" if alpha_y is ignored, "equal" if neither
             is the case, so that the widths must be equal
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
        columns = (
            lookup(self.values, along)
            if len(self.values.shape) == 1
            else lookup(self.values, _row_of(alpha, ROWS), along)
        )
        return columns[column]

    @property
    def long_tailed(self) -> bool:
        """Whether Lambda falls off so slowly that it is noticeable near the normal.

        At the tested angle, the masked fraction of the area is 0.8 % for GGX, 1e-6 for Gaussian slopes, and 1e-3 for
        Student-T with gamma = 3.
        """
        near = self.values.values[..., AREA].reshape(-1, NODES)[:, NODES // 8]
        return bool(np.median(near) - (1.0 - (NODES // 8 / (NODES - 1.0)) ** 2) > 4e-3)


def _row_of(alpha: Pair, count: int) -> Scalar:
    return inset((sqrt(sqrt(alpha.x)) - MIN_ROOT) * (1.0 / (1.0 - MIN_ROOT)), count)


class HasDensity(Protocol):
    """The source of the tables: a distribution with D."""

    name: ClassVar[str]

    def D(self, m: Direction, alpha: Pair) -> Scalar:
        """Density of normals, 1/sr."""
        ...

    def place(self, formula: str) -> str:
        """FILE:LINE of a formula, for errors."""
        ...


def tables_of(ndf: HasDensity) -> Tables:
    """The tables of a distribution, computed on first use.

    They are stored in the distribution's class, so that they are discarded when a user's file is run again. Raises
    InputError if D is not finite or lacks the required symmetry.
    """
    cls = type(ndf)
    if "_tables" not in vars(cls):
        cls._tables = {}  # type: ignore[attr-defined]
    tables: dict[object, Tables] = vars(cls)["_tables"]
    key = tuple((name, _hashable(value)) for name, value in sorted(vars(ndf).items()))
    if key not in tables:
        tables[key] = _build(ndf)
    return tables[key]


def _hashable(value: object) -> object:
    try:
        hash(value)
    except TypeError:
        return repr(value)
    return value


class _Row(NamedTuple):
    """The slopes of a surface of one width.

    width   alpha
    w       unit of the slopes
    shares  fractions of the surface with slopes s, at nodes of log(s / w); their sum is 1
    area    int D(m) m.z dm, which should be 1
    """

    width: float
    w: float
    shares: Floats
    area: float


def _build(ndf: HasDensity) -> Tables:
    density = _density(ndf)
    log_s = np.arange(LOWEST, HIGHEST, STEP)
    widths = np.linspace(MIN_ROOT, 1.0, ROWS) ** 4
    rows = [row for width in widths if (row := _row(density, float(width), log_s)) is not None]
    if not rows:
        what = f"at every width, D of {type(ndf).__name__} is 0, negative or not finite"
        raise InputError(what, ndf.place("D"), "int D(m) m.z dm over the upper hemisphere must be 1")
    middle = rows[len(rows) // 2]
    if abs(middle.area - 1.0) > 1e-3:
        text = f"int D(m) m.z dm is {middle.area:.4g} at alpha = {middle.width:.3g}, 1 expected"
        warnings.warn(f"{ndf.place('D')}: {text}", GonioWarning, stacklevel=3)
    kind = _meaning(ndf, density, [row.width for row in rows[:: max(len(rows) // 4, 1)]])
    scale = middle.w / middle.width
    alike = all(np.abs(row.shares - middle.shares).sum() < SAME for row in rows)
    stem = ndf.name or type(ndf).__name__
    if alike and all(abs(row.w / row.width - scale) < SAME * scale for row in rows):
        return Tables(Table(f"normals_{stem}", _columns(middle.shares[None], log_s)[0]), scale, kind)
    # where D is undefined at a width, as (alpha^2 - 1) / log(alpha^2) is at 1, the shape of the nearest width is used
    shares = np.stack([min(rows, key=lambda row: abs(row.width - width)).shares for width in widths])
    from scipy.interpolate import CubicSpline  # slow to import and rarely needed

    logs = CubicSpline(np.log([row.width for row in rows]), np.log([row.w / row.width for row in rows]))
    fine = np.exp(
        logs(np.log(np.clip(np.linspace(MIN_ROOT, 1.0, FINE) ** 4, 0.9 * rows[0].width, 1.1 * rows[-1].width)))
    )
    return Tables(Table(f"normals_{stem}", _columns(shares, log_s)), Table(f"widths_{stem}", fine[:, None]), kind)


def _columns(shares: Floats, log_s: Floats) -> Floats:
    """The columns AREA, ALL and GRAZING at each node, from fractions of the surface by slope."""
    return np.stack([_areas(shares, log_s), _inverses(shares, log_s), _inverses(shares * np.exp(log_s), log_s)], -1)


def _density(ndf: HasDensity) -> Density:
    """D as a function of NumPy arrays m (3, N) and alpha (2, N), in float64. It is evaluated from its recording, so
    that tables can be computed while a Dr.Jit loop or a shader is recorded."""
    try:
        graph = ops.record(lambda m, alpha: ndf.D(m, alpha), m="vec3", alpha="vec2", name="D")
    except Exception as error:
        what = f"no Lambda from D of {type(ndf).__name__}: {summary(error)}"
        hint = "write D with the functions of gonio.ops, or add Lambda(self, v, alpha) and sample(self, u1, u2, alpha)"
        raise InputError(what, user_line(error) or ndf.place("D"), hint) from error
    return lambda m, alpha: np.broadcast_to(graph.evaluate(m=m, alpha=alpha), m.shape[1:])


def _normals(x: Floats, y: Floats) -> Floats:
    """The normals for slopes x and y, (3, N)."""
    return np.stack([x, y, np.ones_like(x)]) / np.sqrt(1.0 + x * x + y * y)


def _shares(density: Density, alpha: tuple[float, float], s: Floats, turn: float) -> Floats:
    """P(s) s d log s at the given slopes, along one azimuth."""
    m = _normals(s * np.cos(turn), s * np.sin(turn))
    with np.errstate(all="ignore"):
        d = density(m, np.broadcast_to(np.array(alpha)[:, None], (2, len(s))))
    return np.where(s < MAX_SLOPE, 2.0 * np.pi * STEP * np.square(s * m[2] * m[2]) * d, 0.0)


def _row(density: Density, width: float, log_s: Floats) -> _Row | None:
    """The slopes of the surface of one width; None if D cannot be used at that width."""
    w = width
    for last in (False, True):
        shares = _shares(density, (width, width), w * np.exp(log_s), float(AZIMUTHS[0]))
        if not np.all(np.isfinite(shares)):
            return None
        shares[_clamped(shares, w * np.exp(log_s)) :] = 0.0
        area = float(shares.sum())
        if shares.min() < 0.0 or area <= 0.0:
            return None
        if not last:
            w *= float(shares @ np.exp(log_s)) / area * (2.0 / np.pi)
    return _Row(width, w, shares / area, area)


def _clamped(shares: Floats, s: Floats) -> int:
    """The index of the first normal to exclude because D clamps a cosine, as in tan^2 = (1 - c^2) / max(c^2, 1e-7), and
    diverges at the horizon. Such normals cover a negligible fraction of the surface, but their slopes would dominate
    the projected area and hence Lambda."""
    steep = int(np.argmax(s > STEEP))
    moment = shares[steep:] * s[steep:]
    least = np.minimum.accumulate(moment)
    rises = np.flatnonzero(moment > 2.0 * least + 1e-12)
    return steep + int(np.argmin(moment[: rises[0]])) if len(rises) else len(s)


def _meaning(ndf: HasDensity, density: Density, widths: list[float]) -> str:
    """The meaning of two widths for D, as in `Tables.widths`."""
    s = np.exp(np.arange(-8.0, 8.0, STEP))
    for width in widths:
        along = np.stack([_shares(density, (width, width), width * s, float(turn)) for turn in AZIMUTHS])
        if np.abs(along - along[0]).sum(1).max() > SAME * along[0].sum():
            what = f"D of {type(ndf).__name__} depends on the azimuth at equal widths: Lambda cannot be derived from it"
            raise InputError(what, ndf.place("D"), "write Lambda(self, v, alpha) and sample(self, u1, u2, alpha)")
    unit = _shares(density, (0.5, 0.5), 0.5 * s, float(AZIMUTHS[0]))
    stretched, first = True, True
    for x, y in PAIRS:
        one = _shares(density, (x, x), x * s, float(AZIMUTHS[0]))
        for turn in AZIMUTHS:
            c, sin = float(np.cos(turn)), float(np.sin(turn))
            # along this azimuth of the stretched surface, slopes and area elements are larger
            longer = np.hypot(x * c, y * sin)
            there = _shares(density, (x, y), longer * s, float(np.arctan2(y * sin, x * c))) * (x * y / longer**2)
            stretched = stretched and bool(np.abs(there - unit).sum() < SAME * unit.sum())
            same = _shares(density, (x, y), x * s, float(turn))
            first = first and bool(np.abs(same - one).sum() < SAME * one.sum())
    return "stretched" if stretched else "first" if first else "equal"


def _areas(shares: Floats, log_s: Floats) -> Floats:
    """The projected area divided by |v'| at each node of v'.z / |v'|."""
    x = 1.0 - np.linspace(0.0, 1.0, NODES)[:, None] ** 2
    long = np.exp(log_s) * np.sqrt(1.0 - x * x)
    over = np.maximum(long, np.maximum(x, 1e-300))
    visible = (x * np.arccos(-x / over) + np.sqrt((over - x) * (over + x))) / np.pi
    return np.asarray(shares @ np.where(long > x, visible, x).T)


def _inverses(shares: Floats, log_s: Floats) -> Floats:
    """tau of the slope below which a fraction of the surface lies, at nodes of g(fraction)."""
    tau = 1.0 / (1.0 + np.exp(-log_s))
    columns = []
    for row in shares:
        middle = 0.5 * (row[1:] + row[:-1])
        middle = middle / middle.sum()
        below = np.concatenate([[0.0], np.cumsum(middle)])
        above = np.concatenate([np.cumsum(middle[::-1])[::-1], [0.0]])
        first, last = int(np.argmax(below > 1e-12)) - 1, int(np.argmax(above < 1e-12)) + 1
        low, high = np.sqrt(below[first:last]), np.sqrt(above[first:last])
        columns.append(np.interp(np.linspace(0.0, 1.0, NODES), low / (low + high), tau[first:last]))
    return np.stack(columns)
