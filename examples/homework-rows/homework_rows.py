"""The two rows with their names: python examples/homework-rows/homework_rows.py writes homework-rows.jpg.

The balls of scene.json under its light, as a shader computes them, on gray: on black, the darkest ones have no outline.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import gonio as go
import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
import sheets  # noqa: E402

PICTURE = "homework-rows.jpg"  # in the current folder
GREY = 0.1  # radiance behind the balls


def main(size: int = 240) -> None:
    scene = json.loads((HERE / "scene.json").read_text(encoding="utf-8"))["scene"]
    (sun,) = scene["lights"]
    toward, irradiance = -np.array(sun["direction"]), sun["energy"][0]
    cells = []
    for shape in sorted(scene["shapes"], key=lambda one: (-one["center"][1], one["center"][0])):
        material = go.material(shape["material"])
        alpha = shape["material"].get("base", shape["material"])["alpha"]
        title = f"roughness {math.sqrt(alpha):.2f}" if shape["center"][1] > 0.0 else ""
        cells.append((title, sheets.shaded(material, toward, size, irradiance, backdrop=GREY)))
    columns = len(cells) // 2
    print(sheets.draw(PICTURE, cells, columns, rows=("compensated", "one bounce")))


if __name__ == "__main__":
    main()
