"""The command `gonio view`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from ...errors import InputError
from .. import completion
from ..options import Device, Json, Material, Options, Trust
from ..output import print_warnings
from .base import PICTURES, verb

if TYPE_CHECKING:
    from ...viewer.stage import Stage


class Address(Options):
    """The address of the page's server."""

    host: Annotated[str, Option(metavar="ADDRESS", help="Address to listen on.")] = "127.0.0.1"
    port: Annotated[int, Option(metavar="N", help="Port to listen on; 0 selects any free port.")] = 0
    browser: Annotated[bool, Option("--open/--no-open", help="Open the page in a browser.")] = True


@verb(PICTURES, place=4)
def view(
    target: Annotated[
        list[str] | None,
        Argument(
            metavar="SCENE|MODEL",
            help="Scene, or materials; by default, gold with and without Kulla-Conty.",
            autocompletion=completion.materials,
        ),
    ] = None,
    *,
    made: Material,
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            "--export",
            metavar="FILE",
            help="HTML file for the page; no server is started.",
        ),
    ] = None,
    address: Address,
    homework: Annotated[
        bool,
        Option("--homework", help="Show the two rows of homework 4, with the masking term of its text and one light."),
    ] = False,
    device: Device = "cpu",
    trust: Trust,
    as_json: Json = False,
) -> None:
    """Show materials interactively in a browser, on shading balls and next to a path-traced reference.

    Python files (FILE.py:CLASS) and shaders (FILE.glsl) are watched: when a file is saved, the page shows the new
    picture, or the error in the file. With -o, the page is a single file that needs no server and no network.

    \b
    Examples:
      gonio view
      gonio view --homework
      gonio view conductor lambert --param alpha=0.3
      gonio view "conductor(preset=Au)" "conductor(preset=Cu)"
      gonio view ward.py:Ward
      gonio view examples/shading-balls
      gonio view -o page.html
    """
    stage = _homework(target, made) if homework else _stage(target or (), made, trust)
    print_warnings(stage.notes)
    if output is not None:
        from ...viewer import page

        path = page.export(stage, output)
        size = path.stat().st_size
        print(json.dumps({"output": str(path), "size": size}) if as_json else f"{path}  {size / 1e6:.2f} MB")
        return
    from ...viewer import server

    server.serve(stage, address.host, address.port, address.browser, device, as_json)


def _homework(target: Sequence[str] | None, made: Material) -> Stage:
    """The rows of the homework. Raises InputError if a target or a parameter is given."""
    from ...viewer import stage

    made.shaders(())
    if target or made.settings():
        what = f"--homework given with {target[0] if target else 'parameters'}"
        raise InputError(what, "--homework", "leave one of them out; the page's sliders change all values")
    return stage.homework_text()


def _stage(target: Sequence[str], made: Material, trust: Trust) -> Stage:
    """The stage of a scene or of materials, or the default stage if no target is given."""
    from ...catalog import operands
    from ...viewer import stage

    accepted = {*operands.MATERIALS, *([operands.Kind.SCENE] if len(target) == 1 else [])}
    target = made.shaders(target)
    kinds = [operands.kind_of(one, accepted, "MODEL") for one in target]
    settings = made.settings()
    if kinds == [operands.Kind.SCENE]:
        from ...viewer import lab_scene

        if settings:
            raise InputError("a scene takes no parameters here", "--param", "change the scene, or name a model")
        return lab_scene.stage(Path(target[0]), trust.allow_outside, trust.allow_code)
    if target:
        return stage.of_targets(target, settings)
    if settings:
        raise InputError("no model given", "--param", "name one: gonio view conductor --param alpha=0.3")
    return stage.opening()
