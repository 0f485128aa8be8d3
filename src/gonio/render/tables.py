"""Energy tables on disk: the folder that `gonio bake` writes and `gonio info` reads.

    tables.npz      every array and the manifest, float64
    manifest.json   the manifest alone, for people and scripts
    E.exr ...       float32 pictures, row 0 (lowest roughness) on top; .png the same in 8 bits, linear. Of a table with
                    three axes the slices stand one below the other, the first on top
With layout "homework": E.png and E_avg.png exactly as the homework has them (`gonio.energy.baked.homework_pictures`).
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from .. import files
from ..energy import bake as baking
from ..energy.baked import Baked, homework_pictures, load
from ..errors import InputError
from ..models import BSDF
from . import images


def bake(
    target: str | BSDF,
    folder: str | Path,
    *,
    layout: str = "linear",
    store: str = "E",
    flip: bool = True,
    size: int = 128,
    **options: Any,
) -> Baked:
    """Bake tables and write them to a folder, all files or none; options as in `gonio.energy.bake.bake`.
    What was baked before comes from the user's cache.

    layout  "linear", "stretched" or "homework" (linear axes, and the homework's pictures by `store` and `flip`)
    Raises InputError for bad options or a folder that cannot be written, MachineError where the disk is full.
    """
    folder = files.check_folder(folder)
    homework = layout == "homework"
    if homework:
        options["lut"] = options.get("lut") or ("E", "Eavg")
        if not isinstance(target, str) or options.get("aspect") not in (None, 1.0):
            what = "a material, or two widths, in the homework's layout"
            raise InputError(what, "--layout", "give a distribution such as ggx, with one width")
    baked = baking.cached(target, size=size, layout="linear" if homework else layout, **options)
    if homework:
        contents = {f"{name}.png": images.png_bytes(p) for name, p in homework_pictures(baked, store, flip).items()}
        baked.manifest["pictures"] = {"store": store, "bottom row": "lowest" if flip else "highest", "x": "n.v"}
    else:
        contents = _pictures(baked)
    baked.manifest["files"] = ["tables.npz", "manifest.json", *contents]
    contents["tables.npz"] = baked.npz()
    contents["manifest.json"] = (json.dumps(baked.manifest, indent=2) + "\n").encode()
    files.write_all(folder, contents)
    return baked


def _pictures(baked: Baked) -> dict[str, bytes]:
    """Each table as a picture: mu to the right, roughness down, slices of a third axis below each other."""
    files = {}
    for name, dims in baked.manifest["dims"].items():
        value = baked.arrays[name]
        if not dims:
            continue  # one number
        if dims == ["roughness"]:  # constant along mu, so that it is read with the coordinates of E
            size = len(value)
            value = np.broadcast_to(value[:, None], (size, size, *value.shape[1:]))
        channels = value.shape[max(len(dims), 2) :] if dims != ["mu"] else value.shape[1:]
        value = value.reshape(-1, baked.manifest["size"], *channels)
        pixels = np.zeros((*value.shape[:2], 3), np.float32)
        pixels[...] = value[..., None] if not channels else np.pad(value, ((0, 0), (0, 0), (0, 3 - channels[0])))
        files[f"{name}.exr"] = images._bitmap_bytes(pixels, {}, "OpenEXR")
        files[f"{name}.png"] = images.png_bytes(np.round(np.clip(pixels, 0.0, 1.0) * 255.0).astype(np.uint8))
    return files


def describe(path: str | Path) -> dict[str, Any]:
    """What a baked folder or tables.npz holds: its manifest, and the range of each table."""
    baked = load(path)
    ranges = {n: [float(a.min()), float(a.max())] for n, a in baked.arrays.items()}
    return {**baked.manifest, "range": ranges}
