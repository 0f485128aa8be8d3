"""Draw the diagrams of docs/course: directions, angles and surfaces, as drawn in the lecture.

python docs/make_course_diagrams.py [NAME ...]

Labels are symbols, so that the diagrams suit every language.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Arc, FancyArrowPatch, Polygon, Rectangle, Wedge

matplotlib.rcParams["svg.hashsalt"] = "gonio"  # so that the files are reproducible

PICTURES = Path(__file__).parent / "course" / "pictures"
VALUES = PICTURES.parent / "values"
RED, GOLD, GREEN, BLUE, INK, PALE = "#b3403a", "#c98a2b", "#3f7d4f", "#2b5d8a", "#333333", "#d9dee4"
Point = Sequence[float]


def canvas(columns: int, width: float, height: float) -> tuple[Figure, list[Any]]:
    """A figure with panels that have no axes and an equal aspect ratio."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = list(np.atleast_1d(figure.subplots(1, columns)))
    for axis in axes:
        axis.set_aspect("equal")
        axis.axis("off")
    return figure, axes


def save(figure: Figure, name: str) -> None:
    figure.savefig(PICTURES / f"{name}.svg", metadata={"Date": None})


def toward(degrees: float, length: float = 1.0) -> tuple[float, float]:
    """The end of a vector from the origin, `degrees` clockwise from up."""
    t = np.radians(degrees)
    return length * np.sin(t), length * np.cos(t)


def arrow(axis: Any, start: Point, end: Point, color: str = INK, label: str = "", at: Point = (0.0, 0.0)) -> None:
    """Draw an arrow with a label beyond its end, offset by `at`."""
    axis.add_patch(
        FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=12, color=color, lw=1.6, shrinkA=0, shrinkB=0)
    )
    along = np.subtract(end, start)
    x, y = np.add(np.add(end, at), 0.11 * along / max(np.hypot(*along), 1e-9))
    axis.text(x, y, label, color=color, ha="center", va="center", fontsize=12)


def angle(axis: Any, low: float, high: float, radius: float, label: str, color: str = INK) -> None:
    """Draw a labeled arc between two directions, in degrees clockwise from up."""
    axis.add_patch(Arc((0, 0), 2 * radius, 2 * radius, theta1=90 - high, theta2=90 - low, color=color, lw=1))
    x, y = toward((low + high) / 2, radius + 0.13)
    axis.text(x, y, label, color=color, ha="center", va="center", fontsize=11)


def ground(axis: Any, half: float = 1.25, depth: float = 0.1) -> None:
    """Draw the surface, with matter below."""
    axis.add_patch(Rectangle((-half, -depth), 2 * half, depth, color=PALE, lw=0))
    axis.plot([-half, half], [0, 0], color=INK, lw=1.6)


def limits(axis: Any, x: Point, y: Point) -> None:
    axis.set_xlim(*x)
    axis.set_ylim(*y)


def frames() -> None:
    """The framework's frame, Gonio's frame, and the layout of the homework's table."""
    figure, (left, right, table) = canvas(3, 9.2, 3.0)
    for axis, up, side, front, title in (
        (left, "y", "x", "z", "framework: y up"),
        (right, "z", "x", "-y", "Gonio: z up"),
    ):
        ground(axis, 1.1)
        arrow(axis, (0, 0), (0, 1), BLUE, f"${up} = n$", (0.0, 0.04))
        arrow(axis, (0, 0), (0.95, 0), RED, f"${side}$", (0.02, 0.1))
        arrow(axis, (0, 0), (-0.5, -0.42), GREEN, f"${front}$")
        arrow(axis, (0, 0), toward(-40, 0.95), GOLD, "$l$")
        arrow(axis, (0, 0), toward(38, 0.95), GOLD, "$v$")
        axis.set_title(title, fontsize=10)
        limits(axis, (-1.25, 1.25), (-0.65, 1.3))
    shades = np.loadtxt(VALUES / "E-figure.csv", delimiter=",")
    table.imshow(shades, extent=(0, 1, 0, 1), cmap="gray", vmin=0, vmax=1, origin="lower")
    arrow(table, (0, -0.1), (1, -0.1), INK, r"$\mu = n\cdot v$", (-0.5, -0.16))
    arrow(table, (-0.1, 0), (-0.1, 1), INK, "roughness", (0.0, 0.02))
    table.set_title("homework: E.png\n", fontsize=10)
    limits(table, (-0.45, 1.25), (-0.4, 1.25))
    save(figure, "frames")


