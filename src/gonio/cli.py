"""The command line: thin verbs over the rooms below, no logic of its own.

Nothing heavy is imported here at the top, so that `gonio --help` stays under a quarter of a second: each verb
imports what it needs when it runs. Errors are printed in one place, `main`.

Exit codes: 0 done, 1 a verdict of "fails", 2 bad usage or input, 3 a fault of the machine, 130 ended by Ctrl-C.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .errors import GonioError, GonioWarning, InputError, did_you_mean

if TYPE_CHECKING:
    from .render.passes import Progress
    from .render.run import Request, Result

app = typer.Typer(
    name="gonio",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 verdict fails, 2 bad usage or input, 3 fault of the machine, 130 Ctrl-C.",
)

INTERRUPTED = 130  # what a shell reports of a program that Ctrl-C ended: 128 + SIGINT

PICTURES, MATERIALS, SUPPORT = "Pictures", "Materials", "Support"

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Size = Annotated[str | None, typer.Option(metavar="WxH", help="Film size in pixels, such as 640x480.")]
Spp = Annotated[int | None, typer.Option(metavar="N", help="Samples per pixel.")]
Exposure = Annotated[float, typer.Option(metavar="EV", help="Stops of brightness, for .png.")]
SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="A scene's folder or .json; or a Mitsuba .xml.")]
Integrator = Annotated[str | None, typer.Option(metavar="NAME", help="direct, path, whitted, normal, ...")]
MaxDepth = Annotated[int | None, typer.Option(metavar="N", help="Longest path, for the integrator path.")]
Sampler = Annotated[str | None, typer.Option(metavar="NAME", help="Where random numbers come from.")]
Seed = Annotated[int | None, typer.Option(metavar="N", help="Same seed, same picture, to the bit.")]
Device = Annotated[str, typer.Option(metavar="cpu|cuda|auto", help="Where to compute.")]
Threads = Annotated[int | None, typer.Option(metavar="N", help="CPU cores to use; all if not given.")]
Denoise = Annotated[bool, typer.Option("--denoise", help="Remove noise with Open Image Denoise.")]
Outside = Annotated[bool, typer.Option("--allow-outside", help="Let the scene read files outside its folder.")]


def _version(wanted: bool) -> None:
    if wanted:
        from . import __version__

        print(f"gonio {__version__}")
        raise typer.Exit()


@app.callback()
def gonio(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_version, is_eager=True)
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show a traceback where Gonio fails.")] = False,
) -> None:
    """A laboratory for the scattering of light by materials."""
    if debug:
        os.environ["GONIO_DEBUG"] = "1"


# --- pictures ------------------------------------------------------------------------------------------


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
    from .render import run

    request = run.Request(
        scene=scene,
        output=output,
        spp=spp,
        size=run.parse_size(size) if size is not None else None,
        integrator=integrator,
        max_depth=max_depth,
        sampler=sampler,
        seed=seed,
        device=device,
        threads=threads,
        timeout=timeout,
        denoise=denoise,
        exposure=exposure,
        allow_outside=allow_outside,
    )
    result = _render_with_bar(request)
    if as_json:
        print(json.dumps(result.as_dict()))
    else:
        _print_result(result)
    if result.stopped == "interrupt":
        sys.exit(INTERRUPTED)


def _render_with_bar(request: Request) -> Result:
    from .render import run

    with _Bar(request.scene.name) as bar:
        return run.render(request, report=bar.update, notice=bar.stopping)


def _print_result(result: Result) -> None:
    width, height = result.size
    text = f"{result.output}  {width}x{height}, {result.spp} spp, {result.seconds:.1f} s"
    _print_warnings(result.warnings)
    if result.stopped:
        why = "stopped by Ctrl-C" if result.stopped == "interrupt" else "stopped at the time limit"
        text += f"; {why}, {result.wanted_spp} spp were asked for"
    print(text)


def _print_warnings(warnings: tuple[str, ...]) -> None:
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)


class _Bar:
    """A progress bar on stderr: samples done, rate, time left; nothing where stderr is no terminal."""

    def __init__(self, title: str, total: float | None = None) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

        self._console = Console(stderr=True)
        columns = "[cyan]{task.description}", "{task.fields[state]}"
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn(columns[0]),
            BarColumn(),
            TextColumn(columns[1]),
            console=self._console,
            transient=True,
            disable=not self._console.is_terminal,
        )
        self._task = self._bar.add_task(title, total=total, state="loading")

    def __enter__(self) -> _Bar:
        self._bar.__enter__()
        return self

    def __exit__(self, *exc: Any) -> None:
        self._bar.__exit__(*exc)

    def update(self, progress: Progress) -> None:
        minutes, seconds = divmod(round(progress.remaining), 60)
        state = f"{progress.done}/{progress.wanted} spp  {progress.rate / 1e6:.2f} M samples/s"
        state += f"  {minutes}:{seconds:02} left" if progress.done < progress.wanted else "  writing"
        self._bar.update(self._task, total=progress.wanted, completed=progress.done, state=state)

    def step(self, done: int, total: int, state: str) -> None:
        self._bar.update(self._task, total=total, completed=done, state=state)

    def stopping(self) -> None:
        self._console.print("Ctrl-C: ending in a moment; again to end at once")


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
    from .render import run
    from .viewer import contact_sheet

    request = run.Request(
        scene=scene,
        spp=spp,
        size=run.parse_size(size) if size is not None else None,
        integrator=integrator,
        max_depth=max_depth,
        sampler=sampler,
        seed=seed,
        device=device,
        threads=threads,
        denoise=denoise,
        exposure=exposure,
        allow_outside=allow_outside,
    )
    variations = [contact_sheet.parse_variation(text) for text in vary]
    with _Bar(scene.name) as bar:
        sheet = contact_sheet.study(request, variations, output, title, report=bar.step)
    if as_json:
        print(json.dumps(sheet.as_dict()))
    else:
        _print_warnings(sheet.warnings)
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
    from .errors import did_you_mean
    from .render import images, metrics

    if metric not in metrics.METRICS:
        raise InputError(f"unknown metric '{metric}'", "--metric", did_you_mean(metric, tuple(metrics.METRICS)))
    if tolerance is not None and not tolerance >= 0:
        raise InputError(f"a tolerance of {tolerance:g}", "--tolerance", "give 0 or more")
    if output is not None:
        from .viewer import figures

        figures.check_output(output)
    a, b = images.read(test), images.read(reference)
    try:
        result = metrics.compare(a.pixels, b.pixels, hdr=a.hdr and b.hdr)
    except InputError as error:
        raise InputError(error.what, f"{test}, {reference}", error.hint) from error
    if output is not None:
        from .viewer import error_map

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
    from .viewer import page, stage

    if target and len(target) == 1 and (target[0].lower().endswith(".json") or Path(target[0]).is_dir()):
        from .viewer import lab_scene

        if param:
            raise InputError("a scene takes no parameters here", "--param", "change the scene, or name a model")
        shown = lab_scene.stage(Path(target[0]), allow_outside)
    elif target:
        shown = stage.of_targets(target, param or [])
    else:
        if param:
            raise InputError("parameters for no model", "--param", "name one: gonio view conductor --param alpha=.3")
        shown = stage.homework()
    _print_warnings(shown.notes)
    if export is not None:
        path = page.export(shown, export)
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB")
        return
    from .viewer import server

    server.serve(shown, host, port, browser, device)


# --- materials -----------------------------------------------------------------------------------------


@app.command(rich_help_panel=MATERIALS)
def plot(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A material's name; see `gonio models`.")],
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", metavar="NAME=VALUE", help="A parameter; repeatable.")
    ] = None,
    preset: Annotated[str, typer.Option(metavar="NAME", help="A named preset, such as Au for conductor.")] = "",
    kind: Annotated[str, typer.Option(metavar="lobe|slice|albedo", help="What to draw.")] = "lobe",
    angles: Annotated[str, typer.Option(metavar="A,B,..", help="Directions of view, degrees from the normal.")] = "",
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE", help=".png, .pdf, .svg.")] = None,
) -> None:
    """Draw a material: its lobes (polar), a slice over angle, or its albedo curve; or the tables in a baked folder.

    The density it is sampled with is drawn dashed over its values.

    \b
    Examples:
      gonio plot conductor --preset Au --param alpha=.3
      gonio plot phong -p p=32 --kind slice -o phong.pdf
      gonio plot dielectric -p alpha=.2 --kind albedo
      gonio plot ./tables -o tables.png
    """
    if os.sep in model or model.endswith(".npz") or Path(model).is_dir():
        from .viewer import energy_figures

        print(energy_figures.plot_tables(model, output))
        return
    from .viewer import plots

    path = plots.plot(model, param or [], preset, kind, angles, output)
    print(path)


@app.command(rich_help_panel=MATERIALS)
def bake(
    target: Annotated[str, typer.Argument(metavar="TARGET", help="A distribution (ggx, beckmann), or a material.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder to write.")] = Path("tables"),
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", metavar="NAME=VALUE", help="A parameter; repeatable.")
    ] = None,
    preset: Annotated[str, typer.Option(metavar="NAME", help="A named preset, such as Au for conductor.")] = "",
    lut: Annotated[str, typer.Option(metavar="E,Eavg,dfg,glass", help="Which tables.")] = "",
    size: Annotated[int, typer.Option(metavar="N", help="Texels along each axis.")] = 128,
    method: Annotated[str, typer.Option(metavar="NAME", help="quadrature, cosine, ggx, visible, ...")] = "quadrature",
    masking: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of a distribution: smith-correlated, ...")
    ] = None,
    spp: Annotated[int, typer.Option(metavar="N", help="Samples a texel, where sampled.")] = 1024,
    points: Annotated[str, typer.Option(metavar="hammersley|independent", help="Which random points.")] = "hammersley",
    seed: Annotated[int, typer.Option(metavar="N", help="Of independent points.")] = 0,
    layout: Annotated[str, typer.Option(metavar="linear|stretched|homework", help="Axes and files.")] = "linear",
    aspect: Annotated[
        float | None, typer.Option(metavar="A", help="alpha_y / alpha_x of a distribution: adds the axis phi.")
    ] = None,
    azimuths: Annotated[int, typer.Option(metavar="N", help="Slices along phi, with two widths.")] = 24,
    store: Annotated[str, typer.Option(metavar="E|1-E", help="What the homework's pictures hold.")] = "E",
    flip: Annotated[bool, typer.Option("--flip/--no-flip", help="Homework: lowest roughness at the bottom.")] = True,
    as_json: Json = False,
) -> None:
    """Write tables of directional albedo, its average, the split sum and rough glass, with their measured error.

    With two widths the tables have a third axis, the azimuth. Of a material without a width: E over the cosine.

    \b
    Examples:
      gonio bake ggx -o tables
      gonio bake ggx --aspect 0.25 --layout stretched -o brushed
      gonio bake ggx --lut glass --size 32 -o glass
      gonio bake ggx --layout homework --masking schlick-direct --method ggx -o homework
      gonio bake conductor --preset Au --lut E,Eavg -o gold
    """
    from .models import models as known_models
    from .optics.ndf import distributions
    from .render import tables
    from .viewer import plots

    if target in distributions():
        what: Any = target
        if param or preset:
            hint = "bake a material, such as conductor; alpha is an axis of the table"
            raise InputError(f"'{target}' is a distribution, without parameters", "--param", hint)
    else:
        known = [*distributions(), *known_models()]
        if target.replace("_", "-") not in known:
            raise InputError(f"unknown distribution or material '{target}'", "TARGET", did_you_mean(target, known))
        what = plots.make(target, param or [], preset)[0]
    options: dict[str, Any] = {"lut": lut.split(",")} if lut else {}
    options |= {"size": size, "method": method, "masking": masking, "spp": spp, "points": points, "seed": seed}
    options |= {"aspect": aspect, "azimuths": azimuths}
    baked = tables.bake(what, output, layout=layout, store=store, flip=flip, **options)
    _print_tables(baked.manifest, output, as_json)


@app.command(rich_help_panel=MATERIALS)
def info(
    path: Annotated[Path, typer.Argument(metavar="DIR", help="A baked folder or tables.npz.")], as_json: Json = False
) -> None:
    """Read baked tables back: what they hold, how they were made, how far they err.

    \b
    Example:
      gonio info tables
    """
    from .render import tables

    _print_tables(tables.describe(path), path, as_json)


def _print_tables(manifest: dict[str, Any], path: Path, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"path": str(path), **manifest}))
        return
    facts = [manifest["ndf"], manifest["masking"], manifest["method"], f"layout {manifest['layout']}"]
    facts += [f"alpha_y / alpha_x = {manifest['aspect']:g}"] if "aspect" in manifest else []
    print(f"{path}: {', '.join(filter(None, facts))}")
    table = _table("table", "shape", "max error", "rms", "between")
    for name, shape in manifest["tables"].items():
        error = manifest["error"].get(name, {})
        figures = [f"{error[key]:.1e}" if key in error else "" for key in ("max", "rms", "interpolation")]
        dims = [*manifest["dims"][name], ""]
        table.add_row(name, " x ".join(f"{n} {axis}".strip() for n, axis in zip(shape, dims, strict=False)), *figures)
    _print_rich(table)
    for axis, text in manifest["axes"].items():
        print(f"{axis:10} {text}")


@app.command(rich_help_panel=MATERIALS)
def compensation(
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Write a picture and JSON.")
    ] = None,
    walks: Annotated[int, typer.Option(metavar="N", help="Random walks a point of the referee.")] = 200_000,
    as_json: Json = False,
) -> None:
    """Compare the ways to give back lost light: furnace, distance to the random walk, reciprocity, cost.

    \b
    Example:
      gonio compensation -o comparison
    """
    from .energy import comparison

    if output is not None:
        from .render import tables
        from .viewer import energy_figures

        output = tables.check_folder(output)
    found = comparison.compare(walks=walks)
    if output is not None:
        energy_figures.plot_comparison(found, output)
    if as_json:
        print(json.dumps(found))
        return
    names = list(found["rms"])
    table = _table("method", *names, "furnace", "recipr.", "cost")
    print("RMS distance of the albedo to the random walk; largest loss in a white furnace; breach of reciprocity; time")
    for method in comparison.METHODS:
        rms = [f"{found['rms'][n][method]:.4f}" if method in found["rms"][n] else "" for n in names]
        broken = f"{found['reciprocity'][method]:.0e}" if method in found["reciprocity"] else ""
        furnace = f"{found['furnace']['white'].get(method, 0.0):.0e}"
        table.add_row(method, *rms, furnace, broken, f"{found['cost'][method]:.2f}")
    _print_rich(table)


@app.command(rich_help_panel=MATERIALS)
def verify(
    target: Annotated[
        str, typer.Argument(metavar="TARGET", help="MODEL, FILE.py:CLASS, mitsuba:PLUGIN, or a Mitsuba .xml or .json.")
    ],
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", metavar="NAME=VALUE", help="A parameter; repeatable.")
    ] = None,
    sweep: Annotated[
        str, typer.Option(metavar="NAME=A..B", help="A card for each of five values, or for NAME=V1,V2,...")
    ] = "",
    quick: Annotated[bool, typer.Option("--quick", help="A first look, in seconds.")] = False,
    deep: Annotated[bool, typer.Option("--deep", help="More samples, more directions, more widths.")] = False,
    seed: Annotated[int, typer.Option(metavar="N", help="Of all random numbers.")] = 1,
    law: Annotated[list[str] | None, typer.Option("--law", metavar="NAME", help="Only this law; repeatable.")] = None,
    at: Annotated[
        str, typer.Option(metavar="O/I", help="Only print both ways of one pair, theta,phi/theta,phi in degrees.")
    ] = "",
    report: Annotated[
        Path | None, typer.Option("--report", metavar="DIR", help="Write report.html and report.json there.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Prove a BSDF: energy, reciprocity, sampling, gradients, precision.

    Exit code 1 where a law is broken that the material does not declare to break.

    \b
    Examples:
      gonio verify conductor --param alpha=0.3 --report out
      gonio verify dielectric --sweep alpha=0.01..1 --quick
      gonio verify mitsuba:roughplastic
      gonio verify glass.py:Glass --law reciprocity
    """
    from rich.console import Console

    from .verify import run, targets, terminal
    from .verify.directions import parse

    if quick and deep:
        raise InputError("--quick and --deep together", "--quick", "give one of them")
    subjects = targets.resolve(target, param or [], sweep)
    if at:
        for subject in subjects:
            if as_json:
                print(json.dumps(terminal.pair(subject, *parse(at))))
            else:
                terminal.show_pair(subject, *parse(at), Console())
        return
    if report is not None:
        from .verify import page

        page.check_writable(report)
    effort = "quick" if quick else "deep" if deep else "default"
    with _Bar(target) as bar:
        found = run.verify(subjects, effort=effort, seed=seed, laws=law, progress=bar.step)
    if report is not None:
        page.write(found, report)
    if as_json:
        print(json.dumps(found.as_dict()))
    else:
        terminal.show(found, Console())
        if report is not None:
            print(report / "report.html")
    if not found.passed:
        raise typer.Exit(found.exit_code)


