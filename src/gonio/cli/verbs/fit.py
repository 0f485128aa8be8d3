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
    data: Annotated[list[str], Argument(metavar="DATA...", help="Files of measurements, or one folder of them.")],
    *,
    model: Annotated[
        list[str] | None,
        Option("--model", "-m", metavar="NAME", help='What is fitted, such as "lambert+ggx"; repeatable: then ranked.'),
    ] = None,
    lobes: Annotated[int, Option(metavar="N", help="How many of the model's last part are added up.")] = 1,
    metric: Annotated[str, Option(metavar="NAME", help="relative, log, cuberoot or linear.")] = "relative",
    param: Parameters = None,
    free: Annotated[list[str] | None, Option(metavar="NAME", help="A parameter that moves though it is 1.")] = None,
    grazing: Annotated[float, Option(metavar="DEG", help="Leave out directions beyond this angle.")] = 80.0,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help=".json; a figure of the same name lies beside it.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Fit materials to measured values: parameters with their 95 % intervals.

    -p NAME=VALUE holds a parameter. Of several models the one with the lowest criterion (BIC) is best: a parameter more
    must earn its place. Of several files each is a row that is kept when it is done: after Ctrl-C, say the same again.

    \b
    Examples:
      gonio fit gold.binary --model conductor -o gold.json
      gonio fit paint.binary -m lambert+ggx -m lambert+beckmann -m oren-nayar
      gonio fit measured/ --model lambert+ggx -o all.json
    """
    from ...measure.fitting import batch
    from ...models import notation

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
