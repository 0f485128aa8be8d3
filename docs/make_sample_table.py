"""Write src/gonio/measure/sample.gonio: a small table of a satin paint, half metal of alpha 0.35, half Lambertian.

python docs/make_sample_table.py
"""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
from gonio.measure.formats.own import Own
from gonio.measure.tables.half_difference import HalfDifference, sampled

TARGET = Path(__file__).parents[1] / "src" / "gonio" / "measure" / "sample.gonio"
CELLS = (24, 12, 8)  # theta_h, theta_d, phi_d


def main() -> None:
    """Write the table."""
    paint = go.mix(go.Conductor.preset("Cu", alpha=0.35), go.Lambert((0.10, 0.16, 0.42)), 0.5)
    table = sampled(lambda wo, wi: paint.eval(wo, wi, precision="float64"), CELLS)
    kept = HalfDifference(
        table.values.astype(np.float32),
        title="satin paint, computed: copper of alpha .35 and a blue Lambert in equal parts",
        source={"format": "gonio", "made": "docs/make_sample_table.py"},
    )
    kept.values = table.values.astype(np.float32)  # half the size; readers convert it to float64
    TARGET.write_bytes(Own().write(kept))
    print(f"{TARGET.name}: {TARGET.stat().st_size} bytes")


if __name__ == "__main__":
    main()
