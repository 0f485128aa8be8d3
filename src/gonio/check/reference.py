"""Reference values with which students can check their programs: f at 200 pairs of directions, and tables of E and
E_avg.

    gonio check --reference DIR                      every model of the courses, and the homework's tables
    gonio check oren-nayar -p sigma=0.5 --reference DIR

Each file of values states its material, so that it can be passed to `gonio check FILE MODEL` or checked against a
sheet.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .. import files
from ..catalog import notation
from ..material import BSDF
from ..measure.formats import text
from ..render.tables import bake
from ..verify import directions
from .classes import pairs
from .mistakes import f_of

PAIRS = 200
SIZE = 32  # rows and columns of the tables
_SILVER = "preset=Ag,alpha=0.25,fresnel=schlick,masking=smith-separable"
_GLASS = "eta=1.5,alpha=0.25,fresnel=schlick,masking=smith-separable"
_HOMEWORK = "conductor(preset=Ag,alpha=0.25,fresnel=schlick,masking=schlick-direct)"
MODELS = {
    "lambert": "lambert",
    "phong": "phong",
    "blinn-phong": "blinn-phong",
    "oren-nayar": "oren-nayar",
    "conductor-beckmann": f"conductor({_SILVER},ndf=beckmann)",
    "conductor-ggx": f"conductor({_SILVER},ndf=ggx)",
    "dielectric-beckmann": f"dielectric({_GLASS},ndf=beckmann)",
    "dielectric-ggx": f"dielectric({_GLASS},ndf=ggx)",
    "pbr-material": _HOMEWORK,
    "kulla-conty": f"kulla-conty(base={_HOMEWORK},color=sheet)",
}
TABLES = {"text": "schlick-direct", "figure": "schlick-ibl"}


def write(folder: str | Path, material: str | BSDF | None = None) -> list[Path]:
    """Write the values of one material, or the values and tables of the courses. Returns the paths of the files.

    material  a material, as a string or an object; None for all models of the courses
    Either all files are written or none. Raises InputError if the folder cannot be written.
    """
    place = files.check_folder(folder)
    if material is not None:
        named = material if isinstance(material, BSDF) else notation.named(material)[0]
        contents = {f"{type(named).name}.csv": values(named)}
    else:
        contents = {f"{name}.csv": values(notation.named(model)[0]) for name, model in MODELS.items()}
        for name, masking in TABLES.items():
            baked = bake("ggx", lut=["E", "Eavg"], resolution=SIZE, masking=masking)
            rows = f"# {masking}; row i: roughness (i + 1/2) / {SIZE}"
            columns = f"column j: n.v = (j + 1/2) / {SIZE}"
            contents[f"E-{name}.csv"] = f"{rows}; {columns}\n" + text.written(baked.arrays["E"], ",")
            contents[f"E_avg-{name}.csv"] = f"{rows}\n" + text.written(baked.arrays["E_avg"][:, None])
    files.write_all(place, {name: content.encode() for name, content in contents.items()})
    return [place / name for name in contents]


def values(material: BSDF) -> str:
    """f at 200 pairs of directions, with z up, in the format read by `samples.read`."""
    wo, wi = pairs(material, PAIRS)
    if material.transmits:
        wi = directions.uniform(np.random.default_rng(2), PAIRS)
    heading = (
        f"# model: {notation.written(material)}\n# wo.x, wo.y, wo.z, wi.x, wi.y, wi.z, f red, green, blue (1/sr)\n"
    )
    return heading + text.written(np.column_stack([wo, wi, f_of(material, wo, wi)]), ",")
