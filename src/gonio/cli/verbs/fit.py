"""The command `gonio fit`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from ...errors import InputError
from ..options import Fitting, Json, Models, Options, Spp, output_option
from ..output import Bar, listing, print_intervals, print_rich
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...fitting.batch import Row

PICTURES = (".exr", ".hdr", ".png")


class Model(Options):
    """The model that is fitted to measured values."""

    model: Models = None
    lobes: Annotated[int, Option(metavar="N", help="Number of copies of the model's last lobe.")] = 1
    loss: Annotated[str, Option(metavar="NAME", help="Loss to minimize: relative, log, log1p, cuberoot or linear.")] = (
        "relative"
    )


class Scene(Options):
    """The scene whose materials are fitted to a picture."""

    scene: Annotated[
        Path | None, Option(metavar="FILE", help="Scene whose materials are fitted to the picture DATA.")
    ] = None
    spp: Spp = 64


@verb(MATERIALS, place=8)
def fit(
    data: Annotated[
        list[str] | None,
        Argument(
            metavar="[DATA...]", help="Measurement files, a folder of them, or a picture of the scene given by --scene."
        ),
    ] = None,
    *,
    what: Model,
    how: Fitting,
    of: Scene,
    output: Annotated[
        Path | None, output_option("FILE", "File for the result (.json); a figure is written next to it.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Fit materials to measured values, and print the parameters with 95 % confidence intervals.

    -p NAME=VALUE fixes a parameter. Several models are ranked by the Bayesian information criterion (BIC), which
    penalizes additional parameters; the lowest value is best. With several files, each result is stored as soon as it
    is computed; to continue after Ctrl-C, run the same command again.

    With --scene, materials of the scene are fitted to a picture of the scene. --free selects a parameter, such as
    shapes.0.material.alpha, or all parameters of a material; the default is shapes.0.material. --model replaces that
    material, and -p sets values in the scene.

    \b
    Examples:
      gonio fit gold.binary --model conductor -o gold.json
      gonio fit paint.binary -m lambert+ggx -m lambert+beckmann -m oren-nayar
      gonio fit measured/ --model lambert+ggx -o all.json
      gonio fit photo.exr --scene scene.json --free shapes.0.material.alpha -o found.json
    """
    from ...fitting import batch

    if not data:
        raise _nothing(of.scene)
    target = None if output is None else batch.check_output(output)
    if of.scene is not None:
        _to_picture(data, of.scene, _single_model(how.models(what.model or ())), how, of.spp, target, as_json)
        return
    files = batch.files_of(_measurements(data))
    with Bar("fit", len(files)) as bar:
        rows = batch.run(
            files,
            how.models(what.model or ()) or ["lambert+ggx"],
            batch.Settings(what.lobes, what.loss, how.fixed(), tuple(how.free or ()), how.grazing),
            report=lambda done, total, text: bar.step(done, total, text),
            notice=bar.tell,
        )
    written = [] if target is None else _write(target, files, rows)
    if as_json:
        print(json.dumps([row.as_dict() for row in rows] if len(rows) > 1 else rows[0].as_dict()))
    else:
        for row in rows:
            _print(row.as_dict())
        if written:
            print(*written)
    if not any(row.fits for row in rows):
        raise Exit(2)  # nothing was fitted


def _write(target: Path, files: Sequence[str], rows: Sequence[Row]) -> list[Path]:
    """Write the rows and, for a single file, a figure; returns the files written."""
    from ...fitting import batch
    from ...viewer import fit_figure

    batch.write(target, rows)
    if len(files) > 1 or rows[0].best is None:
        return [target]
    fit_figure.draw(rows[0].best, files[0]).save(target.with_suffix(".png"))
    return [target, target.with_suffix(".png")]


def _nothing(scene: Path | None) -> InputError:
    if scene is not None:
        return InputError("--scene given without a picture", "DATA", f"gonio fit picture.exr --scene {scene}")
    hint = "name a file of measurements, or a picture with --scene scene.json"
    return InputError("no files of measurements given", "gonio fit", hint)


def _measurements(data: list[str]) -> list[str]:
    """The files. Raises InputError if there is only one, and it is a picture."""
    if len(data) == 1 and Path(data[0]).suffix.lower() in PICTURES:
        hint = f"gonio fit {data[0]} --scene scene.json"
        raise InputError(f"'{data[0]}' is a picture, but --scene is not given", "--scene", hint)
    return data


def _single_model(models: Sequence[str]) -> str | None:
    if len(models) > 1:
        raise InputError(f"{len(models)} models given, one expected", "--model", "fit them one after the other")
    return models[0] if models else None


def _to_picture(
    data: Sequence[str],
    scene: Path,
    model: str | None,
    how: Fitting,
    spp: int | None,
    target: Path | None,
    as_json: bool,
) -> None:
    """Fit a scene's materials to a picture of the scene."""
    from ...catalog import notation
    from ...instruments import pictures
    from ...viewer import figures

    if len(data) > 1:
        raise InputError(f"{len(data)} files given with --scene, one expected", "DATA", "give one picture of the scene")
    with Bar("fit") as bar:
        result = pictures.fit_picture(
            data[0],
            scene,
            how.free or ["shapes.0.material"],
            model=model,
            param={path: figures.parse_value(value) for path, value in how.fixed().items()},
            spp=pictures.SPP if spp is None else spp,
            progress=lambda step, loss: bar.step(step, pictures.STEPS, f"step {step}, loss {loss:.4g}"),
        )
    if target is not None:
        from ...viewer import picture_fit_figure

        result.save(target)
        picture_fit_figure.draw(result).save(target.with_suffix(".png"))
    if as_json:
        print(json.dumps(result.as_dict()))
        return
    for path, material in result.materials.items():
        print(f"{path}  {notation.written(material)}")
    print_intervals(result.names, result.values, result.interval)
    print(f"mean error {100.0 * result.relative:.3g} %, {len(result.losses) - 1} steps, {result.seconds:.1f} s")
    for note in result.notes:
        print(f"note: {note}")
    if target is not None:
        print(target, target.with_suffix(".png"))


def _print(row: dict) -> None:
    print(f"{row['file']}  {row.get('failed', '')}".rstrip())
    for rank, one in enumerate(row.get("fits", []), 1):
        print(f"{rank}. {one['material']}")
        table = listing("", "value", "95 % interval")
        for name, about in one["parameters"].items():
            ends = about["interval"]
            reach = "not determined by the data" if ends is None else f"{ends[0]:.5g} to {ends[1]:.5g}"
            table.add_row(name, f"{about['value']:.5g}", reach)
        print_rich(table)
        print(
            f"   mean error {100.0 * one['relative']:.3g} %, {one['error']:.4g} ({one['metric']}), "
            f"BIC {one['criterion']:.0f}, {one['values']} values, {one['seconds']:.1f} s"
        )
        for note in one["notes"]:
            print(f"   note: {note}")