def phong() -> None:
    """l, n, v, r."""
    figure, (axis,) = canvas(1, 4.4, 2.5)
    ground(axis)
    for degrees, label, color in ((-45, "$l$", GOLD), (0, "$n$", INK), (45, "$r$", RED), (68, "$v$", BLUE)):
        arrow(axis, (0, 0), toward(degrees), color, label)
    angle(axis, -45, 0, 0.42, r"$\theta$")
    angle(axis, 0, 45, 0.42, r"$\theta$")
    angle(axis, 45, 68, 0.62, r"$\gamma$", RED)
    axis.text(1.45, 0.62, r"$(v\cdot r)^p = \cos^p\gamma$", color=RED, fontsize=11)
    limits(axis, (-1.35, 2.5), (-0.15, 1.2))
    save(figure, "phong-vectors")


def grooves() -> None:
    """V-grooves that hide one another."""
    figure, (axis,) = canvas(1, 5.6, 2.1)
    x = np.linspace(0, 6, 7)
    y = np.where(np.arange(7) % 2 == 0, 0.55, 0.0)
    axis.add_patch(Polygon([*zip(x, y, strict=True), (6, -0.15), (0, -0.15)], color=PALE, lw=0))
    axis.plot(x, y, color=INK, lw=1.8)
    axis.plot(x, 0 * x + 0.55, color=INK, lw=0.8, ls=":")
    arrow(axis, (0.2, 1.6), (1.5, 0.27), GOLD)
    arrow(axis, (1.5, 0.27), (0.75, 1.55), RED)
    arrow(axis, (1.5, 0.27), (2.85, 1.35), BLUE)
    axis.text(0.05, 1.66, "$l$", color=GOLD, fontsize=12)
    axis.text(0.68, 1.62, "$o$", color=RED, fontsize=12)
    axis.text(2.9, 1.4, "$o'$", color=BLUE, fontsize=12)
    arrow(axis, (4.5, 0.27), (4.5 + 0.44, 0.27 + 0.8), INK, "$a$")
    arrow(axis, (4.5, 0.27), (4.5, 1.18), INK, "$n$")
    axis.text(4.62, 0.86, r"$\theta_a$", fontsize=11)
    axis.text(3.0, -0.36, r"slope of $a$: Gaussian, standard deviation $\sigma$", fontsize=10, ha="center")
    limits(axis, (-0.1, 6.1), (-0.5, 1.85))
    save(figure, "v-grooves")


def half_vector() -> None:
    """h bisects the angle between i and o."""
    figure, (axis,) = canvas(1, 4.4, 2.5)
    ground(axis)
    for degrees, label, color in ((-30, "$i$", GOLD), (0, "$n$", INK), (70, "$o$", BLUE), (20, "$h$", RED)):
        arrow(axis, (0, 0), toward(degrees), color, label)
    angle(axis, 0, 20, 0.5, r"$\theta_h$", INK)
    angle(axis, -30, 20, 0.72, "", RED)
    angle(axis, 20, 70, 0.72, r"$\theta_d$", RED)
    facet = np.array([toward(110, 0.34), toward(-70, 0.34)])
    axis.plot(facet[:, 0], facet[:, 1], color=RED, lw=3)
    axis.text(1.3, 0.55, r"$h = \dfrac{i + o}{|i + o|}$", color=RED, fontsize=12)
    limits(axis, (-1.35, 2.2), (-0.2, 1.2))
    save(figure, "half-vector")


