"""Verbs about materials: plot, verify, emit, models, explain."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from .app import MATERIALS, app
from .options import Json
from .output import Bar, listing, print_rich


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
        from ..viewer import energy_figures

        print(energy_figures.plot_tables(model, output))
        return
    from ..viewer import plots

    path = plots.plot(model, param or [], preset, kind, angles, output)
    print(path)


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

    from ..verify import run, targets, terminal
    from ..verify.directions import parse

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
        from .. import files
        from ..verify import page

        files.check_folder(report)
    effort = "quick" if quick else "deep" if deep else "default"
    with Bar(target) as bar:
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
    from .. import files
    from ..emit import bundle as make_bundle
    from ..models import notation

    if output is not None:  # before anything is computed or written
        files.check_file(output)
    if bundle is not None:
        files.check_folder(bundle)
    made = make_bundle(notation.named(model, param or [], preset)[0], lang, functions)
    written = [str(path) for path in made.write(bundle)] if bundle is not None else []
    if output is not None:
        files.write_whole(output, made.text.encode())
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
    from ..models import models

    found = models()
    if as_json:
        rows = {name: {"doc": _first_line(cls), "parameters": list(cls.parameters())} for name, cls in found.items()}
        print(json.dumps(rows))
        return
    table = listing("material", "what it is", "parameters")
    for name, cls in found.items():
        table.add_row(name, _first_line(cls), ", ".join(cls.parameters()))
    print_rich(table)


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

    from ..models import model as find

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
