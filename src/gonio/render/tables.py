"""Energy tables on disk: the folder that `gonio bake` writes and `gonio info` reads.

    tables.npz      every array and the manifest, float64
    manifest.json   the manifest alone, for people and scripts
    E.exr ...       float32 pictures, row 0 (lowest roughness) on top; .png the same in 8 bits, linear. Of a table with
                    three axes the slices stand one below the other, the first on top
With layout "homework": E.png and E_avg.png exactly as the homework has them (`gonio.energy.baked.homework_pictures`).
"""

from __future__ import annotations

import errno
import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from ..energy import bake as baking
from ..energy.baked import Baked, homework_pictures, load
from ..errors import InputError, MachineError
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
    folder = check_folder(folder)
    homework = layout == "homework"
    if homework:
        options["lut"] = options.get("lut") or ("E", "Eavg")
        if not isinstance(target, str) or options.get("aspect") not in (None, 1.0):
            what = "a material, or two widths, in the homework's layout"
            raise InputError(what, "--layout", "give a distribution such as ggx, with one width")
    baked = baking.cached(target, size=size, layout="linear" if homework else layout, **options)
    if homework:
        files = {f"{name}.png": images.png_bytes(p) for name, p in homework_pictures(baked, store, flip).items()}
        baked.manifest["pictures"] = {"store": store, "bottom row": "lowest" if flip else "highest", "x": "n.v"}
    else:
        files = _pictures(baked)
    baked.manifest["files"] = ["tables.npz", "manifest.json", *files]
    files["tables.npz"] = baked.npz()
    files["manifest.json"] = (json.dumps(baked.manifest, indent=2) + "\n").encode()
    write_all(folder, files)
    return baked


def check_folder(folder: str | Path) -> Path:
    """The folder, if it exists or can be made where it is named; InputError before anything is computed where not."""
    folder = Path(folder).expanduser()
    if not folder.is_dir():
        if folder.exists():
            raise InputError(f"'{folder}' is a file", str(folder), "choose another folder with -o")
        return images.check_folder(folder)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"no permission to write in '{folder}'", str(folder), "choose another folder with -o")
    return folder


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


def write_all(folder: Path, files: dict[str, bytes]) -> None:
    """Write to a folder beside, then move: a new folder appears whole, an old one keeps its other files."""
    part = folder.absolute().with_name(f".{folder.name}.{os.getpid()}.part")
    try:
        part.mkdir()
        for name, content in files.items():
            with open(part / name, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        if not folder.exists():
            os.replace(part, folder)
        else:
            for name in files:
                os.replace(part / name, folder / name)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        what = "the disk is full" if full else f"cannot write: {error.strerror or error}"
        kind = MachineError if full else InputError
        raise kind(what, str(folder), "nothing was written; choose another folder with -o") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def describe(path: str | Path) -> dict[str, Any]:
    """What a baked folder or tables.npz holds: its manifest, and the range of each table."""
    baked = load(path)
    ranges = {n: [float(a.min()), float(a.max())] for n, a in baked.arrays.items()}
    return {**baked.manifest, "range": ranges}
