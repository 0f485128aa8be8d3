"""Write docs/published-fits.md, its pictures and cards.json: tests of the published fits to the MERL materials.

    python docs/make_published_fits.py [--networks merl.npz] [--only FILE/FIT,...]

merl.npz contains neural networks of 675 weights for 13 of the materials (Sztrajman2021), as `NAME/kernel0..2` and
`NAME/bias0..2`. Without this file, or with --only, the program only prints a table. All fits are evaluated at the same
fixed points.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import gonio as go
import numpy as np
from gonio.catalog import library
from gonio.verify import quality
from gonio.verify.subject import Subject
from matplotlib.figure import Figure
from numpy.typing import NDArray

HERE = Path(__file__).parent
FOLDER = HERE / "published-fits"
Array = NDArray[np.float64]
BRDF = Callable[[Array, Array], Array]

THETA = np.array([1.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 88.0, 89.5])  # viewing angles, degrees
POINTS = 4096  # lattice points (rank 1) per view, which make albedos accurate to about a thousandth
SIZE = 96  # width in pixels of the spheres whose differences are reported
BALL, OVERSAMPLING = 136, 3  # width in pixels of a sphere on a sheet, and samples along each side of a pixel
SHEETS = 2  # number of sheets of spheres, among which the materials are divided
LIGHTS = np.array([[-0.45, 0.55, 0.7], [0.9, 0.35, 0.25], [0.3, -0.75, -0.15]])  # key, rim, and from behind


class Card(NamedTuple):
    """The measured values of one fit of one material.

    gain      largest albedo of any channel at any view, minus 1; `at` is the angle of this view in degrees
    mean      energy gain averaged over all views, weighted by their cosines, in the worst channel
    negative  fraction of the light that is negative, at the view where this fraction is largest
    recip     maximum of |f(o, i) - f(i, o)|, relative to the larger value
    cosine    variance of cosine sampling divided by that of the material's own sampling
    """

    material: str
    fit: str
    gain: float
    at: float
    mean: float
    negative: float
    recip: float
    cosine: float | None

    @property
    def severity(self) -> float:
        """Average error of a picture: gained and negative light, plus a tenth of the gain at the worst view."""
        return self.mean + self.negative + 0.1 * max(self.gain, 0.0)


# --------------------------------------------------------------------------- directions


def unit(w: Array) -> Array:
    return w / np.linalg.norm(w, axis=-1, keepdims=True)


def polar(theta: Array, phi: Array | float) -> Array:
    """Unit vectors from angles in radians."""
    theta, phi = np.broadcast_arrays(theta, phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def rusinkiewicz() -> tuple[Array, Array]:
    """(wo, wi) on a coarse grid in the coordinates of the MERL tables: evenly spaced in sqrt(theta_h), theta_d
    and phi_d. Pairs below the surface are omitted."""
    half = (np.arange(24) + 0.5) ** 2 / 24**2 * np.pi / 2
    difference = (np.arange(12) + 0.5) / 12 * np.pi / 2
    turn = (np.arange(12) + 0.5) / 12 * np.pi
    h, d, p = (x.ravel() for x in np.meshgrid(half, difference, turn, indexing="ij"))
    v = polar(d, p)
    x, y = np.stack([np.cos(h), 0 * h, -np.sin(h)], -1), np.array([0.0, 1.0, 0.0])
    n = polar(h, 0.0)
    wi = v[:, :1] * x + v[:, 1:2] * y + v[:, 2:] * n
    wo = -v[:, :1] * x - v[:, 1:2] * y + v[:, 2:] * n
    above = (wo[:, 2] > 0.01) & (wi[:, 2] > 0.01)
    return unit(wo[above]), unit(wi[above])


def sphere(size: int) -> tuple[Array, Array, Array]:
    """Mask of the ball's pixels, wo per pixel, and wi per light and pixel, in the local frames of the surface."""
    at = (np.arange(size) + 0.5) / size * 2.1 - 1.05
    x, y = np.meshgrid(at, -at)
    inside = x**2 + y**2 < 1.0
    n = np.stack([x, y, np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))], -1)[inside]
    tangent = unit(np.cross([0.0, 1.0, 0.0], n))
    frame = np.stack([tangent, np.cross(n, tangent), n], 1)
    wo = frame @ np.array([0.0, 0.0, 1.0])
    wi = np.stack([frame @ light for light in unit(LIGHTS)])
    return inside, wo, wi


