"""Fit the parameters of materials in a scene to a picture, by differentiable rendering with Gonio's path tracer.

Each step renders the picture and its derivatives with respect to all parameters (`transport.gradients`) and solves for
all parameters at once, as in a fit to a table. A fit takes about ten steps and provides standard errors.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from .. import files, garbage
from .. import scene as scenes
from ..arguments import renamed, takes_fields
from ..bridge import engine
from ..bridge.types import BSDFPlugin
from ..catalog import notation
from ..errors import InputError, did_you_mean
from ..fitting.certainty import certainty, information
from ..fitting.fit import NORMAL_95, moving_of, notes_on
from ..fitting.parameters import CHANNELS, Free, start_of, with_values
from ..fitting.solver import Linearized, columns_of, solve
from ..material import BSDF, tree
from ..owner import public
from ..pictures import images
from ..scene.build import Built
from ..scene.derivatives import material_at, place_of
from ..scene.schema import SceneDescription
from ..transport.gradients import Along, Gradients
from ..transport.integrators import Render, Settings

Floats = NDArray[np.float64]
SPP, STEPS = 64, 20
DARK = 0.05  # fraction of the median brightness: residuals are absolute below and relative above
TILE = 8  # pixels: errors within a tile are correlated
SHOWN = 16  # ratio of the sample counts of the final picture and of a step, so that noise does not hide differences
OTHER = 0x9E3779B9  # XOR mask between the seeds of picture and derivatives
DEEPEST = 8  # path segments if the scene sets no depth


@dataclass(frozen=True)
class PictureFit:
    """The result of a fit to a picture.

    materials    materials with the fitted values, by their paths, such as "shapes.0.material"
    names        names of the fitted numbers, such as "shapes.0.material.alpha"
    values       fitted numbers, (K,)
    errors       standard errors, (K,); inf for numbers that the picture does not determine
    correlation  correlation matrix of the fitted numbers, (K, K)
    losses       mean squared relative difference, before the first step and after each step
    relative     mean absolute difference divided by the mean brightness
    wanted       the given picture, (H, W, 3)
    fitted       the picture rendered with the fitted values, (H, W, 3)
    notes        remarks on the quality of the fit
    seconds      duration of the fit, s
    """

    materials: Mapping[str, BSDF]
    names: tuple[str, ...]
    values: Floats
    errors: Floats
    correlation: Floats
    losses: tuple[float, ...]
    relative: float
    wanted: NDArray[np.float32]
    fitted: NDArray[np.float32]
    notes: tuple[str, ...]
    seconds: float

    @property
    def interval(self) -> Floats:
        """95 % confidence intervals of the fitted numbers, (K, 2)."""
        return np.stack([self.values - NORMAL_95 * self.errors, self.values + NORMAL_95 * self.errors], axis=1)

    def as_dict(self) -> dict[str, Any]:
        """The result as a dictionary for JSON, in which unknown errors are null."""
        return {
            "materials": {path: notation.written(one) for path, one in self.materials.items()},
            "notations": {path: notation.for_files(one) for path, one in self.materials.items()},
            "parameters": {
                name: {"value": float(v), "error": float(e) if np.isfinite(e) else None}
                for name, v, e in zip(self.names, self.values, self.errors, strict=True)
            },
            "correlation": [[round(float(x), 4) for x in row] for row in self.correlation],
            "losses": list(self.losses),
            "relative": self.relative,
            "seconds": round(self.seconds, 3),
            "notes": list(self.notes),
        }

    def save(self, path: str | Path) -> Path:
        """Write the result as .json, atomically, and return the path."""
        return files.write_whole(Path(path), (json.dumps(self.as_dict(), indent=1) + "\n").encode())

    def __str__(self) -> str:
        lines = [f"{100.0 * self.relative:.3g} % off on average after {len(self.losses) - 1} steps"]
        for name, value, error in zip(self.names, self.values, self.errors, strict=True):
            lines.append(f"  {name} = {value:.5g} +- {NORMAL_95 * error:.2g}")
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])


@dataclass(frozen=True)
class Fitting:
    """Options of the renders during a fit. The fields are also arguments of `fit_picture`."""

    spp: int = SPP
    seed: int | None = None
    device: str = "cpu"
    allow_outside: bool = False
    allow_code: bool = False


class FittingKeywords(TypedDict, total=False):
    """The fields of `Fitting` as keyword arguments, for type checkers."""

    spp: int
    seed: int | None
    device: str
    allow_outside: bool
    allow_code: bool


@renamed(fixed="param", scene_file="scene")
@public
@takes_fields(Fitting, FittingKeywords)
def fit_picture(
    picture: str | Path,
    scene: str | Path,
    free: Sequence[str] = ("shapes.0.material",),
    *,
    model: str | BSDF | None = None,
    param: Mapping[str, object] | None = None,
    steps: int = STEPS,
    progress: Callable[[int, float], None] = lambda step, loss: None,
    **rendering: Unpack[FittingKeywords],
) -> PictureFit:
    """Fit the parameters of materials in a scene to a picture of the scene.

        result = fit_picture("photo.exr", "scene.json", ["shapes.0.material"])

    picture     a picture of linear radiance, taken by the camera of the scene: .exr, .hdr, .npz or .png
    scene       a scene file; the fit starts from the parameters of its materials
    free        parameters to fit: "shapes.0.material" for all free parameters of this material,
                "shapes.0.material.alpha" for one parameter
    model       a material that replaces the first material of `free`
    param       values that are set before the fit, by their paths in the scene, as in `gonio study`
    spp         samples per pixel of each render
    steps       maximum number of steps
    seed        seed of all random numbers; 1 if None
    progress    called after each step with its number and the loss
    Raises InputError for invalid files and paths, and if the picture does not match the scene.
    """
    started = time.perf_counter()
    wanted = images.read(picture).pixels
    how = Fitting(**rendering)
    mi = engine.load(how.device)
    if not str(mi.variant()).endswith("ad_rgb"):
        raise InputError(
            f"variant {mi.variant()} is set", "device", "a fit to a picture needs llvm_ad_rgb or cuda_ad_rgb"
        )
    overrides = dict(param or {})
    if model is not None:
        overrides[place_of(free[0], "free")[0]] = moving_of(model)[0]
    description = scenes.read(
        scene,
        allow_outside=how.allow_outside,
        allow_code=how.allow_code,
        overrides=overrides,
        names_output=False,
    )
    _check_picture(wanted, description, str(picture))
    with garbage.paused():
        built = scenes.built(description, mi)
        targets, seed = _targets(description, built, free), 1 if how.seed is None else how.seed
        problem = Problem(mi, built, targets, _depth(description), wanted, how.spp, seed)
        start = problem.start()
        losses = [problem.loss(start)]
        progress(0, losses[0])

        def step(cost: float) -> None:
            losses.append(cost / wanted.size)
            progress(len(losses) - 1, losses[-1])

        numbers = solve(problem, start, steps=steps, tolerance=1e-5, progress=step).numbers
        return _result(problem, numbers, losses, time.perf_counter() - started)


def _check_picture(wanted: NDArray[np.float32], description: SceneDescription, location: str) -> None:
    width, height = description.camera.film.size
    if wanted.shape[:2] != (height, width):
        what = f"{wanted.shape[1]}x{wanted.shape[0]} pixels, {width}x{height} expected, the size of the film"
        raise InputError(what, location, "set the film to the size of the picture")
    if not np.isfinite(wanted).all() or not wanted.max() > 0.0:
        raise InputError("the picture is black or not finite", location)


def _depth(description: SceneDescription) -> int:
    deep = description.integrator.max_depth
    return int(deep) if deep is not None else DEEPEST if description.integrator.type == "path" else 2


@dataclass(frozen=True)
class Target:
    """A material of the scene with free parameters."""

    path: str
    plugin: BSDFPlugin
    material: BSDF
    moving: list[Free]


def _targets(description: SceneDescription, built: Built, free: Sequence[str]) -> list[Target]:
    chosen: dict[str, list[str]] = {}
    for path in free:
        place, parameter = place_of(path, "free")
        chosen.setdefault(place, []).append(parameter)
    targets: list[Target] = []
    for place, parameters in chosen.items():
        plugin = material_at(description, built, place, f"free: {place}")
        if any(plugin is other.plugin for other in targets):
            raise InputError("two shapes share this material", f"free: {place}", "name one of them")
        material = plugin.placed.model
        if any(plugin.placed.slots[name].textures for name in plugin.placed.slots):
            raise InputError("a texture varies this material", f"free: {place}", "give it plain numbers")
        known = [leaf.path for leaf in tree.leaves(material) if leaf.parameter.numeric]
        for parameter in filter(None, parameters):
            if parameter not in known:
                raise InputError(f"no parameter '{parameter}'", f"free: {place}", did_you_mean(parameter, known))
        moving = moving_of(material, free=tuple(filter(None, parameters)))[1]
        if "" not in parameters:
            moving = [one for one in moving if one.path in parameters]
        targets.append(Target(place, plugin, material, moving))
    return targets


class Problem:
    """Residuals of a picture, (rendered - wanted) / (wanted + c), and their derivatives."""

    def __init__(
        self,
        mi: ModuleType,
        built: Built,
        targets: list[Target],
        depth: int,
        wanted: NDArray[np.float32],
        spp: int,
        seed: int,
    ) -> None:
        from scipy import ndimage

        self.mi, self.scene, self.targets, self.spp, self.seed = mi, built.scene, targets, spp, seed
        self.depth = depth
        self.wanted = wanted.astype(np.float64)
        # the mean over neighbors makes the weight of a pixel almost independent of its own noise
        level = ndimage.uniform_filter(np.abs(self.wanted), (3, 3, 1))
        lit = level[level > 0.0]
        self.weight = 1.0 / (level + DARK * float(np.median(lit)))
        self.free = [replace(one, path=f"{target.path}.{one.path}") for target in targets for one in target.moving]
        # groups of parameters with a common derivative
        self.columns: list[list[int]] = []
        self.along: list[Along] = []
        for target in targets:
            before = sum(map(len, self.columns))
            numbers = [(one.path, c if one.count > 1 else None) for one in target.moving for c in range(one.count)]
            for group in columns_of(target.material, target.moving):
                self.columns.append([before + n for n in group])
                path, channel = numbers[group[0]]
                self.along.append(Along(target.plugin, path, None if len(group) > 1 else channel))

    @property
    def count(self) -> int:
        return sum(one.count for one in self.free)

    def start(self) -> Floats:
        return np.concatenate([start_of(target.material, target.moving) for target in self.targets])

    def put(self, numbers: Floats) -> None:
        """Set the parameters of the plugins to the given numbers."""
        import drjit as dr

        at = 0
        for target in self.targets:
            for one in target.moving:
                slot = Along(target.plugin, one.path).slot
                part = [float(x) for x in numbers[at : at + one.count]]
                at += one.count
                for key in slot.values:
                    slot.values[key] = self.mi.Color3f(*part) if one.count > 1 else self.mi.Float(part[0])
                dr.make_opaque(*slot.values.values())
            target.plugin.placed.derive()

    def _settings(self, seed: int) -> Settings:
        return Settings("path", max_depth=self.depth, seed=seed)

    def render(self, numbers: Floats, spp: int | None = None, seed: int | None = None) -> Floats:
        """Render the picture with the given parameters. If `spp` or `seed` is None, that of the fit is used."""
        self.put(numbers)
        render = Render(self.scene, self._settings(self.seed if seed is None else seed))
        render.advance(spp or self.spp)
        return render.image().astype(np.float64)

    def loss(self, numbers: Floats) -> float:
        return float(np.mean(((self.render(numbers) - self.wanted) * self.weight) ** 2))

    def linearized(self, numbers: Floats) -> list[Linearized]:
        """The residuals of each channel and their derivatives."""
        residual = (self.render(numbers) - self.wanted) * self.weight
        # independent samples, because noise common to the derivatives and the residuals would bias the gradient
        render = Gradients(self.scene, self._settings(self.seed ^ OTHER), self.along)
        render.advance(self.spp)
        slopes = [slope.astype(np.float64) * self.weight for slope in render.slopes()]
        blocks: list[Linearized] = []
        for channel in range(CHANNELS):
            which = [columns[channel] if len(columns) > 1 else columns[0] for columns in self.columns]
            jacobian = np.stack([slope[..., channel].ravel() for slope in slopes], -1)
            blocks.append((residual[..., channel].ravel(), jacobian, which))
        return blocks


def _result(problem: Problem, numbers: Floats, losses: list[float], seconds: float) -> PictureFit:
    height, width = problem.wanted.shape[:2]
    row, column = np.indices((height, width)) // TILE
    tile = (row * (-(-width // TILE)) + column).ravel()
    sure = certainty(*information(problem.linearized(numbers), tile, problem.count))
    names = tuple(name for one in problem.free for name in one.names)
    shown = problem.render(numbers, SHOWN * problem.spp)
    materials, at = {}, 0
    for target in problem.targets:
        count = sum(one.count for one in target.moving)
        materials[target.path] = with_values(target.material, target.moving, numbers[at : at + count])
        at += count
    return PictureFit(
        materials,
        names,
        numbers,
        sure.errors,
        sure.correlation,
        tuple(losses),
        float(np.abs(shown - problem.wanted).mean() / np.abs(problem.wanted).mean()),
        problem.wanted.astype(np.float32),
        shown.astype(np.float32),
        tuple(notes_on(problem.free, numbers, ~np.isfinite(sure.errors), sure.coupling, names, sure.undetermined)),
        seconds,
    )
