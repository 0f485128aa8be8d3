"""The content of a page: materials on balls, lights, and the camera.

A `Stage` is built from models (`of_models`) or from a scene (`lab_scene.stage`), or consists of the two rows of the
homework (`homework`). `page.py` converts it to the page's data, and `reference.py` renders it.

Values of nested materials have paths: "base.alpha" is the alpha of the material `base`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NotRequired, TypeAlias, TypedDict

import numpy as np

from ..catalog import operands, outside, shaders
from ..errors import InputError, did_you_mean
from ..material import BSDF, Parameter, model, tree
from ..ops import backend
from .targets import Named, named
from .watch import Code

Leaf: TypeAlias = "tree.Leaf[BSDF]"
Value: TypeAlias = "float | bool | str | Sequence[float]"  # a parameter's value in JSON
Light: TypeAlias = "dict[str, object]"  # described in docs/viewer.md


class Camera(TypedDict):
    """A camera, as described in docs/viewer.md. Without a distance, all balls are in view."""

    target: list[float]
    azimuth: float
    elevation: float
    fov: float
    distance: NotRequired[float]


ROUGHNESS = (0.15, 0.35, 0.55, 0.75, 0.95)  # roughness of the homework's balls; alpha is its square
# the homework's masking term and the exact one, between which the page switches
HOMEWORK_MASKINGS = ("smith-correlated", "schlick-direct")
LARGEST_ROW = 5

# From the upper left; an irradiance of pi gives a white Lambertian ball the value 1 where it faces the light.
SUN: Light = {"type": "directional", "direction": [-0.4364358, 0.4364358, 0.7867958], "irradiance": [math.pi] * 3}
# A picture that the page computes: web/src/studio.ts
STUDIO: Light = {
    "type": "environment",
    "image": {"width": 256, "height": 128, "data": "studio"},
    "constant": [0.5] * 3,
    "rotation": 0.0,
    "scale": 1.0,
}
CAMERA: Camera = {"target": [0.0, 0.0, 0.0], "azimuth": 0.0, "elevation": 0.0, "fov": 30.0}
SPACING = 2.4


@dataclass(frozen=True)
class Ball:
    """One ball: its label, and the numeric parameters that differ from those of its material, path -> value."""

    label: str
    values: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """Balls of one material; `material` is its key in the stage."""

    label: str
    material: str
    balls: tuple[Ball, ...]


@dataclass(frozen=True)
class Material:
    """A model with the initial values of its balls.

    choices  options between which the page switches: path of a choice -> its names, the model's own first
    """

    title: str
    bsdf: BSDF
    choices: dict[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Stage:
    """Materials by key, rows from top to bottom, lights and camera as described in docs/viewer.md.

    code  the user's files from which the stage was built, to rebuild it when one of them is saved
    """

    title: str
    materials: dict[str, Material]
    rows: tuple[Row, ...]
    lights: tuple[Light, ...] = (SUN,)
    camera: Camera = field(default_factory=lambda: CAMERA)
    notes: tuple[str, ...] = ()
    code: Code[Stage] | None = None

    def framed(self) -> Camera:
        """The camera, at a distance from which all balls fit into a picture of 16 : 9 or wider, with a margin.

        The page preserves the horizontal field of view in narrower pictures, so all balls fit into these, too.
        """
        across = (max(len(row.balls) for row in self.rows) - 1) * SPACING / 2 + 1.25
        up = (len(self.rows) - 1) * SPACING / 2 + 1.25
        half = math.tan(math.radians(CAMERA["fov"]) / 2)
        distance = max(up / half, across / (half * 16 / 9), 4.0) + 0.3
        return {**self.camera, "distance": self.camera.get("distance", round(distance, 2))}


# --------------------------------------------------------------------------- parameters by path


def replaced(bsdf: BSDF, values: Mapping[str, Value], location: str = "values") -> BSDF:
    """The material with other values at some paths. Raises InputError with the given `location` for an invalid path or
    value."""
    known = {leaf.path: leaf.parameter for leaf in tree.leaves(bsdf)}
    for path in values:
        if path not in known:
            raise InputError(f"unknown parameter '{path}'", location, did_you_mean(path, list(known)))
    return tree.replace(bsdf, {path: _plain(known[path], value) for path, value in values.items()}, location)


def _plain(parameter: Parameter, value: Value) -> Value:
    """A value from JSON in the form for a constructor: two equal alphas become one, and a list becomes a tuple."""
    if isinstance(value, list | tuple):
        if parameter.kind == "alpha" and len(value) == 2 and value[0] == value[1]:
            return value[0]
        return tuple(value)
    return value


# --------------------------------------------------------------------------- presets


class PresetData(TypedDict):
    """A preset in the page's format: values by path, and the linear reflectance at normal incidence."""

    name: str
    set: dict[str, Value]
    f0: NotRequired[list[float]]


