"""Draw the figures of docs/course for Lab 2 and Lecture 17: plots, and rows of balls.

python docs/make_course_figures.py [NAME ...]
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gonio as go
import matplotlib
import numpy as np
from matplotlib.figure import Figure

matplotlib.rcParams["svg.hashsalt"] = "gonio"  # so that the files are reproducible
ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "course" / "pictures"
RED, GOLD, GREEN, BLUE = "#b3403a", "#c98a2b", "#3f7d4f", "#2b5d8a"
COLORS = (BLUE, RED, GOLD, GREEN, "#6b4c8a")


def canvas(columns: int, width: float, height: float, **options: Any) -> tuple[Figure, list[Any]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = list(np.atleast_1d(figure.subplots(1, columns, **options)))
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=8)
    return figure, axes


def save(figure: Figure, name: str) -> None:
    """Save curves as .svg, tables as .png and renders as .jpg."""
    options = {"metadata": {"Date": None}} if name.endswith(".svg") else {"dpi": 120}
    figure.savefig(PICTURES / name, **options)


def label(axis: Any, x: str, y: str, legend: bool = True) -> None:
    axis.set_xlabel(x, fontsize=9)
    axis.set_ylabel(y, fontsize=9)
    if legend:
        axis.legend(frameon=False, fontsize=8)


def encoded(linear: np.ndarray) -> np.ndarray:
    """Linear values encoded as sRGB."""
    c = np.clip(linear, 0.0, 1.0)
    return np.where(c < 0.0031308, 12.92 * c, 1.055 * np.maximum(c, 1e-9) ** (1 / 2.4) - 0.055)


def balls(name: str, materials: Sequence[tuple[str, go.BSDF]]) -> None:
    """Five balls in a dark studio, each with its title above."""
    overrides = {f"shapes.{i}.material": material for i, (_, material) in enumerate(materials)}
    scene = str(ROOT / "examples" / "conductor-ggx" / "print.json")
    picture = encoded(go.render(scene, overrides=overrides, size=(1000, 260), spp=96, denoise=True))
    figure, (axis,) = canvas(1, 9.0, 2.55)
    axis.imshow(picture)
    for i, (title, _) in enumerate(materials):
        axis.text(500 + 155 * (i - 2), -14, title, ha="center", fontsize=9)
    axis.axis("off")
    save(figure, name)


def direction(degrees: Any, azimuth: float = 0.0) -> np.ndarray:
    """Unit vectors, (N, 3)."""
    t, p = np.radians(np.atleast_1d(degrees)), np.radians(azimuth)
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1)


# ------------------------------------------------------------------------------------------------ Lab 2 and Lecture 17


def distributions() -> None:
    """D of three distributions as a function of angle, and its projected area."""
    figure, (linear, log) = canvas(2, 8.6, 3.0)
    t = np.radians(np.linspace(0.0, 89.5, 400))
    a2, tan2, cos4 = 0.3**2, np.tan(t) ** 2, np.cos(t) ** 4
    n = 2.0 / a2 - 2.0
    curves = {
        "ggx": a2 / (np.pi * cos4 * (a2 + tan2) ** 2),
        "beckmann": np.exp(-tan2 / a2) / (np.pi * a2 * cos4),
        f"power of the cosine, n = {n:.1f}": (n + 2.0) / (2.0 * np.pi) * np.cos(t) ** n,
    }
    for (name, d), color in zip(curves.items(), COLORS, strict=False):
        linear.plot(np.degrees(t), d, color=color, label=name)
        log.semilogy(np.degrees(t), d * np.cos(t), color=color, label=name)
    log.set_ylim(1e-5, 10)
    label(linear, "angle of the facet, degrees", "D, 1/sr")
    label(log, "angle of the facet, degrees", "D cos, 1/sr", legend=False)
    linear.set_title(r"$\alpha = 0.3$", fontsize=9, loc="left")
    save(figure, "distributions.svg")


def sampling() -> None:
    """Copper at 16 samples per pixel, with four sampling methods."""
    scene = str(ROOT / "examples" / "conductor-ggx" / "print.json")
    figure = Figure(figsize=(10.0, 3.7), layout="constrained")
    metal = {"ndf": "ggx", "masking": "smith-separable", "fresnel": "schlick"}
    changes = (
        ("directSampleBSDF, sampling=normals", "directSampleBSDF", "normals"),
        ("directSampleBSDF, sampling=bounded", "directSampleBSDF", "bounded"),
        ("directSampleLight", "directSampleLight", "bounded"),
        ("direct: both", "direct", "bounded"),
    )
    for axis, (title, integrator, method) in zip(figure.subplots(2, 2).flat, changes, strict=True):
        materials = {
            f"shapes.{i}.material": go.Conductor.preset("Cu", alpha=alpha, sampling=method, **metal)
            for i, alpha in enumerate((0.02, 0.25, 0.5, 0.75, 0.99))
        }
        picture = go.render(scene, integrator=integrator, spp=16, size=(760, 236), overrides=materials)
        axis.imshow(encoded(picture))
        axis.set_title(title, fontsize=9)
        axis.axis("off")
    save(figure, "sampling.jpg")


def diffuse() -> None:
    albedos = (0.1, 0.3, 0.5, 0.7, 0.9)
    balls("diffuse.jpg", [(rf"$\rho = {a:g}$", go.Lambert(albedo=[a, 0.7 * a, 0.45 * a])) for a in albedos])


def indices() -> None:
    """n as a function of wavelength."""
    figure, (axis,) = canvas(1, 6.4, 3.2)
    wavelength = np.linspace(400.0, 700.0, 151)
    for name, color in zip(("diamond", "sf10", "bk7", "water"), COLORS, strict=False):
        n = np.asarray(go.refractive_index(name, wavelength)[0])
        spread = n[0] - n[-1]
        axis.plot(wavelength, n - n[-1], color=color, label=f"{name}: {n[-1]:.3f} at 700 nm, +{spread:.3f} at 400 nm")
    shades = np.stack([np.interp(wavelength, *curve) for curve in HUES], -1)
    axis.imshow(shades[None], extent=(400, 700, -0.006, -0.002), aspect="auto")
    axis.set_ylim(-0.006, 0.075)
    label(axis, "wavelength, nm", r"$n(\lambda) - n(700\,nm)$")
    save(figure, "indices.svg")


# RGB colors of the band that marks the wavelengths; a guide to the eye, not colorimetric
HUES = (
    ([400, 440, 490, 510, 580, 645, 700], [0.5, 0.2, 0.0, 0.0, 1.0, 1.0, 0.7]),
    ([400, 440, 490, 510, 580, 645, 700], [0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0]),
    ([400, 440, 490, 510, 580, 645, 700], [0.7, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
)


def fresnel() -> None:
    """Reflectance of glass and of gold: the two polarizations, their mean, Schlick."""
    figure, axes = canvas(3, 10.2, 3.0)
    degrees = np.linspace(0.0, 90.0, 361)
    n, k = (float(np.squeeze(value)) for value in go.refractive_index("Al", 650.0))
    for axis, title, eta, absorption in (
        (axes[0], "air to glass, η = 1.5", 1.5, 0.0),
        (axes[1], "glass to air, η = 1/1.5", 1 / 1.5, 0.0),
        (axes[2], f"aluminum at 650 nm, {n:.2f} + {k:.2f} i", n, k),
    ):
        at = go.fresnel(np.radians(degrees), eta, absorption)
        r0 = ((eta - 1) ** 2 + absorption**2) / ((eta + 1) ** 2 + absorption**2)
        axis.plot(degrees, at.R_s, color=BLUE, lw=1, label="$R_s$")
        axis.plot(degrees, at.R_p, color=GREEN, lw=1, label="$R_p$")
        axis.plot(degrees, at.R, color="black", lw=1.8, label="$R$")
        schlick = r0 + (1 - r0) * (1 - np.cos(np.radians(degrees))) ** 5
        axis.plot(degrees, schlick, color=RED, ls="--", label="Schlick")
        axis.set_title(title, fontsize=9, loc="left")
        axis.set_ylim(0.0 if not absorption else 0.75, 1.02)
        label(axis, "angle, degrees", "reflectance", legend=axis is axes[0])
    save(figure, "fresnel.svg")


def anisotropy() -> None:
    """The same pair of alphas, rotated about the normal."""

    def steel(alpha: tuple[float, float], degrees: float = 0.0) -> go.BSDF:
        return go.Conductor.preset("Cr", alpha=alpha, rotation=np.radians(degrees))

    rows = [
        (r"$\alpha = (0.2, 0.2)$", steel((0.2, 0.2))),
        ("(0.05, 0.4)", steel((0.05, 0.4))),
        ("turned by 30°", steel((0.05, 0.4), 30.0)),
        ("turned by 60°", steel((0.05, 0.4), 60.0)),
        ("turned by 90°", steel((0.05, 0.4), 90.0)),
    ]
    balls("anisotropy.jpg", rows)


def reciprocity() -> None:
    """f(o, i) against f(i, o) at random pairs, for Phong and for a metal."""
    figure, axes = canvas(2, 7.0, 3.2)
    rng = np.random.default_rng(3)
    z = rng.uniform(0.1, 1.0, (2, 3000))
    phi = rng.uniform(0.0, 2.0 * np.pi, (2, 3000))
    o, i = (
        np.stack([np.sqrt(1 - a * a) * np.cos(p), np.sqrt(1 - a * a) * np.sin(p), a], -1)
        for a, p in zip(z, phi, strict=True)
    )
    for axis, title, model, color in (
        (axes[0], "phong", go.Phong(kd=0.1, ks=0.6, p=4.0), RED),
        (axes[1], "conductor", go.Conductor.preset("Au", alpha=0.4), BLUE),
    ):
        forth = np.asarray(model.f(o, i, precision="float64"))[:, 0]
        back = np.asarray(model.f(i, o, precision="float64"))[:, 0]
        axis.loglog(np.maximum(forth, 1e-4), np.maximum(back, 1e-4), ".", color=color, ms=2, rasterized=True)
        axis.plot([1e-4, 10], [1e-4, 10], color="#888", lw=0.8, ls=":")
        axis.set_aspect("equal")
        axis.set_xlim(5e-3, 10)
        axis.set_ylim(5e-3, 10)
        axis.set_title(title, fontsize=9, loc="left")
        label(axis, "f(o, i), 1/sr", "f(i, o), 1/sr", legend=False)
    save(figure, "reciprocity.png")


def storing() -> None:
    """A highlight in a regular table of angles, and in one of half and difference angles with as many cells."""
    figure, axes = canvas(2, 8.6, 3.2)
    gold = go.Conductor.preset("Au", alpha=0.02)
    view, light = np.linspace(0.0, 80.0, 1601), 31.5  # between two cells of the regular table
    grid = np.linspace(0.0, 87.0, 30)
    rows = [_plane(gold, grid, angle) for angle in (light - 1.5, light + 1.5)]
    regular = np.interp(view, grid, np.mean(rows, axis=0))
    # in the plane of incidence: theta_h = |theta_o - theta_i| / 2, stored at equal steps of its square root
    root, differences = np.linspace(0.0, np.sqrt(90.0), 31), np.linspace(0.0, 80.0, 31)
    cells = np.array([_value(gold, root**2, angle) for angle in differences])
    column = np.abs(differences[:, None] - (view + light) / 2.0).argmin(0)
    half = np.sqrt(np.abs(view - light) / 2.0)
    stored = np.array([np.interp(x, root, cells[c]) for x, c in zip(half, column, strict=True)])
    for axis, values, title in (
        (axes[0], regular, r"$\theta_i, \theta_r$: steps of 3 degrees"),
        (axes[1], stored, r"$\sqrt{\theta_h}, \theta_d$: as many steps"),
    ):
        axis.plot(view, _plane(gold, view, light), color="black", lw=1.6, label=r"gold, $\alpha = 0.02$")
        axis.plot(view, values, color=RED, lw=1.2, label="table")
        axis.set_title(title, fontsize=9, loc="left")
        axis.set_xlim(15, 48)
        label(axis, "angle of the view, degrees (light at 31.5)", "f, 1/sr")
    save(figure, "storing.svg")


def _plane(model: go.BSDF, view: np.ndarray, light: float) -> np.ndarray:
    """f in the plane of incidence, for views opposite the light."""
    wi = np.repeat(direction(light), len(view), 0)
    return np.asarray(model.f(direction(view, 180.0), wi, precision="float64"))[:, 0]


def _value(model: go.BSDF, half: np.ndarray, difference: float) -> np.ndarray:
    """f in the plane of incidence, at angles of the half vector and one difference angle; 0 below the horizon."""
    o, i = direction(half + difference), direction(half - difference)
    above = (o[:, 2] > 1e-3) & (i[:, 2] > 1e-3)
    value = np.zeros(len(half))
    if above.any():
        value[above] = np.asarray(model.f(o[above], i[above], precision="float64"))[:, 0]
    return value


def draw(figures: Sequence[Callable[[], None]]) -> int:
    """Draw the figures that the command names, or all."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for one in figures:
        if len(sys.argv) == 1 or one.__name__ in sys.argv:
            one()
            print(one.__name__, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(draw((distributions, sampling, diffuse, indices, fresnel, anisotropy, reciprocity, storing)))
