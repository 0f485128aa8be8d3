"""MaterialX: open_pbr_surface and standard_surface, read with the package MaterialX (gonio[materialx])."""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, TypeAlias
from xml.etree import ElementTree

import numpy as np

from ...errors import InputError, MachineError, did_you_mean
from . import Described, Document, Notation, xml_guard

Node: TypeAlias = Any  # a C++ object of MaterialX, which has no type stubs
Number: TypeAlias = float | bool | tuple[float, ...]
Inputs: TypeAlias = dict[str, Number]

OPEN_PBR, STANDARD = "open_pbr_surface", "standard_surface"
LIBRARIES = ("stdlib/stdlib_defs.mtlx", "pbrlib/pbrlib_defs.mtlx", f"bxdf/{OPEN_PBR}.mtlx", f"bxdf/{STANDARD}.mtlx")
FRAMES = {
    "geometry_normal",
    "geometry_coat_normal",
    "geometry_tangent",
    "geometry_coat_tangent",
    "coat_normal",
    "normal",
}

# inputs that `to_open_pbr` cannot express, with the values for which they have no effect
LEFT: Mapping[str, Number] = {
    "specular_rotation": 0.0, "transmission_extra_roughness": 0.0, "coat_rotation": 0.0, "coat_affect_color": 0.0,
}  # fmt: skip


class MaterialX(Document):
    """MaterialX documents (.mtlx)."""

    name: ClassVar[str] = "materialx"
    suffixes: ClassVar[tuple[str, ...]] = (".mtlx",)
    writes: ClassVar[str] = "openpbr"

    def materials(self, path: Path) -> list[str]:
        return list(_surfaces(_document(path)))

    def read(self, path: Path, name: str) -> Described:
        document = _document(path)  # must be referenced here, because its nodes do not keep it alive
        surface = _surfaces(document)[name]
        where = f"{path}#{surface.getName()}"
        given = _inputs(surface, where)
        notices: list[str] = []
        if surface.getCategory() == STANDARD:
            definition = surface.getNodeDef()  # contains the version
            inputs = {**_defaults(definition.getName() if definition else f"ND_{STANDARD}_surfaceshader"), **given}
            notices = [f"{key} is omitted" for key, without in LEFT.items() if inputs[key] != without]
            given = to_open_pbr(inputs)
        values = {key: list(value) if isinstance(value, tuple) else value for key, value in given.items()}
        return Described({"type": "openpbr", **values}, tuple(notices))

    def write(self, notation: Notation, name: str) -> bytes:
        """The bytes of a file for an `openpbr`, with an open_pbr_surface and a material of the given name."""
        mx = _wheel()
        document = mx.createDocument()
        surface = document.addNode(OPEN_PBR, "surface_" + mx.createValidName(name), "surfaceshader")
        known = _types(OPEN_PBR)
        for key, value in notation.items():
            if key in ("type", "layering"):  # the combination of the lobes is specific to Gonio
                continue
            if key not in known:
                raise InputError(f"{OPEN_PBR} has no input '{key}'", "material", did_you_mean(key, list(known)))
            surface.addInput(key, known[key]).setValueString(_text(value, known[key], key))
        material = document.addNode("surfacematerial", mx.createValidName(name), "material")
        material.addInput("surfaceshader", "surfaceshader").setNodeName(surface.getName())
        text: str = mx.writeToXmlString(document)
        return text.encode()


def to_open_pbr(s: Mapping[str, Number]) -> Inputs:
    """The parameters of OpenPBR that correspond to those of Autodesk's Standard Surface.

    The formulas are those of the node graph NG_standard_surface_to_open_pbr_surface in MaterialX (MaterialX2024,
    libraries/bxdf/translation). It converts the thickness of a film to micrometers, reduces a coat over metal to a
    tint, and maps `coat_affect_roughness` to `coat_darkening`.
    """
    coat, metal = _number(s["coat"]), _number(s["metalness"])
    colour, coat_colour = _colour(s["base_color"]), _colour(s["coat_color"])
    specular_colour = _colour(s["specular_color"])
    film = _number(s["thin_film_thickness"]) * 0.001
    return {
        "base_weight": s["base"],
        "base_color": tuple(c * (1.0 + (k - 1.0) * coat) for c, k in zip(colour, coat_colour, strict=True)),
        "base_diffuse_roughness": s["diffuse_roughness"],
        "base_metalness": metal,
        "specular_weight": 1.0 if metal > 0.0 else s["specular"],
        "specular_color": specular_colour if sum(specular_colour) != 0.0 else (1.0, 1.0, 1.0),
        "specular_roughness": s["specular_roughness"],
        "specular_ior": s["specular_IOR"],
        "specular_roughness_anisotropy": s["specular_anisotropy"],
        "transmission_weight": s["transmission"],
        "transmission_color": s["transmission_color"],
        "transmission_depth": s["transmission_depth"],
        "transmission_scatter": s["transmission_scatter"],
        "transmission_scatter_anisotropy": s["transmission_scatter_anisotropy"],
        "transmission_dispersion_scale": s["transmission_dispersion"],
        "subsurface_weight": s["subsurface"],
        "subsurface_color": s["subsurface_color"],
        "subsurface_radius": s["subsurface_scale"],
        "subsurface_radius_scale": s["subsurface_radius"],
        "subsurface_scatter_anisotropy": s["subsurface_anisotropy"],
        "fuzz_weight": s["sheen"],
        "fuzz_color": s["sheen_color"],
        "fuzz_roughness": _number(s["sheen_roughness"]) ** 0.4,
        "coat_weight": 0.0 if coat * metal > 0.0 else coat,
        "coat_color": coat_colour,
        "coat_roughness": s["coat_roughness"],
        "coat_roughness_anisotropy": s["coat_anisotropy"],
        "coat_ior": s["coat_IOR"],
        "coat_darkening": s["coat_affect_roughness"],
        "thin_film_weight": 1.0 if film > 0.0 else 0.0,
        "thin_film_thickness": film,
        "thin_film_ior": s["thin_film_IOR"],
        "emission_luminance": s["emission"],
        "emission_color": s["emission_color"],
        "geometry_opacity": _colour(s["opacity"])[0],
        "geometry_thin_walled": s["thin_walled"],
    }


