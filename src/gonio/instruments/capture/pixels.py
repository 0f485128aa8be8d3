"""Select the usable pixels of photographs and convert them to BRDF samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import special

from ...errors import InputError
from ...measure.angles import half_difference_arrays
from ...measure.tables.half_difference import pair_at
from ...measure.tables.samples import Samples
from ...ops import backend
from . import geometry
from .calibration import Camera, Flat, Floats
from .geometry import Array, Placed, Seen
from .photographs import Photograph

# largest angle from the normal, degrees; beyond it, errors of the outline change the angles too much (as in Ngan2005)
GRAZING = 80.0
EDGE = 0.02  # fraction of a flat sample excluded at each edge
NEAR = 5.0  # standard deviations above 0 within which the clipping of values at 0 matters
TILE = 8  # pixels: errors within a tile are correlated
MIN_PIXELS = 50  # minimum number of lit pixels of a sample
CONTRAST = 3.0  # minimum brightness ratio of the lit sample to the background
GAUSS = 0.5 / np.sqrt(3.0)  # distance of the nodes of two-point Gauss quadrature from the pixel center, pixels
CELLS = (60, 60, 36)  # numbers of cells along sqrt(theta_h), theta_d and phi_d

Kind = Literal["ball", "flat"]
FATES = ("used", "saturated", "shadowed", "grazing")  # categories of the sample's pixels


@dataclass(frozen=True)
class Scene:
    """The camera, samples and lamps of the photographs.

    lamps        positions of the lamps, (L, 3)
    intensities  radiant intensities of the lamps, (L, 3)
    names        names of the lamps
    """

    camera: Camera
    ball: Placed | None
    flat: Flat | None
    lamps: Floats
    intensities: Floats
    names: tuple[str, ...]

    @cached_property
    def plane(self) -> tuple[Floats, Floats]:
        """A point of the flat sample, and its axes, (3, 3): x along edge0, and z the normal toward the camera."""
        assert self.flat is not None, "a photograph shows it"
        return plane_of(self.flat)


def plane_of(flat: Flat) -> tuple[Floats, Floats]:
    base, x, y = (np.array(v, np.float64) for v in (flat.base, flat.edge0, flat.edge1))
    normal = np.cross(x, y)
    normal /= np.linalg.norm(normal)
    if normal @ base > 0.0:
        normal = -normal
    x = x / np.linalg.norm(x)
    return base, np.stack([x, np.cross(normal, x), normal])


@dataclass(frozen=True)
class Pixels:
    """Usable pixels of samples of one kind.

    kind    "ball" or "flat"
    place   (N, 2), pixel coordinates of their centers
    lamp    (N,), index of the lamp
    tile    (N,), index of the tile of neighboring pixels
    value   (N, 3), radiance in the unit of the camera
    step    (N, 3), standard deviation due to quantization and, for a series, also photon and read noise
    photon  (N, 3), derivative of step^2 with respect to the radiance
    cut     (N,), whether negative noise was stored as 0
    """

    kind: Kind
    place: Floats
    lamp: NDArray[np.int64]
    tile: NDArray[np.int64]
    value: Floats
    step: Floats
    photon: Floats
    cut: NDArray[np.bool_]

    def variance(self, radiance: Floats) -> Floats:
        """The variance of `value`, (N, 3), at a given radiance, from `step` and `photon`.

        The variance of merged exposures is a concave function of the radiance (a parallel sum of linear functions), so
        its tangent at `value` is a positive upper bound.
        """
        return np.maximum(self.step**2 + self.photon * (np.abs(radiance) - np.maximum(self.value, 0.0)), 0.0)

    def expected(self, radiance: Floats) -> tuple[Floats, Floats]:
        """The mean of the stored values, (N, 3), at a given radiance, and its derivative with respect to the radiance.

        If negative values are stored as 0, the mean of a normal variable of mean m and standard deviation s is
        m P(m / s) + s p(m / s), where P is the cumulative normal distribution and p its density (Tobin1958).
        """
        mean, slope = radiance.copy(), np.ones_like(radiance)
        spread = np.sqrt(self.variance(radiance))
        near = self.cut[:, None] & (radiance < NEAR * spread)
        m, s = radiance[near], spread[near]
        above, density = special.ndtr(m / s), np.exp(-0.5 * (m / s) ** 2) / np.sqrt(2.0 * np.pi)
        mean[near] = m * above + s * density
        slope[near] = above + density * self.photon[near] / (2.0 * s)
        return mean, slope

    def __len__(self) -> int:
        return len(self.place)

    def at(self, chosen: NDArray[np.generic]) -> Pixels:
        """The pixels with the given indices or mask."""
        return replace(
            self,
            place=self.place[chosen],
            lamp=self.lamp[chosen],
            tile=self.tile[chosen],
            value=self.value[chosen],
            step=self.step[chosen],
            photon=self.photon[chosen],
            cut=self.cut[chosen],
        )


def observe(scene: Scene, kind: Kind, ray: Array, lamp: Array, ball: tuple[Array, Array] | None = None) -> Seen:
    """The local directions, and the distances of the lamp, at the points where rays hit a sample.

    ball  center and radius of the ball, if they differ from those of the scene
    """
    types = backend.types_like(type(ray))
    if kind == "ball":
        if ball is None:
            assert scene.ball is not None, "a photograph shows it"
            ball = constant(scene.ball.center, types), backend.float_of(scene.ball.radius, types)
        return geometry.on_ball(ray, ball[0], ball[1], lamp)
    base, frame = scene.plane
    x, y, normal = (constant(axis, types) for axis in frame)
    return geometry.on_plane(ray, constant(base, types), (x, y, normal), lamp)


def constant(vector: Floats, types: backend.Types) -> Array:
    return types.vec3(*(backend.float_of(float(v), types) for v in vector))


def directions(scene: Scene, kind: Kind, place: Floats, lamp: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """wo, wi and the squared distance of the lamp at pixel coordinates, in float64; NaN outside the ball."""
    types = backend.types("float64")
    ray = backend.vector_of(geometry.rays(scene.camera, *place.T), 3, types)
    view = observe(scene, kind, ray, backend.vector_of(scene.lamps[lamp], 3, types))
    backend.drjit().eval(view)
    wo, wi, square = (backend.to_numpy(part, len(place)) for part in view)
    return wo, wi, square


# ---------------------------------------------------------------------- selection


@dataclass(frozen=True)
class Chosen:
    """The usable pixels of all photographs.

    parts   the pixels, in groups
    counts  number of pixels of the sample in each category of `FATES`
    maps    a map of the categories for each photograph: 0 outside the sample, otherwise 1 + the index in `FATES`
    """

    parts: tuple[Pixels, ...]
    counts: Mapping[str, int]
    maps: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)

    def __len__(self) -> int:
        return sum(map(len, self.parts))


def choose(
    scene: Scene, photographs: Sequence[Photograph], grazing: float, slack: tuple[float, float] = (0.0, 0.0)
) -> Chosen:
    """Select the pixels of samples that are neither saturated nor shadowed, nor viewed or lit beyond `grazing` degrees.

    slack  possible errors of the ball's outline, relative to its radius, and of a lamp's direction, radians. Pixels
           whose true angle could therefore exceed `grazing` are excluded too
    Raises InputError, with the name of the file, if a photograph does not show the sample at its position.
    """
    counts, maps = dict.fromkeys(FATES, 0), {}
    gathered: dict[Kind, list[Pixels]] = {"ball": [], "flat": []}
    tiles = 0
    for shot in photographs:
        if shot.shot.sample == "reference":
            continue
        kind: Kind = shot.shot.sample
        lamp = scene.names.index(shot.shot.light)
        place, own = on_sample(scene, kind)
        row, column = own
        wo, wi, _ = directions(scene, kind, place, np.full(len(place), lamp))
        fine = np.isfinite(wo).all(axis=1) & np.isfinite(wi).all(axis=1)
        saturated = shot.saturated[row, column]
        shadowed = fine & (wi[:, 2] <= 0.0)
        steep = ~shadowed & is_steep(wo, wi, grazing, slack if kind == "ball" else (0.0, slack[1]))
        used = ~saturated & ~shadowed & ~steep
        _check_sample(shot, scene, kind, own, used | (saturated & ~shadowed & ~steep))
        if saturated[~shadowed & ~steep].all():
            raise InputError("every pixel of the sample is saturated", shot.name, "use or add a shorter exposure")
        fate = np.select([used, saturated, shadowed], [1, 2, 3], 4).astype(np.uint8)
        maps[shot.name] = np.zeros(shot.saturated.shape, np.uint8)
        maps[shot.name][own] = fate
        for number, name in enumerate(FATES, 1):
            counts[name] += int(np.sum(fate == number))
        across = -(-scene.camera.size[0] // TILE)
        tile = tiles + (row // TILE) * across + column // TILE
        tiles += across * -(-scene.camera.size[1] // TILE)
        gathered[kind].append(
            Pixels(
                kind,
                place[used],
                np.full(int(used.sum()), lamp),
                tile[used],
                shot.radiance[row, column][used],
                shot.step[row, column][used],
                np.broadcast_to(shot.photon, shot.step.shape)[row, column][used],
                np.full(int(used.sum()), shot.cut),
            )
        )
    parts = tuple(_joined(group) for group in gathered.values() if group)
    return Chosen(parts, counts, maps)


def is_steep(wo: Floats, wi: Floats, grazing: float, slack: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.bool_]:
    """Whether a pixel is, or may be, viewed or lit beyond `grazing` degrees from the normal.

    A relative error s of the outline tilts the normal so that sin theta_o becomes (1 + s) sin theta_o.
    """
    outline, lamp = slack
    theta_o, theta_i = (np.arccos(np.clip(np.nan_to_num(w[:, 2], nan=0.0), -1.0, 1.0)) for w in (wo, wi))
    moved = (1.0 + outline) * np.sin(theta_o)
    tilt = np.where(moved <= 1.0, np.arcsin(np.minimum(moved, 1.0)) - theta_o, np.inf)
    return np.asarray(np.maximum(theta_o, theta_i + lamp) + tilt > np.radians(grazing))


def _joined(group: list[Pixels]) -> Pixels:
    """Concatenate groups of pixels, sorted by lamp."""
    joined = Pixels(
        group[0].kind,
        np.concatenate([one.place for one in group]),
        np.concatenate([one.lamp for one in group]),
        np.concatenate([one.tile for one in group]),
        np.concatenate([one.value for one in group]),
        np.concatenate([one.step for one in group]),
        np.concatenate([one.photon for one in group]),
        np.concatenate([one.cut for one in group]),
    )
    return joined.at(np.argsort(joined.lamp, kind="stable"))


def on_sample(scene: Scene, kind: Kind) -> tuple[Floats, tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """The centers of the pixels that show a sample, and their rows and columns. Raises InputError if there are none."""
    if kind == "ball":
        assert scene.ball is not None, "a photograph shows it"
        inside = geometry.covers(scene.ball, scene.camera)
    else:
        assert scene.flat is not None, "a photograph shows it"
        inside = on_flat(scene.camera, scene.flat)
    row, column = np.nonzero(inside)
    if row.size == 0:
        hint = "check its position, the camera and the size of the pictures"
        raise InputError(f"no pixel shows the {kind} sample: it lies outside the picture", "calibration", hint)
    return np.stack([column + 0.5, row + 0.5], -1), (row, column)


def on_flat(camera: Camera, flat: Flat) -> NDArray[np.bool_]:
    """A mask of the pixels that show a flat sample, without its edges."""
    base, frame = plane_of(flat)
    ray = geometry.grid_rays(camera)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (base @ frame[2]) / (ray @ frame[2])
    point = ray * along[:, None] - base
    edges = np.stack([flat.edge0, flat.edge1], 1)
    part = point @ np.linalg.pinv(edges).T
    inside = (along > 0.0) & np.all((part > EDGE) & (part < 1.0 - EDGE), axis=1)
    return np.asarray(inside.reshape(camera.size[1], camera.size[0]))


def _check_sample(
    shot: Photograph,
    scene: Scene,
    kind: Kind,
    own: tuple[NDArray[np.int64], NDArray[np.int64]],
    lit: NDArray[np.bool_],
) -> None:
    """Raise InputError if a photograph does not show the lit sample at its position."""
    if int(lit.sum()) < MIN_PIXELS:
        what = f"the light '{shot.shot.light}' reaches {int(lit.sum())} pixels of the {kind} at non-grazing angles"
        raise InputError(what, shot.name, "check the positions of lamp and sample")
    gray = np.where(shot.saturated, np.inf, np.nan_to_num(shot.radiance).mean(axis=-1))
    inside = np.zeros(gray.shape, bool)
    inside[own] = True
    bright = float(np.median(gray[own][lit]))
    ground = float(np.median(gray[~inside])) if kind == "ball" and not inside.all() else 0.0
    if not bright > CONTRAST * max(ground, 0.0):
        what = f"no {kind} found: where it should be lit, it is not brighter than the background"
        raise InputError(what, shot.name, "check that the lamp was on and the background dark")


# ---------------------------------------------------------------------- samples


@dataclass(frozen=True)
class Gathered:
    """BRDF samples, each of which is the mean of the pixels in a cell of theta_h, theta_d and phi_d.

    table  the samples, unordered
    error  (N,), relative standard error, from the scatter of the pixels; nan for a single pixel
    count  (N,), number of pixels per sample
    """

    table: Samples
    error: Floats
    count: NDArray[np.int64]

    def confidence(self) -> Floats:
        """The relative standard error of f in cells of (sqrt(theta_h), theta_d).

        It is nan in cells without samples, where the table interpolates the nearest samples.
        """
        theta_h, theta_d, _ = half_difference_arrays(*self.table.pairs())
        at = (_cell(np.sqrt(theta_h / (0.5 * np.pi)), CELLS[0]), _cell(theta_d / (0.5 * np.pi), CELLS[1]))
        inverse, spread = np.zeros(CELLS[:2]), np.full(CELLS[:2], np.nan)
        np.add.at(inverse, at, np.where(self.error > 0.0, 1.0 / np.maximum(self.error, 1e-6) ** 2, 0.0))
        spread[inverse > 0.0] = 1.0 / np.sqrt(inverse[inverse > 0.0])
        return spread


def _cell(share: Floats, count: int) -> NDArray[np.int64]:
    return np.minimum((share * count).astype(np.int64), count - 1)


def gather(scene: Scene, chosen: Chosen, title: str) -> Gathered:
    """Convert pixels to BRDF samples, f = radiance distance^2 / (intensity cos theta_i), averaged in each cell."""
    angles, values = [], []
    for part in chosen.parts:
        wo, wi, square = directions(scene, part.kind, part.place, part.lamp)
        angles.append(np.stack(half_difference_arrays(wo, wi), -1))
        values.append(part.value * square[:, None] / scene.intensities[part.lamp] / wi[:, 2:])
    theta, value = np.concatenate(angles), np.concatenate(values)
    theta[:, 2] %= np.pi  # by reciprocity
    share = np.stack([np.sqrt(theta[:, 0] / (0.5 * np.pi)), theta[:, 1] / (0.5 * np.pi), theta[:, 2] / np.pi], -1)
    index = np.ravel_multi_index(tuple(_cell(share[:, k], CELLS[k]) for k in range(3)), CELLS)
    _, which, count = np.unique(index, return_inverse=True, return_counts=True)

    def mean(x: Floats) -> Floats:
        return np.stack([np.bincount(which, weights=column) for column in x.T], -1) / count[:, None]

    middle, level = mean(share), mean(value)
    scatter = mean((value - level[which]) ** 2)
    size = np.maximum(np.abs(level).mean(axis=1), 1e-12)
    with np.errstate(invalid="ignore", divide="ignore"):
        error = np.sqrt(scatter.mean(axis=1) / np.maximum(count - 1, 1)) / size
    wo, wi = pair_at(middle[:, 0] ** 2 * 0.5 * np.pi, middle[:, 1] * 0.5 * np.pi, middle[:, 2] * np.pi)
    above = (wo[:, 2] > 0.0) & (wi[:, 2] > 0.0)
    table = Samples.of_pairs(wo[above], wi[above], level[above], title=title, source={"format": "photographs"})
    return Gathered(table, np.where(count > 1, error, np.nan)[above], count[above])
