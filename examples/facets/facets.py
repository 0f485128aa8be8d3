"""D, G and F on a ball, and the facets that they describe: python examples/facets/facets.py writes facets.jpg."""

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
LIGHT, VIEWER = np.array([-1.2, 0.95, 1.5]), np.array([0.0, 0.0, 2.6])  # near the ball, so that angles vary across it
GOLD, BLUE, RED, GRAY = "#ffc24d", "#6ea4ff", "#ff6b7d", "#8a9099"
UNLIT = 0.008  # radiance of the unlit side


def local(size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """View and light directions in the frames of a ball's normals, (N, 3) each, and the mask of its pixels."""
    y, x = np.meshgrid(*[np.linspace(-1.06, 1.06, size)] * 2, indexing="ij")
    inside = x**2 + y**2 < 1.0
    # the visible part of the ball ends where n.VIEWER = 1
    z = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))
    rim = 1.0 / VIEWER[2]
    n = np.stack([x * np.sqrt(1.0 - rim**2), -y * np.sqrt(1.0 - rim**2), rim + (1.0 - rim) * z], -1)[inside]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    frame = sheets.tangent_frames(n)

    def toward(place: np.ndarray) -> np.ndarray:
        way = place - n
        return np.einsum("nij,nj->ni", frame, way / np.linalg.norm(way, axis=1, keepdims=True))

    return toward(VIEWER), toward(LIGHT), inside


def balls(size: int, alpha: float = 0.35, oversampling: int = 3) -> list[tuple[str, np.ndarray]]:
    """D, G, F and their product on a ball of gold, as linear pictures; D relative to its peak."""
    gold = go.Conductor.preset("Au", alpha=alpha)
    wo, wi, inside = local(size * oversampling)
    d, g, f = (np.asarray(term).reshape(len(wo), -1) for term in gold.terms(wo, wi))
    lit = (wi[:, 2] > 0.0)[:, None]
    whole = np.asarray(gold.eval(wo, wi))

    def picture(values: np.ndarray) -> np.ndarray:
        pixels = np.full((*inside.shape, 3), sheets.BACKDROP)
        pixels[inside] = np.where(lit, values, UNLIT)
        return sheets.averaged(pixels, oversampling)

    d = d * np.pi * alpha**2
    return [
        ("D: facets that\nface h", picture(d * [1.0, 1.0, 1.0])),
        ("G: share that\nboth see", picture(g * [1.0, 1.0, 1.0])),
        ("F: reflected by\neach facet", picture(f)),
        ("gold:\nD G F / (4 n.o)", picture(1.6 * whole)),
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
    """Draw facets that face the half vector, are shadowed from the light, or are masked from the viewer."""
    x, y = profile()
    middle = (x[1:] + x[:-1]) / 2.0, (y[1:] + y[:-1]) / 2.0
    tilt = np.arctan(np.gradient(y, x))[:-1]
    half = np.radians((55.0 - 40.0) / 2.0)  # light 55 degrees to the left, viewer 40 degrees to the right
    dark = hidden(*middle, -1.0 / np.tan(np.radians(55.0)))
    masked = hidden(*middle, 1.0 / np.tan(np.radians(40.0)))
    mirror = (np.abs(tilt - half) < np.radians(9.0)) & ~dark & ~masked
    colors = np.where(mirror, GOLD, np.where(dark, BLUE, np.where(masked, RED, GRAY)))
    lines = np.stack([np.stack([x[:-1], y[:-1]], 1), np.stack([x[1:], y[1:]], 1)], 1)
    axes.fill_between(x, y, -2.0, color="#24272d")
    axes.add_collection(LineCollection(list(lines), colors=list(colors), linewidths=4.5, capstyle="round"))
    first = np.flatnonzero(mirror & ~np.roll(mirror, 1))
    for place in first[(middle[0][first] > 1.0) & (middle[0][first] < 11.5)][::3]:
        start = np.array([middle[0][place], middle[1][place]])
        for angle, shade, arrow in ((-55.0, "#fff3c4", "<|-"), (40.0, GOLD, "-|>")):
            end = start + 1.9 * np.array([np.sin(np.radians(angle)), np.cos(np.radians(angle))])
            style = {"arrowstyle": arrow, "color": shade, "lw": 1.6, "mutation_scale": 16, "shrinkA": 3, "shrinkB": 0}
            axes.annotate("", end, start, arrowprops=style)
    axes.set(xlim=(0.0, 12.8), ylim=(-1.35, 2.05))
    words = ((0.2, "facing h (D)", GOLD), (3.6, "light is blocked (G)", BLUE), (8.2, "viewer is blocked (G)", RED))
    for left, text, color in words:
        axes.text(left, -1.15, text, color=color, fontsize=sheets.POINTS)
    axes.text(0.2, 1.65, "from the light", color="#fff3c4", fontsize=sheets.POINTS)
    axes.text(12.6, 1.65, "to the viewer", color=GOLD, fontsize=sheets.POINTS, ha="right")
    axes.set_axis_off()


def main(size: int = 305) -> None:
    cells = balls(size)
    side, low = 3.05, 3.4  # inches: size of a ball's picture, height of the section
    height = low + side + 2.2 * sheets.LINE + 0.1
    width = sheets.WIDTH / sheets.DPI
    figure = Figure(figsize=(width, height), facecolor=sheets.BACKGROUND, dpi=sheets.DPI)
    for number, (title, picture) in enumerate(cells):
        left = (width - 4 * side) / 5 * (number + 1) + side * number
        axes = figure.add_axes((left / width, (low + 0.1) / height, side / width, side / height))
        axes.imshow(images.to_screen(picture), interpolation="lanczos")
        axes.set_axis_off()
        for above, line in enumerate(reversed(title.split("\n"))):
            base = low + 0.1 + side + (above + 0.33) * sheets.LINE
            place = (left + side / 2) / width, base / height
            figure.text(*place, line, color=sheets.TEXT, fontsize=sheets.POINTS, ha="center")
    section(figure.add_axes((0.0, 0.0, 1.0, low / height)))
    print(sheets.save(figure, PICTURE))


if __name__ == "__main__":
    main()
