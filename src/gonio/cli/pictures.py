"""Verbs that make pictures: render, study, compare, view."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError, did_you_mean
from .app import INTERRUPTED, PICTURES, app
from .options import (
    Denoise,
    Device,
    Exposure,
    Integrator,
    Json,
    MaxDepth,
    Outside,
    Sampler,
    SceneFile,
    Seed,
    Size,
    Spp,
    Threads,
)
from .output import Bar, print_warnings

if TYPE_CHECKING:
    from ..render.run import Request, Result


@app.command(rich_help_panel=PICTURES)
def render(
    scene: SceneFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help=".exr, .hdr, .png or .npz.")
    ] = None,
    spp: Spp = None,
    size: Size = None,
    integrator: Integrator = None,
    max_depth: MaxDepth = None,
    sampler: Sampler = None,
    seed: Seed = None,
    device: Device = "cpu",
    threads: Threads = None,
    timeout: Annotated[
        float | None, typer.Option(metavar="S", help="Stop after S seconds and keep the picture so far.")
    ] = None,
    denoise: Denoise = False,
    exposure: Exposure = 0.0,
    allow_outside: Outside = False,
    as_json: Json = False,
) -> None:
    """Render a scene to a picture.

    Without -o the picture gets the name that the scene gives it, in the current folder.
    Ctrl-C ends after the pass (half a second or so) and keeps the picture so far; a second one ends at once.

    \b
    Examples:
      gonio render examples/phong
      gonio render examples/phong -o phong.exr --spp 256 --size 640x480
      gonio render scene.xml --integrator path --max-depth 5 --denoise
    """
    result = _render_with_bar(_request(locals()))
    if as_json:
        print(json.dumps(result.as_dict()))
    else:
        _print_result(result)
    if result.stopped == "interrupt":
        sys.exit(INTERRUPTED)


def _request(options: dict[str, Any]) -> Request:
    """The request of a verb, whose options have the names of the request's fields."""
    from ..render import run

    names = {field.name for field in dataclasses.fields(run.Request)}
    size = run.parse_size(options["size"]) if options["size"] is not None else None
    return run.Request(**{name: value for name, value in options.items() if name in names} | {"size": size})


def _render_with_bar(request: Request) -> Result:
    from ..render import run

    with Bar(request.scene.name) as bar:
        return run.render(request, report=bar.update, notice=bar.stopping)


def _print_result(result: Result) -> None:
    width, height = result.size
    text = f"{result.output}  {width}x{height}, {result.spp} spp, {result.seconds:.1f} s"
    print_warnings(result.warnings)
    if result.stopped:
        why = "stopped by Ctrl-C" if result.stopped == "interrupt" else "stopped at the time limit"
        text += f"; {why}, {result.wanted_spp} spp were asked for"
    print(text)


@app.command(rich_help_panel=PICTURES)
def study(
    scene: SceneFile,
    vary: Annotated[
        list[str],
        typer.Option(metavar="PATH=V1,V2", help="A value in the scene and what it shall be; repeatable."),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="The sheet: .png, .pdf or .svg.")
    ] = Path("study.png"),
    spp: Spp = None,
    size: Size = None,
    integrator: Integrator = None,
    max_depth: MaxDepth = None,
    sampler: Sampler = None,
    seed: Seed = None,
    device: Device = "cpu",
    threads: Threads = None,
    denoise: Denoise = False,
    exposure: Exposure = 0.0,
    title: Annotated[str, typer.Option(metavar="TEXT", help="Heading of the sheet.")] = "",
    allow_outside: Outside = False,
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
    request = _request({**locals(), "output": None})  # the request's output would be a picture; this one is the sheet
    from ..viewer import contact_sheet

    variations = [contact_sheet.parse_variation(text) for text in vary]
    with Bar(scene.name) as bar:
        sheet = contact_sheet.study(request, variations, output, title, report=bar.step)
    if as_json:
        print(json.dumps(sheet.as_dict()))
    else:
        print_warnings(sheet.warnings)
        print(f"{sheet.output}  {len(sheet.cells)} pictures, {sheet.spp} spp, {sheet.seconds:.1f} s")


