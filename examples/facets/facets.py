"""What D, G and F do to a ball, and the facets behind them: python examples/facets/facets.py writes facets.jpg."""

from __future__ import annotations

import sys
from pathlib import Path

import gonio as go
import matplotlib
import numpy as np
from gonio.pictures import images
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[1]))
import sheets

PICTURE = "facets.jpg"  # in the current folder
LIGHT, VIEWER = np.array([-1.2, 0.95, 1.5]), np.array([0.0, 0.0, 2.6])  # near the ball, so that angles vary over it
GOLD, BLUE, RED, GRAY = "#ffc24d", "#3f6fb5", "#a33b4f", "#6a6f78"


def local(size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """View and light in the frames of a ball's normals, (N, 3) each, and the mask of its pixels, (size, size)."""
    y, x = np.meshgrid(*[np.linspace(-1.02, 1.02, size)] * 2, indexing="ij")
    inside = x**2 + y**2 < 1.0
    # the part of the ball that the viewer sees ends where n.VIEWER = 1
    z = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))
    rim = 1.0 / VIEWER[2]
    n = np.stack([x * np.sqrt(1.0 - rim**2), -y * np.sqrt(1.0 - rim**2), rim + (1.0 - rim) * z], -1)[inside]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    t = np.cross([0.0, 1.0, 0.0], n)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    frame = np.stack([t, np.cross(n, t), n], 1)

    def toward(place: np.ndarray) -> np.ndarray:
        way = place - n
        return np.einsum("nij,nj->ni", frame, way / np.linalg.norm(way, axis=1, keepdims=True))

    return toward(VIEWER), toward(LIGHT), inside


def balls(size: int, alpha: float = 0.35) -> list[tuple[str, np.ndarray]]:
    """D, G, F and their product on a ball of gold, as linear pictures; D relative to its peak."""
    gold = go.Conductor.preset("Au", alpha=alpha)
    wo, wi, inside = local(size)
    d, g, f = (np.asarray(term).reshape(len(wo), -1) for term in gold.terms(wo, wi))
    lit = (wi[:, 2] > 0.0)[:, None]
    whole = np.asarray(gold.eval(wo, wi))

    def picture(values: np.ndarray) -> np.ndarray:
        pixels = np.zeros((size, size, 3))
        pixels[inside] = np.where(lit, values, 0.0)
        return pixels

    d = d * np.pi * alpha**2
    return [
        ("D: how many facets face the half vector", picture(d * [1.0, 1.0, 1.0])),
        ("G: the share that light and viewer see", picture(g * [1.0, 1.0, 1.0])),
        ("F: what each reflects, here almost alike", picture(f)),
        ("D G F / (4 n.o): gold", picture(1.6 * whole)),
    ]


def profile(points: int = 260) -> tuple[np.ndarray, np.ndarray]:
    """A section through a rough surface: x and height."""
    rng = np.random.default_rng(5)
    x = np.linspace(0.0, 12.8, points)
    waves = [(rng.uniform(3.0, 11.0), rng.uniform(0.0, 2.0 * np.pi)) for _ in range(18)]
    return x, sum(0.3 / k * np.sin(k * x + phase) for k, phase in waves)


def hidden(x: np.ndarray, y: np.ndarray, slope: float) -> np.ndarray:
    """Whether a ray from each point toward +x (slope > 0) or -x, rising |slope| per unit, meets the surface."""
    distance = x[None, :] - x[:, None]
    ahead = distance * np.sign(slope) > 1e-9
    return (ahead & (y[None, :] > y[:, None] + np.abs(distance * slope) + 1e-6)).any(1)


def section(axes: matplotlib.axes.Axes) -> None:
    """Facets: toward the half vector, in the light's shadow, behind others from the viewer."""
    x, y = profile()
    middle = (x[1:] + x[:-1]) / 2.0, (y[1:] + y[:-1]) / 2.0
    tilt = np.arctan(np.gradient(y, x))[:-1]
    half = np.radians((55.0 - 40.0) / 2.0)  # light 55 degrees to the left, viewer 40 degrees to the right
    dark = hidden(*middle, -1.0 / np.tan(np.radians(55.0)))
    masked = hidden(*middle, 1.0 / np.tan(np.radians(40.0)))
    mirror = (np.abs(tilt - half) < np.radians(9.0)) & ~dark & ~masked
    colors = np.where(mirror, GOLD, np.where(dark, BLUE, np.where(masked, RED, GRAY)))
    lines = np.stack([np.stack([x[:-1], y[:-1]], 1), np.stack([x[1:], y[1:]], 1)], 1)
    axes.fill_between(x, y, -1.2, color="#15171c")
    axes.add_collection(LineCollection(list(lines), colors=list(colors), linewidths=3.0, capstyle="round"))
    first = np.flatnonzero(mirror & ~np.roll(mirror, 1))
    for place in first[::2]:
        start = np.array([middle[0][place], middle[1][place]])
        for angle, shade in ((-55.0, "#fff3c4"), (40.0, GOLD)):
            end = start + 2.4 * np.array([np.sin(np.radians(angle)), np.cos(np.radians(angle))])
            axes.plot(*zip(start, end, strict=True), color=shade, lw=0.7, alpha=0.55)
    axes.set(xlim=(0.0, 12.8), ylim=(-0.7, 2.0))
    words = (
        ("toward the half vector (D)", GOLD),
        ("in the light's shadow (G)", BLUE),
        ("hidden from the viewer (G)", RED),
    )
    for number, (text, color) in enumerate(words):
        axes.text(0.2 + 4.3 * number, -0.6, text, color=color, fontsize=10)
    axes.set_axis_off()


def main(size: int = 316) -> None:
    figure = Figure(figsize=(sheets.WIDTH / sheets.DPI, 6.2), facecolor="#0b0c0f", dpi=sheets.DPI)
    for number, (title, picture) in enumerate(balls(size)):
        axes = figure.add_axes((number / 4 + 0.005, 0.46, 0.24, 0.5))
        axes.imshow(images.to_screen(picture), interpolation="lanczos")
        axes.set_axis_off()
        figure.text(number / 4 + 0.125, 0.965, title, color=sheets.TEXT, fontsize=9.5, ha="center", va="center")
    section(figure.add_axes((0.0, 0.0, 1.0, 0.44)))
    figure.savefig(PICTURE, pil_kwargs={"quality": 88, "optimize": True, "progressive": True})
    print(PICTURE)


if __name__ == "__main__":
    main()