def presets(bsdf: BSDF) -> list[PresetData]:
    """The presets of the first nested material that has presets, each with its linear F0, the reflectance at normal
    incidence.

    F0 is computed by the exact formula, in linear values; values picked from sRGB pictures are too dark. Presets
    without a surface, whose F0 is 0, are omitted. If the default values reflect all light at every angle, they are
    listed last.
    """
    path, owner = next(((path, inner) for path, inner in tree.walk(bsdf) if inner.presets()), ("", bsdf))
    listed: list[PresetData] = []
    defaults: dict[str, Value] = {}
    for preset in owner.presets().values():
        defaults |= {name: owner.parameters()[name].default for name in preset.values}
        f0 = _f0(owner, preset.values)
        if f0 is None or any(f0):
            listed.append(_preset(preset.title, path, preset.values, f0))
    if defaults and dataclasses.MISSING not in defaults.values():
        f0 = _f0(owner, defaults)
        if f0 == [1.0] * 3:
            listed.append(_preset("F = 1", path, defaults, f0))
    return listed


def _preset(title: str, path: str, values: Mapping[str, Value], f0: list[float] | None) -> PresetData:
    data: PresetData = {"name": title, "set": {tree.join(path, name): _listed(value) for name, value in values.items()}}
    return data if f0 is None else {**data, "f0": f0}


def _listed(value: Value) -> Value:
    return list(value) if isinstance(value, tuple) else value


def _f0(owner: BSDF, values: Mapping[str, Value]) -> list[float] | None:
    f0 = tree.replace(owner, values).bind(backend.types("float64")).normal_reflectance()
    return None if f0 is None else [round(float(x), 6) for x in np.broadcast_to(backend.to_numpy(f0, 1), (1, 3))[0]]


# --------------------------------------------------------------------------- the homework


def homework(metal: str = "Ag") -> Stage:
    """Two rows of five balls under one light, with roughness increasing to the right: Kulla-Conty above, single
    scattering below."""
    base = model("conductor").preset(metal, alpha=ROUGHNESS[0] ** 2)
    compensated = model("kulla-conty")(base=base)  # type: ignore[call-arg]
    materials = {
        "m0": Material("Kulla-Conty", compensated, {"base.masking": HOMEWORK_MASKINGS}),
        "m1": Material("Plain conductor", base, {"masking": HOMEWORK_MASKINGS}),
    }
    rows = (
        Row("Kulla-Conty", "m0", tuple(_rough("base.alpha", r) for r in ROUGHNESS)),
        Row("Plain", "m1", tuple(_rough("alpha", r) for r in ROUGHNESS)),
    )
    return Stage("Kulla-Conty and plain, side by side", materials, rows)


def opening() -> Stage:
    """The stage shown by default: the homework's two rows in gold, in a studio."""
    return replace(homework("Au"), title="Gold, with and without Kulla-Conty", lights=(STUDIO,))