def network(weights: dict[str, Array], name: str) -> BRDF:
    """BRDF of a material's network: ReLU layers from the half and difference vectors to exp(x) - 1 (Sztrajman2021)."""
    layers = [(weights[f"{name}/kernel{i}"], weights[f"{name}/bias{i}"]) for i in range(3)]

    def f(wo: Array, wi: Array) -> Array:
        h = unit(wo + wi)
        sin = np.hypot(h[:, 0], h[:, 1])
        c, s = (np.where(sin > 1e-12, x / np.maximum(sin, 1e-12), one) for x, one in ((h[:, 0], 1.0), (h[:, 1], 0.0)))
        flat = np.stack([c * wi[:, 0] + s * wi[:, 1], c * wi[:, 1] - s * wi[:, 0], wi[:, 2]], -1)  # h to azimuth 0
        d = np.stack([h[:, 2] * flat[:, 0] - sin * flat[:, 2], flat[:, 1], sin * flat[:, 0] + h[:, 2] * flat[:, 2]], -1)
        x = np.concatenate([np.stack([sin, 0 * sin, h[:, 2]], -1), d], 1)
        for kernel, bias in layers[:-1]:
            x = np.maximum(x @ kernel + bias, 0.0)
        return np.expm1(x @ layers[-1][0] + layers[-1][1])

    return f


def of(material: go.BSDF) -> BRDF:
    return lambda wo, wi: np.asarray(material.f(wo, wi, precision="float64"))


# --------------------------------------------------------------------------- figures


GRID = rusinkiewicz()
_, EYE, TO_LIGHTS = sphere(SIZE)


def card(name: str, fit: str) -> Card:
    """The measured values of one fit."""
    material = go.material(name, fit)
    wo = np.repeat(polar(np.radians(THETA), 0.35), POINTS, axis=0)
    i = np.arange(POINTS)[:, None]
    u = np.tile((i * np.array([0.8191725134, 0.6710436067, 0.5497004779]) + 0.5) % 1.0, (len(THETA), 1))
    drawn = material.sample(wo, u, precision="float64")
    weight = np.where(drawn.pdf[:, None] > 0.0, drawn.weight, 0.0).reshape(len(THETA), POINTS, 3)
    albedo = weight.mean(1)
    row, _ = np.unravel_index(np.argmax(albedo), albedo.shape)
    # trapezoidal rule in sin^2 theta, whose differential is 2 cos theta sin theta dtheta
    views = np.concatenate([[0.0], np.sin(np.radians(THETA)) ** 2, [1.0]])
    excess = np.maximum(albedo - 1.0, 0.0)
    excess = np.concatenate([excess[:1], excess, excess[-1:]])
    negative = np.minimum(weight, 0.0).mean(1).sum(1) / np.abs(weight).mean(1).sum(1)
    a, b = GRID[0][::7], GRID[1][::7]
    one, other = of(material)(a, b), of(material)(b, a)
    off = np.abs(one - other) / np.maximum(np.maximum(np.abs(one), np.abs(other)), 1e-9)
    found = quality.of(Subject(material, name))
    return Card(
        name,
        fit,
        float(albedo.max() - 1.0),
        float(THETA[row]),
        float(np.trapezoid(excess, views, axis=0).max()),
        float(max(-negative.min(), 0.0)),
        float(off.max()),
        None if found is None else found.cosine,
    )


def mapped(brdf: BRDF) -> Array:
    """Cube roots of f cos theta_i on the grid, flattened; their differences are roughly perceptually uniform."""
    wo, wi = GRID
    return np.cbrt(brdf(wo, wi) * wi[:, 2:]).ravel()


def picture(brdf: BRDF) -> Array:
    """sRGB values, from 0 to 1, of a sphere under three lights of irradiance pi, with shape (pixels of the ball, 3)."""
    return encoded(radiance(brdf, EYE, TO_LIGHTS))


def radiance(brdf: BRDF, eye: Array, to_lights: Array) -> Array:
    """Radiance of points of a sphere, from directions in their local frames."""
    total = np.zeros((len(eye), 3))
    for wi in to_lights:
        lit = wi[:, 2] > 0.0
        total[lit] += np.pi * brdf(eye[lit], wi[lit]) * wi[lit, 2:]
    return total


