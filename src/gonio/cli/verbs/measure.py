"""The command `gonio measure`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from .. import completion
from ..options import Device, Json, Material, Options, Seed, output_option, samples_option
from ..output import Bar, listing, print_rich
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...instruments.goniometer.run import Readout

MAX_ROWS = 12  # largest number of angles of incidence that are listed


class Detector(Options):
    """Options that describe the positions of the detector and its imperfections."""

    theta_i: Annotated[
        str | None,
        Option(
            metavar="DEG",
            help="Angles of incidence in degrees, such as 0,30,60 or 0:85:5; for .gonio, .astm, .brdf, .csv.",
        ),
    ] = None
    theta_r: Annotated[
        str | None, Option(metavar="DEG", help="Viewing angles in degrees, in the same form as --theta-i.")
    ] = None
    phi: Annotated[
        str | None, Option(metavar="DEG", help="Differences in azimuth between light and view, from 0 to 180 degrees.")
    ] = None
    solid_angle: Annotated[
        float | None,
        Option(
            metavar="SR", help="Solid angle of the detector; by default, 0.006 sr for surfaces and 0 for materials."
        ),
    ] = None
    noise: Annotated[
        float, Option(metavar="FRACTION", help="Relative standard deviation of the noise in each reading.")
    ] = 0.0
    blocked: Annotated[
        float,
        Option(metavar="DEG", help="Angle around the lamp within which the detector blocks the light, in degrees."),
    ] = 0.0
    table: Annotated[
        str,
        Option(
            metavar="NAME",
            help="Kind of table in a .gonio file: angles, half-difference, adaptive, specular or samples.",
        ),
    ] = ""


class Specimen(Options):
    """Options that describe a rough surface and the rays traced to it."""

    surface: Annotated[
        str | None,
        Option(
            metavar="NAME",
            help="Surface: gaussian, vgroove, spheres or a height map (.exr); --param sets its parameters.",
            autocompletion=completion.surfaces,
        ),
    ] = None
    facet: Annotated[
        str, Option(metavar="MODEL", help="Material of the facets: mirror, lambert:albedo=0.8, conductor:Au, ...")
    ] = "mirror"
    bounces: Annotated[str, Option(metavar="NAME", help="Bounces to count: all, first or later.")] = "all"
    samples: Annotated[int, samples_option("Number of rays per angle of incidence.")] = 1_000_000
    patches: Annotated[int, Option(metavar="N", help="Number of patches to measure, for random surfaces.")] = 16
    seed: Seed = None
    device: Device = "cpu"


@verb(MATERIALS, place=7)
def measure(
    material: Annotated[
        str | None,
        Argument(
            metavar="MODEL",
            help="Material to measure; omit it if --surface is given.",
            autocompletion=completion.materials,
        ),
    ] = None,
    *,
    output: Annotated[Path, output_option("FILE", "File for the table; its suffix selects the format.")],
    made: Material,
    detector: Detector,
    specimen: Specimen,
    as_json: Json = False,
) -> None:
    """Measure a material, or a rough surface made of facets, with a virtual gonioreflectometer.

    For a rough surface, rays are traced until they leave the surface, and the detector counts them. The output can have
    any format that Gonio writes. Each measured value has a standard error, which is stored in .gonio files.

    \b
    Examples:
      gonio measure conductor --param alpha=0.2 -o gold.binary
      gonio measure --surface gaussian --param alpha=0.3 --facet mirror -o rough.gonio
      gonio measure --surface vgroove --param sigma=0.5 --facet lambert:albedo=0.8 -o grooves.binary
      gonio measure --surface heights.exr --facet conductor:Au --theta-i 0,30,60 -o worn.gonio
      gonio measure conductor --preset Au --noise 0.02 --blocked 5 --solid-angle 0.002 -o real.binary
    """
    import time

    from ...instruments.goniometer import plan, run

    begun = time.perf_counter()
    angles = {name: plan.axis_of(getattr(detector, name), name) for name in ("theta_i", "theta_r", "phi")}
    options = {**vars(detector), **angles, **vars(specimen)}
    if specimen.surface is not None:
        made.shaders(())
        options["surface"] = run.surface_of(specimen.surface, made.param or (), made.preset)
    with Bar("measure") as bar:

        def progress(done: int, total: int) -> None:
            rate = done / max(time.perf_counter() - begun, 1e-3)
            bar.step(done, total, f"{done / 1e6:.1f}/{total / 1e6:.1f} M rays  {rate / 1e6:.2f} M rays/s")

        target = made.text(material) if material and not specimen.surface else material
        readout = run.measure(target, output, **options, progress=progress)
    if as_json:
        print(json.dumps(readout.as_dict()))
        return
    _print(readout)


def _print(readout: Readout) -> None:
    error = "" if readout.error is None else f", median standard error {100.0 * readout.error:.2g} %"
    hidden = f", {100.0 * readout.blocked:.2g} % blocked" if readout.blocked else ""
    print(f"{readout.path}  {readout.table.title}: {readout.cells} cells{hidden}{error}")
    if readout.rays:
        rate = readout.rays / readout.seconds / 1e6
        print(
            f"{readout.rays / 1e6:.1f} M rays in {readout.seconds:.1f} s ({rate:.2f} M/s); fractions of the light "
            "that leave the surface:"
        )
        table = listing("incidence", "first bounce", "later bounces", "total", "lost")
        rows = list(zip(readout.incidence, readout.first, readout.later, readout.lost, strict=True))
        for angle, first, later, lost in rows[:: -(-len(rows) // MAX_ROWS)]:
            table.add_row(f"{angle:.4g}", f"{first:.4f}", f"{later:.4f}", f"{first + later:.4f}", f"{lost:.1e}")
        print_rich(table)
    for note in readout.notes:
        print(f"note: {note}")