def reflection() -> None:
    """Equal angles, and opposite azimuths."""
    figure, (side, top) = canvas(2, 6.6, 2.6)
    ground(side)
    for degrees, label, color in ((-50, r"$\omega_i$", GOLD), (0, "$n$", INK), (50, r"$\omega_o$", BLUE)):
        arrow(side, (0, 0), toward(degrees), color, label)
    angle(side, -50, 0, 0.4, r"$\theta_i$")
    angle(side, 0, 50, 0.4, r"$\theta_o$")
    limits(side, (-1.35, 1.35), (-0.2, 1.25))
    top.add_patch(Arc((0, 0), 2, 2, color=INK, lw=1))
    arrow(top, (0, 0), toward(-60), GOLD, r"$\omega_i$")
    arrow(top, (0, 0), toward(120), BLUE, r"$\omega_o$")
    arrow(top, (0, 0), (1.0, 0.0), INK, "$x$", (0.05, 0.05))
    top.add_patch(Arc((0, 0), 0.7, 0.7, theta1=0, theta2=150, color=GOLD))
    top.text(0.12, 0.48, r"$\phi_i$", color=GOLD, fontsize=11)
    top.text(0.0, -1.3, r"$\phi_o = (\phi_i + \pi)\ \mathrm{mod}\ 2\pi$", ha="center", fontsize=11)
    limits(top, (-1.4, 1.4), (-1.45, 1.15))
    save(figure, "reflection")


def refraction() -> None:
    """Snell's law, and total internal reflection from below."""
    figure, (snell, window) = canvas(2, 7.4, 3.0)
    for axis in (snell, window):
        axis.add_patch(Rectangle((-1.4, -1.2), 2.8, 1.2, color="#dcebf5", lw=0))
        axis.plot([-1.4, 1.4], [0, 0], color=INK, lw=1.6)
        axis.plot([0, 0], [-1.15, 1.1], color=INK, lw=0.8, ls=":")
    arrow(snell, toward(-50), (0, 0), GOLD)
    arrow(snell, (0, 0), toward(180 - np.degrees(np.arcsin(np.sin(np.radians(50)) / 1.5))), BLUE)
    angle(snell, -50, 0, 0.42, r"$\theta_i$")
    angle(snell, 180 - 30.7, 180, 0.5, r"$\theta_t$")
    snell.text(0.55, 0.75, r"$\eta_i \sin\theta_i = \eta_t \sin\theta_t$", fontsize=11)
    snell.text(-1.3, 0.1, r"$\eta_i$", fontsize=11)
    snell.text(-1.3, -0.2, r"$\eta_t$", fontsize=11)
    for degrees in (0, 25, 40):
        arrow(window, toward(180 - degrees, 1.1), (0, 0), PALE if degrees else BLUE)
        out = np.degrees(np.arcsin(1.333 * np.sin(np.radians(degrees))))
        arrow(window, (0, 0), toward(-out), BLUE)
    for degrees in (25, 40):
        window.plot(*zip(toward(180 - degrees, 1.1), (0, 0), strict=True), color=BLUE, lw=1.6)
    arrow(window, toward(180 - 65, 1.1), (0, 0), RED)
    arrow(window, (0, 0), toward(180 + 65, 1.1), RED)
    window.add_patch(Wedge((0, 0), 0.34, 270 - 48.6, 270 + 48.6, color="#f3d9a6", lw=0, zorder=1.5))
    window.text(0.36, -0.3, r"$\theta_c$", fontsize=11)
    window.text(-1.35, 0.95, r"$\sin\theta_c = 1 / \eta$", fontsize=11)
    for axis in (snell, window):
        limits(axis, (-1.4, 1.75), (-1.2, 1.25))
    save(figure, "refraction")