def encoded(total: Array) -> Array:
    """Linear values encoded as sRGB, 0 to 1."""
    total = np.clip(total, 0.0, 1.0)
    return np.where(total <= 0.0031308, 12.92 * total, 1.055 * total ** (1 / 2.4) - 0.055)


def apart(a: Array, b: Array) -> float:
    """|a - b| divided by the mean of |a| and |b|."""
    return float(2.0 * np.linalg.norm(a - b) / (np.linalg.norm(a) + np.linalg.norm(b)))


def rms(a: Array, b: Array) -> float:
    return float(np.sqrt(np.mean(np.square(a - b))))


# --------------------------------------------------------------------------- the page


def table(header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    header = list(header)
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows])


def short(value: float) -> str:
    return f"{value:.3g}"


def percent(value: float) -> str:
    return "0" if value < 5e-5 else f"{100.0 * value:.2g} %" if value < 10.0 else f"{value:.3g} x"


def summary(cards: list[Card]) -> str:
    rows = []
    for fit, one in library.published().items():
        mine = [c for c in cards if c.fit == fit]
        cosine = np.array([c.cosine for c in mine if c.cosine is not None])
        gains = sorted(mine, key=lambda c: -c.gain)
        rows.append(
            (
                f"`{fit}`",
                f"`{one.model}`",
                len(mine),
                sum(c.gain > 1e-3 for c in mine),
                sum(c.mean > 1e-3 for c in mine),
                f"{gains[0].material}, {short(1 + gains[0].gain)} at {gains[0].at:g}" if gains[0].gain > 1e-3 else "-",
                sum(c.negative > 1e-6 for c in mine),
                f"{short(float(cosine.min()))} / {short(float(np.median(cosine)))}",
            )
        )
    header = (
        "fit",
        "model",
        "materials",
        "energy gain at some view",
        "energy gain on average",
        "largest albedo, at view angle",
        "negative values",
    )
    return table((*header, "sampling efficiency, smallest / median"), rows)


def worst(cards: list[Card], count: int) -> str:
    rows = [
        (
            c.material,
            f"`{c.fit}`",
            f"{short(1.0 + c.gain)} at {c.at:g}",
            percent(c.mean),
            percent(c.negative),
        )
        for c in sorted(cards, key=lambda c: -c.severity)[:count]
    ]
    return table(("material", "fit", "largest albedo, at view angle", "average energy gain", "negative light"), rows)


class Material(NamedTuple):
    """All fits of a material: cube roots and pictures, keyed by fit; the key of the network is "network"."""

    name: str
    values: dict[str, Array]
    pictures: dict[str, Array]

    def distance(self, a: str, b: str) -> float:
        return apart(self.values[a], self.values[b])

    @property
    def spread(self) -> float:
        """Median distance between two fits of the material."""
        fits = [fit for fit in self.values if fit != "network"]
        return float(np.median([self.distance(a, b) for i, a in enumerate(fits) for b in fits[:i]]))


def brdfs_of(name: str, weights: dict[str, Array]) -> dict[str, BRDF]:
    brdfs = {fit: of(go.material(name, fit)) for fit in library.fits(name)}
    if f"{name}/kernel0" in weights:
        brdfs["network"] = network(weights, name)
    return brdfs


def side_by_side(name: str, weights: dict[str, Array]) -> Material:
    brdfs = brdfs_of(name, weights)
    return Material(name, {fit: mapped(f) for fit, f in brdfs.items()}, {fit: picture(f) for fit, f in brdfs.items()})


def figure_energy(cards: list[Card]) -> None:
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    axes = figure.subplots(1, 2)
    fits = list(library.published())
    for row, fit in enumerate(fits):
        mine = [c for c in cards if c.fit == fit]
        color = {"b": "#2b5d8a", "l": "#3f7d4f", "n": "#b3403a"}[fit[0]]
        axes[0].plot([1.0 + c.gain for c in mine], [row + 0.0] * len(mine), "|", color=color, markersize=9)
        ratios = [c.cosine for c in mine if c.cosine is not None]  # None if there is nothing to compare
        axes[1].plot(ratios, [row] * len(ratios), "|", color=color, markersize=9)
    axes[0].axvline(1.0, color="0.5", lw=0.8)
    axes[1].axvline(1.0, color="0.5", lw=0.8)
    axes[0].set(xscale="log", xlabel="largest albedo over the views (1: all light)", yticks=range(len(fits)))
    axes[0].set_yticklabels(fits)
    axes[1].set(xscale="log", xlabel="variance of cosine sampling over its own", yticks=[])
    for axis in axes:
        axis.invert_yaxis()
        axis.tick_params(labelsize=8)
        axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(FOLDER / "energy.svg", metadata={"Date": None})


