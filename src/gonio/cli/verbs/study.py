"""`gonio study`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Option

from ..options import Crew, Json, Rendering, SceneFile
from ..output import Bar, print_warnings
from .base import PICTURES, verb


@verb(PICTURES, place=2)
def study(
    scene: SceneFile,
    *,
    vary: Annotated[
        list[str], Option(metavar="PATH=V1,V2", help="A value in the scene and what it shall be; repeatable.")
    ],
    output: Annotated[Path, Option("-o", "--output", metavar="FILE", help="The sheet: .png, .pdf or .svg.")] = Path(
        "study.png"
    ),
    how: Rendering,
    crew: Crew,
    title: Annotated[str, Option(metavar="TEXT", help="Heading of the sheet.")] = "",
    as_json: Json = False,
) -> None:
    """Compare parameters: render a scene with each value and lay the pictures on one labelled sheet.

    One --vary gives a row, two a grid (the first goes down, the second across), more give a grid each.

    \b
    Examples:
      gonio study examples/phong --vary shapes.1.material.p=4,16,64
      gonio study examples/phong-kd-p -o kd-p.png --size 200x200 \\
        --vary "shapes.*.material.kd=[.1,.1,.1],[.5,.5,.5]" \\
        --vary "shapes.*.material.p=4,16,64"
    """
    request = how.request(scene)
    from ...viewer import contact_sheet

    variations = [contact_sheet.parse_variation(text) for text in vary]
    with Bar(scene.name) as bar, crew.working():
        sheet = contact_sheet.render_sheet(request, variations, output, title, report=bar.step, tell=bar.tell)
    if as_json:
        print(json.dumps(sheet.as_dict()))
    else:
        print_warnings(sheet.warnings)
        chosen = f", exposure {sheet.exposure:+g} EV" if how.exposure == "auto" else ""
        print(f"{sheet.output}  {len(sheet.cells)} pictures, {sheet.spp} spp, {sheet.seconds:.1f} s{chosen}")