@app.command(rich_help_panel=MATERIALS)
def emit(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A material's name; see `gonio models`.")],
    lang: Annotated[str, typer.Option(metavar="glsl|wgsl|hlsl", help="The shader language.")] = "glsl",
    functions: Annotated[
        str, typer.Option(metavar="NAME,..", help="Which of eval, pdf, sample, terms.")
    ] = "eval,pdf,sample",
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", metavar="NAME=VALUE", help="A parameter; repeatable.")
    ] = None,
    preset: Annotated[str, typer.Option(metavar="NAME", help="A named preset, such as Au for conductor.")] = "",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Where to write; else it is printed.")
    ] = None,
    bundle: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write shader, manifest.json and tables (raw float32) there.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a material as shader code, traced from its own source: GLSL ES 3.00, WGSL or HLSL.

    \b
    Examples:
      gonio emit conductor --preset Au
      gonio emit dielectric --lang wgsl --functions eval -o glass.wgsl
      gonio emit kulla-conty -p base=conductor --bundle shaders
    """
    from .emit import bundle as make_bundle
    from .viewer import plots

    made = make_bundle(plots.make(model, param or [], preset)[0], lang, functions)
    written = [str(path) for path in made.write(bundle)] if bundle is not None else []
    if output is not None:
        from .render import images

        images.write_whole(output, made.text.encode())
        written.append(str(output))
    if as_json:
        print(json.dumps({"text": made.text, "manifest": made.manifest, "written": written}))
    elif written:
        print("\n".join(written))
    else:
        sys.stdout.write(made.text)


@app.command("models", rich_help_panel=MATERIALS)
def list_models(as_json: Json = False) -> None:
    """List the materials.

    \b
    Example:
      gonio models
    """
    from .models import models

    found = models()
    if as_json:
        rows = {name: {"doc": _first_line(cls), "parameters": list(cls.parameters())} for name, cls in found.items()}
        print(json.dumps(rows))
        return
    table = _table("material", "what it is", "parameters")
    for name, cls in found.items():
        table.add_row(name, _first_line(cls), ", ".join(cls.parameters()))
    _print_rich(table)


@app.command(rich_help_panel=MATERIALS)
def explain(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A material's name; see `gonio models`.")],
    as_json: Json = False,
) -> None:
    """Print a material's manual page: formula, parameters, limits, source.

    \b
    Example:
      gonio explain conductor
    """
    import inspect

    from .models import model as find

    cls = find(model)
    rows = [_parameter_row(parameter) for parameter in cls.parameters().values()]
    text = inspect.cleandoc(cls.__doc__ or "")
    if as_json:
        print(json.dumps({"name": cls.name, "doc": text, "parameters": rows}))
        return
    print(f"{cls.name}\n{'=' * len(cls.name)}\n{text}\n")
    if rows:
        _print_parameters(rows)


def _parameter_row(parameter: Any) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "doc": parameter.doc,
        "kind": parameter.kind,
        "range": parameter.range,
        "unit": parameter.unit,
        "default": "required" if parameter.required else str(parameter.default),
        "choices": parameter.choices,
    }


def _print_parameters(rows: list[dict[str, Any]]) -> None:
    """Each parameter with what it is, then its kind, range, unit and default; choices with their meaning."""
    import shutil
    import textwrap

    width = min(shutil.get_terminal_size().columns, 100)
    indent = max(len(row["name"]) for row in rows) + 4
    for row in rows:
        print(
            textwrap.fill(
                row["doc"], width, initial_indent=f"  {row['name']:<{indent - 2}}", subsequent_indent=" " * indent
            )
        )
        facts = [row["kind"]]
        if not row["choices"] and row["range"] != row["kind"]:
            facts.append(row["range"])
        facts += [row["unit"]] * bool(row["unit"])
        facts.append(row["default"] if row["default"] == "required" else f"default {row['default']}")
        print(" " * indent + ", ".join(facts))
        for choice, meaning in row["choices"].items():
            hanging = " " * (indent + 4)
            print(
                textwrap.fill(
                    f"{choice}: {meaning}", width, initial_indent=" " * (indent + 2), subsequent_indent=hanging
                )
            )


def _first_line(cls: type) -> str:
    return (cls.__doc__ or "").strip().split("\n", 1)[0]


# --- support -------------------------------------------------------------------------------------------


@app.command(rich_help_panel=SUPPORT)
def schema(
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Where to write; else it is printed.")
    ] = None,
) -> None:
    """Print the JSON Schema of scene files, by which editors complete and check them.

    \b
    Example:
      gonio schema -o scene.schema.json
    """
    from .render import scene

    text = json.dumps(scene.json_schema(), indent=2) + "\n"
    if output is None:
        sys.stdout.write(text)
        return
    from .render import images

    images.write_whole(output, text.encode())
    print(output)


@app.command(rich_help_panel=SUPPORT)
def doctor(as_json: Json = False) -> None:
    """Say what this machine can render with, what is missing, and how to get it.

    Exit code 3 where there is nothing to render with.

    \b
    Example:
      gonio doctor
    """
    from .render import doctor as examination

    report = examination.examine()
    if as_json:
        print(json.dumps(report.as_dict()))
    else:
        table = _table("", "", "")
        marks = {"ok": "[green]ok[/]", "missing": "[yellow]--[/]", "bad": "[red]!![/]"}
        for finding in report.findings:
            table.add_row(marks[finding.state], finding.subject, finding.text)
        _print_rich(table)
        print(report.verdict)
    if not report.can_render:
        raise typer.Exit(3)


# --- printing and errors -------------------------------------------------------------------------------


def _table(*headings: str) -> Any:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, show_header=any(headings), pad_edge=False)
    for index, heading in enumerate(headings):
        table.add_column(heading, no_wrap=index == 0, style="cyan" if index == 0 else "")
    return table


def _print_rich(what: Any) -> None:
    from rich.console import Console

    Console().print(what)


def _fail(error: GonioError, as_json: bool) -> int:
    """Print an error in three lines at most (what, where, hint), or as JSON; its exit code."""
    if as_json:
        parts = {"what": error.what, "where": error.where, "hint": error.hint, "code": error.code}
        print(json.dumps({"error": parts}))
        return error.code
    from rich.console import Console
    from rich.text import Text

    text = Text("error: ", style="bold red").append(" ".join(error.what.split()), style="default not bold")
    for name, line in (("   in: ", error.where), (" hint: ", error.hint)):
        if line:
            text.append(f"\n{name}", style="bold cyan").append(" ".join(line.split()), style="default not bold")
    Console(stderr=True, highlight=False, soft_wrap=True).print(text)
    return error.code


def _show_warning(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
    """Our own warnings are for the user, in one line; those of libraries are for their authors."""
    if issubclass(category, GonioWarning) or os.environ.get("GONIO_DEBUG"):
        print(f"warning: {message}", file=sys.stderr)


def _run(arguments: list[str] | None) -> int:
    as_json = "--json" in (sys.argv[1:] if arguments is None else arguments)
    try:
        code = app(arguments, prog_name="gonio", standalone_mode=False)
        sys.stdout.flush()
        if code == INTERRUPTED:  # Typer's answer to a KeyboardInterrupt; a render that kept its picture exits itself
            print("ended by Ctrl-C; nothing was written", file=sys.stderr)
        return code if isinstance(code, int) else 0
    except GonioError as error:
        return _fail(error, as_json)
    except BrokenPipeError:  # `gonio schema | head`: whoever read us has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if hasattr(error, "format_message"):  # a usage error of the argument parser
            if not error.format_message():  # `gonio` alone: the help has been printed
                return 2
            return _fail(_usage_error(error), as_json)
        if os.environ.get("GONIO_DEBUG"):
            raise
        what = f"Gonio failed: {type(error).__name__}: {str(error).strip().splitlines()[0] if str(error) else ''}"
        failure = GonioError(what, "", "this is a fault of Gonio; run `gonio --debug ...` and report what it prints")
        failure.code = 3
        return _fail(failure, as_json)


def _usage_error(error: Any) -> InputError:
    command = error.ctx.command_path if getattr(error, "ctx", None) else "gonio"
    message = error.format_message()
    return InputError(message, "", "" if "Did you mean" in message else f"see `{command} --help`")


def main(arguments: list[str] | None = None) -> None:
    """The `gonio` command."""
    import warnings

    warnings.showwarning = _show_warning
    warnings.simplefilter("always", GonioWarning)
    sys.exit(_run(arguments))


if __name__ == "__main__":
    main()