def smooth_sphere(brdf: BRDF) -> Array:
    """sRGB values of a sphere on white, with shape (BALL, BALL, 3); each pixel is the mean of several samples."""
    inside, eye, to_lights = sphere(BALL * OVERSAMPLING)
    fine = np.ones((*inside.shape, 3))
    fine[inside] = np.clip(radiance(brdf, eye, to_lights), 0.0, 1.0)
    return encoded(fine.reshape(BALL, OVERSAMPLING, BALL, OVERSAMPLING, 3).mean((1, 3)))


def figure_spheres(path: Path, names: list[str], weights: dict[str, Array]) -> None:
    """Draw a sheet with one column per material; the row of the network is above those of the fits."""
    fits = ["network", *library.published()]
    dpi, width, label, head = 100, 1280, 320, 112  # pixels
    height = head + len(fits) * BALL + 4
    figure = Figure(figsize=(width / dpi, height / dpi), dpi=dpi, facecolor="white")
    for column, name in enumerate(names):
        left = label + column * (width - label) / len(names)
        brdfs = brdfs_of(name, weights)
        text = {"fontsize": 17.5, "ha": "center", "va": "center", "linespacing": 1.0}
        figure.text((left + BALL / 2) / width, 1.0 - head / 2 / height, name.replace("-", "-\n"), **text)
        for row, fit in enumerate(fits):
            if fit in brdfs:
                bottom = height - head - (row + 1) * BALL
                axes = figure.add_axes((left / width, bottom / height, BALL / width, BALL / height))
                axes.imshow(smooth_sphere(brdfs[fit]), interpolation="nearest")
                axes.set_axis_off()
    for row, fit in enumerate(fits):
        middle = height - head - (row + 0.5) * BALL
        words = "network\n(reference)" if fit == "network" else fit.replace("/", "\n")
        figure.text(12 / width, middle / height, words, fontsize=20.0, va="center", linespacing=1.1)
    figure.savefig(path, pil_kwargs={"quality": 88, "optimize": True, "progressive": True})


def scales() -> str:
    """Medians of the ratio of diffuse colors in Ngan's fits to those in Low's, over all non-black materials."""
    fits = library.published()
    low = fits["low2012/cooktorrance_E1"].materials
    rows = []
    for name, fit in fits.items():
        if not name.startswith("ngan2005"):
            continue
        pairs = [(np.array(fit.materials[m]["diffuse"]), np.array(low[m]["diffuse"])) for m in fit.materials]
        ratio = np.array([a / b for a, b in pairs if a.min() > 0.005 and b.min() > 0.02])
        _, green, blue = np.median(ratio / ratio[:, :1], axis=0)
        rows.append((f"`{name}`", len(ratio), f"{green:.3f}", f"{blue:.3f}"))
    return table(
        ("fit", "materials", f"green / red (1 / 1.15 = {1 / 1.15:.3f})", f"blue / red (1 / 1.66 = {1 / 1.66:.3f})"),
        rows,
    )


def rescaled(materials: list[Material]) -> tuple[float, float]:
    """Median distance between Ngan's and other fits of the same material, without and with MERL's scale factors."""
    factor = np.cbrt(np.array([1.0, 1.15, 1.66]))
    plain, mended = [], []
    for m in materials:
        for a in (fit for fit in m.values if fit.startswith("ngan2005")):
            scaled = (m.values[a].reshape(-1, 3) * factor).ravel()
            for b in (fit for fit in m.values if not fit.startswith("ngan2005") and fit != "network"):
                plain.append(m.distance(a, b))
                mended.append(apart(scaled, m.values[b]))
    return float(np.median(plain)), float(np.median(mended))


def strangers(materials: list[Material]) -> float:
    """Median distance between Bagher's fits of two different materials."""
    values = [m.values[library.DEFAULT] for m in materials]
    return float(np.median([apart(a, b) for i, a in enumerate(values) for b in values[:i]]))


def generations(materials: list[Material]) -> str:
    fits = list(library.published())
    rows = []
    for a in fits:
        row = [f"`{a}`"]
        for b in fits:
            both = [m.distance(a, b) for m in materials if a in m.values and b in m.values]
            row.append("-" if a == b else f"{float(np.median(both)):.2f}")
        rows.append(row)
    return table(
        ("", *(str(i + 1) for i in range(len(fits)))), [(f"{i + 1} {r[0]}", *r[1:]) for i, r in enumerate(rows)]
    )


