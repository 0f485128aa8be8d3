"""Phong's failures as pictures: python examples/phong-failures/phong_failures.py writes failures.jpg.

Above: Phong as it is often written. Below: the same light on a ball without that failure.
"""

from __future__ import annotations

import functools
import sys
from pathlib import Path

import gonio as go
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1] / "docs")]
import sheets  # noqa: E402
from make_phong_limits import EvenPower, NoHorizon  # noqa: E402

PICTURE = "failures.jpg"  # in the current folder
BODY = (0.06, 0.13, 0.3)
FRONT, SIDE, BEHIND = (-0.5, 0.45, 0.75), (-0.75, 0.45, -0.45), (0.45, 0.55, -0.65)  # toward the light


def normalized(ks: float, p: float) -> go.BSDF:
    """The reciprocal, energy-conserving form with the same body color."""
    return go.ModifiedPhong(kd=tuple(np.pi * kd * (1.0 - ks) for kd in BODY), ks=ks, p=p)


def cases() -> list[tuple[tuple[float, float, float], str, go.BSDF, str, go.BSDF]]:
    """The light, then title and material of the wrong form and of the sound one."""
    phong = functools.partial(go.Phong, kd=BODY)
    even, through = EvenPower(kd=BODY, ks=0.6, p=4.0), NoHorizon(kd=BODY, ks=0.6, p=6.0)
    return [
        (FRONT, "(v.r)^4 without\nmax(0, v.r)", even, "(max(0, v.r))^4", phong(ks=0.6, p=4.0)),
        (BEHIND, "no test of n.l:\nshines through", through, "0 if n.l < 0", phong(ks=0.6, p=6.0)),
        (FRONT, "ks = 1, p = 2:\ntwice the light", phong(ks=1.0, p=2.0), "normalized", normalized(0.5, 2.0)),
        (SIDE, "no n.l: a hard\nterminator", phong(ks=0.7, p=2.0), "with n.l", normalized(0.7, 2.0)),
        (FRONT, "p = 0.5: edge\nat v.r = 0", phong(ks=0.4, p=0.5), "p = 4", phong(ks=0.4, p=4.0)),
    ]


def main(size: int = 240) -> None:
    wrong, right = [], []
    for light, title, failing, words, sound in cases():
        wrong.append((title, sheets.shaded(failing, light, size)))
        right.append((words, sheets.shaded(sound, light, size)))
    print(sheets.draw(PICTURE, [*wrong, *right], len(wrong), rows=("wrong", "mended")))


if __name__ == "__main__":
    main()
