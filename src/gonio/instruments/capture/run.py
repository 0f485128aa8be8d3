"""Convert photographs to BRDF samples and a fitted material."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ... import files
from ...arguments import renamed
from ...catalog import operands
from ...catalog.material import MaterialLike
from ...errors import InputError
from ...fitting.fit import Fit, moving_of
from ...material import BSDF
from ...measure import format_of
from ...measure.formats.base import Format
from ...owner import public
from . import advice, fitting, geometry, pixels, planning
from . import calibration as calibrations
from . import photographs as photographs_of
from .calibration import NAME, Calibration, Floats
from .photographs import Photograph
from .pixels import GRAZING, Chosen, Gathered, Kind, Scene
from .planning import Proposal

PHOTOGRAPHS = frozenset({operands.Kind.CALIBRATION, operands.Kind.FOLDER, operands.Kind.PICTURE, operands.Kind.FILE})


@dataclass(frozen=True)
class Capture:
    """The result of `capture`.

    scene     camera, sample and lamps as given or detected; after a fit, they are corrected for calibration errors
    samples   BRDF samples, averaged in cells: the table, the standard errors, and the number of pixels per sample
    counts    numbers of pixels of the sample: used, saturated, shadowed and grazing
    fitted    the material fitted to the pixels; None if no model was given
    warnings  defects of the pictures, and parameters that the pictures do not determine
    others    the other fitted models, ranked by the BIC, best first
    """

    scene: Scene
    samples: Gathered
    counts: Mapping[str, int]
    fitted: fitting.Fitted | None
    warnings: tuple[str, ...]
    photographs: tuple[Photograph, ...]
    chosen: Chosen
    others: tuple[Fit, ...] = ()

    @property
    def fit(self) -> Fit:
        """The fitted material with its parameters, their errors and correlations. Raises InputError without a fit."""
        if self.fitted is None:
            raise InputError("no material was fitted", "model", 'go.capture(photographs, "lambert+ggx")')
        return self.fitted.fit

    @property
    def material(self) -> BSDF:
        """The fitted material."""
        return self.fit.material

    def next(self, count: int = 1, places: Sequence[Sequence[float]] | None = None) -> list[Proposal]:
        """Plan the next photographs: the most informative positions of the lamp, best first.

        count   number of photographs
        places  possible positions in the frame of the camera; None allows any direction at the median distance of the
                lamps
        """
        if self.fitted is None:
            raise InputError("no material was fitted", "model", "a plan needs a fitted model")
        problem, scene = self.fitted.problem, self.scene
        kind = self.chosen.parts[0].kind
        away = np.linalg.norm(scene.lamps - fitting.middle_of(scene), axis=1)
        setting = planning.Setting(
            scene,
            kind,
            self.fit.material,
            problem.moving,
            problem.faults,
            np.median(scene.intensities, axis=0),
            problem.noise,
            problem.alike,
            float(np.median(self.chosen.parts[0].step)),
        )
        hessian, _ = problem.information(self.fitted.numbers)
        shared = problem.count - len(scene.names) * len(problem.faults.of_lamp)
        known = planning.without(hessian + problem.prior(), shared)
        lamps = planning.places(scene, kind, float(np.median(away))) if places is None else _points(places)
        return planning.propose(setting, lamps, count, known)

    def save(self, path: str | Path) -> Path:
        """Write the samples as a table (.gonio, .binary, .astm, ...), or the full result as .json."""
        if Path(path).suffix.lower() == ".json":
            text = json.dumps(self.as_dict(), indent=1)
            return files.write_whole(path, (text + "\n").encode())
        form = _table_format(Path(path))
        return files.write_whole(path, form.write(form.resampled(self.samples.table)))

    def as_dict(self) -> dict[str, Any]:
        """The result as a dictionary for JSON."""
        ball = self.scene.ball
        entries: dict[str, Any] = {
            "pixels": dict(self.counts),
            "samples": len(self.samples.count),
            "ball": None if ball is None else {"center": [float(x) for x in ball.center], "radius": ball.radius},
            "lights": {
                name: {"position": [float(x) for x in place], "intensity": [float(x) for x in intensity]}
                for name, place, intensity in zip(
                    self.scene.names, self.scene.lamps, self.scene.intensities, strict=True
                )
            },
            "warnings": list(self.warnings),
        }
        if self.fitted is not None:
            entries |= {
                "fit": self.fitted.fit.as_dict(),
                **({"fits": [one.as_dict() for one in (self.fit, *self.others)]} if self.others else {}),
                "noise": self.fitted.noise,
                "faults": {
                    name: {"deviations": value, "error": error} for name, (value, error) in self.fitted.faults.items()
                },
            }
        return entries

    def __str__(self) -> str:
        counts = self.counts
        left = ", ".join(f"{counts[why]} {why}" for why in ("saturated", "shadowed", "grazing"))
        lines = [f"{counts['used']} pixels in {len(self.samples.count)} samples; left out: {left}"]
        lines += [str(one) for one in (self.fitted.fit, *self.others)] if self.fitted is not None else []
        return "\n".join([*lines, *(f"  warning: {text}" for text in self.warnings)])


def check_output(path: Path) -> Path:
    """Return the path of a result. Raises InputError if the result cannot be written there."""
    if path.suffix.lower() != ".json":
        _table_format(path)
    return files.check_file(path)


def _table_format(path: Path) -> Format:
    """The table format of a path's suffix. Raises InputError if Gonio cannot write this format."""
    form = format_of(path)
    if not form.writes:
        raise InputError(f"{form.name} files cannot be written", str(path), "such as -o gold.gonio")
    return form


