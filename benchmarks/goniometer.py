"""The virtual gonioreflectometer compared with theory, and its speed.

python benchmarks/goniometer.py [gaussian|grooves|later|speed ...]      --pictures FOLDER also draws (docs/images)

gaussian  a Gaussian surface of mirrors against Beckmann's D and Smith's G
grooves   V-grooves of Lambertian facets against Oren-Nayar
later     the second and later bounces in gold against the Kulla-Conty lobe
speed     rays per second, and a table of MERL's size
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import gonio as go
import matplotlib
import numpy as np
from gonio.instruments.goniometer.run import DETECTOR, Readout
from gonio.instruments.goniometer.specimen import Model
from gonio.measure.tables.angles import pairs
from gonio.viewer import figures
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

matplotlib.use("Agg")
Floats = NDArray[np.float64]
LIGHTS = (0.0, 30.0, 60.0)
VIEWS = np.arange(0.0, 88.0, 2.5)
AZIMUTHS = np.arange(0.0, 181.0, 5.0)
PLANE = (0.0, 180.0)  # azimuths of the plane of incidence: on the light's side, and opposite
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def measured(surface: str, facet: str, rays: int, patches: int = 16, bounces: str = "all") -> Readout:
    found = go.measure(
        surface=surface,
        facet=facet,
        theta_i=LIGHTS,
        theta_r=VIEWS,
        phi=AZIMUTHS,
        samples=rays,
        patches=patches,
        bounces=bounces,
    )
    rate = found.rays / found.seconds / 1e6
    print(f"{surface} of {facet}: {found.rays / 1e6:.0f} M rays, {found.seconds:.0f} s, {rate:.2f} M rays/s")
    return found


def intensity(values: Floats) -> Floats:
    """f cos theta_r, which the detector receives, from values (theta_i, theta_r, phi, channel)."""
    return values * np.cos(np.radians(VIEWS))[None, :, None, None]


def of_model(model: go.BSDF) -> Floats:
    """f of a model at the same angles, measured by the same detector."""
    axes = [np.radians(axis) for axis in (LIGHTS, VIEWS, AZIMUTHS)]
    return Model(model, DETECTOR).f(*pairs(*axes)).reshape(*map(len, axes), 3)


def slices(values: Floats) -> tuple[Floats, Floats]:
    """Viewing angles from -87.5 to 87.5 degrees, positive opposite the light, and values (theta_i, view, channel)."""
    back, ahead = values[:, ::-1, 0], values[:, :, -1]
    return np.concatenate([-VIEWS[::-1], VIEWS[1:]]), np.concatenate([back, ahead[:, 1:]], axis=1)


def save(figure: Figure, folder: Path | None, name: str) -> None:
    if folder is not None:
        print("   ", figures.Drawing(figure, name).save(folder / name).path)


def sheet(columns: int, height: float = 3.6) -> tuple[Figure, list]:
    from matplotlib.figure import Figure as Sheet

    figure = Sheet(figsize=(3.6 * columns, height), layout="constrained")
    return figure, list(figure.subplots(1, columns))


def page(rows: int, columns: int, height: float) -> tuple[Figure, NDArray]:
    """A figure as wide as a page of the documentation, 1,280 pixels."""
    from matplotlib.figure import Figure as Sheet

    figure = Sheet(figsize=(1280 / 150, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, sharex="col" if rows > 1 and columns == 3 else False)


def lines(axis: object, x: Floats, theory: dict[str, Floats], points: Floats, error: Floats, label: str) -> None:
    for (name, y), dashes, colour in zip(theory.items(), ("-", figures.DASHES, ":"), figures.PALETTE, strict=False):
        axis.plot(x, y, linestyle=dashes, color=colour, lw=1.5, label=name)  # type: ignore[attr-defined]
    axis.errorbar(x, points, 2.0 * error, fmt="o", ms=2.6, lw=0.8, color=figures.INK, label=label)  # type: ignore[attr-defined]
    axis.set_xlabel("angle of view [degrees]")  # type: ignore[attr-defined]
    axis.set_xlim(-90.0, 90.0)  # type: ignore[attr-defined]
    axis.set_ylim(bottom=0.0)  # type: ignore[attr-defined]
    axis.grid(True)  # type: ignore[attr-defined]


# ---------------------------------------------------------------------- the three comparisons


def gaussian(folder: Path | None) -> None:
    found = measured("gaussian:alpha=.3", "mirror", 4_000_000, 128)
    first = intensity(found.table.beside["first"])
    error = intensity(found.table.beside["error"])
    theory = {}
    for masking in ("smith-correlated", "smith-separable-exact"):
        model = go.Conductor(alpha=0.3, ndf="beckmann", masking=masking, fresnel="one")
        theory[masking] = intensity(of_model(model))
        print(f"  first bounce against Beckmann with {masking}; f cos theta_r, views to 87.5 degrees, all azimuths")
        for light, a, b, s in zip(LIGHTS, first, theory[masking], error, strict=True):
            off = np.abs(a - b)
            row, column = np.unravel_index(off[..., 0].argmax(), off.shape[:2])
            peak, place = b.max() / 100.0, f"view {VIEWS[row]:g}, azimuth {AZIMUTHS[column]:g}"
            print(
                f"    light {light:2.0f}: worst {off.max() / peak:.2f} % of the peak, at {place}; rms "
                f"{np.sqrt(np.mean(off**2)) / peak:.2f} %; standard error there {s[row, column, 0] / peak:.2f} %, at "
                f"the peak {s.max() / peak:.2f} %"
            )
    for light, one, later, lost in zip(LIGHTS, found.first, found.later, found.lost, strict=True):
        print(f"    light {light:2.0f}: energy of all bounces {one + later:.6f}, first {one:.5f}, lost {lost:.1e}")
    with matplotlib.rc_context(figures.STYLE):
        figure, axes = page(2, 3, 5.6)
        x, points = slices(first)
        _, spread = slices(error)
        of_theory = {f"Beckmann, {name}": slices(values)[1] for name, values in theory.items()}
        for k, (above, below) in enumerate(axes.T):
            mine = {name: values[k, :, 0] for name, values in of_theory.items()}
            lines(above, x, mine, points[k, :, 0], spread[k, :, 0], "measured, first bounce")
            above.set_title(f"light at {LIGHTS[k]:g} degrees", fontsize=11)
            above.set_xlabel("")
            model = mine["Beckmann, smith-correlated"]
            off, bars = points[k, :, 0] - model, 2.0 * spread[k, :, 0]
            share = 100.0 / model.max()
            below.errorbar(x, share * off, share * bars, fmt="o", ms=2.6, lw=0.8, color=figures.INK)
            below.axhline(0.0, color=figures.INK, lw=0.8)
            below.set_xlabel("angle of view [degrees]")
            below.set_ylim(-3.0, 3.0)
            below.grid(True)
        axes[0, 0].set_ylabel("f cos theta_r [1/sr]")
        axes[1, 0].set_ylabel("measured - correlated\n[% of the peak]")
        names = ["Beckmann, correlated", "Beckmann, separable", "measured, first bounce (bars: 2 standard errors)"]
        handles = axes[0, 0].get_legend_handles_labels()[0]
        figure.legend(handles, names, loc="outside lower center", ncols=3, fontsize=10)
        figure.suptitle("A Gaussian surface of mirrors, alpha = 0.3, in the plane of incidence", fontsize=12)
        save(figure, folder, "goniometer-gaussian.png")


def oren_nayar(albedo: float, sigma: float) -> tuple[Floats, Floats]:
    """f at our angles by the functional approximation of OrenNayar1994, sec. 4.3, for one bounce and for two."""
    i, r, phi = np.meshgrid(*(np.radians(axis) for axis in (LIGHTS, VIEWS, AZIMUTHS)), indexing="ij")
    a, b, c, s2 = np.maximum(i, r), np.minimum(i, r), np.cos(phi), sigma * sigma
    c1 = 1.0 - 0.5 * s2 / (s2 + 0.33)
    c2 = 0.45 * s2 / (s2 + 0.09) * np.where(c >= 0.0, np.sin(a), np.sin(a) - (2.0 * b / np.pi) ** 3)
    c3 = 0.125 * s2 / (s2 + 0.09) * (4.0 * a * b / np.pi**2) ** 2
    one = albedo / np.pi * (c1 + c * c2 * np.tan(b) + (1.0 - np.abs(c)) * c3 * np.tan(0.5 * (a + b)))
    two = 0.17 * albedo**2 / np.pi * s2 / (s2 + 0.13) * (1.0 - c * (2.0 * b / np.pi) ** 2)
    return one, two


def grooves(folder: Path | None) -> None:
    albedo, sigma = 0.8, 0.5
    found = measured(f"vgroove:sigma={sigma}", f"lambert:albedo={albedo}", 16_000_000)
    every, first = found.table.values[..., 0], found.table.beside["first"][..., 0]  # type: ignore[attr-defined]
    error = found.table.beside["error"][..., 0]
    one, two = oren_nayar(albedo, sigma)
    qualitative = of_model(go.OrenNayar(albedo=albedo, sigma=sigma))[..., 0]
    lambert = albedo / np.pi
    seen = VIEWS <= 75.0

    def off(a: Floats, b: Floats, k: int) -> str:
        part = (a - b)[k, seen] / (0.01 * lambert)
        return f"mean {part.mean():+.1f} %, rms {np.sqrt(np.mean(part**2)):.1f} %, worst {np.abs(part).max():.1f} %"

    print(f"  sigma {sigma}, albedo {albedo}; measured - theory as shares of albedo / pi, views to 75 degrees")
    for k, light in enumerate(LIGHTS):
        print(f"    light {light:2.0f}: first bounce against the full expression: {off(first, one, k)}")
        print(f"              all against the full one with interreflection: {off(every, one + two, k)}")
        print(f"              all against Gonio's oren-nayar (qualitative):   {off(every, qualitative, k)}")
        print(f"              later bounces {100.0 * found.later[k] / found.first[k]:.1f} % of the first")
    with matplotlib.rc_context(figures.STYLE):
        figure, axes = sheet(3)
        x, points = slices(every[..., None])
        _, spread = slices(error[..., None])
        _, single = slices(first[..., None])
        theory = {
            "Oren-Nayar, full, two bounces": one + two,
            "gonio oren-nayar (qualitative)": qualitative,
            "Oren-Nayar, full, one bounce": one,
        }
        for k, axis in enumerate(axes):
            mine = {name: slices(values[..., None])[1][k, :, 0] for name, values in theory.items()}
            lines(axis, x, mine, points[k, :, 0], spread[k, :, 0], "measured, all bounces")
            axis.plot(x, single[k, :, 0], "o", ms=2.6, mfc="none", mec=figures.SOFT, mew=0.7, label="measured, first")
            axis.set_title(f"light at {LIGHTS[k]:g} degrees", fontsize=10)
            axis.set_ylim(0.0, 0.52)
        axes[0].set_ylabel("f [1/sr]")
        axes[0].legend(fontsize=7, loc="lower center")
        figure.suptitle(
            f"V-grooves of Lambertian facets, sigma = {sigma}, albedo {albedo} (negative: on the light's side)",
            fontsize=11,
        )
        save(figure, folder, "goniometer-grooves.png")


def energy(f: Floats) -> Floats:
    """Fractions of the light by channel, (theta_i, 3): int f cos theta_r dw over the measured views."""
    weight = (np.cos(np.radians(VIEWS)) * np.sin(np.radians(VIEWS)))[None, :, None, None]
    step = np.radians(VIEWS[1] - VIEWS[0])
    return 2.0 * np.pi * step * np.sum(np.mean(f, axis=2, keepdims=True) * weight, axis=(1, 2))


def later(folder: Path | None) -> None:
    alpha = 1.0
    gold = go.Conductor.preset("Au", alpha=alpha, ndf="beckmann")
    white = go.Conductor(alpha=alpha, ndf="beckmann", fresnel="one")
    facets = {"white": "mirror", "gold": "conductor:Au"}
    found = {name: measured(f"gaussian:alpha={alpha}", facet, 4_000_000, 64, "later") for name, facet in facets.items()}
    rest = {name: one.table.values for name, one in found.items()}  # type: ignore[attr-defined]
    added = {
        "white": of_model(go.KullaConty(white)) - of_model(white),
        "bounce": of_model(go.KullaConty(gold, color="bounce")) - of_model(gold),
        "sheet": of_model(go.KullaConty(gold, color="sheet")) - of_model(gold),
    }
    print(f"  alpha {alpha}; energy of later bounces of mirrors, and 1 - E, which Kulla-Conty adds")
    albedo = np.asarray(go.albedo(white, mu=np.cos(np.radians(LIGHTS))).value).reshape(len(LIGHTS), -1)[:, 0]
    for k, light in enumerate(LIGHTS):
        print(f"    light {light:2.0f}: {found['white'].later[k]:.4f}, {1.0 - albedo[k]:.4f}")
    print("  colour: later bounces of gold over those of mirrors, red green blue; and f_add")
    ratio = energy(rest["gold"]) / energy(rest["white"])
    own = {name: energy(added[name]) / energy(added["white"]) for name in ("bounce", "sheet")}
    for k, light in enumerate(LIGHTS):
        words = ", ".join(f"{name} {np.round(values[k], 3)}" for name, values in own.items())
        print(f"    light {light:2.0f}: measured {np.round(ratio[k], 3)}, {words}")
    print("  shape, both of energy 1: rms of measured - Kulla-Conty as a share of the mean; f cos theta_r at view 60")
    across = int(np.argmin(np.abs(VIEWS - 60.0)))
    for k, light in enumerate(LIGHTS):
        a, b = (intensity(f)[k, ..., 0] / energy(f)[k, 0] for f in (rest["white"], added["white"]))
        rms = 100.0 * np.sqrt(np.mean((a - b) ** 2)) / b.mean()
        back, ahead = a[across, 0], a[across, -1]
        print(
            f"    light {light:2.0f}: rms {rms:.0f} %; on the light's side {back:.3f}, across {ahead:.3f}, Kulla-Conty "
            f"{b[across, 0]:.3f} on both"
        )
    with matplotlib.rc_context(figures.STYLE):
        figure, axes = page(2, 2, 7.0)
        x, points = slices(intensity(rest["gold"]))
        _, spread = slices(intensity(found["gold"].table.beside["error"]))
        _, theory = slices(intensity(added["bounce"]))
        names = ("red", "green", "blue")
        for k, axis in enumerate(axes.flat[:3]):
            for channel, (colour, name) in enumerate(zip(figures.CHANNELS, names, strict=True)):
                axis.plot(x, theory[k, :, channel], color=colour, lw=1.5, label=f"Kulla-Conty, {name}")
                points_, bars = points[k, :, channel], 2.0 * spread[k, :, channel]
                axis.errorbar(x, points_, bars, fmt="o", ms=2.8, lw=0.8, color=colour, label=f"measured, {name}")
            axis.set_title(f"light at {LIGHTS[k]:g} degrees", fontsize=11)
            axis.set_xlabel("angle of view [degrees]")
            axis.set_ylabel("f cos theta_r [1/sr]")
            axis.set_xlim(-90.0, 90.0)
            axis.set_ylim(bottom=0.0)
            axis.grid(True)
        last = axes.flat[3]
        for row, values in enumerate((ratio[0], own["bounce"][0], own["sheet"][0])):
            style = {"alpha": (1.0, 0.6, 0.25)[row], "hatch": ("", "", "//")[row], "edgecolor": figures.INK, "lw": 0.8}
            place = np.arange(3) + 0.27 * (row - 1)
            last.bar(place, values, 0.25, color=figures.CHANNELS, **style)
            words = ("measured", "bounce", "sheet")[row]
            for x_, value in zip(place, values, strict=True):
                last.text(x_, value + 0.015, words, rotation=90, ha="center", va="bottom", fontsize=9)
        last.set_xticks(range(3), names)
        last.set_ylim(0.0, 1.3)
        last.set_ylabel("light of gold over that of mirrors")
        last.set_title("color of later bounces, light at 0", fontsize=11)
        handles, words_ = axes[0, 0].get_legend_handles_labels()
        order = (0, 3, 1, 4, 2, 5)  # one column per color
        figure.legend(
            [handles[i] for i in order], [words_[i] for i in order], loc="outside lower center", ncols=3, fontsize=10
        )
        figure.suptitle(f"Second and later bounces on a Gaussian surface of gold, alpha = {alpha:g}", fontsize=12)
        save(figure, folder, "goniometer-later.png")


def speed(folder: Path | None) -> None:
    with tempfile.TemporaryDirectory() as place:
        for surface, facet in (("gaussian", "mirror"), ("vgroove", "lambert"), ("spheres", "conductor:Au")):
            begun = time.process_time()
            found = go.measure(surface=surface, facet=facet, output=f"{place}/a.binary")
            busy = time.process_time() - begun
            error = f"standard error {100.0 * found.error:.2g} % in the median" if found.error else ""
            print(
                f"  {surface} of {facet} as MERL, {found.cells} cells, {len(found.incidence)} angles of light: "
                f"{found.rays / 1e6:.0f} M rays, {found.seconds:.0f} s, {busy:.0f} s of a core; "
                f"{error}"
            )


PARTS: dict[str, Callable[[Path | None], None]] = {
    "gaussian": gaussian,
    "grooves": grooves,
    "later": later,
    "speed": speed,
}


def main() -> None:
    words = sys.argv[1:]
    folder = None
    if "--pictures" in words:
        at = words.index("--pictures")
        folder = Path(words[at + 1])
        del words[at : at + 2]
    for name in words or PARTS:
        PARTS[name](folder)


if __name__ == "__main__":
    main()
