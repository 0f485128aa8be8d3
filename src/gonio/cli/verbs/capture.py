"""The command `gonio capture`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from ..options import Fitting, Json, Models, output_option
from ..output import Bar, print_intervals, print_warnings
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...instruments.capture.planning import Proposal
    from ...instruments.capture.run import Capture


Photographs = Annotated[
    list[str],
    Argument(metavar="PHOTOS...", help="Folder with a calibration.json, or photographs that the calibration lists."),
]


@verb(MATERIALS, place=9)
def capture(
    photographs: Photographs,
    *,
    output: Annotated[
        Path | None,
        output_option("FILE", "File for the table (.gonio, .binary, ...) or fit (.json), with a figure next to it."),
    ] = None,
    model: Models = None,
    how: Fitting,
    calibration: Annotated[
        Path | None,
        Option(metavar="FILE", help="Calibration file; by default, calibration.json in the folder of the photographs."),
    ] = None,
    next_: Annotated[
        int, Option("--next", metavar="N", help="Number of further photographs for which to suggest lamp positions.")
    ] = 0,
    as_json: Json = False,
) -> None:
    """Measure a material from photographs of a ball or a flat sample under a lamp.

    The calibration file states the positions of the camera, the sample and the lamps, with their uncertainties;
    docs/capture.md lists its keys. An output file with the suffix .json contains a fitted model, lambert+ggx by
    default. If the calibration lists no photographs yet, --next plans the first ones for a material similar to the
    model.

    \b
    Examples:
      gonio capture photographs -o paint.gonio
      gonio capture photographs -m lambert+ggx -o paint.json --next 2
      gonio capture photographs -m lambert+ggx -m lambert+ward
      gonio capture a.png b.png --calibration rig.json -o paint.binary
    """
    from ...instruments.capture import run

    target = None if output is None else run.check_output(output)
    if not model and (next_ or how.preset or (target is not None and target.suffix.lower() == ".json")):
        model = ["lambert+ggx"]
    named = how.models(model or ())
    fixed, free = how.fixed(), tuple(how.free or ())
    if next_ and run.is_blank(photographs, calibration):
        rig, first = run.calibration_of(photographs, calibration), next(iter(named), "lambert+ggx")
        return _print_plan(run.plan(rig, first, next_, fixed=fixed, free=free), as_json)
    with Bar("capture") as bar:
        result = run.capture(
            photographs,
            named,
            calibration=calibration,
            grazing=how.grazing,
            param=fixed,
            free=free,
            progress=lambda text: bar.step(0, 1, text),
        )
        plan = result.next(next_) if next_ else []
    written = [] if target is None else _write(result, target)
    if as_json:
        print(json.dumps(result.as_dict() | ({"next": [one.as_dict() for one in plan]} if plan else {})))
    else:
        _print(result)
        for line in [*(f"next: {one}" for one in plan), *([" ".join(map(str, written))] if written else [])]:
            print(line)


def _write(result: Capture, target: Path) -> list[Path]:
    """Write the table or the fit, and a figure; returns the paths of the files."""
    from ...viewer import capture_figure

    written = [result.save(target), target.with_suffix(".png")]
    capture_figure.draw(result).save(written[1])
    return written


def _print_plan(plan: Sequence[Proposal], as_json: bool) -> None:
    """Print the plan for the first photographs."""
    if as_json:
        print(json.dumps([one.as_dict() for one in plan]))
    else:
        print(*plan, sep="\n")


def _print(result: Capture) -> None:
    print_warnings(result.warnings)
    left = ", ".join(f"{result.counts[why]} {why}" for why in ("saturated", "shadowed", "grazing"))
    print(f"{result.counts['used']} pixels in {len(result.samples.count)} samples; left out: {left}")
    if result.fitted is None:
        return
    ranks = [f"{rank}. " for rank in range(1, len(result.others) + 2)] if result.others else [""]
    for rank, one in zip(ranks, (result.fit, *result.others), strict=True):
        print(rank + one.text)
        print_intervals(one.names, one.values, one.interval)
        ranked = f", BIC {one.criterion:.0f}" if rank else ""
        noise = f", pixel noise {100.0 * result.fitted.noise:.3g} %" if one is result.fit else ""
        print(f"mean error {100.0 * one.relative:.3g} %{noise}{ranked}")