@renamed(fixed="param")
@public
def capture(
    photographs: str | Path | Sequence[str],
    model: MaterialLike | Sequence[MaterialLike] | None = None,
    *,
    calibration: str | Path | None = None,
    grazing: float = GRAZING,
    param: Mapping[str, object] | None = None,
    free: Sequence[str] = (),
    progress: Callable[[str], None] = lambda text: None,
) -> Capture:
    """Measure a material from photographs of a ball or a flat sample, lit by a lamp at several positions.

        result = go.capture("photographs", "lambert+ggx")
        result.fit.interval          # 95 % interval per parameter
        result.save("paint.gonio")

    photographs  a folder with a calibration.json, or files that the calibration lists
    model        model to fit, as in `go.fit`. Several models are ranked by the BIC. None computes only the samples
    calibration  the calibration file; None selects calibration.json in the folder of the photographs
    grazing      largest angle from the normal, degrees; pixels viewed or lit at larger angles are excluded
    param        values of parameters that stay fixed, by path
    free         paths of parameters to fit that are fixed by default
    progress     called before each step, with the name of the step
    Raises InputError, with the name of the file, for photographs without an exposure time, of a different size,
    completely saturated, or without a visible sample.
    """
    if not 10.0 <= grazing < 90.0:
        raise InputError(f"{grazing:g} degrees given, 10 to less than 90 expected", "grazing")
    path, stated, folder = _calibration(photographs, calibration)
    shots = photographs_of.read_all(stated, folder, lambda file: progress(f"reading {file}"))
    scene = _scene(stated, shots)
    progress("selecting pixels")
    # errors of exposure times act as errors of the overall scale
    scale = float(np.hypot(stated.uncertainty.scale, max(shot.scale_error for shot in shots)))
    uncertainty = stated.uncertainty.model_copy(update={"scale": scale})
    slack = fitting.Faults.of(uncertainty, scene).slack(scene)
    chosen = pixels.choose(scene, shots, grazing, slack)
    if not len(chosen):
        raise InputError("no pixel is left", str(path), "raise --grazing, or check the calibration")
    results = []
    for one in model if isinstance(model, list | tuple) else () if model is None else (model,):
        progress("fitting")
        results.append(fitting.fitted(scene, chosen, one, uncertainty, fixed=param, free=free))
    results.sort(key=lambda one: one.fit.criterion)
    result = results[0] if results else None
    if result is not None:
        scene = result.problem.corrected(result.numbers)
    gathered = pixels.gather(scene, chosen, title=folder.resolve().name)
    warnings = advice.on(scene, chosen, result)
    others = tuple(one.fit for one in results[1:])
    return Capture(scene, gathered, chosen.counts, result, warnings, tuple(shots), chosen, others)


