"""`gonio capture`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from ..options import Json, Parameters
from ..output import Bar, listing, print_rich, print_warnings
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...instruments.capture.run import Capture


@verb(MATERIALS, place=9)
def capture(
    photographs: Annotated[
        list[str], Argument(metavar="PHOTOS...", help="A folder with a calibration.json, or photographs that it lists.")
    ],
    *,
    output: Annotated[
        Path | None,
        Option("-o", "--output", metavar="FILE", help="A table (.gonio, .binary, ...) or .json; a .png beside it."),
    ] = None,
    model: Annotated[
        str | None, Option("--model", "-m", metavar="NAME", help='What is fitted, such as "lambert+ggx".')
    ] = None,
    param: Parameters = None,
    free: Annotated[list[str] | None, Option(metavar="NAME", help="A parameter that moves though it is 1.")] = None,
    calibration: Annotated[
        Path | None,
        Option(metavar="FILE", help="What stood where; else calibration.json beside them."),
    ] = None,
    grazing: Annotated[float, Option(metavar="DEG", help="Leave out pixels beyond this angle.")] = 80.0,
    next_: Annotated[
        int, Option("--next", metavar="N", help="Say where the lamp should stand for the next N photographs.")
    ] = 0,
    as_json: Json = False,
) -> None:
    """Measure a material from photographs of a ball or a flat sample under a lamp.

    The calibration file says where camera, sample and lamps stood, and how sure that is: docs/capture.md has its keys.
    A .json is of a fit, of lambert+ggx where no model is named. With --next and a calibration that lists no photographs
    yet, the first ones are planned for a material like the model.

    \b
    Examples:
      gonio capture photographs -o paint.gonio
      gonio capture photographs -m lambert+ggx -o paint.json --next 2
      gonio capture a.png b.png --calibration rig.json -o paint.binary
    """
    from ...catalog import notation
    from ...instruments.capture import run

    fixed = dict(notation.assignment(one) for one in param or ())
    target = None if output is None else run.check_output(output)
    wanted = model or ("lambert+ggx" if next_ or (target is not None and target.suffix.lower() == ".json") else None)
    if next_ and run.is_blank(photographs, calibration):
        path = run.calibration_of(photographs, calibration)
        plan = run.plan(path, wanted or "lambert+ggx", next_, fixed=fixed, free=tuple(free or ()))
        if as_json:
            print(json.dumps([one.as_dict() for one in plan]))
        else:
            print(*plan, sep="\n")
        return
    with Bar("capture") as bar:
        found = run.capture(
            photographs,
            wanted,
            calibration=calibration,
            grazing=grazing,
            fixed=fixed,
            free=tuple(free or ()),
            progress=lambda text: bar.step(0, 1, text),
        )
        plan = found.next(next_) if next_ else []
    written = []
    if target is not None:
        from ...viewer import capture_figure

        written = [found.save(target), target.with_suffix(".png")]
        capture_figure.draw(found).save(written[1])
    if as_json:
        print(json.dumps(found.as_dict() | ({"next": [one.as_dict() for one in plan]} if plan else {})))
        return
    print_warnings(found.warnings)
    _print(found)
    for one in plan:
        print(f"next: {one}")
    if written:
        print(*written)


def _print(found: Capture) -> None:
    left = ", ".join(f"{found.counts[why]} {why}" for why in ("saturated", "shadowed", "grazing"))
    print(f"{found.counts['used']} pixels in {len(found.samples.count)} samples; left out: {left}")
    if found.fitted is None:
        return
    print(found.fit.text)
    table = listing("", "value", "95 % interval")
    for name, value, (low, high) in zip(found.fit.names, found.fit.values, found.fit.interval, strict=True):
        table.add_row(name, f"{value:.5g}", f"{low:.5g} to {high:.5g}")
    print_rich(table)
    print(f"{100.0 * found.fit.relative:.3g} % off on average, pixels by {100.0 * found.fitted.noise:.3g} %")
