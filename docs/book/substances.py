"""Pages of the substances, with plots of n and k, and of the named materials, with all their fits."""

from __future__ import annotations

import io

import gonio as go
import numpy as np
from gonio.catalog import library
from matplotlib.figure import Figure

from .text import escaped, table

WAVELENGTHS = np.arange(380.0, 781.0, 5.0)


def pages() -> dict[str, str | bytes]:
    """The two pages, and a plot for each substance."""
    made: dict[str, str | bytes] = {"reference/substances/materials.md": _materials()}
    lines = [
        "# Substances",
        "",
        'To use a refractive index by name, write `eta="bk7"` in a dielectric, `preset="Au"` in a conductor, or '
        "`go.refractive_index(name, wavelength)` in Python. The plots cover the visible spectrum, 380 to 780 nm.",
        "",
    ]
    for name, constants in go.indices().items():
        made[f"reference/substances/{name}.svg"] = _curve(name)
        lines += [
            f"## {name}", "",
            f"{constants.title[:1].upper()}{constants.title[1:]}. Source: {escaped(constants.source)}. "
            f"Range: {_range(constants.curve.low, constants.curve.high)}.", "",
            f"![n and k of {name}]({name}.svg)", "",
        ]  # fmt: skip
    made["reference/substances/index.md"] = "\n".join(lines)
    return made


def _range(low: float, high: float) -> str:
    return f"{low:g} to {high:g} nm" if np.isfinite(high) else "all wavelengths"


def _curve(name: str) -> bytes:
    values = go.refractive_index(name, list(WAVELENGTHS), outside="level")
    figure = Figure(figsize=(6.4, 2.4), layout="constrained")
    axes = figure.subplots()
    axes.plot(WAVELENGTHS, values.eta, color="#1f5fa8", label="n")
    if np.any(np.asarray(values.k) > 1e-6):
        axes.plot(WAVELENGTHS, values.k, color="#c2571a", label="k")
    axes.set(xlabel="wavelength, nm", xlim=(380, 780))
    axes.legend(frameon=False)
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()


def _materials() -> str:
    rows = [(f"`{name}`", ", ".join(f"`{fit}`" for fit in go.fits(name))) for name in go.materials()]
    return "\n".join(
        [
            "# Named materials",
            "",
            f"There are {len(rows)} named materials, each with published fits to MERL measurements. Use a name as in "
            f'`gonio render {go.materials()[0]} -o a.png` or `go.material("{go.materials()[0]}")`. The default fit is '
            f"`{library.DEFAULT}`; to select another one, write "
            "`NAME:FILE/FIT`. See [how accurate the fits are](../../published-fits.md).",
            "",
            table(("material", "fits"), rows),
            "",
        ]
    )