@public
def plan(
    calibration: str | Path,
    model: MaterialLike,
    count: int = 4,
    *,
    places: Sequence[Sequence[float]] | None = None,
    fixed: Mapping[str, object] | None = None,
    free: Sequence[str] = (),
) -> list[Proposal]:
    """Plan the first photographs: the most informative lamp positions for a material similar to the model.

    calibration  a calibration file with a ball at a given position or a flat sample, and with a lamp of given position
                 and intensity
    model        the model to fit, with parameters close to those of the material
    count        number of photographs
    places       possible positions of the lamp; None allows any direction at the distance of the lamp in the
    calibration fixed        values of parameters that stay fixed, by path
    free         paths of parameters to fit that are fixed by default
    """
    path = Path(os.path.expanduser(calibration))
    stated = calibrations.read(path)
    kind: Kind = "ball" if stated.ball is not None else "flat"
    ball = None if stated.ball is None else geometry.placed(stated.ball, stated.camera, ())
    lamps = [np.array(lamp.position) for lamp in stated.lights.values() if lamp.position is not None]
    light = next((intensity for name in stated.lights if (intensity := stated.intensity(name)) is not None), None)
    if not lamps or light is None or (ball is None and stated.flat is None):
        hint = "a plan needs a ball or a flat sample, and a lamp with its position and intensity"
        raise InputError("the calibration is incomplete for a plan", str(path), hint)
    scene = Scene(stated.camera, ball, stated.flat, np.array(lamps), np.tile(light, (len(lamps), 1)), ())
    material, moving = moving_of(model, fixed=fixed, free=free)
    away = np.linalg.norm(scene.lamps - fitting.middle_of(scene), axis=1)
    setting = planning.Setting(scene, kind, material, moving, fitting.Faults.of(stated.uncertainty, scene), light)
    stand = planning.places(scene, kind, float(np.median(away))) if places is None else _points(places)
    return planning.propose(setting, stand, count)


def _points(places: Sequence[Sequence[float]]) -> Floats:
    try:
        points = np.array(places, np.float64)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InputError("lamp positions are not (N, 3) numbers", "places", "such as [[0, -300, 200]]")
    return points


def calibration_of(named: str | Path | Sequence[str], calibration: str | Path | None = None) -> Path:
    """The path of the calibration file: `calibration` if given, otherwise that in the folder of the photographs.

    named  the photographs, their folder, or the calibration file itself
    """
    if calibration is not None:
        return Path(os.path.expanduser(calibration))
    several = [str(named)] if isinstance(named, str | Path) else [str(one) for one in named]
    if not several:
        raise InputError("no photographs given", "photographs", "name files, or a folder with a calibration.json")
    first = Path(os.path.expanduser(several[0]))
    kinds = [operands.kind_of(Path(os.path.expanduser(one)), PHOTOGRAPHS, "photographs") for one in several]
    if kinds == [operands.Kind.CALIBRATION] and not os.path.isdir(first):
        return first
    return (first if os.path.isdir(first) else first.parent) / NAME


def is_blank(named: str | Path | Sequence[str], calibration: str | Path | None = None) -> bool:
    """Whether the calibration lists no photograph of a sample."""
    stated = calibrations.read(calibration_of(named, calibration))
    return all(shot.sample == "reference" for shot in stated.photographs)


