"""`gonio view`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ...errors import InputError
from .. import completion
from ..options import Code, Device, Outside, Parameters
from ..output import print_warnings
from .base import PICTURES, verb


@verb(PICTURES, place=4)
def view(
    target: Annotated[
        list[str] | None,
        Argument(
            metavar="SCENE|MODEL",
            help="A lab scene, or materials; none: Kulla-Conty and plain.",
            autocompletion=completion.materials,
        ),
    ] = None,
    param: Parameters = None,
    export: Annotated[
        Path | None, Option("--export", metavar="FILE", help="Write the page as one .html and end.")
    ] = None,
    host: Annotated[str, Option(metavar="ADDRESS", help="Where to listen.")] = "127.0.0.1",
    port: Annotated[int, Option(metavar="N", help="0 takes any that is free.")] = 0,
    browser: Annotated[bool, Option("--open/--no-open", help="Open the page in a browser.")] = True,
    device: Device = "auto",
    allow_outside: Outside = False,
    allow_code: Code = False,
) -> None:
    """Show materials live on shading balls, in a browser, beside a path-traced reference.

    FILE.py:CLASS is watched: save the file, and the page shows the new picture, or what is wrong with it. With --export
    the page is one file that needs no server and no network.

    \b
    Examples:
      gonio view
      gonio view conductor lambert --param alpha=.3
      gonio view "conductor(preset=Au)" "conductor(preset=Cu)"
      gonio view ward.py:Ward
      gonio view examples/shading-balls
      gonio view --export page.html
    """
    from ...catalog import operands
    from ...viewer import page, stage

    accepted = {*operands.MATERIALS, *([operands.Kind.SCENE] if len(target or ()) == 1 else [])}
    kinds = [operands.kind_of(one, accepted, "MODEL") for one in target or ()]
    if target and kinds == [operands.Kind.SCENE]:
        from ...viewer import lab_scene

        if param:
            raise InputError("a scene takes no parameters here", "--param", "change the scene, or name a model")
        shown = lab_scene.stage(Path(target[0]), allow_outside, allow_code)
    elif target:
        shown = stage.of_targets(target, param or [])
    else:
        if param:
            raise InputError("parameters for no model", "--param", "name one: gonio view conductor --param alpha=.3")
        shown = stage.homework()
    print_warnings(shown.notes)
    if export is not None:
        path = page.export(shown, export)
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB")
        return
    from ...viewer import server

    server.serve(shown, host, port, browser, device)