RIM = (
    "balls of low roughness in the upper row have a false rim: with k = (roughness + 1)^2 / 8, masking does not vanish "
    "on a smooth surface (E_avg is 0.835 at roughness 0.05), and the compensation adds light that was not lost; "
    "schlick-ibl, k = alpha / 2, causes no such rim"
)


def homework_text(metal: str = "Ag") -> Stage:
    """The two rows of the homework with the terms of its text: GGX, Schlick's F, k = (roughness + 1)^2 / 8, and f_add
    as on its sheet, with F_avg from the fit of Kulla2017. Roughness increases to the left, as in the homework."""
    terms = {"masking": "schlick-direct", "fresnel": "schlick", "alpha": ROUGHNESS[0] ** 2}
    base = model("conductor").preset(metal, **terms)
    compensated = model("kulla-conty")(base=base, color="sheet", average="imageworks")  # type: ignore[call-arg]
    maskings = ("schlick-direct", "schlick-ibl", "smith-correlated")
    materials = {
        "m0": Material("Kulla-Conty", compensated, {"base.masking": maskings}),
        "m1": Material("Plain conductor", base, {"masking": maskings}),
    }
    rows = (
        Row("Kulla-Conty", "m0", tuple(_rough("base.alpha", r) for r in reversed(ROUGHNESS))),
        Row("Plain", "m1", tuple(_rough("alpha", r) for r in reversed(ROUGHNESS))),
    )
    return Stage("Homework 4: Kulla-Conty above, plain below", materials, rows, notes=(RIM,))


def _rough(path: str, roughness: float) -> Ball:
    alpha = round(roughness**2, 6)
    return Ball(f"roughness {_short(roughness)}", {path: [alpha, alpha]})


def _short(x: float) -> str:
    return f"{x:.4g}"


# --------------------------------------------------------------------------- any models


def of_targets(targets: Sequence[str], parameters: Sequence[str] = ()) -> Stage:
    """A stage of models by their names on the command line: "conductor", "conductor(alpha=0.2)", "glass.py:Glass".

    parameters  settings "name=value", each of which is applied to every model that has the parameter
    Raises InputError for a parameter that no model has.
    """
    files = [file for target in (*targets, *parameters) for file in outside.files_in(target)]
    texts = [file for target in targets if (file := shaders.file_in(target)) is not None]
    if not files and not texts:
        return _of_targets(targets, parameters)
    code = Code(files, partial(_of_targets, targets, parameters), texts)
    return replace(code.run(), code=code)


def _of_targets(targets: Sequence[str], parameters: Sequence[str]) -> Stage:
    named_, notes = shown(targets, parameters)
    return replace(of_models([one.bsdf for one in named_], [one.given for one in named_]), notes=tuple(notes))


def shown(targets: Sequence[str], parameters: Sequence[str] = ()) -> tuple[list[Named], list[str]]:
    """`targets.named`, for materials that a page can show. Raises InputError for all other targets."""
    for target in targets:
        if operands.MATERIALS.isdisjoint(operands.readings(target)):
            hint = "the page needs shader code, which only Gonio's models have"
            raise InputError(f"'{target}' is not a model of Gonio", "MODEL", hint)
    return named(targets, parameters)


def of_models(bsdfs: Sequence[BSDF], given: Sequence[Collection[str]] | None = None) -> Stage:
    """One row of five balls per model: from smooth to rough if no alpha is given, otherwise with increasing values of
    the model's first numeric parameter.

    given  for each model, the paths of parameters that the user has set
    """
    if not bsdfs:
        return opening()
    free = [
        [leaf for leaf in tree.leaves(bsdf) if leaf.path not in fixed]
        for bsdf, fixed in zip(bsdfs, given or [()] * len(bsdfs), strict=True)
    ]
    mains = _mains(free)
    materials, rows = {}, []
    titles = _titles(bsdfs)
    for index, (bsdf, main, title) in enumerate(zip(bsdfs, mains, titles, strict=True)):
        key = f"m{index}"
        path, choices = _masking(bsdf)
        materials[key] = Material(title, bsdf, {path: choices} if path else {})
        rows.append(Row(title, key, _series(main) if main else (Ball(_title(bsdf)),)))
    title = ", ".join(titles)
    return Stage(title, materials, tuple(rows))