def _calibration(named: str | Path | Sequence[str], calibration: str | Path | None) -> tuple[Path, Calibration, Path]:
    """The calibration file, the calibration with only the named photographs, and the folder of the photographs."""
    path = calibration_of(named, calibration)
    full = calibrations.read(path)
    several = [str(named)] if isinstance(named, str | Path) else [str(one) for one in named]
    first = Path(os.path.expanduser(several[0]))
    folder = first if os.path.isdir(first) else first.parent
    selected = full.photographs
    if not (len(several) == 1 and (os.path.isdir(first) or first.suffix.lower() == ".json")):
        known = {Path(one.file).name for shot in full.photographs for one in shot.pictures}
        wanted = {Path(one).name for one in several}
        for name in sorted(wanted - known):
            what = "the calibration lists neither its exposure nor its light"
            raise InputError(what, str(folder / name), f"add it under photographs in {path}")
        # references are always read, since the intensities of lamps may depend on them
        selected = [
            shot
            for shot in full.photographs
            if shot.sample == "reference" or any(Path(one.file).name in wanted for one in shot.pictures)
        ]
    if all(shot.sample == "reference" for shot in selected):
        raise InputError("no photograph of a sample", str(path), 'add some with "sample": "ball" or "flat"')
    return path, full.model_copy(update={"photographs": selected}), folder


# ---------------------------------------------------------------------- scene


def _scene(stated: Calibration, shots: Sequence[Photograph]) -> Scene:
    camera = stated.camera
    mirrors = []
    for mirror in stated.mirrors:
        if mirror.center is None and mirror.outline is None:
            raise InputError("a mirror ball needs its center or its outline", "mirrors", "measure it in the picture")
        mirrors.append(geometry.placed(mirror, camera, shots))
    ball = None
    if stated.ball is not None and any(shot.shot.sample == "ball" for shot in shots):
        ball = geometry.placed(stated.ball, camera, shots, avoid=mirrors)
    names = tuple(dict.fromkeys(shot.shot.light for shot in shots))
    lamps = []
    for name in names:
        lamp = stated.lights[name]
        if lamp.position is not None:
            lamps.append(np.array(lamp.position))
            continue
        if not mirrors:
            raise InputError(f"no position of the light '{name}'", "lights", 'give "position", or describe "mirrors"')
        about = ball.center if ball is not None else np.zeros(3)
        shot = next(one for one in shots if one.shot.light == name)
        lamps.append(geometry.lamp_in_mirrors(shot, mirrors, camera, about, lamp.distance))
    blank = Scene(camera, ball, stated.flat, np.array(lamps), np.ones((len(names), 3)), names)
    intensities = np.array([_intensity(stated, blank, name, shots) for name in names])
    return Scene(camera, ball, stated.flat, np.array(lamps), intensities, names)


def _intensity(stated: Calibration, scene: Scene, name: str, shots: Sequence[Photograph]) -> Floats:
    """The intensity of a lamp, as given or as determined from photographs of the white target."""
    given = stated.intensity(name)
    if given is not None:
        return given
    shot = next((one for one in shots if one.shot.sample == "reference" and one.shot.light == name), None)
    if shot is None:
        hint = 'give its "intensity", or photograph a "reference" under it'
        raise InputError(f"no intensity of the light '{name}'", "lights", hint)
    target = stated.reference
    assert target is not None, "checked when it was read"
    row, column = np.nonzero(pixels.on_flat(stated.camera, target))
    place = np.stack([column + 0.5, row + 0.5], -1)
    held = Scene(stated.camera, None, target, scene.lamps, scene.intensities, scene.names)
    _, wi, square = pixels.directions(held, "flat", place, np.full(len(place), scene.names.index(name)))
    values = shot.radiance[row, column]
    fine = ~np.isnan(values).any(axis=1) & (wi[:, 2] > 0.1)
    if fine.sum() < pixels.MIN_PIXELS:
        what = f"{int(fine.sum())} pixels of the reference are lit and not saturated, {pixels.MIN_PIXELS} expected"
        raise InputError(what, shot.name, "check the position of the target")
    white = np.broadcast_to(np.asarray(target.albedo, float), 3) / np.pi * wi[fine, 2:]
    intensity = np.median(values[fine] * square[fine, None] / white, axis=0)
    if not np.all(intensity > 0.0):
        raise InputError("the reference is dark", shot.name, "was the lamp on?")
    return np.asarray(intensity)
