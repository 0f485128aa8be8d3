"""A sound ball and a broken one for each law: python examples/broken-laws/broken_laws.py writes laws.jpg.

The broken materials are the negative controls of tests/broken: each differs from a sound material in one mistake.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
from gonio.pictures import images

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1] / "tests")]
import sheets  # noqa: E402

from broken import facets, surfaces  # noqa: E402

PICTURE = "laws.jpg"  # in the current folder
# the most visible mistakes; none is known that breaks only `delta` or only `shader`
SHOWN: dict[type[Any], dict[str, object]] = {
    facets.UnnormalisedD: {"alpha": 0.35},
    surfaces.CosineTwice: {"albedo": (0.75, 0.5, 0.3)},
    surfaces.NegativeLobe: {"albedo": (0.75, 0.5, 0.3)},
    surfaces.HalfTheHemisphere: {"albedo": (0.75, 0.5, 0.3)},
    facets.NoJacobianInSample: {"alpha": 0.35},
    facets.SwappedAxes: {"alpha": (0.1, 0.5)},
    surfaces.AlbedoSquared: {"albedo": (0.75, 0.5, 0.3)},
    facets.CancellingD: {"alpha": 0.002},
    facets.FloorInTheParameter: {"alpha": 0.35},
}


def twin(broken: type[Any]) -> type[Any]:
    """The sound class from which a broken one derives."""
    return next(base for base in broken.__mro__ if base.__name__.startswith("Right"))


def ball(material: go.BSDF, size: int = 208, spp: int = 256) -> np.ndarray:
    """The picture of a material by BSDF sampling, which also shows mistakes in `sample` and `pdf`."""
    scene = HERE.parent / "all-models"
    changes = {"shapes.0.material": material}
    return go.render(
        scene, overrides=changes, size=(size, size), spp=spp, integrator="directSampleBSDF", denoise=spp > 16
    )


def visible(sound: np.ndarray, broken: np.ndarray) -> bool:
    """Whether two pictures, as encoded for a screen, differ by more than 4 levels of 255 on average."""
    one, other = (images.to_screen(picture).astype(float) for picture in (sound, broken))
    return bool(np.abs(one - other).mean() > 4.0)


def main(size: int = 420, spp: int = 256) -> None:
    cells = []
    for broken, values in SHOWN.items():
        pair = [ball(kind(**values), size, spp) for kind in (twin(broken), broken)]
        words = re.findall(r"[A-Z][a-z]*", broken.__name__)
        mistake = " ".join(word.lower() if len(word) > 1 else word for word in words)
        seen = "" if visible(*pair) else " (not visible)"
        cells.append((f"{broken.caught_by}{seen}:\n{mistake}", np.hstack(pair)))
    print(sheets.draw(PICTURE, cells, 3, names=("sound", "broken")))


if __name__ == "__main__":
    main()