def facets() -> None:
    """What D, G and F measure: facets along h, facets hidden from light or eye, and the light that is transmitted."""
    figure, panels = canvas(3, 9.4, 2.2)
    rng = np.random.default_rng(4)
    x = np.linspace(0, 4, 9)
    y = np.array([0.15, 0.5, 0.1, 0.55, 0.2, 0.75, 0.1, 0.45, 0.2]) + 0.02 * rng.standard_normal(9)
    for axis, title in zip(panels, ("shadowing", "masking", "a second facet"), strict=True):
        axis.add_patch(Polygon([*zip(x, y, strict=True), (4, -0.2), (0, -0.2)], color=PALE, lw=0))
        axis.plot(x, y, color=INK, lw=1.8)
        axis.set_title(title, fontsize=10)
        limits(axis, (-0.1, 4.1), (-0.25, 1.9))
    hit = (1.25, 0.325)
    blocked = (2.28, 0.5)
    arrow(panels[0], (4.0, 0.84), blocked, GOLD)
    panels[0].plot([blocked[0], hit[0]], [blocked[1], hit[1]], color=GOLD, lw=1.2, ls=":")
    panels[0].text(3.55, 0.98, "$i$", color=GOLD, fontsize=12)
    arrow(panels[1], (1.0, 1.75), (1.75, 0.38), GOLD, "", (0, 0))
    panels[1].text(0.82, 1.6, "$i$", color=GOLD, fontsize=12)
    arrow(panels[1], (1.75, 0.38), (2.3, 0.5), BLUE)
    panels[1].plot([2.3, 3.9], [0.5, 0.85], color=BLUE, lw=1.2, ls=":")
    panels[1].text(3.75, 1.0, "$o$", color=BLUE, fontsize=12)
    for start, end in (((1.35, 1.8), (1.75, 0.38)), ((1.75, 0.38), (2.25, 0.47)), ((2.25, 0.47), (1.9, 1.75))):
        arrow(panels[2], start, end, GOLD if start[1] > 1 else RED)
    panels[2].text(2.05, 1.6, r"$\propto F^2$", color=RED, fontsize=12)
    save(figure, "facets")


def lobes() -> None:
    """One incident direction; diffuse, glossy and ideal reflection."""
    figure, panels = canvas(3, 8.6, 2.3)
    for axis, title in zip(panels, ("diffuse", "glossy", "ideal"), strict=True):
        ground(axis)
        arrow(axis, toward(-45, 1.15), (0, 0), GOLD)
        axis.set_title(title, fontsize=10)
        limits(axis, (-1.3, 1.3), (-0.2, 1.2))
    t = np.linspace(-89, 89, 400)
    for axis, r in ((panels[0], 0.5 + 0 * t), (panels[1], np.exp(-(((t - 45) / 14) ** 2)) + 0.03)):
        curve = np.array([toward(a, s) for a, s in zip(t, r, strict=True)])
        axis.fill(*curve.T, color=BLUE, alpha=0.15)
        axis.plot(*curve.T, color=BLUE, lw=1.4)
    for degrees in (-60, -30, 0, 30, 60):
        arrow(panels[0], (0, 0), toward(degrees, 0.5), BLUE)
    for degrees, length in ((30, 0.36), (45, 1.03), (60, 0.36)):
        arrow(panels[1], (0, 0), toward(degrees, length), BLUE)
    arrow(panels[2], (0, 0), toward(45, 1.15), BLUE)
    save(figure, "lobes")


def brushing() -> None:
    """Grooves along x, seen from above; the facets in two cross sections."""
    figure, (top, cuts) = canvas(2, 7.0, 2.5)
    rng = np.random.default_rng(2)
    for _ in range(70):
        x, y, length = rng.uniform(-1, 0.6), rng.uniform(-0.95, 0.95), rng.uniform(0.3, 0.9)
        top.plot([x, min(x + length, 1)], [y, y], color="#9aa4b0", lw=0.8)
    arrow(top, (0, 0), (1.15, 0), RED, "$x$")
    arrow(top, (0, 0), (0, 1.15), GREEN, "$y$")
    arrow(top, (0, 0), toward(50), GOLD, r"$i$")
    top.add_patch(Arc((0, 0), 0.8, 0.8, theta1=0, theta2=40, color=GOLD))
    top.text(0.5, 0.16, r"$\phi_i$", color=GOLD, fontsize=11)
    limits(top, (-1.15, 1.4), (-1.1, 1.4))
    s = np.linspace(0, 2.4, 400)
    for height, y, color, label in (
        (0.9, 0.015 * np.sin(9 * s), RED, r"along $x$: $\alpha_x$ small"),
        (0.1, 0.11 * np.sin(17 * s) + 0.05 * np.sin(41 * s), GREEN, r"along $y$: $\alpha_y$ large"),
    ):
        cuts.fill_between(s, height + y, height - 0.25, color=PALE, lw=0)
        cuts.plot(s, height + y, color=color, lw=1.6)
        cuts.text(1.2, height + 0.24, label, color=color, ha="center", fontsize=10)
    limits(cuts, (-0.05, 2.45), (-0.3, 1.4))
    save(figure, "brushing")


