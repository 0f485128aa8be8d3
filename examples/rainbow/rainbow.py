"""The rainbow of a cloud of drops, ray by ray: python examples/rainbow/rainbow.py [rays] writes sky.jpg.

Sunlight hits the disks of the drops uniformly. Each ray has one wavelength, is traced through a drop by
`go.Dielectric.sample`, and is seen by an eye in the direction in which it leaves. The cloud is thin and uniform, so the
brightness of the sky in a direction is the light that drops scatter back at that angle from the antisolar point.
"""

from __future__ import annotations

import sys

import gonio as go
import matplotlib.image
import numpy as np
from gonio.measure.colours import D65, XYZ_TO_RGB, observer
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PICTURE = "sky.jpg"  # in the current folder
SUN = np.radians(0.2665)  # angular radius of the sun
STEP = 0.01  # step of the profile, degrees
ORDERS = 6  # interactions of a ray with the drop's surface, after which 0.3 % of the light is left inside


def frame(normal: Floats) -> tuple[Floats, Floats]:
    """Two tangents of each normal."""
    axis = np.where(np.abs(normal[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    x = np.cross(axis, normal)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return x, np.cross(normal, x)


def scattered(
    wavelengths: Floats, rng: np.random.Generator, sun: float = SUN
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """One ray of sunlight per wavelength: the angle from the antisolar point at which it is seen, in degrees; its
    fraction of the power; and whether it has left the drop."""
    count = len(wavelengths)
    angle, radius = 2.0 * np.pi * rng.random(count), np.sqrt(rng.random(count))
    height = np.sqrt(1.0 - radius**2)
    place = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)  # the sun is at +z
    turn, tilt = 2.0 * np.pi * rng.random(count), sun * np.sqrt(rng.random(count))
    way = -np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=1)
    water = go.Dielectric(eta=go.refractive_index("water", wavelengths).eta, alpha=0.0)
    power, free = np.ones(count), np.zeros(count, bool)
    for _ in range(ORDERS):
        x, y = frame(place)
        local = np.stack([-np.sum(way * axis, 1) for axis in (x, y, place)], axis=1)
        drawn = water.sample(local, rng.random((count, 3)), mode="importance", precision="float64")
        onward = x * drawn.wi[:, :1] + y * drawn.wi[:, 1:2] + place * drawn.wi[:, 2:]
        way = np.where(free[:, None], way, onward)
        power = np.where(free, power, power * drawn.weight[:, 0])
        free |= drawn.wi[:, 2] > 0.0
        across = place - 2.0 * np.sum(place * way, 1)[:, None] * way  # to the other end of the chord
        place = np.where(free[:, None], place, across / np.linalg.norm(across, axis=1, keepdims=True))
    return np.degrees(np.arccos(np.clip(way[:, 2], -1.0, 1.0))), power, free


def descartes(eta: Floats, reflections: int) -> Floats:
    """The angle of the bow in degrees, where the deviation of rays reflected k times inside is stationary.

    cos^2 i = (n^2 - 1) / (k (k + 2)), deviation k pi + 2 i - 2 (k + 1) r.
    """
    i = np.arccos(np.sqrt((eta**2 - 1.0) / (reflections * (reflections + 2.0))))
    deviation = reflections * np.pi + 2.0 * i - 2.0 * (reflections + 1.0) * np.arcsin(np.sin(i) / eta)
    return np.degrees(np.abs(np.pi - deviation % (2.0 * np.pi)))


def edge(wavelength: float, low: float, high: float, inner: bool, rays: int = 400_000) -> float:
    """The edge of a bow of one wavelength in degrees: the steepest point of its brightness between `low` and `high`.

    inner  whether the bow lies at smaller angles than its edge, as the primary bow does
    """
    rng = np.random.default_rng(7)
    seen, power, free = scattered(np.full(rays, wavelength), rng, sun=0.0)
    bins = np.arange(low, high + STEP / 2.0, STEP)
    profile = np.histogram(seen[free], bins, weights=power[free])[0]
    slope = np.diff(profile)
    return float(bins[1:-1][np.argmin(slope) if inner else np.argmax(slope)])


def profile(rays: int) -> tuple[Floats, Floats]:
    """Angles from the antisolar point, and the color of the drops there, relative to sunlight."""
    rng, bins = np.random.default_rng(1), np.arange(0.0, 90.0 + STEP, 5.0 * STEP)
    xyz, white = np.zeros((3, len(bins) - 1)), np.zeros(3)
    for _ in range(max(rays // 500_000, 1)):
        wavelengths = rng.uniform(390.0, 720.0, min(rays, 500_000))
        seen, power, free = scattered(wavelengths, rng)
        light = np.interp(wavelengths, np.arange(380.0, 781.0, 10.0), D65)
        response = observer(wavelengths) * light
        white += response.sum(1)
        for channel in range(3):
            xyz[channel] += np.histogram(seen[free], bins, weights=(response[channel] * power)[free])[0]
    solid = 2.0 * np.pi * np.diff(-np.cos(np.radians(bins)))
    rgb = XYZ_TO_RGB @ xyz / (XYZ_TO_RGB @ white)[:, None]
    return (bins[1:] + bins[:-1]) / 2.0, (rgb / solid).T


def picture(angles: Floats, colours: Floats, size: tuple[int, int] = (1280, 640), sun: float = 22.0) -> Floats:
    """The eastern sky in the evening, 110 degrees wide: the antisolar point is `sun` degrees below the horizon."""
    width, height = size
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    scale = 2.0 * np.tan(np.radians(55.0)) / width
    way = np.stack([(x - width / 2.0) * scale, (0.8 * height - y) * scale, np.ones_like(x)], axis=2)
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    down = np.radians(sun)
    away = np.degrees(np.arccos(way @ [0.0, -np.sin(down), np.cos(down)]))
    bow = np.stack([np.interp(away, angles, colours[:, channel]) for channel in range(3)], axis=2)
    haze = np.exp(-7.0 * np.maximum(way[..., 1:2], 0.0))  # air near the horizon, warm under the low sun
    sky = np.array([0.04, 0.055, 0.1]) * (1.0 - 0.6 * way[..., 1:2]) + np.array([0.1, 0.075, 0.055]) * haze
    sky += 4.0 * np.maximum(bow, 0.0)
    ground = landscape(way)
    return np.where(way[..., 1:2] > ridge(way[..., 0:1] / way[..., 2:3]), sky, ground)


def ridge(across: Floats, seed: int = 4, height: float = 0.012) -> Floats:
    """Height of the hills above the horizon, as the tangent of the elevation, at tangents of the azimuth."""
    rng = np.random.default_rng(seed)
    waves = [(2.0**k, rng.uniform(0.0, 2.0 * np.pi), 1.7**-k) for k in range(1, 8)]
    return np.asarray(height * (1.0 + sum(size * np.sin(rate * 1.3 * across + turn) for rate, turn, size in waves)))


def landscape(way: Floats) -> Floats:
    """Radiance of hills and fields lit by the low sun behind the viewer, for directions (..., 3)."""
    down = np.maximum(-way[..., 1:2], 0.004)
    across = way[..., 0:1] / way[..., 2:3]
    depth = way[..., 2:3] / down  # distance of the plain, relative to the height of the eye
    stripes = np.floor(1.8 * np.log(depth) + 0.35 * np.sin(2.0 * across)) % 3.0
    fields = np.array([[0.16, 0.13, 0.025], [0.075, 0.105, 0.02], [0.21, 0.16, 0.045]])[stripes[..., 0].astype(int)]
    furrows = 1.0 + 0.12 * np.exp(-depth / 12.0) * np.sin(14.0 * across * depth)
    air = np.exp(-0.012 * depth)
    plain = fields * furrows * air + np.array([0.1, 0.095, 0.085]) * (1.0 - air)
    woods = np.array([0.05, 0.062, 0.034]) + 0.4 * np.maximum(way[..., 1:2], 0.0)
    return np.where(way[..., 1:2] < -0.004, plain, woods)


def angles(rays: int = 400_000) -> list[float]:
    """Print the angles of the bows by Descartes and by rays; returns the differences in degrees."""
    apart = []
    print("bow         nm      n        Descartes   rays      apart")
    for name, k, low, high, inner in (("primary", 1, 39.0, 44.0, True), ("secondary", 2, 48.0, 56.0, False)):
        for wavelength in (650.0, 450.0):
            eta = go.refractive_index("water", wavelength).eta
            expected, found = float(descartes(eta, k)), edge(wavelength, low, high, inner, rays)
            print(f"{name:10s}  {wavelength:.0f}  {eta:.5f}   {expected:8.3f}  {found:8.3f}  {found - expected:+.3f}")
            apart.append(found - expected)
    return apart


def main() -> None:
    rays = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000_000
    angles()
    shown = np.clip(1.055 * np.clip(picture(*profile(rays)), 1e-6, 1.0) ** (1.0 / 2.4) - 0.055, 0.0, 1.0)
    matplotlib.image.imsave(PICTURE, shown, pil_kwargs={"quality": 90})
    print(PICTURE)


if __name__ == "__main__":
    main()
