"""`gonio fit`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from ..options import Json, Parameters
from ..output import Bar, listing, print_rich
from .base import MATERIALS, verb


@verb(MATERIALS, place=8)
def fit(
    data: Annotated[
        list[str] | None, Argument(metavar="[DATA...]", help="Files of measurements, or one folder of them.")
    ] = None,
    *,
    model: Annotated[
        list[str] | None,
        Option("--model", "-m", metavar="NAME", help='What is fitted, such as "lambert+ggx"; repeatable: then ranked.'),
    ] = None,
    lobes: Annotated[int, Option(metavar="N", help="How many of the model's last part are added up.")] = 1,
    metric: Annotated[str, Option(metavar="NAME", help="relative, log, log1p, cuberoot or linear.")] = "relative",
    param: Parameters = None,
    free: Annotated[list[str] | None, Option(metavar="NAME", help="A parameter that moves though it is 1.")] = None,
    grazing: Annotated[float, Option(metavar="DEG", help="Leave out directions beyond this angle.")] = 80.0,
    picture: Annotated[
        Path | None, Option("--from", metavar="FILE", help="A picture of --scene, to whose materials it is fitted.")
    ] = None,
    scene: Annotated[Path | None, Option(metavar="FILE", help="The scene that the picture of --from shows.")] = None,
    spp: Annotated[int, Option(metavar="N", help="Samples per pixel of each render, with --from.")] = 64,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help=".json; a figure of the same name lies beside it.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Fit materials to measured values: parameters with their 95 % intervals.

    -p NAME=VALUE holds a parameter. Of several models the one with the lowest criterion (BIC) is best: a parameter more
    must earn its place. Of several files each is a row that is kept when it is done: after Ctrl-C, say the same again.

    With --from and --scene, parameters of the scene's materials are fitted to a picture of it: those that --free
    names, such as shapes.0.material.alpha, or all of a material, shapes.0.material if nothing is said. --model puts
    another material there, and -p sets values of the scene before.

    \b
    Examples:
      gonio fit gold.binary --model conductor -o gold.json
      gonio fit paint.binary -m lambert+ggx -m lambert+beckmann -m oren-nayar
      gonio fit measured/ --model lambert+ggx -o all.json
      gonio fit --from photo.exr --scene scene.json --free shapes.0.material.alpha -o found.json
    """
    from ...errors import InputError

    if picture is not None or scene is not None:
        if picture is None or scene is None or data:
            raise InputError("--from and --scene go together, without files of measurements", "gonio fit")
        _to_picture(picture, scene, model, param, free, spp, output, as_json)
        return
    if not data:
        raise InputError("no files of measurements given", "gonio fit", "or give --from picture.exr --scene scene.json")
    from ...catalog import notation
    from ...fitting import batch

    fixed = dict(notation.assignment(one) for one in param or ())
    files = batch.files_of(data)
    target = None if output is None else batch.check_output(output)
    with Bar("fit", len(files)) as bar:
        rows = batch.run(
            files,
            model or ["lambert+ggx"],
            lobes=lobes,
            metric=metric,
            fixed=fixed,
            free=tuple(free or ()),
            grazing=grazing,
            report=lambda done, total, text: bar.step(done, total, text),
            notice=bar.tell,
        )
    if target is not None:
        from ...viewer import fit_figure

        batch.write(target, rows)
        if len(files) == 1 and rows[0].best is not None:
            fit_figure.draw(rows[0].best, files[0]).save(target.with_suffix(".png"))
    if as_json:
        print(json.dumps([row.as_dict() for row in rows] if len(rows) > 1 else rows[0].as_dict()))
        return
    for row in rows:
        _print(row.as_dict())
    if target is not None:
        print(target, *([target.with_suffix(".png")] if len(files) == 1 else []))


def _to_picture(
    picture: Path,
    scene: Path,
    model: list[str] | None,
    param: list[str] | None,
    free: list[str] | None,
    spp: int,
    output: Path | None,
    as_json: bool,
) -> None:
    from ...catalog import notation
    from ...errors import InputError
    from ...fitting import batch
    from ...instruments import pictures
    from ...viewer import figures

    if model is not None and len(model) > 1:
        raise InputError(f"{len(model)} models given, one expected", "--model", "fit them one after the other")
    target = None if output is None else batch.check_output(output)
    given = (notation.assignment(one) for one in param or ())
    with Bar("fit") as bar:
        found = pictures.fit_picture(
            picture,
            scene,
            free or ["shapes.0.material"],
            model=model[0] if model else None,
            fixed={path: figures.parse_value(value) for path, value in given},
            spp=spp,
            progress=lambda step, loss: bar.step(step, pictures.STEPS, f"step {step}, loss {loss:.4g}"),
        )
    if target is not None:
        from ...viewer import picture_fit_figure

        found.save(target)
        picture_fit_figure.draw(found).save(target.with_suffix(".png"))
    if as_json:
        print(json.dumps(found.as_dict()))
        return
    for path, material in found.materials.items():
        print(f"{path}  {notation.written(material)}")
    table = listing("", "value", "95 % interval")
    for name, value, (low, high) in zip(found.names, found.values, found.interval, strict=True):
        table.add_row(name, f"{value:.5g}", f"{low:.5g} to {high:.5g}")
    print_rich(table)
    print(f"{100.0 * found.relative:.3g} % off on average, {len(found.losses) - 1} steps, {found.seconds:.1f} s")
    for note in found.notes:
        print(f"note: {note}")
    if target is not None:
        print(target, target.with_suffix(".png"))


def _print(row: dict) -> None:
    print(f"{row['file']}  {row.get('failed', '')}".rstrip())
    for rank, one in enumerate(row.get("fits", []), 1):
        print(f"{rank}. {one['material']}")
        table = listing("", "value", "95 % interval")
        for name, about in one["parameters"].items():
            value, error = about["value"], about["error"]
            reach = (
                "not told by the data" if error is None else f"{value - 1.96 * error:.5g} to {value + 1.96 * error:.5g}"
            )
            table.add_row(name, f"{value:.5g}", reach)
        print_rich(table)
        print(
            f"   {100.0 * one['relative']:.3g} % off on average, {one['error']:.4g} ({one['metric']}), "
            f"criterion {one['criterion']:.0f}, {one['values']} values, {one['seconds']:.1f} s"
        )
        for note in one["notes"]:
            print(f"   note: {note}")