@app.command(rich_help_panel=PICTURES)
def compare(
    test: Annotated[Path, typer.Argument(metavar="A", help="The picture to judge: .exr, .hdr, .png, .npz.")],
    reference: Annotated[Path, typer.Argument(metavar="B", help="The picture to judge it by.")],
    tolerance: Annotated[
        float | None, typer.Option(metavar="X", help="Exit with 1 where the metric is over X.")
    ] = None,
    metric: Annotated[str, typer.Option(metavar="relmse|rmse|flip", help="What --tolerance is for.")] = "relmse",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="A map of the error: .png, .pdf, .svg.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Say how far picture A is from picture B: RMSE, relMSE, ratio of the means, FLIP.

    FLIP of .exr, .hdr and .npz is HDR-FLIP: the worst of the exposures at which B can be shown.

    \b
    Examples:
      gonio compare mine.exr reference.exr
      gonio compare mine.exr reference.exr --tolerance 0.01 -o error.png
    """
    from ..render import images, metrics

    if metric not in metrics.METRICS:
        raise InputError(f"unknown metric '{metric}'", "--metric", did_you_mean(metric, tuple(metrics.METRICS)))
    if tolerance is not None and not tolerance >= 0:
        raise InputError(f"a tolerance of {tolerance:g}", "--tolerance", "give 0 or more")
    if output is not None:
        from ..viewer import figures

        figures.check_output(output)
    a, b = images.read(test), images.read(reference)
    try:
        result = metrics.compare(a.pixels, b.pixels, hdr=a.hdr and b.hdr)
    except InputError as error:
        raise InputError(error.what, f"{test}, {reference}", error.hint) from error
    if output is not None:
        from ..viewer import error_map

        error_map.write(output, a, b, metric)
    passed = tolerance is None or result.value(metric) <= tolerance
    if as_json:
        verdict = {"metric": metric, "tolerance": tolerance, "passed": passed}
        print(json.dumps({"test": str(test), "reference": str(reference), **result.as_dict(), **verdict}))
    else:
        _print_comparison(result, metric, tolerance, passed)
        if output is not None:
            print(f"error map  {output}")
    if not passed:
        raise typer.Exit(1)


def _print_comparison(result: Any, metric: str, tolerance: float | None, passed: bool) -> None:
    kind = "LDR" if result.exposures is None else "HDR, {:+.1f} to {:+.1f} EV".format(*result.exposures)
    print(f"RMSE        {result.rmse:.6g}")
    print(f"relMSE      {result.relmse:.6g}")
    print(f"mean ratio  {result.mean_ratio:.6f}")
    print(f"FLIP        {result.flip:.6f}  ({kind})")
    if tolerance is not None:
        relation, verdict = ("<=", "passes") if passed else (">", "fails")
        print(f"{verdict}: {metric} {result.value(metric):.6g} {relation} {tolerance:g}")


@app.command(rich_help_panel=PICTURES)
def view(
    target: Annotated[
        list[str] | None,
        typer.Argument(metavar="SCENE|MODEL", help="A lab scene, or materials; none: Kulla-Conty and plain."),
    ] = None,
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", metavar="NAME=VALUE", help="A parameter; repeatable.")
    ] = None,
    export: Annotated[
        Path | None, typer.Option("--export", metavar="FILE", help="Write the page as one .html and end.")
    ] = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Where to listen.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(metavar="N", help="0 takes any that is free.")] = 0,
    browser: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in a browser.")] = True,
    device: Device = "auto",
    allow_outside: Outside = False,
) -> None:
    """Show materials live on shading balls, in a browser, beside a path-traced reference.

    With --export the page is one file that needs no server and no network.

    \b
    Examples:
      gonio view
      gonio view conductor lambert --param alpha=.3
      gonio view "conductor(preset=Au)" "conductor(preset=Cu)"
      gonio view examples/shading-balls
      gonio view --export page.html
    """
    from ..viewer import page, stage

    if target and len(target) == 1 and (target[0].lower().endswith(".json") or Path(target[0]).is_dir()):
        from ..viewer import lab_scene

        if param:
            raise InputError("a scene takes no parameters here", "--param", "change the scene, or name a model")
        shown = lab_scene.stage(Path(target[0]), allow_outside)
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
    from ..viewer import server

    server.serve(shown, host, port, browser, device)
