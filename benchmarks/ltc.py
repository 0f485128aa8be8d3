"""Linearly transformed cosines of GGX: Gonio's fit and the published one, by the same metrics.

python benchmarks/ltc.py web/node_modules/three/examples/jsm/lights/RectAreaLightTexturesLib.js

The file holds the tables of the authors of Heitz2016a, 64 x 64. The two fits are compared with the lobe itself, by sums
over it: L3, which the paper minimizes; the fraction of light in wrong directions; integrals over 1,024 rectangles.

    python benchmarks/ltc.py --anisotropic docs/images/ltc_anisotropic.png

prints the errors of anisotropic GGX, for which no table is published, and draws a map of them for alphas of 4 : 1.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import gonio as go
import numpy as np
from gonio.energy.tables import ltc, ltc_anisotropic
from gonio.energy.tables.baked import Baked

SIZE = 64


def main(path: Path) -> None:
    """Print one line per fit."""
    model = go.Conductor().lossless()
    roughness, mu = np.linspace(0.0, 1.0, SIZE), ltc.cosines(SIZE)
    own = ltc.bake(model, SIZE, schlick=True).arrays["ltc_inverse"]
    numbers = re.search(r"LTC_MAT_1 = \[(.*?)\]", path.read_text(), re.S)
    assert numbers is not None, f"no LTC_MAT_1 in {path}"
    theirs = np.array([float(x.replace(" ", "")) for x in numbers[1].split(",") if x.strip()]).reshape(SIZE, SIZE, 4)
    theirs = theirs.transpose(1, 0, 2)  # there, x is the roughness
    tables = {"gonio": own, "published": theirs[..., (0, 2, 1, 3)]}
    print(
        f"{'fit':10} {'L3 mean':>9} {'elsewhere mean':>15} {'max':>7} {'rectangles':>16} {'max':>7}   roughness > 0.1"
    )
    for name, table in tables.items():
        inverse = np.insert(table, 2, 1.0, axis=-1)
        cubed, elsewhere = (np.array(part)[7:] for part in zip(*_lobes(model, roughness, mu, inverse), strict=True))
        quads = ltc.polygon_errors(model, "alpha", roughness[7:], mu, inverse[7:])
        figures = np.mean(np.cbrt(cubed)), np.mean(elsewhere), np.max(elsewhere), np.mean(quads), np.max(quads)
        print("{:10} {:9.4f} {:15.4f} {:7.3f} {:16.5f} {:7.3f}".format(name, *figures))


def anisotropic(picture: Path) -> None:
    """Print one line per ratio of alphas, and draw the first."""
    for first, widths in enumerate([(0.4, 0.1), (0.4, 0.2)]):
        baked = ltc_anisotropic.bake(go.Conductor(alpha=widths).lossless())
        lobe, quads = (baked.manifest["error"][name] for name in ("ltc_inverse", "ltc_norm"))
        rough = baked.arrays["ltc_error"][2:, :, :-1]  # above roughness 0.1, without the horizon
        print(
            f"{widths[0] / widths[1]:.0f} : 1  elsewhere {lobe['mean']:.3f}, max {lobe['max']:.2f}; without the "
            f"horizon {rough.mean():.3f}, {rough.max():.2f}; rectangles {quads['mean']:.4f}, max {quads['max']:.2f}"
        )
        if first == 0:
            _draw(baked, picture)


def _draw(baked: Baked, picture: Path) -> None:
    """Draw the fraction of light in wrong directions over azimuth and angle, at two roughnesses."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), constrained_layout=True)
    image = None
    columns, rows = [0, 5, 8, 11, 13, 15], range(0, ltc_anisotropic.AZIMUTHS, 2)
    angles = np.degrees(np.arccos(baked.arrays["mu"]))
    for axis, layer in zip(axes, (6, 12), strict=True):
        error = baked.arrays["ltc_error"][layer, ..., 0]
        image = axis.imshow(error, origin="lower", aspect="auto", cmap="viridis", vmin=0.0, vmax=0.5)
        axis.set_title(f"roughness {baked.arrays['roughness'][layer]:.1f}", fontsize=10)
        axis.set_xticks(columns, [f"{angles[column]:.0f}" for column in columns])
        axis.set_yticks(list(rows), [f"{np.degrees(baked.arrays['phi'][row]):g}" for row in rows])
        axis.set_xlabel("angle from the normal, degrees")
        axis.tick_params(length=0)
    axes[0].set_ylabel("azimuth from the wide axis, degrees")
    figure.colorbar(image, ax=axes, shrink=0.9, label="share of light elsewhere", extend="max")
    figure.savefig(picture, dpi=110, metadata={"Software": None})


def _lobes(model: go.BSDF, roughness: np.ndarray, mu: np.ndarray, inverse: np.ndarray) -> list[tuple]:
    """(L3, fraction of light in wrong directions) of each cell, row by row."""
    rows = []
    for row, value in enumerate(roughness):
        points = ltc.points_of(ltc.at(model, "alpha", value), mu, 4 * ltc.LOBE, 4 * ltc.SPHERE)
        lobe = points.value.mean(-1)
        total = np.sum(points.weight * lobe, axis=1, keepdims=True)
        rows.append(ltc.lobe_errors(points, lobe, total, inverse[row]))
    return rows


if __name__ == "__main__":
    anisotropic(Path(sys.argv[2])) if sys.argv[1] == "--anisotropic" else main(Path(sys.argv[1]))