def _number(value: Number) -> float:
    assert isinstance(value, float), "guaranteed by the definition"
    return value


def _colour(value: Number) -> tuple[float, ...]:
    assert isinstance(value, tuple), "guaranteed by the definition"
    return value


# --------------------------------------------------------------------------- the library MaterialX


def _wheel() -> ModuleType:
    try:
        return importlib.import_module("MaterialX")
    except ImportError:
        what = "a MaterialX document needs the package MaterialX"
        raise MachineError(what, "FILE.mtlx", "pip install 'gonio[materialx]'") from None


@lru_cache(maxsize=1)
def _library() -> Node:
    """The node definitions that a document may use."""
    mx = _wheel()
    library = mx.createDocument()
    for file in LIBRARIES:
        mx.readFromXmlFile(library, str(Path(str(mx.__file__)).parent / "libraries" / file))
    return library


@lru_cache(maxsize=4)
def _types(category: str) -> dict[str, str]:
    """The types of those inputs of a surface that are values."""
    inputs = _library().getNodeDef(f"ND_{category}_surfaceshader").getActiveInputs()
    return {one.getName(): one.getType() for one in inputs if one.getName() not in FRAMES}


def _defaults(definition: str) -> Inputs:
    inputs = _library().getNodeDef(definition).getActiveInputs()
    return {one.getName(): _plain(one.getValue()) for one in inputs if one.getName() not in FRAMES | {"tangent"}}


def _plain(value: Node) -> Number:
    """Convert a value of MaterialX; a float32 is converted to the shortest decimal number that rounds to it."""
    if isinstance(value, bool):
        return value
    if isinstance(value, int | float):
        return float(str(np.float32(value)))
    return tuple(float(str(np.float32(part))) for part in value)


def _document(path: Path) -> Node:
    """Read a file as a MaterialX document. Includes are resolved, entities are rejected, and sizes are limited."""
    mx = _wheel()
    root = xml_guard.read(path)
    if root.tag != "materialx":
        raise InputError(f"<{root.tag[:40]}> is not a MaterialX document", str(path), "it must start with <materialx>")
    document = mx.createDocument()
    try:
        mx.readFromXmlString(document, ElementTree.tostring(root, "unicode"))
        document.setDataLibrary(_library())
    except Exception as error:  # MaterialX raises its own exceptions
        raise InputError(f"MaterialX rejects it: {str(error)[:200]}", str(path), "correct it there") from None
    return document


def _surfaces(document: Node) -> dict[str, Node]:
    """The surface of each material, by the name of the material, and other surfaces, by their own names."""
    surfaces: dict[str, Node] = {}
    loose = {node.getName(): node for node in document.getNodes() if node.getType() == "surfaceshader"}
    for material in document.getNodes():
        link = material.getInput("surfaceshader") if material.getType() == "material" else None
        name = link.getNodeName() if link is not None else ""
        if name in loose:
            surfaces[material.getName()] = loose[name]
    worn = {node.getName() for node in surfaces.values()}
    return {**surfaces, **{name: node for name, node in loose.items() if name not in worn}}


def _inputs(surface: Node, where: str) -> Inputs:
    """The inputs that are set on a surface, as values of the types in its definition."""
    category = surface.getCategory()
    if category not in (OPEN_PBR, STANDARD):
        raise InputError(f"unknown node '{category[:60]}'", where, f"supported: {OPEN_PBR} and {STANDARD}")
    known, inputs = _types(category), {}
    for one in surface.getInputs():
        name = one.getName()
        linked = [key for key in ("nodename", "nodegraph", "interfacename", "output") if one.hasAttribute(key)]
        if linked:
            what = f"its {name[:60]} is connected to '{one.getAttribute(linked[0])[:60]}', but only values can be read"
            raise InputError(what, where, "bake it into a value")
        if name not in known:
            raise InputError(f"{category} has no input '{name[:60]}'", where, did_you_mean(name, list(known)))
        if one.getType() != known[name]:
            what = f"{name} is of type {one.getType()[:40]}, {known[name]} expected"
            raise InputError(what, where)
        inputs[name] = _value(one, where)
    return inputs


def _value(one: Node, where: str) -> Number:
    name, text = one.getName(), one.getValueString()
    try:
        value = _plain(one.getValue())
    except Exception:  # no value, or a text that is not a number
        raise InputError(f"{name} = '{text[:60]}' is not of type {one.getType()}", where) from None
    numbers = value if isinstance(value, tuple) else (value,)
    if not all(math.isfinite(number) for number in numbers):
        raise InputError(f"{name} = '{text[:60]}' is not finite", where)
    return value


def _text(value: object, kind: str, name: str) -> str:
    """Format a value as in a MaterialX file."""
    try:
        if kind == "boolean":
            if not isinstance(value, bool):
                raise TypeError
            return str(value).lower()
        parts = np.asarray(value, float).ravel().tolist()
        parts = parts * 3 if kind == "color3" and len(parts) == 1 else parts
        if len(parts) != (3 if kind == "color3" else 1) or not all(map(math.isfinite, parts)):
            raise ValueError
    except (TypeError, ValueError):
        raise InputError(f"{str(value)[:60]} given, a {kind} expected", f"material: {name}") from None
    return ", ".join(f"{part:.9g}" for part in parts)
