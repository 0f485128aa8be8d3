"""Write the parameters of the published fits as the package ships them: src/gonio/catalog/published/*.json.

    python docs/make_library.py FOLDER      # with bagher2012.json, low2012.json and ngan2005.json

The files in FOLDER hold the values printed in three papers, as transcribed by the BSDF benchmark bsdfbenchmark/bbm:
{fit: {"model": ..., "materials": {name: {parameter: number or list}}}}. Nothing is converted; the values are only
written more compactly, as one list of numbers per material, in the order of `parameters`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

TO = Path(__file__).parents[1] / "src" / "gonio" / "catalog" / "published"
SOURCES = {"ngan2005": "Ngan2005", "low2012": "Low2012", "bagher2012": "Bagher2012"}


def shipped(fits: dict[str, dict], source: str) -> dict[str, object]:
    """The parameters of one paper in the package's layout."""
    found = {}
    for fit, one in fits.items():
        materials = dict(sorted(one["materials"].items()))
        first = next(iter(materials.values()))
        found[fit] = {
            "model": one["model"],
            "parameters": {name: list(np.shape(value)) for name, value in first.items()},
            "materials": {
                name: [number for parameter in first for number in np.ravel(figures[parameter]).tolist()]
                for name, figures in materials.items()
            },
        }
    return {"source": source, "collection": "github.com/bsdfbenchmark/bbm, fits/ (2023)", "fits": found}


def main() -> None:
    TO.mkdir(exist_ok=True)
    for name, source in SOURCES.items():
        fits = json.loads((Path(sys.argv[1]) / f"{name}.json").read_text())
        text = json.dumps(shipped(fits, source), separators=(",", ":")).replace("],", "],\n")
        (TO / f"{name}.json").write_text(text + "\n")


if __name__ == "__main__":
    main()
