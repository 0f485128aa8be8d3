"""Draw docs/images/capture.png and fit-to-picture.png: the figures that `gonio capture` and `gonio fit` write.

python docs/make_fit_figures.py [capture] [picture]

The photographs are those of benchmarks/capture.py, the scene is that of tests/instruments/test_pictures.py.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import gonio as go
from gonio.instruments.capture import rehearsal
from gonio.viewer import capture_figure, picture_fit_figure

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "tests" / "instruments")]
from test_pictures import FREE, SCENE, TRUE  # noqa: E402

from capture import PAINT, eight, rig  # noqa: E402


def capture(folder: Path) -> None:
    """Eight photographs of a painted ball with 1 % noise, and the fit to them."""
    photographs = rehearsal.take(rig(eight()), PAINT, folder / "photographs", noise=0.01)
    capture_figure.draw(go.capture(photographs, "lambert+ggx")).save(IMAGES / "capture.png")


def picture(folder: Path) -> None:
    """A picture of a gold ball, and the fit of its alpha and of the floor's color."""
    scene = json.loads(json.dumps(SCENE))
    scene["camera"]["film"]["size"] = [160, 120]
    (folder / "scene.json").write_text(json.dumps(scene))
    go.render(folder, output=folder / "true.npz", overrides=TRUE, spp=1024, seed=5)
    found = go.fit_picture(folder / "true.npz", folder / "scene.json", FREE)
    picture_fit_figure.draw(found).save(IMAGES / "fit-to-picture.png")


PARTS = {"capture": capture, "picture": picture}


def main() -> None:
    for name in sys.argv[1:] or PARTS:
        with tempfile.TemporaryDirectory() as folder:
            PARTS[name](Path(folder))


if __name__ == "__main__":
    main()
