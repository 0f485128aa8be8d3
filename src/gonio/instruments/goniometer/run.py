"""Measure a material or a surface, and write the values to a file."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ... import files
from ...arguments import renamed, shown
from ...catalog import notation, outside
from ...catalog.material import MaterialLike
from ...catalog.material import material as named
from ...errors import InputError
from ...material import BSDF, is_model
from ...measure import colours
from ...measure.compare import asymmetry
from ...measure.tables.base import Measurement
from ...optics.frame import angles_of_array
from ...owner import public
from ..surfaces import base as surfaces
from ..surfaces.base import Surface
from .plan import Plan, beside_lamp, grid_of, without
from .readings import Rough, Tracing
from .specimen import BOUNCES, GROUPS, Model, Specimen

Floats = NDArray[np.float64]
DETECTOR = 0.006  # sr, the default for surfaces: a cone with a half angle of 2.5 degrees
MAX_BLOCKED = 60.0  # degrees
EXCHANGED = 1 << 12  # number of pairs of directions at which reciprocity is tested
SAME = 1e-6  # if swapping the two directions changes f by less than this, relative, rounding errors are the cause


@dataclass(frozen=True)
class Detector:
    """The properties of a detector, as given by the arguments of `measure`.

    solid_angle  solid angle of the detector, sr; None for the default of the specimen
    noise        relative standard deviation of a reading
    blocked      smallest angle between detector and lamp, degrees
    bounces      the light that the detector collects, a key of `BOUNCES`
    """

    solid_angle: float | None
    noise: float
    blocked: float
    bounces: str

    @property
    def blocked_angle(self) -> float:
        """`blocked` in radians."""
        return float(np.radians(self.blocked))


@dataclass(frozen=True)
class Readout:
    """The result of a measurement.

    f is the light that the detector collects, divided by the projected solid angle of the part of its cone that lies
    above the horizon. If the table has few angles of incidence, each of them is measured. Otherwise, a grid up to 89
    degrees is measured, whose spacing is the half angle of the detector, and f is interpolated linearly. The sample
    rotates about its normal, so the result is isotropic.

    table      the values; `table.beside` contains their standard errors ("error") and, for a surface, the part of f due
               to light that was reflected once ("first")
    path       the file; None if no file was written
    format     format of the file
    cells      number of values in the table
    blocked    fraction of the cells that could not be measured
    error      median relative standard error; None if the values are exact
    incidence  angles of incidence of the rays, degrees; empty for a material, as are `first`, `later` and `lost`
    first      fraction of the light that leaves after one reflection, by angle of incidence, luminance
    later      fraction of the light that leaves after two or more reflections, by angle of incidence, luminance
    lost       fraction of the rays lost to rounding, by angle of incidence
    rays       number of rays
    seconds    duration of the measurement, s
    notes      remarks on the measurement
    """

    table: Measurement
    path: Path | None
    format: str
    cells: int
    blocked: float
    error: float | None
    incidence: tuple[float, ...]
    first: tuple[float, ...]
    later: tuple[float, ...]
    lost: tuple[float, ...]
    rays: int
    seconds: float
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, object]:
        """The result as a dictionary for JSON, without the values of the table."""
        about = {name: value for name, value in vars(self).items() if name not in ("table", "path")}
        path = None if self.path is None else str(self.path)
        return {"output": path, "title": self.table.title, "kind": self.table.name, **about}


class _Pass(Measurement):
    """The source of values for a table: each call of `rgb` is a measurement."""

    def __init__(
        self,
        specimen: Specimen,
        detector: Detector,
        seed: int,
        part: int | None = None,
        known: dict[int, Floats] | None = None,
    ) -> None:
        """A source of measured values.

        part   index of one of the independent measurements; None for the mean of all
        known  noise-free f by the number of the call, for calls whose results are the same in all parts
        """
        super().__init__(specimen.title, specimen.about)
        self._specimen, self._detector, self._seed = specimen, detector, seed
        self._part, self._known = part, {} if known is None else known
        self._asked = 0

    def part(self, part: int) -> _Pass:
        """The source of values for one independent part of the measurement."""
        return _Pass(self._specimen, self._detector, self._seed, part, self._known)

    def first(self) -> _Pass:
        """The source of values for light reflected once, without noise."""
        return _Pass(self._specimen, replace(self._detector, noise=0.0, bounces="first"), self._seed, None, self._known)

    def rgb(self, wo: Floats, wi: Floats) -> Floats:
        self._asked += 1
        f = self._known.get(self._asked)
        if f is None:
            away = beside_lamp(wo, wi, self._detector.blocked_angle)
            f = self._specimen.f(away, wi, self._part, self._detector.bounces)
            if self._specimen.exact or wo is wi:
                self._known[self._asked] = f
        if self._detector.noise > 0.0:
            # adaptive tables derive their coordinates from retroreflection, so all parts share these values and their
            # noise
            is_shared = self._part is None or wo is wi
            rng = np.random.default_rng([self._seed, 92, GROUPS if is_shared else self._part or 0, self._asked])
            f = f * (
                1.0 + self._detector.noise * (1.0 if is_shared else np.sqrt(GROUPS)) * rng.standard_normal(f.shape)
            )
        return f * wi[:, 2:]


class _Scout(Measurement):
    """Records the angles of incidence at which a table is evaluated."""

    def __init__(self) -> None:
        super().__init__()
        self.theta_i: list[Floats] = []

    def rgb(self, wo: Floats, wi: Floats) -> Floats:
        self.theta_i.append(np.unique(np.round(angles_of_array(wi)[0], 9)))
        return np.repeat(wi[:, 2:], 3, 1)


@renamed(kind="table", rays="samples")
@public
def measure(
    material: MaterialLike | None = None,
    output: str | Path | None = None,
    *,
    surface: Surface | str | None = None,
    facet: MaterialLike = "mirror",
    table: str = "",
    theta_i: Sequence[float] | None = None,
    theta_r: Sequence[float] | None = None,
    phi: Sequence[float] | None = None,
    solid_angle: float | None = None,
    noise: float = 0.0,
    blocked: float = 0.0,
    bounces: str = "all",
    samples: int = 1_000_000,
    patches: int = 16,
    seed: int | None = None,
    device: str = "cpu",
    progress: Callable[[int, int], None] | None = None,
) -> Readout:
    """Measure a material, or the microgeometry of a rough surface, with a virtual gonioreflectometer.

        go.measure("conductor(alpha=0.2)", "gold.binary")                     # any material, in any format
        go.measure(surface="gaussian:alpha=0.3", facet="mirror", output="rough.gonio")

    material     the material to evaluate, as for `go.material`; None to measure a surface
    output       the file to write, .binary, .bsdf, .brdf, .astm, .zbsdf or .gonio; None writes no file
    surface      the surface, a triangle mesh: gaussian, vgroove or spheres, with parameters after a colon; a file of
                 heights; or a `Surface` of your own
    facet        material of the triangles: "mirror", "lambert:albedo=0.8", "conductor:Au"; smooth without an alpha
    table        table of a .gonio file: angles, half-difference, adaptive, specular or samples; "" is the default
    theta_i, theta_r, phi  angles of incidence, viewing angles and azimuths between the two at which to measure,
                 degrees, for .gonio, .astm and .brdf files
    solid_angle  of the detector, sr, over which f is averaged; None selects 0.006 for surfaces, 0 for materials
    noise        relative standard deviation of a reading
    blocked      smallest possible angle between detector and lamp, degrees. At smaller angles, cells of MERL files are
                 invalid, samples are omitted, and other tables have the value at this angle
    bounces      the light to measure from a surface: "all", or that after the "first" or after "later" bounces
    samples      rays per angle of incidence
    patches      patches of a random surface, a multiple of 8; standard errors include the variation among them
    seed         seed of the random numbers, 0 if None; equal seeds give equal values
    device       device for tracing rays: "cpu", "cuda" or "auto"
    progress     called with the number of rays traced and their total number
    Returns a `Readout`: the table with a standard error per value, the reflected energy, and the duration.
    Raises InputError for invalid arguments, and if the file cannot be written, before anything is computed.
    """
    begun = time.perf_counter()
    detector = Detector(solid_angle, noise, blocked, bounces)
    tracing = Tracing(samples, patches, 0 if seed is None else seed, device, progress)
    _check_numbers(detector, tracing)
    target = None if output is None else files.check_file(output)
    path = None if output is None else Path(output)
    plan = Plan(path, table, grid_of(theta_i, theta_r, phi))
    if surface is not None and material is not None:
        raise InputError("a material and a surface given", "MODEL", "name the material of the facets by --facet")
    rough = None if surface is None else _rough(surface, facet, detector, tracing, plan)
    specimen = rough or _model(material, detector)
    measured, hidden, notes = _filled(plan, specimen, detector, tracing.seed)
    notes += _lost(measured, specimen) + ([] if target is None else _written(measured, plan, target))
    return _readout(measured, specimen, path, "" if path is None else plan.file.name, hidden, notes, begun)


def _check_numbers(detector: Detector, tracing: Tracing) -> None:
    """Raise InputError if an argument of `measure` is out of range."""
    if detector.bounces not in BOUNCES:
        raise InputError(f"'{detector.bounces}' given, {', '.join(BOUNCES)} expected", "--bounces")
    for name, value, high in (("noise", detector.noise, 1.0), ("blocked", detector.blocked, MAX_BLOCKED)):
        if not 0.0 <= value <= high:
            raise InputError(f"{value:g} given, 0 to {high:g} expected", f"--{name}")
    solid_angle = detector.solid_angle
    if solid_angle is not None and not 0.0 < solid_angle < np.pi:
        raise InputError(f"{solid_angle:g} sr given, more than 0 and less than pi expected", "--solid-angle")
    for name, low, most in (("samples", 1000, 1 << 40), ("patches", 1, 4096), ("seed", 0, 1 << 31)):
        if not low <= getattr(tracing, name) <= most:
            raise InputError(f"{getattr(tracing, name)} given, {low} to {most} expected", f"--{name}")


def _rough(surface: Surface | str, facet: MaterialLike, detector: Detector, tracing: Tracing, plan: Plan) -> Rough:
    """The rough surface, measured at the angles of incidence of the planned table."""
    built = surface_of(surface) if isinstance(surface, str) else surface
    if not isinstance(built, Surface):
        raise InputError(f"{shown(surface)} given, a surface expected", "surface", 'such as "gaussian:alpha=0.3"')
    name, material = (facet, facet_of(facet)) if isinstance(facet, str) else ("", named(facet))
    solid_angle = DETECTOR if detector.solid_angle is None else detector.solid_angle
    specimen = Rough(built, material, solid_angle, tracing, name)
    scout = _Scout()
    plan.table(scout)
    specimen.prepare(np.unique(np.concatenate(scout.theta_i)))
    return specimen


def _model(material: MaterialLike | None, detector: Detector) -> Model:
    if material is None:
        raise InputError("nothing to measure", "MODEL", "name a material, or a surface by --surface")
    if detector.bounces != "all":
        what = f"{detector.bounces} bounces of a material requested"
        raise InputError(what, "--bounces", "use it with --surface only")
    name = (str(material),) if isinstance(material, str | Path) else ()
    return Model(named(material), detector.solid_angle, *name)


def _lost(measured: Measurement, specimen: Specimen) -> list[str]:
    """Notes on properties of a material that the table cannot represent: transmission, and a lack of reciprocity."""
    if not isinstance(specimen, Model):
        return []
    notes = []
    if specimen.material.transmits:
        notes.append("the material also transmits light, which is not measured: tables contain reflected light only")
    if not measured.reciprocal:
        return notes
    change = asymmetry(_Pass(Model(specimen.material, None), Detector(None, 0.0, 0.0, "all"), 0), EXCHANGED)
    if change < SAME:
        return notes
    return [
        *notes,
        f"swapping the two directions changes f by {100.0 * change:.2g} % on average, but this table has one value "
        "for both: their least-squares mean. .bsdf files, and .gonio files with --table angles, store both values",
    ]


def _written(measured: Measurement, plan: Plan, target: Path) -> list[str]:
    """Write the table; returns notes on what its format cannot store."""
    files.write_whole(target, plan.file.write(measured))
    if "error" in measured.beside and plan.file.writes != "any":
        return [f"{plan.file.name} files cannot store standard errors; .gonio files can"]
    return []


def _readout(
    measured: Measurement,
    specimen: Specimen,
    path: Path | None,
    name: str,
    hidden: float,
    notes: Sequence[str],
    begun: float,
) -> Readout:
    """The result of `measure`, with the median relative standard error and the energy that a surface reflects."""
    rough = specimen if isinstance(specimen, Rough) else None
    error = measured.beside.get("error")
    values = vars(measured)["values"]
    typical = None if error is None or not np.any(values > 0.0) else error[values > 0.0] / values[values > 0.0]
    return Readout(
        table=measured,
        path=path,
        format=name,
        cells=int(np.prod(values.shape)) // 3,
        blocked=hidden,
        error=None if typical is None else float(np.median(typical)),
        incidence=() if rough is None else tuple(np.degrees(rough.lights).tolist()),
        first=() if rough is None else tuple((rough.first @ colours.LUMINANCE).tolist()),
        later=() if rough is None else tuple((rough.later @ colours.LUMINANCE).tolist()),
        lost=() if rough is None else tuple(rough.lost.tolist()),
        rays=0 if rough is None else rough.sent,
        seconds=time.perf_counter() - begun,
        notes=tuple(notes),
    )


def _filled(plan: Plan, specimen: Specimen, detector: Detector, seed: int) -> tuple[Measurement, float, list[str]]:
    """The table with its standard errors and first-bounce part, the fraction of blocked cells, and notes."""
    asked = _Pass(specimen, detector, seed)
    table = plan.table(asked)
    values = vars(table)["values"]
    if detector.noise > 0.0 or not specimen.exact:
        total, square = np.zeros_like(values), np.zeros_like(values)
        for part in range(GROUPS):
            off = vars(plan.table(asked.part(part)))["values"] - values
            total += off
            square += off * off
        variance = np.maximum(square - total * total / GROUPS, 0.0) / (GROUPS - 1.0)
        table.beside["error"] = np.sqrt(variance / GROUPS)
    if detector.bounces == "all" and not specimen.exact:
        table.beside["first"] = vars(plan.table(asked.first()))["values"]
    table, hidden, left_out = without(table, detector.blocked_angle)
    notes = []
    if detector.blocked > 0.0 and not left_out:
        notes.append(f"{table.name} tables need a value everywhere: near the lamp, it is that at the --blocked angle")
    return table, hidden, notes


def surface_of(text: str, assignments: Sequence[str] = (), preset: str = "") -> Surface:
    """A surface from a string: "gaussian", "gaussian:alpha=0.3,length=4", "gaussian(alpha=0.3)", a file of heights, or
    FILE.py:CLASS.

    assignments  further parameters, each in the form "name=value"
    preset       must be "", because surfaces have no presets
    """
    if preset:
        raise InputError("surfaces have no presets", "--preset", "such as --facet conductor:Au")
    if outside.names_code(text):
        head, rest = outside.member(text, where="--surface"), ""
    else:
        head, rest = _parted(text)
    own = dict(notation.assignment(part, "--surface") for part in rest.split(",") if part.strip())
    return surfaces.named(head, {**own, **dict(map(notation.assignment, assignments))})


def facet_of(text: str) -> BSDF:
    """The material of the facets from its notation, or from a short form such as "conductor:Au" or
    "lambert:albedo=0.8".

    If no alpha is given, it is set to 0, provided that the model allows this value.
    """
    head, colon, rest = text.strip().partition(":")
    if colon and is_model(head):
        first, comma, more = rest.partition(",")
        text = f"{head}({first if '=' in first else 'preset=' + first}{comma}{more})"
    smooth: list[str] = []
    if is_model(text.partition("(")[0].strip()):
        kind, given = notation.taken_apart(text, "--facet")
        width = kind.parameters().get("alpha")
        if width is not None and getattr(width, "low", None) == 0.0 and "alpha" not in given:
            smooth = ["alpha=0"]
    return notation.named(text, smooth)[0]


def _parted(text: str) -> tuple[str, str]:
    """Split "gaussian:alpha=0.3" or "gaussian(alpha=0.3)" into ("gaussian", "alpha=0.3")."""
    match = re.fullmatch(r"([\w-]+)\s*(?::(.*)|\((.*)\))?", text.strip(), re.DOTALL)
    return (text.strip(), "") if match is None else (match[1], match[2] or match[3] or "")
