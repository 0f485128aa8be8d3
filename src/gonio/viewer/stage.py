"""What a page shows: materials on balls, the lights on them, the camera.

A `Stage` is made of models (`of_models`), of a lab scene (`lab_scene.stage`), or it is the two rows of the homework
(`homework`). `page.py` turns it into the data of the page, `reference.py` renders it.

Values of nested materials are named by a path: "base.alpha" is the alpha of the material `base`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ..errors import InputError, did_you_mean
from ..models import BSDF, Parameter, model, notation, outside, tree
from ..optics import fresnel, indices
from .watch import Code

ROUGHNESS = (0.15, 0.35, 0.55, 0.75, 0.95)  # of the homework's balls; alpha is its square
# the homework's masking and the correct one; the page toggles between them
HOMEWORK_MASKINGS = ("smith-correlated", "schlick-direct")
LARGEST_ROW = 5

# From the upper left, over the camera's shoulder; pi, so that a white Lambert ball reads 1 where it faces the light.
SUN = {"type": "directional", "direction": [-0.4364358, 0.4364358, 0.7867958], "irradiance": [math.pi] * 3}
CAMERA: dict[str, Any] = {"target": [0.0, 0.0, 0.0], "azimuth": 0.0, "elevation": 0.0, "fov": 30.0}
SPACING = 2.4


@dataclass(frozen=True)
class Ball:
    """One ball: its label, and the numeric parameters that differ from its material's, path -> value."""

    label: str
    values: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """Balls of one material, `material` being its key in the stage."""

    label: str
    material: str
    balls: tuple[Ball, ...]


