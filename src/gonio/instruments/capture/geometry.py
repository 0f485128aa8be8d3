"""The geometry of photographs in the frame of the camera.

Computes the rays of pixels, the position of a ball from its outline, the positions of lamps from highlights in mirror
balls, and the local directions at the point that a pixel shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ... import ops
from ...errors import InputError
from ...ops import backend
from .calibration import Ball, Camera, Floats
from .photographs import Photograph

Array = backend.Array
ANGLES = 720  # number of angles at which the outline is detected
INSIDE = 2.0  # distance from the edge at which the brightness of the ball is sampled, pixels
SHARP = 2.5  # maximum width of the edge of an outline, pixels; the edge of a shadow is wider
MIN_VISIBLE = 0.25  # fraction of the outline that must be detected
ROUND = 0.6  # fraction of the detected outline that must lie on one circle
BRIGHT = 0.3  # upper bound of the background, relative to the brightest value
SYSTEMATIC = 0.1  # systematic error of a detected outline, pixels, because the ball darkens toward its edge


# ---------------------------------------------------------------------- camera


def rays(camera: Camera, x: Floats, y: Floats) -> Floats:
    """The unit directions (N, 3) of rays through pixel coordinates, corrected for lens distortion."""
    across = (np.asarray(x) - camera.center[0]) / camera.focal_pixels
    down = (np.asarray(y) - camera.center[1]) / camera.focal_pixels
    bent = np.hypot(across, down)
    radius = bent.copy()
    for _ in range(20):  # Newton iteration; lenses that fold the picture are rejected below
        square = radius**2
        off = radius * (1.0 + camera.k1 * square + camera.k2 * square**2) - bent
        if not np.any(np.abs(off) > 1e-14):
            break
        slope = 1.0 + 3.0 * camera.k1 * square + 5.0 * camera.k2 * square**2
        radius = radius - off / np.where(np.abs(slope) > 1e-6, slope, 1e-6)
    square = radius**2
    if np.any(np.abs(radius * (1.0 + camera.k1 * square + camera.k2 * square**2) - bent) > 1e-9 * (1.0 + bent)):
        what = f"k1 = {camera.k1:g} and k2 = {camera.k2:g} fold the picture over"
        raise InputError(what, "camera", "real lenses distort less; do k1 and k2 refer to x / z?")
    ratio = np.where(bent > 0.0, radius / np.where(bent > 0.0, bent, 1.0), 1.0)
    directions = np.stack([across * ratio, down * ratio, np.ones_like(across)], -1)
    return np.asarray(directions / np.linalg.norm(directions, axis=-1, keepdims=True))


def pixels_of(camera: Camera, points: Floats) -> Floats:
    """The pixel coordinates (N, 2) of points (N, 3) in front of the camera."""
    flat = points[:, :2] / points[:, 2:]
    square = np.sum(flat * flat, axis=1, keepdims=True)
    bent = flat * (1.0 + camera.k1 * square + camera.k2 * square**2)
    return np.asarray(bent * camera.focal_pixels + np.array(camera.center))


# ---------------------------------------------------------------------- the ball


@dataclass(frozen=True)
class Placed:
    """A ball at its position in the frame of the camera.

    center   center of the ball, (3,)
    radius   radius of the ball
    pixel    size of a pixel at the distance of the ball
    off      standard deviations of the detected position, pixels, and of the radius, relative
    given    whether the position was given; otherwise it is computed from the outline and the radius
    """

    center: Floats
    radius: float
    pixel: float
    off: tuple[float, float] = (0.0, 0.0)
    given: bool = False


def placed(ball: Ball, camera: Camera, photographs: Sequence[Photograph], avoid: Sequence[Placed] = ()) -> Placed:
    """The ball at its given position, or at the position detected in the photographs.

    avoid  other balls, whose pixels the detection must ignore
    Raises InputError if no ball is visible.
    """
    if ball.center is not None:
        center = np.array(ball.center)
        return Placed(center, ball.radius, float(np.linalg.norm(center)) / camera.focal_pixels, given=True)
    if ball.outline is not None:
        x, y, radius = ball.outline
        turn = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        return _of_cone(_cone(rays(camera, x + radius * np.cos(turn), y + radius * np.sin(turn))), ball, camera)
    return _locate(ball, camera, photographs, avoid)


def _cone(directions: Floats) -> Floats:
    """The vector m of the cone d . m = 1 that fits unit directions d best.

    The axis of the cone is m / |m|, and the cosine of its half angle is 1 / |m|. The outline of a ball is such a cone
    about the direction of its center. Fitting m is a linear problem.
    """
    return np.asarray(np.linalg.lstsq(directions, np.ones(len(directions)), rcond=None)[0])


def _of_cone(m: Floats, ball: Ball, camera: Camera, off: tuple[float, float] = (0.0, 0.0)) -> Placed:
    cos = 1.0 / float(np.linalg.norm(m))
    distance = ball.radius / np.sqrt(max(1.0 - cos * cos, 1e-12))
    return Placed(m * cos * distance, ball.radius, distance / camera.focal_pixels, off)


def _locate(ball: Ball, camera: Camera, photographs: Sequence[Photograph], avoid: Sequence[Placed]) -> Placed:
    """Detect the outline of the ball in all photographs together, because each lamp lights a different part of it."""
    from scipy import ndimage

    hint = 'the background must be dark; or give "center" or "outline" of the ball'
    shots = [one for one in photographs if one.shot.sample == "ball"]
    brightness = np.zeros(shots[0].radiance.shape[:2])
    for one in shots:
        gray = np.where(one.saturated, np.inf, one.radiance.mean(axis=-1))
        bright = float(np.percentile(gray[np.isfinite(gray)], 99.0))
        if not bright > 0.0:
            raise InputError("no ball found: the photograph is dark", one.name, "was the lamp on?")
        if float(np.median(_rim(gray))) > BRIGHT * bright:
            raise InputError("no ball found: the background is as bright as everything else", one.name, hint)
        brightness = np.maximum(brightness, np.minimum(gray / bright, 1.0))
    for other in avoid:
        brightness[covers(other, camera, margin=1.1)] = 0.0
    rim = _rim(brightness)
    ground, spread = float(np.median(rim)), 1.4826 * float(np.median(np.abs(rim - np.median(rim))))
    level = ground + max(8.0 * spread, 0.03)
    parts, count = ndimage.label(ndimage.binary_opening(brightness > level, iterations=2))
    names = shots[0].name if len(shots) == 1 else f"{shots[0].name} and {len(shots) - 1} more"
    if count == 0:
        raise InputError("no ball found: nothing stands out from the background", names, hint)
    largest = int(np.argmax(np.bincount(parts.ravel())[1:])) + 1
    rows, columns = np.nonzero(parts == largest)
    x, y = float(columns.mean()) + 0.5, float(rows.mean()) + 0.5
    edge = _edge(brightness, x, y, ground, level)
    if len(edge) < MIN_VISIBLE * ANGLES:
        raise InputError("no ball found: no sharp outline stands out from the background", names, hint)
    m, residual = _agreed(rays(camera, edge[:, 0], edge[:, 1]), camera)
    if m is None or len(residual) < max(MIN_VISIBLE * ANGLES, ROUND * len(edge)):
        raise InputError("no ball found: the shape that stands out is not round", names, hint)
    noise = float(np.sqrt(np.mean(residual**2) / len(residual))) + SYSTEMATIC
    estimate = _of_cone(m, ball, camera)
    return _of_cone(m, ball, camera, (noise, noise * estimate.pixel / estimate.radius))


def _rim(picture: Floats) -> Floats:
    """The pixels at the edges of a picture, which show the background."""
    return np.concatenate([picture[:3].ravel(), picture[-3:].ravel(), picture[:, :3].ravel(), picture[:, -3:].ravel()])


def _edge(brightness: Floats, x: float, y: float, ground: float, level: float) -> Floats:
    """The pixel coordinates (N, 2) of the outermost sharp edge along each of several lines from a center."""
    from scipy import ndimage

    height, width = brightness.shape
    step = 0.25
    along = np.arange(0.0, np.hypot(height, width), step)
    turn = np.linspace(0.0, 2.0 * np.pi, ANGLES, endpoint=False)
    px, py = x + np.cos(turn)[:, None] * along, y + np.sin(turn)[:, None] * along
    profile = ndimage.map_coordinates(brightness, [py - 0.5, px - 0.5], order=1, cval=ground)
    points = []
    for line, cos, sin in zip(profile, np.cos(turn), np.sin(turn), strict=True):
        above = np.flatnonzero(line > level)
        if not len(above) or above[-1] * step < 4.0:
            continue
        outer = int(above[-1])
        half = 0.5 * (ground + line[outer - round((1.0 + INSIDE) / step)])
        crossing = np.flatnonzero(line[: outer + 1] > half)
        if not len(crossing) or crossing[-1] < outer - round(SHARP / step) or half < level:
            continue  # a slow rise is the edge of a shadow, not of the ball
        at = int(crossing[-1])
        part = (line[at] - half) / max(line[at] - line[at + 1], 1e-12) if at + 1 < len(line) else 0.0
        radius = (at + part) * step
        points.append((x + cos * radius, y + sin * radius))
    return np.array(points).reshape(-1, 2)


def _agreed(directions: Floats, camera: Camera) -> tuple[Floats | None, Floats]:
    """The cone that fits the most directions to within a pixel, and the residuals in pixels (RANSAC, Fischler1981)."""
    rng = np.random.default_rng(7)
    best = np.zeros(len(directions), bool)
    for _ in range(200):
        three = directions[rng.choice(len(directions), 3, replace=False)]
        m = _cone(three)
        if not np.linalg.norm(m) > 1.0:
            continue
        near = np.abs(_off(directions, m)) * camera.focal_pixels < 1.0
        if near.sum() > best.sum():
            best = near
    if best.sum() < 8:
        return None, np.zeros(0)
    for _ in range(3):
        m = _cone(directions[best])
        best = np.abs(_off(directions, m)) * camera.focal_pixels < 1.0
    return m, _off(directions[best], m) * camera.focal_pixels


def _off(directions: Floats, m: Floats) -> Floats:
    """The angles by which directions lie outside a cone, radians."""
    length = float(np.linalg.norm(m))
    return np.asarray(np.arccos(np.clip(directions @ m / length, -1.0, 1.0)) - np.arccos(min(1.0 / length, 1.0)))


def covers(ball: Placed, camera: Camera, margin: float = 1.0) -> NDArray[np.bool_]:
    """A mask of the pixels that show a ball, whose radius is multiplied by `margin`."""
    direction = grid_rays(camera)
    distance = float(np.linalg.norm(ball.center))
    cos = np.sqrt(max(1.0 - (margin * ball.radius / distance) ** 2, 0.0))
    return np.asarray((direction @ (ball.center / distance) > cos).reshape(camera.size[1], camera.size[0]))


def grid_rays(camera: Camera) -> Floats:
    """The rays through the centers of all pixels, (H W, 3)."""
    y, x = np.mgrid[0 : camera.size[1], 0 : camera.size[0]]
    return rays(camera, x.ravel() + 0.5, y.ravel() + 0.5)


# ---------------------------------------------------------------------- lamps in mirror balls


def lamp_in_mirrors(
    photograph: Photograph, mirrors: Sequence[Placed], camera: Camera, about: Floats, distance: float | None
) -> Floats:
    """The position of a lamp from its highlights in mirror balls.

    It is the point closest to the reflected rays. For a single mirror ball, it is the point on the reflected ray at
    the given distance from the point `about`.

    Raises InputError if a mirror ball shows no highlight, or if there is a single mirror ball and no distance.
    """
    origins, directions = [], []
    for mirror in mirrors:
        x, y = _highlight(photograph, covers(mirror, camera, margin=0.98))
        ray = rays(camera, np.array([x]), np.array([y]))[0]
        along = float(ray @ mirror.center)
        root = along * along - float(mirror.center @ mirror.center) + mirror.radius**2
        point = (along - np.sqrt(max(root, 0.0))) * ray
        normal = (point - mirror.center) / np.linalg.norm(point - mirror.center)
        origins.append(point)
        directions.append(ray - 2.0 * float(ray @ normal) * normal)
    if len(mirrors) > 1:
        system, wanted = np.zeros((3, 3)), np.zeros(3)
        for origin, direction in zip(origins, directions, strict=True):
            across = np.eye(3) - np.outer(direction, direction)
            system, wanted = system + across, wanted + across @ origin
        return np.asarray(np.linalg.solve(system, wanted))
    if distance is None:
        what = f"one mirror ball gives only the direction of the light '{photograph.shot.light}'"
        raise InputError(what, "lights", 'give its "distance", or describe a second mirror ball')
    away = origins[0] - about
    along = float(away @ directions[0])
    root = along * along - float(away @ away) + distance**2
    if root < 0.0:
        raise InputError(f"no point of the ray lies {distance:g} from the ball", "lights", "check the distance")
    return np.asarray(origins[0] + (np.sqrt(root) - along) * directions[0])


def _highlight(photograph: Photograph, where: NDArray[np.bool_]) -> tuple[float, float]:
    gray = photograph.radiance.mean(axis=-1)
    top = float(np.nanmax(np.where(where, gray, -np.inf), initial=-np.inf)) if where.any() else -np.inf
    clipped = where & np.isnan(gray)
    rest = gray[where & ~np.isnan(gray)]
    if not clipped.any() and (not len(rest) or top <= 4.0 * max(float(np.median(rest)), 0.0) or top <= 0.0):
        hint = "the mirror ball must show the lamp brighter than everything else; is its outline right?"
        raise InputError("no highlight in the mirror ball", photograph.name, hint)
    weight = np.where(clipped, 1.0, 0.0) if clipped.any() else np.where(where & (gray > 0.5 * top), gray, 0.0)
    rows, columns = np.nonzero(weight)
    w = weight[rows, columns]
    return float(np.average(columns, weights=w)) + 0.5, float(np.average(rows, weights=w)) + 0.5


# ---------------------------------------------------------------------- local directions at a pixel, in Dr.Jit


class Seen(NamedTuple):
    """The local directions to the camera and to the lamp, and the squared distance of the lamp."""

    wo: Array
    wi: Array
    square: Array


def on_ball(ray: Array, center: Array, radius: Array, lamp: Array) -> Seen:
    """The local directions where rays hit a ball, or at its edge if they miss it.

    z is the normal; x and y are chosen as in Duff2017.
    """
    along = ops.dot(ray, center)
    root = ops.sqr(along) - ops.dot(center, center) + ops.sqr(radius)
    point = ray * (along - ops.safe_sqrt(root))
    normal = (point - center) / radius
    # the normal faces the camera, so its z, which points forward, is negative, and the frame has no singularity
    a = -1.0 / (normal.z - 1.0)
    b = normal.x * normal.y * a
    x = ops.vec3(1.0 - ops.sqr(normal.x) * a, -b, normal.x)
    y = ops.vec3(b, ops.sqr(normal.y) * a - 1.0, -normal.y)
    return _local(ray, point, x, y, normal, lamp)


def on_plane(ray: Array, base: Array, frame: tuple[Array, Array, Array], lamp: Array) -> Seen:
    """The local directions where rays hit the plane through the point `base`.

    frame  the axes of the local frame, of which z is the normal
    """
    x, y, normal = frame
    point = ray * (ops.dot(base, normal) / ops.dot(ray, normal))
    return _local(ray, point, x, y, normal, lamp)


def _local(ray: Array, point: Array, x: Array, y: Array, normal: Array, lamp: Array) -> Seen:
    toward = lamp - point
    square = ops.dot(toward, toward)
    wi = toward * ops.rsqrt(square)

    def local(w: Array) -> Array:
        return ops.vec3(ops.dot(w, x), ops.dot(w, y), ops.dot(w, normal))

    return Seen(-local(ray), local(wi), square)
