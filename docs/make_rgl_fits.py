"""Write docs/rgl-fits.md and its pictures: fits to the measured files of the RGL database (Dupuy2018).

    python docs/make_rgl_fits.py FOLDER [-o docs]

FOLDER contains the .bsdf files, which are not part of the repository. benchmarks/rgl_fits.py computes the errors; those
that are already stored in rgl-fits/fits.json are not recomputed.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import gonio as go
import numpy as np
from gonio.fitting.data import Data, data_of
from gonio.fitting.fit import Fit
from gonio.measure import read
from make_published_fits import BALL, BRDF, OVERSAMPLING, Array, encoded, of, radiance, sphere, table
from matplotlib.figure import Figure

HERE = Path(__file__).parent
sys.path.append(str(HERE.parent / "benchmarks"))
import rgl_fits as errors  # noqa: E402

SHOWN = (
    "lambert", "conductor", "cook-torrance", "disney", "lambert+ggx", "lambert+ggx+ggx",
)  # fmt: skip
VALUES = 6000  # number of values of each file to which all models are fitted
BRIGHT = 0.9  # linear value of the brightest pixels of a measured ball, excluding the highlight
MARGIN, HEAD, LABEL = 6, 30, 84  # pixels


class File(NamedTuple):
    """A measured file, all of its values, and the fits to a sample of them."""

    name: str
    measured: go.BSDF
    data: Data
    fits: dict[str, Fit]

    @property
    def title(self) -> str:
        return self.name.removesuffix("_rgb").replace("_", " ")


# --------------------------------------------------------------------------- pictures


def ball(brdf: BRDF, size: int) -> Array:
    """Linear radiance of a sphere under three lights, with shape (size, size, samples, 3); nan outside the sphere."""
    inside, eye, to_lights = sphere(size * OVERSAMPLING)
    fine = np.full((*inside.shape, 3), np.nan)
    fine[inside] = radiance(brdf, eye, to_lights)
    blocks = fine.reshape(size, OVERSAMPLING, size, OVERSAMPLING, 3).swapaxes(1, 2)
    return blocks.reshape(size, size, OVERSAMPLING**2, 3)


def shown(samples: Array, gain: float) -> Array:
    """sRGB values of a ball on a white background."""
    return encoded(np.nan_to_num(np.clip(gain * samples, 0.0, 1.0), nan=1.0).mean(2))


def difference(fitted: Array, measured: Array, gain: float) -> Array:
    """Half the difference of sRGB values, added to gray: bright where the fit is brighter; white around the ball."""
    around = np.isnan(measured[..., 0]).mean(2)[..., None]
    gray = 0.5 + 0.5 * (shown(fitted, gain) - shown(measured, gain))
    return np.asarray((1.0 - around) * gray + around)


def draw(file: File, path: Path, size: int = BALL) -> None:
    """Draw a sheet: the measured ball, then one column per model, with the fit above its difference from the data."""
    truth = ball(of(file.measured), size)
    gain = BRIGHT / max(float(np.nanpercentile(truth, 95.0)), 1e-6)
    width = 2 * MARGIN + (1 + len(file.fits)) * size
    height = HEAD + 2 * size + MARGIN
    figure = Figure(figsize=(width / 100, height / 100), dpi=100, facecolor="white")

    def put(picture: Array, column: int, row: int) -> None:
        left, bottom = MARGIN + column * size, height - HEAD - (row + 1) * size
        axes = figure.add_axes((left / width, bottom / height, size / width, size / height))
        axes.imshow(np.clip(picture, 0.0, 1.0), interpolation="nearest")
        axes.set_axis_off()

    def label(text: str, column: float, y: float) -> None:
        x = (MARGIN + (column + 0.5) * size) / width
        figure.text(x, y / height, text, fontsize=10.5, ha="center", va="center", linespacing=1.3)

    put(shown(truth, gain), 0, 0)
    label("measured", 0, height - HEAD / 2)
    label("difference\n(fit - measured,\ngray: none)", 0, MARGIN + 0.5 * size)
    for column, (model, fit) in enumerate(file.fits.items(), 1):
        fitted = ball(of(fit.material), size)
        put(shown(fitted, gain), column, 0)
        put(difference(fitted, truth, gain), column, 1)
        label(model, column, height - HEAD / 2)
    figure.savefig(path, pil_kwargs={"quality": 82, "method": 6})


# --------------------------------------------------------------------------- tables


def of_data(files: Sequence[File]) -> str:
    """Table of the number of values in each file, and of negative and excluded ones."""
    rows = []
    for file in files:
        data = file.data
        share = " / ".join(f"{100.0 * n / len(data):.2g}" for n in data.negative)
        left = ", ".join(f"{count:,} {why}" for why, count in data.out.items()) or "0"
        rows.append((file.title, f"{3 * len(data):,}", f"{int(data.negative.sum()):,}", share, left))
    header = "file", "values", "negative values", "negative, % of red / green / blue", "excluded directions"
    return table(header, rows)


def of_errors(rows: Sequence[dict[str, Any]], names: Sequence[str]) -> str:
    """Table of the errors, one row per model, with the smallest error for each file in bold."""
    found = {(row["model"], row["file"]): row["error"] for row in rows}
    medians = {m: float(np.median([found[m, name] for name in names])) for m in {row["model"] for row in rows}}
    models = sorted(medians, key=lambda m: (medians[m], m))
    least = {name: min(found[m, name] for m in models) for name in names}

    def cell(model: str, name: str) -> str:
        text = f"{found[model, name]:.2f}"
        return f"**{text}**" if found[model, name] == least[name] else text

    header = ["model", *(name.removesuffix("_rgb").replace("_", " ") for name in names)]
    return table(header, [(f"`{m}`", *(cell(m, name) for name in names)) for m in models])


def of_starts(rows: Sequence[dict[str, Any]]) -> str:
    """Table of the largest and smallest excess error per model, relative to the best random start."""
    models = list(dict.fromkeys(row["model"] for row in rows if row["excess"] is not None))
    lines = []
    for model in models:
        mine = [row for row in rows if row["model"] == model]
        worst, best = max(mine, key=lambda row: row["excess"]), min(mine, key=lambda row: row["excess"])
        lines.append((f"`{model}`", len(mine), *(f"{100.0 * row['excess']:+.2f} %" for row in (worst, best))))
    return table(("model", "files", "largest excess", "smallest excess"), lines)


# --------------------------------------------------------------------------- the page


def fitted(path: Path, models: Sequence[str], values: int = VALUES) -> File:
    """The fits of the given models to a sample of `values` values of a file."""
    cells = data_of(read(path), where=str(path))
    fits = {model: go.fit(cells.some(values), model) for model in models}
    return File(path.stem, go.Measured(str(path)), cells, fits)


def page(files: Sequence[File], rows: Sequence[dict[str, Any]], template: str) -> str:
    """The text of the page."""
    judged = [row["excess"] for row in rows if row["excess"] is not None]
    sheets = [f"![{f.title}: measured, fits and differences](rgl-fits/{f.name}.webp)" for f in files]
    parts = {
        "FILES": str(len(files)),
        "MODELS": str(len({row["model"] for row in rows})),
        "VALUES": f"{VALUES:,}",
        "STARTS": str(errors.STARTS),
        "JUDGED": str(len(judged)),
        "WORST": f"{100.0 * max(judged):.2f}",
        "BETTER": str(sum(excess < -0.01 for excess in judged)),
        "DATA": of_data(files),
        "ERRORS": of_errors(rows, [file.name for file in files]),
        "RANDOM": of_starts(rows),
        "SHEETS": "\n\n".join(f"{f.title}\n\n{sheet}" for f, sheet in zip(files, sheets, strict=True)),
    }
    for key, part in parts.items():
        template = template.replace("{" + key + "}", part)
    return template


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=HERE)
    given = parser.parse_args()
    paths, folder = errors.files_in(given.folder), given.output / "rgl-fits"
    folder.mkdir(exist_ok=True)
    stored = folder / "fits.json"
    known = json.loads(stored.read_text()) if stored.exists() else []
    models = (*errors.JUDGED, *errors.OTHERS)
    rows = list(errors.rows_of(paths, models, known, VALUES, errors.STARTS))
    errors.write(stored, rows)
    files = []
    for path in paths:
        files.append(fitted(path, SHOWN))
        draw(files[-1], folder / f"{path.stem}.webp")
        print(path.stem, flush=True)
    text = page(files, rows, (HERE / "rgl-fits" / "template.txt").read_text())
    (given.output / "rgl-fits.md").write_text(text)


if __name__ == "__main__":
    main()
