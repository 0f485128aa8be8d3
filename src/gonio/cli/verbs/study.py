"""The command `gonio study`."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from typer import Option

from ..options import Executor, Json, Material, Rendering, SceneFile, output_option
from ..output import Bar, print_warnings
from .base import PICTURES, verb


@verb(PICTURES, place=2)
def study(
    scene: SceneFile,
    *,
    vary: Annotated[
        list[str],
        Option(metavar="NAME=V1,V2|A..B", help="Parameter or path, and its values; repeatable."),
    ],
    output: Annotated[Path, output_option("FILE", "File for the sheet: .png, .pdf or .svg.")] = Path("study.png"),
    made: Material,
    how: Rendering,
    executor: Executor,
    title: Annotated[str, Option(metavar="TEXT", help="Heading of the sheet.")] = "",
    as_json: Json = False,
) -> None:
    """Compare parameter values: render a scene with each value, and arrange the pictures on one labeled sheet.

    One --vary gives a row, two give a grid (the first varies from top to bottom, the second from left to right), and
    more give several grids. A path denotes a value in the scene, or a parameter of a material, such as p or base.alpha.
    Several paths in one --vary change together, for example with a constant sum: kd,ks=(0.05,0.25),(0.15,0.15).

    \b
    Examples:
      gonio study examples/phong --vary shapes.1.material.p=4,16,64
      gonio study phong --vary p=4,16,64 --vary "kd,ks=(.05,.25),(.15,.15),(.25,.05)"
      gonio study kulla-conty -p base=conductor --vary base.alpha=0.1,0.3,0.5 --vary base.preset=Au,Cu
      gonio study examples/phong-kd-p -o kd-p.png --size 200x200 \\
        --vary "shapes.*.material.kd=[0.1,0.1,0.1],[0.5,0.5,0.5]" \\
        --vary "shapes.*.material.p=4,16,64"
    """
    from ...viewer import contact_sheet

    named = made.instead_of(scene, how.allow_code)
    request = replace(how.request(scene), scene=Path(named[0].name if named else scene))

    variations = [contact_sheet.parse_variation(text) for text in vary]
    with Bar(request.scene.name) as bar, executor.running():
        sheet = contact_sheet.render_sheet(request, variations, output, title, named, report=bar.step, tell=bar.tell)
    if as_json:
        print(json.dumps(sheet.as_dict()))
    else:
        print_warnings(sheet.warnings)
        chosen = f", exposure {sheet.exposure:+g} EV" if how.exposure == "auto" else ""
        print(f"{sheet.output}  {len(sheet.cells)} pictures, {sheet.spp} spp, {sheet.seconds:.1f} s{chosen}")
