"""Linearly transformed cosines of GGX: Gonio's fit and the published one, by the same measures.

python benchmarks/ltc.py web/node_modules/three/examples/jsm/lights/RectAreaLightTexturesLib.js

The file holds the tables of Heitz2016a's authors, 64 x 64. Both fits are compared with sums over the lobe itself:
L3, the measure that the paper minimizes; the share of light that goes elsewhere; integrals over 1,024 rectangles.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import gonio as go
import numpy as np
from gonio.energy.tables import ltc

SIZE = 64


def main(path: Path) -> None:
    """Print one line per fit."""
    model = go.Conductor().lossless()
    roughness, mu = np.linspace(0.0, 1.0, SIZE), ltc.cosines(SIZE)
    own = ltc.bake(model, SIZE, schlick=True).arrays["ltc_inverse"]
    numbers = re.search(r"LTC_MAT_1 = \[(.*?)\]", path.read_text(), re.S)
    assert numbers is not None, f"no LTC_MAT_1 in {path}"
    theirs = np.array([float(x.replace(" ", "")) for x in numbers[1].split(",") if x.strip()]).reshape(SIZE, SIZE, 4)
    theirs = theirs.transpose(1, 0, 2)  # x is the roughness
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


def _lobes(model: go.BSDF, roughness: np.ndarray, mu: np.ndarray, inverse: np.ndarray) -> list[tuple]:
    """(L3, share elsewhere) of each cell by row."""
    rows = []
    for row, value in enumerate(roughness):
        points = ltc.points_of(ltc.at(model, "alpha", value), mu, 4 * ltc.LOBE, 4 * ltc.SPHERE)
        lobe = points.value.mean(-1)
        total = np.sum(points.weight * lobe, axis=1, keepdims=True)
        rows.append(ltc.lobe_errors(points, lobe, total, inverse[row]))
    return rows


if __name__ == "__main__":
    main(Path(sys.argv[1]))