def gonioreflectometer() -> None:
    """A lamp and a detector on arcs around the sample, and a ball, which has all normals at once."""
    figure, (arcs, ball) = canvas(2, 7.4, 2.7)
    arcs.add_patch(Arc((0, 0), 2.2, 2.2, theta1=0, theta2=180, color="#9aa4b0", lw=1.2))
    arcs.add_patch(Rectangle((-0.35, -0.08), 0.7, 0.08, color=INK))
    for degrees, color, label in ((-40, GOLD, "lamp"), (62, BLUE, "detector")):
        x, y = toward(degrees, 1.1)
        arcs.plot(x, y, "o", color=color, ms=11)
        arcs.text(1.22 * x, 1.16 * y + 0.08, label, color=color, ha="center", fontsize=10)
    arrow(arcs, toward(-40, 1.02), (0, 0), GOLD)
    arrow(arcs, (0, 0), toward(62, 1.0), BLUE)
    angle(arcs, -40, 0, 0.45, r"$\theta_i$")
    angle(arcs, 0, 62, 0.45, r"$\theta_r$")
    limits(arcs, (-1.6, 1.7), (-0.2, 1.5))
    ball.add_patch(Wedge((0, 0), 0.75, 0, 360, color=PALE, lw=0))
    ball.add_patch(Arc((0, 0), 1.5, 1.5, color=INK, lw=1.4))
    for degrees in (-70, -45, -20, 5, 30, 55):
        arrow(ball, toward(degrees, 0.75), toward(degrees, 1.0), INK)
    ball.plot(-1.5, 1.3, "o", color=GOLD, ms=11)
    ball.text(-1.5, 1.45, "lamp", color=GOLD, ha="center", fontsize=10)
    ball.add_patch(Rectangle((1.35, 0.9), 0.34, 0.26, color=BLUE))
    ball.text(1.52, 1.25, "camera", color=BLUE, ha="center", fontsize=10)
    limits(ball, (-1.9, 2.0), (-0.85, 1.65))
    save(figure, "gonioreflectometer")


def compensation() -> None:
    """The power of a beam: E leaves after single scattering, 1 - E is restored by the added lobe."""
    figure, (axis,) = canvas(1, 7.0, 2.0)
    for y, parts in ((1.0, ((0.62, BLUE, r"$E(\mu_o)$"), (0.38, PALE, r"$1 - E(\mu_o)$"))),):
        left = 0.0
        for width, color, label in parts:
            axis.add_patch(Rectangle((left, y), width, 0.22, color=color, lw=0))
            axis.text(
                left + width / 2,
                y + 0.11,
                label,
                ha="center",
                va="center",
                fontsize=11,
                color="white" if color == BLUE else INK,
            )
            left += width
    axis.text(-0.05, 1.11, "1", ha="right", va="center", fontsize=12)
    axis.text(0.31, 0.78, r"$\int f_{micro}\,\mu_i\,d\omega_i$", ha="center", va="center", fontsize=12, color=BLUE)
    axis.text(0.81, 0.78, r"$\int f_{ms}\,\mu_i\,d\omega_i$", ha="center", va="center", fontsize=12, color=RED)
    axis.text(
        0.5,
        0.45,
        r"$f_{ms} = c\,(1 - E(\mu_o))\,(1 - E(\mu_i)),\quad c = 1 / (\pi\,(1 - E_{avg}))$",
        ha="center",
        va="center",
        fontsize=12,
        color=RED,
    )
    limits(axis, (-0.12, 1.05), (0.3, 1.3))
    axis.set_aspect("auto")
    save(figure, "compensation")


DIAGRAMS = (
    frames,
    phong,
    grooves,
    half_vector,
    reflection,
    refraction,
    facets,
    lobes,
    brushing,
    gonioreflectometer,
    compensation,
)


def main() -> int:
    """Draw the named diagrams, or all."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for draw in DIAGRAMS:
        if len(sys.argv) == 1 or draw.__name__ in sys.argv:
            draw()
    return 0


if __name__ == "__main__":
    sys.exit(main())