@dataclass(frozen=True)
class Material:
    """A model with the values that its balls start from.

    choices  alternatives worth a toggle: path of a choice -> its names, the model's own first
    """

    title: str
    bsdf: BSDF
    choices: dict[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Stage:
    """Materials by key, rows from top to bottom, lights and camera as docs/viewer.md writes them.

    code  the user's files that it was made of, to make it anew when one of them is saved
    """

    title: str
    materials: dict[str, Material]
    rows: tuple[Row, ...]
    lights: tuple[dict[str, Any], ...] = (SUN,)
    camera: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    code: Code[Stage] | None = None

    def framed(self) -> dict[str, Any]:
        """The camera, far enough away that all balls stand in a picture of 16 : 9 or wider, with some air.

        The page keeps the horizontal field of view in narrower pictures, so they hold all balls too.
        """
        across = (max(len(row.balls) for row in self.rows) - 1) * SPACING / 2 + 1.25
        up = (len(self.rows) - 1) * SPACING / 2 + 1.25
        half = math.tan(math.radians(CAMERA["fov"]) / 2)
        distance = max(up / half, across / (half * 16 / 9), 4.0) + 0.3
        return {**CAMERA, "distance": round(distance, 2), **self.camera}


# --------------------------------------------------------------------------- parameters by path


def walk(bsdf: BSDF) -> Iterator[tuple[str, Parameter, BSDF]]:
    """Every parameter of a material and of those inside it: (path, declaration, the material that has it)."""
    for leaf in tree.leaves(bsdf):
        yield leaf.path, leaf.parameter, leaf.owner


def replaced(bsdf: BSDF, values: dict[str, Any], where: str = "values") -> BSDF:
    """The material with other values at some paths; InputError for a path or value that cannot be."""
    known = {path: parameter for path, parameter, _ in walk(bsdf)}
    for path in values:
        if path not in known:
            raise InputError(f"unknown parameter '{path}'", where, did_you_mean(path, list(known)))
    return tree.replace(bsdf, {path: plain(known[path], value) for path, value in values.items()}, where)


def plain(parameter: Parameter, value: Any) -> Any:
    """A value from JSON as a constructor takes it: two equal widths are one, a list is a tuple."""
    if isinstance(value, list | tuple):
        if parameter.kind == "alpha" and len(value) == 2 and value[0] == value[1]:
            return value[0]
        return tuple(value)
    return value


# --------------------------------------------------------------------------- presets


def presets(bsdf: BSDF) -> list[dict[str, Any]]:
    """Named indices for the first material inside that takes them, each with its linear F0 at normal incidence.

    F0 is exact (course sheet, eq. 11 and 12), in linear values: what people type from sRGB pictures is too dark.
    """
    found: list[dict[str, Any]] = []
    for path, parameter, owner in walk(bsdf):
        if parameter.name != "eta" or not owner.presets():
            continue
        stem = path.removesuffix("eta")
        if "k" in owner.parameters():
            for metal in indices.METALS.values():
                f0 = [fresnel.r0_conductor(*index) for index in zip(metal.eta, metal.k, strict=True)]
                values = {f"{stem}eta": list(metal.eta), f"{stem}k": list(metal.k)}
                found.append({"name": metal.name, "set": values, "f0": [round(x, 6) for x in f0]})
            # index 0 with any k reflects everything, at every angle
            white = {f"{stem}eta": [0.0] * 3, f"{stem}k": [1.0] * 3}
            found.append({"name": "F = 1", "set": white, "f0": [1.0] * 3})
        else:
            for medium in indices.MEDIA.values():
                if medium.eta > 1.0:
                    f0 = [round(fresnel.r0_dielectric(medium.eta), 6)] * 3
                    found.append({"name": medium.name, "set": {path: medium.eta}, "f0": f0})
        return found
    return found


# --------------------------------------------------------------------------- the homework


def homework(metal: str = "Ag") -> Stage:
    """Two rows of five balls under one light, roughness rising to the right: Kulla-Conty above, plain below."""
    silver = indices.metal(metal)
    base = model("conductor")(eta=silver.eta, k=silver.k, alpha=ROUGHNESS[0] ** 2)  # type: ignore[call-arg]
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


def _rough(path: str, roughness: float) -> Ball:
    alpha = round(roughness**2, 6)
    return Ball(f"roughness {_short(roughness)}", {path: [alpha, alpha]})


def _short(x: float) -> str:
    text = f"{x:.4g}"
    return text[1:] if text.startswith("0.") else text


# --------------------------------------------------------------------------- any models


def of_targets(targets: Sequence[str], parameters: Sequence[str] = ()) -> Stage:
    """A stage of models as the command line names them: "conductor", "conductor(alpha=0.2)", "glass.py:Glass".

    parameters  "name=value" each, for every model that has it; InputError where none has
    """
    files = [file for target in (*targets, *parameters) for file in outside.files_in(target)]
    if not files:
        return _of_targets(targets, parameters)
    code = Code(files, partial(_of_targets, targets, parameters))
    return replace(code.run(), code=code)


def _of_targets(targets: Sequence[str], parameters: Sequence[str]) -> Stage:
    wished = dict(map(notation.assignment, parameters))
    bsdfs, given, known = [], [], set()
    for target in targets:
        cls, own = _class(target)
        fits = {*cls.parameters(), *(["preset"] if cls.presets() else [])}
        settings = {**{name: value for name, value in wished.items() if name in fits}, **own}
        bsdfs.append(outside.probe(notation.made(cls, settings)[0]))
        given.append({*settings})
        known |= fits
    for name in wished:
        if name not in known:
            raise InputError(f"unknown parameter '{name}'", f"--param {name}", did_you_mean(name, sorted(known)))
    return of_models(bsdfs, given)


def _class(target: str) -> tuple[type[BSDF], dict[str, str]]:
    """The class of a target, and the parameters that the target itself sets."""
    head = target.partition("(")[0]
    if ":" in head and not outside.names_code(head):
        hint = "the page's shader code is written from Gonio's models only"
        raise InputError(f"'{target}' is no model of Gonio", "MODEL", hint)
    return notation.taken_apart(target)


def of_models(bsdfs: Sequence[BSDF], given: Sequence[set[str]] | None = None) -> Stage:
    """One row a model. Where no width is given, five balls from smooth to rough; else five over its first number.

    given  per model, the names of parameters that the user has fixed
    """
    if not bsdfs:
        return homework()
    fixed = given or [set() for _ in bsdfs]
    materials, rows = {}, []
    titles = _titles(bsdfs)
    for index, (bsdf, names, title) in enumerate(zip(bsdfs, fixed, titles, strict=True)):
        key = f"m{index}"
        path, choices = _masking(bsdf)
        materials[key] = Material(title, bsdf, {path: choices} if path else {})
        rows.append(Row(title, key, _series(bsdf, names)))
    title = ", ".join(titles)
    return Stage(title, materials, tuple(rows))


def _titles(bsdfs: Sequence[BSDF]) -> list[str]:
    names = [_title(bsdf) for bsdf in bsdfs]
    return [f"{name} {'ABCDEFGH'[i % 8]}" if names.count(name) > 1 else name for i, name in enumerate(names)]


def _title(bsdf: BSDF) -> str:
    inner = [_title(child) for child in tree.children(bsdf).values()]
    return type(bsdf).__name__ + (f"({', '.join(inner)})" if inner else "")


def _masking(bsdf: BSDF) -> tuple[str, tuple[str, ...]]:
    """The first masking inside, and the choices worth a toggle: the model's own, then the homework's two."""
    for path, parameter, _ in walk(bsdf):
        if parameter.name == "masking" and parameter.kind == "choice":
            own = tree.value_at(bsdf, path)
            allowed = [own]
            for name in HOMEWORK_MASKINGS:
                if name not in allowed and _accepts(bsdf, {path: name}):
                    allowed.append(name)
            return path, tuple(allowed)
    return "", ()


def _accepts(bsdf: BSDF, values: dict[str, Any]) -> bool:
    try:
        replaced(bsdf, values)
    except InputError:
        return False
    return True


def _series(bsdf: BSDF, fixed: set[str]) -> tuple[Ball, ...]:
    """Balls over the first width that is not fixed, else over the first such number, else one ball."""
    free = [(path, p) for path, p, _ in walk(bsdf) if path.partition(".")[0] not in fixed and path not in fixed]
    for path, parameter in free:
        if parameter.kind == "alpha" and not isinstance(tree.value_at(bsdf, path), tuple):
            return tuple(_rough(path, r) for r in ROUGHNESS)
    for path, parameter in free:
        if parameter.kind == "float" and parameter.name != "seed":
            return tuple(Ball(f"{path} {_short(v)}", {path: v}) for v in _steps(parameter, tree.value_at(bsdf, path)))
    for path, parameter in free:
        if parameter.kind == "spectrum" and parameter.high <= 1.0:
            return tuple(Ball(f"{path} {_short(v)}", {path: [v] * 3}) for v in (0.1, 0.3, 0.5, 0.7, 0.9))
    return (Ball(_title(bsdf)),)


def _steps(parameter: Parameter, value: float) -> list[float]:
    if math.isfinite(parameter.low) and math.isfinite(parameter.high):
        return [round(float(v), 6) for v in np.linspace(parameter.low, parameter.high, LARGEST_ROW)]
    centre = float(value) or 1.0
    return [round(centre * factor, 6) for factor in (0.25, 0.5, 1.0, 2.0, 4.0)]


__all__ = ["Ball", "Material", "Row", "Stage", "homework", "of_models", "of_targets", "presets", "replaced"]