def _titles(bsdfs: Sequence[BSDF]) -> list[str]:
    names = [_title(bsdf) for bsdf in bsdfs]
    return [f"{name} {'ABCDEFGH'[i % 8]}" if names.count(name) > 1 else name for i, name in enumerate(names)]


def _title(bsdf: BSDF) -> str:
    inner = [_title(child) for child in tree.children(bsdf).values()]
    return type(bsdf).__name__ + (f"({', '.join(inner)})" if inner else "")


def _masking(bsdf: BSDF) -> tuple[str, tuple[str, ...]]:
    """The path of the first masking term, and its options: the model's own term, then the two terms of the homework."""
    for path, parameter, own, _ in tree.leaves(bsdf):
        if parameter.name == "masking" and parameter.choices:
            others = (name for name in HOMEWORK_MASKINGS if name != own and _accepts(bsdf, {path: name}))
            return path, (own, *others)
    return "", ()


def _accepts(bsdf: BSDF, values: Mapping[str, Value]) -> bool:
    try:
        replaced(bsdf, values)
    except InputError:
        return False
    return True


def _mains(free: Sequence[Sequence[Leaf]]) -> list[Leaf | None]:
    """For each row, the parameter that varies along its balls, or None.

    If a material occurs in one row and is nested in the material of another, both rows vary the same parameter: an
    alpha or, if there is none, the parameter of the other row.
    """
    mains = [_main(leaves) for leaves in free]
    names = {main.path for main in mains if main is not None}
    for row, main in enumerate(mains):
        if main is None or main.parameter.kind == "alpha" or "." in main.path:
            continue
        inside = (leaf for leaf in free[row] if "." in leaf.path and leaf.parameter.name in names - {main.path})
        mains[row] = next(inside, main)
    return mains


def _main(leaves: Sequence[Leaf]) -> Leaf | None:
    """The first alpha; otherwise, the first number; otherwise, the first color that no preset sets."""
    for leaf in leaves:
        if leaf.parameter.kind == "alpha" and not isinstance(leaf.value, tuple):
            return leaf
    for leaf in leaves:
        if leaf.parameter.kind == "float":
            return leaf
    for leaf in leaves:
        named = any(leaf.parameter.name in preset.values for preset in leaf.owner.presets().values())
        if leaf.parameter.kind == "spectrum" and leaf.parameter.high <= 1.0 and not named:
            return leaf
    return None


def _series(main: Leaf) -> tuple[Ball, ...]:
    """Balls that cover the range of a parameter."""
    path, parameter, value, _ = main
    if parameter.kind == "alpha":
        return tuple(_rough(path, r) for r in ROUGHNESS)
    if parameter.kind == "float":
        return tuple(Ball(f"{path} {_short(v)}", {path: v}) for v in _steps(parameter, value))
    return tuple(Ball(f"{path} {_short(v)}", {path: [v] * 3}) for v in (0.1, 0.3, 0.5, 0.7, 0.9))


def _steps(parameter: Parameter, value: float) -> list[float]:
    if math.isfinite(parameter.low) and math.isfinite(parameter.high):
        return [round(float(v), 6) for v in np.linspace(parameter.low, parameter.high, LARGEST_ROW)]
    center = float(value) or 1.0
    return [round(center * factor, 6) for factor in (0.25, 0.5, 1.0, 2.0, 4.0)]


__all__ = ["Ball", "Material", "Row", "Stage", "homework", "of_models", "of_targets", "presets", "replaced"]
