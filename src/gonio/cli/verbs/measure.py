"""`gonio measure`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from .. import completion
from ..options import Device, Json, Material
from ..output import Bar, listing, print_rich
from .base import MATERIALS, verb

if TYPE_CHECKING:
    from ...instruments.goniometer.run import Readout

MOST_ROWS = 12  # angles of incidence that are listed


@dataclass(frozen=True)
class Detector:
    """How the detector looks, and what is wrong with it."""

    theta_i: Annotated[
        str | None,
        Option(metavar="DEG", help="Angles of light, such as 0,30,60 or 0:85:5; for .gonio, .astm and .brdf."),
    ] = None
    theta_r: Annotated[str | None, Option(metavar="DEG", help="Angles of view.")] = None
    phi: Annotated[str | None, Option(metavar="DEG", help="Azimuths between light and view, 0 to 180.")] = None
    solid_angle: Annotated[
        float | None, Option(metavar="SR", help="Of the detector: .006 for surfaces, a point for materials.")
    ] = None
    noise: Annotated[float, Option(metavar="SHARE", help="Standard deviation of a reading, as a share of it.")] = 0.0
    blocked: Annotated[float, Option(metavar="DEG", help="About the lamp, where the detector cannot stand.")] = 0.0


@verb(MATERIALS, place=7)
def measure(
    model: Annotated[
        str | None,
        Argument(metavar="MODEL", help="A material; none with --surface.", autocompletion=completion.materials),
    ] = None,
    *,
    output: Annotated[Path, Option("-o", "--output", metavar="FILE", help="The suffix names the format.")],
    surface: Annotated[
        str | None,
        Option(
            metavar="NAME",
            help="gaussian, vgroove, spheres or a file of heights (.exr); --param sets its parameters.",
            autocompletion=completion.surfaces,
        ),
    ] = None,
    facet: Annotated[str, Option(metavar="MODEL", help="mirror, lambert:albedo=.8, conductor:Au, ...")] = "mirror",
    made: Material,
    how: Detector,
    kind: Annotated[
        str, Option(metavar="NAME", help="Of table, in .gonio: angles, half-difference, adaptive, specular, samples.")
    ] = "",
    bounces: Annotated[str, Option(metavar="NAME", help="Of a surface: all, first or later.")] = "all",
    rays: Annotated[int, Option(metavar="N", help="Rays at each angle of incidence.")] = 1_000_000,
    patches: Annotated[int, Option(metavar="N", help="Pieces of a random surface.")] = 16,
    seed: Annotated[int, Option(metavar="N", help="Same seed, same values.")] = 0,
    device: Device = "cpu",
    as_json: Json = False,
) -> None:
    """Measure a material, or a surface of facets, as a gonioreflectometer does.

    Rays go down to the surface and bounce until they leave; the detector counts them. Any material can be measured too:
    into any format that Gonio writes. Each value has its standard error, which .gonio files keep.

    \b
    Examples:
      gonio measure conductor --param alpha=.2 -o gold.binary
      gonio measure --surface gaussian --param alpha=.3 --facet mirror -o rough.gonio
      gonio measure --surface vgroove --param sigma=.5 --facet lambert:albedo=.8 -o grooves.binary
      gonio measure --surface heights.exr --facet conductor:Au --theta-i 0,30,60 -o worn.gonio
      gonio measure conductor --preset Au --noise .02 --blocked 5 --solid-angle .002 -o real.binary
    """
    import time

    from ...instruments.goniometer import plan, run

    begun = time.perf_counter()
    theta_i, theta_r, phi = (plan.axis_of(getattr(how, name), name) for name in ("theta_i", "theta_r", "phi"))
    with Bar("measure") as bar:

        def progress(done: int, total: int) -> None:
            rate = done / max(time.perf_counter() - begun, 1e-3)
            bar.step(done, total, f"{done / 1e6:.1f}/{total / 1e6:.1f} M rays  {rate / 1e6:.2f} M rays/s")

        found = run.measure(
            made.text(model) if model and not surface else model,
            output,
            surface=None if surface is None else run.surface_of(surface, made.param or (), made.preset),
            facet=facet,
            kind=kind,
            theta_i=theta_i,
            theta_r=theta_r,
            phi=phi,
            solid_angle=how.solid_angle,
            noise=how.noise,
            blocked=how.blocked,
            bounces=bounces,
            rays=rays,
            patches=patches,
            seed=seed,
            device=device,
            progress=progress,
        )
    if as_json:
        print(json.dumps(found.as_dict()))
        return
    _print(found)


def _print(found: Readout) -> None:
    error = "" if found.error is None else f", standard error {100.0 * found.error:.2g} % in the median"
    hidden = f", {100.0 * found.blocked:.2g} % blocked" if found.blocked else ""
    print(f"{found.path}  {found.table.title}: {found.cells} cells{hidden}{error}")
    if found.rays:
        rate = found.rays / found.seconds / 1e6
        print(
            f"{found.rays / 1e6:.1f} M rays in {found.seconds:.1f} s ({rate:.2f} M/s); shares of the light that leave:"
        )
        table = listing("incidence", "first bounce", "later ones", "all", "lost")
        rows = list(zip(found.incidence, found.first, found.later, found.lost, strict=True))
        for angle, first, later, lost in rows[:: -(-len(rows) // MOST_ROWS)]:
            table.add_row(f"{angle:.4g}", f"{first:.4f}", f"{later:.4f}", f"{first + later:.4f}", f"{lost:.1e}")
        print_rich(table)
    for note in found.notes:
        print(f"note: {note}")
