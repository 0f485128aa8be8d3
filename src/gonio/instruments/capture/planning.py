"""Plan photographs: choose the most informative lamp positions (A-optimal design, Chaloner1995).

A photograph adds J^T J to the information matrix of the material's parameters, where J contains the derivatives of its
pixels, computed by Dr.Jit. From this, the information is subtracted that is lost to the unknown errors of its lamp. The
chosen position minimizes the sum of the squared relative errors of the material's parameters. The alternative, to
maximize the determinant (D-optimal design), would minimize the volume of the confidence region, but might improve
parameters that are already well determined. Positions are chosen greedily. In a comparison, the error with four planned
positions was 0.77 times that with eight random positions (median of 15 materials).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError
from ...fitting.fit import NORMAL_95
from ...fitting.parameters import Free, ranges, start_of
from ...material import BSDF
from . import pixels
from .calibration import Floats
from .fitting import Faults, Problem, inverse_of, middle_of
from .pixels import GRAZING, Kind, Pixels, Scene

PLACES = 96  # number of candidate positions
# range of angles between lamp and camera, degrees: below, the lamp blocks the view; above, only a crescent is lit
ASIDE, BEHIND = 8.0, 125.0
STEEP = 75.0  # largest angle of the lamp from the normal of a flat sample, degrees
SEEN = 1500  # number of pixels that represent a photograph
LITTLE = 0.01  # lower bound of the denominator of relative errors, as a fraction of a parameter's range
NOTHING = 1.0  # prior standard deviation of each parameter of the material


@dataclass(frozen=True)
class Proposal:
    """A photograph to take.

    position  position of the lamp in the frame of the camera
    angle     angle between lamp and camera as seen from the sample, degrees
    names     names of the material's parameters
    errors    expected standard errors of the parameters with this and all earlier photographs, (K,)
    """

    position: tuple[float, float, float]
    angle: float
    names: tuple[str, ...]
    errors: Floats

    def as_dict(self) -> dict[str, object]:
        """The proposal as a dictionary for JSON."""
        errors = {name: float(error) for name, error in zip(self.names, self.errors, strict=True)}
        return {"position": list(self.position), "angle": self.angle, "errors": errors}

    def __str__(self) -> str:
        place = ", ".join(f"{x:.4g}" for x in self.position)
        told = ", ".join(f"{n} +- {NORMAL_95 * e:.2g}" for n, e in zip(self.names, self.errors, strict=True))
        return f"lamp at ({place}), {self.angle:.0f} degrees from the camera: then {told}"


@dataclass(frozen=True)
class Setting:
    """The sample, camera and lamp of the planned photographs.

    scene      camera and sample
    kind       kind of the sample
    material   current estimate of the material, or a guess
    moving     free parameters of the material
    faults     standard deviations of the calibration errors
    intensity  intensity of the lamp, (3,)
    noise      relative noise of a pixel
    alike      number of neighboring pixels that count as one
    step       standard deviation of quantization
    """

    scene: Scene
    kind: Kind
    material: BSDF
    moving: list[Free]
    faults: Faults
    intensity: Floats
    noise: float = 0.01
    alike: float = 1.0
    step: float = 0.0


def places(scene: Scene, kind: Kind, distance: float, count: int = PLACES) -> Floats:
    """About `count` candidate lamp positions, (N, 3), on the visible side of the sample.

    They are evenly distributed over a sphere of radius `distance` about the sample.
    """
    middle = middle_of(scene)
    many = 4 * count
    turn = np.arange(many) * np.pi * (3.0 - np.sqrt(5.0))  # a spiral that covers the sphere evenly
    z = 1.0 - 2.0 * (np.arange(many) + 0.5) / many
    flat = np.sqrt(1.0 - z * z)
    toward = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], -1)
    angle = np.degrees(np.arccos(np.clip(-toward @ middle / np.linalg.norm(middle), -1.0, 1.0)))
    lit = (angle > ASIDE) & (angle < BEHIND)
    if kind == "flat":
        lit &= toward @ scene.plane[1][2] > np.cos(np.radians(STEEP))
    chosen = np.flatnonzero(lit)
    return np.asarray(middle + distance * toward[chosen[:: max(1, len(chosen) // count)]])


def propose(setting: Setting, lamps: Floats, count: int, known: Floats | None = None) -> list[Proposal]:
    """Choose the best `count` of the lamp positions `lamps`, (N, 3), for the next photographs, best first.

    known  information matrix of the material's parameters and of the calibration errors common to all photographs
           (position of the ball, scale), (K, K); None before the first photograph
    """
    if not 1 <= count <= len(lamps):
        raise InputError(f"{count} photographs requested, 1 to {len(lamps)} expected", "next")
    added, own = _told(setting, lamps)
    total = np.eye(len(added[0])) if known is None else known.copy()
    total[:own, :own] += np.eye(own) / NOTHING**2  # otherwise the error of an unknown parameter would be 0
    values, (low, high, _) = start_of(setting.material, setting.moving), ranges(setting.moving)
    size = np.maximum(np.abs(values), LITTLE * np.minimum(high - low, 1.0))
    to_camera = -middle_of(setting.scene)
    names = tuple(name for one in setting.moving for name in one.names)
    proposals: list[Proposal] = []
    left = list(range(len(lamps)))
    for _ in range(count):
        spreads = [_spread(total + added[place], size) for place in left]
        best = left.pop(int(np.argmin(spreads)))
        total = total + added[best]
        away = lamps[best] + to_camera
        cos = away @ to_camera / (np.linalg.norm(away) * np.linalg.norm(to_camera))
        errors = np.sqrt(np.diag(inverse_of(total))[:own])
        x, y, z = map(float, lamps[best])
        proposals.append(Proposal((x, y, z), float(np.degrees(np.arccos(np.clip(cos, -1.0, 1.0)))), names, errors))
    return proposals


def _spread(information: Floats, size: Floats) -> float:
    """The sum of the squared relative errors of the first parameters, where the others are free too."""
    return float(np.sum(np.diag(inverse_of(information))[: len(size)] / size**2))


def without(information: Floats, count: int) -> Floats:
    """The information matrix of the first `count` parameters after marginalizing the others (Schur complement)."""
    if count == len(information):
        return information
    aside = information[:count, count:]
    return np.asarray(information[:count, :count] - aside @ inverse_of(information[count:, count:]) @ aside.T)


def _told(setting: Setting, lamps: Floats) -> tuple[list[Floats], int]:
    """The information that each lamp position adds on the common parameters, and the number of material parameters."""
    scene = replace(
        setting.scene,
        lamps=lamps,
        intensities=np.tile(setting.intensity, (len(lamps), 1)),
        names=tuple(f"place {number}" for number in range(len(lamps))),
    )
    part, counts = _imagined(scene, setting)
    problem = Problem(setting.material, setting.moving, scene, [part], setting.faults, setting.noise, setting.alike)
    numbers = np.concatenate([start_of(setting.material, setting.moving), np.zeros(len(problem.open))])
    each = len(setting.faults.of_lamp)
    shared = problem.count - each * len(lamps)
    information = [np.diag(np.r_[np.zeros(shared), np.ones(each)]) for _ in lamps]
    for rows in problem.rows(numbers):
        # the common parameters come first, then those of the lamp
        local = [n if n < shared else shared + (n - shared) % each for n in rows.which]
        information[rows.lamp][np.ix_(local, local)] += counts * (rows.slope.T @ rows.slope)
    return [without(one, shared) for one in information], problem.own


def _imagined(scene: Scene, setting: Setting) -> tuple[Pixels, float]:
    """Representative pixels of one photograph per lamp position, and the number of pixels that each represents."""
    place, _ = pixels.on_sample(scene, setting.kind)
    some = place[np.random.default_rng(29).permutation(len(place))[:SEEN]]
    parts = []
    slack = setting.faults.slack(scene)
    for lamp in range(len(scene.names)):
        which = np.full(len(some), lamp)
        wo, wi, _ = pixels.directions(scene, setting.kind, some, which)
        lit = (wi[:, 2] > 0.0) & ~pixels.is_steep(wo, wi, GRAZING, slack)
        parts.append((some[lit], which[lit]))
    where, which = np.concatenate([p for p, _ in parts]), np.concatenate([w for _, w in parts])
    blank = np.zeros((len(where), 3))
    tile, cut = np.zeros(len(where), np.int64), np.zeros(len(where), bool)
    part = Pixels(setting.kind, where, which, tile, blank, blank + setting.step, blank, cut)
    return part, len(place) / len(some)