def networks(materials: list[Material]) -> str:
    with_network = [m for m in materials if "network" in m.values]
    rows = []
    for m in with_network:
        fits = {fit: m.distance(fit, "network") for fit in m.values if fit != "network"}
        best = min(fits, key=lambda fit: fits[fit])
        image = rms(m.pictures[best], m.pictures["network"])
        rows.append(
            (
                m.name,
                f"`{best}`",
                f"{fits[best]:.2f}",
                f"{fits[library.DEFAULT]:.2f}",
                f"{float(np.median(list(fits.values()))):.2f}",
                f"{image:.3f} / {rms(m.pictures[library.DEFAULT], m.pictures['network']):.3f}",
            )
        )
    header = "material", "nearest fit", "distance of the nearest fit", "distance of Bagher's fit"
    return table((*header, "median distance of all fits", "RMS difference, nearest / Bagher's"), rows)


def spreads(materials: list[Material], count: int) -> str:
    rows = []
    for m in sorted(materials, key=lambda m: -m.spread)[:count]:
        fits = [fit for fit in m.values if fit != "network"]
        pairs = {(a, b): m.distance(a, b) for i, a in enumerate(fits) for b in fits[:i]}
        a, b = max(pairs, key=lambda pair: pairs[pair])
        image = float(np.median([rms(m.pictures[x], m.pictures[y]) for x, y in pairs]))
        rows.append((m.name, f"{m.spread:.2f}", f"{image:.3f}", f"{pairs[a, b]:.2f}: `{a}`, `{b}`"))
    return table(("material", "median distance", "median RMS difference", "largest distance"), rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--networks", type=Path)
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    start = time.perf_counter()
    wanted = given.only.split(",") if given.only else list(library.published())
    cards = [card(name, fit) for fit in wanted for name in sorted(library.published()[fit].materials)]
    seconds = time.perf_counter() - start
    print(worst(cards, 20))
    print(f"{len(cards)} cards in {seconds:.0f} s")
    if given.only or given.networks is None:
        return
    with np.load(given.networks) as data:
        weights = {key: np.asarray(data[key], float) for key in data.files}
    materials = [side_by_side(name, weights) for name in library.materials()]
    FOLDER.mkdir(exist_ok=True)
    kept: list[dict[str, Any]] = [
        {key: float(f"{v:.5g}") if isinstance(v, float) else v for key, v in c._asdict().items()} for c in cards
    ]
    (FOLDER / "cards.json").write_text("[\n" + ",\n".join(json.dumps(one) for one in kept) + "\n]\n")
    figure_energy(cards)
    order = sorted((m for m in materials if "network" in m.values), key=lambda m: -m.spread)
    for number, names in enumerate(np.array_split([m.name for m in order], SHEETS), 1):
        figure_spheres(FOLDER / f"spheres-{number}.jpg", [str(name) for name in names], weights)
    text = (HERE / "published-fits" / "template.txt").read_text()
    parts = {
        "COUNT": str(len(cards)),
        "SUMMARY": summary(cards),
        "WORST": worst([c for c in cards if c.severity > 1e-6], 40),
        "GENERATIONS": generations(materials),
        "SPREADS": spreads(materials, 20),
        "SCALES": scales(),
        "PLAIN": f"{rescaled(materials)[0]:.2f}",
        "MENDED": f"{rescaled(materials)[1]:.2f}",
        "STRANGERS": f"{strangers(materials):.2f}",
        "SPREAD": f"{float(np.median([m.spread for m in materials])):.2f}",
        "GAINS": str(sum(c.gain > 1e-3 for c in cards)),
        "RECIP": f"{max(c.recip for c in cards):.0e}",
        "DARK": str(
            sum(
                library.published()["ngan2005/he"].materials[m]["eta"] == 1.0
                for m in library.published()["ngan2005/he"].materials
            )
        ),
        "BELOW": str(sum(c.cosine is not None and c.cosine < 1.0 for c in cards)),
        "NETWORKS": networks(materials),
    }
    for key, part in parts.items():
        text = text.replace("{" + key + "}", part)
    (HERE / "published-fits.md").write_text(text)
    print(f"all in {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
