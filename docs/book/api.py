"""The public API: every name of `gonio.__all__`, with its signature and its docstring."""

from __future__ import annotations

import inspect
import re
import typing
from typing import Any

import gonio as go

from .text import escaped, fenced, markdown, table

HEAD = """# Python API

These pages describe all public names of `import gonio as go`. Arrays are NumPy or Dr.Jit arrays; an array of shape
`(N, 3)` contains N directions or spectra. A list of length 3 is broadcast. Directions are unit vectors in the local
frame, whose +z axis is the normal. Color values are linear, angles are in radians, and wavelengths are in nanometers
([Conventions](../../conventions.md)). Each model is also a class; see [Models](../models/index.md).
"""
TOPICS = {
    "Materials": "material materials fits models model mix two_sided BSDF Sample Preset KnownViolation Limit Parameter",
    "Define your own components": "number spectrum width angle index choice flag file bsdf method never register "
    "Angle Colour Index Number Width Direction Mask Mode Pair Scalar Spectrum NDF Stretched Masking Fresnel Interface "
    "Integrator Law Panel ops",
    "Rendering and plots": "render resume study report plot view compare explain info convert",
    "Energy and light": "albedo Albedo bake compensation fresnel indices refractive_index",
    "Measure and fit": "measure capture fit fit_picture compress check",
    "Shaders and laws": "emit Shader verify",
    "Machines and settings": "cluster Cluster get_precision set_precision",
    "Errors": "GonioError InputError MachineError GonioWarning",
}


def pages() -> dict[str, str | bytes]:
    """The index of the API, and a page for each topic."""
    made: dict[str, str | bytes] = {}
    known = {cls.__name__ for cls in go.models().values()}
    listed = {name for names in TOPICS.values() for name in names.split()}
    rest = [name for name in go.__all__ if name not in listed | known | {"Mix", "TwoSided"}]
    topics = {**TOPICS, **({"Other": " ".join(rest)} if rest else {})}
    rows = []
    for title, names in topics.items():
        key = title.lower().replace(" ", "-")
        made[f"reference/api/{key}.md"] = _page(title, names.split())
        rows.append((f"[{title}]({key}.md)", ", ".join(f"`{name}`" for name in names.split())))
    listing = "\n".join(path.rpartition("/")[2].removesuffix(".md") for path in made)
    toctree = f":::{{toctree}}\n:hidden:\n\n{listing}\n:::"
    made["reference/api/index.md"] = "\n".join([HEAD, table(("topic", "names"), rows), "", toctree, ""])
    return made


def _page(title: str, names: list[str]) -> str:
    return "\n\n".join([f"# {title}", *(part for name in names for part in _entry(name))]) + "\n"


def _entry(name: str) -> list[str]:
    thing = getattr(go, name)
    doc = inspect.getdoc(thing) or ""
    parts = [f"## go.{name}"]
    if inspect.isclass(thing) or inspect.isfunction(thing):
        parts.append(fenced(_signature(f"go.{name}", thing), "python"))
        parts.append(markdown(doc) if not doc.startswith(f"{name}(") else "")
    elif inspect.ismodule(thing):
        parts.append(markdown(doc))
    else:
        parts.append(f"A type: `{re.sub(r'`', '', str(typing.get_args(thing) or thing))[:300]}`")
    if inspect.isclass(thing):
        parts += _members(name, thing)
    return [part for part in parts if part]


def _members(name: str, cls: type) -> list[str]:
    rows = []
    for key, member in vars(cls).items():
        plain: Any = member.__func__ if isinstance(member, classmethod | staticmethod) else member
        if not key.startswith("_") and (callable(plain) or isinstance(plain, property)) and inspect.getdoc(plain):
            text = escaped(" ".join((inspect.getdoc(plain) or "").split("\n\n")[0].split()))
            shown = key if isinstance(plain, property) else _signature(key, plain)
            rows.append((f"`{' '.join(shown.split())}`".replace("|", "\\|"), text))
    return [table(("member", "description"), rows)] if rows else []


def _signature(name: str, thing: Any) -> str:
    try:
        text = f"{name}{inspect.signature(thing)}".replace("'", "")
    except (TypeError, ValueError):
        return name
    if len(text) <= 90:
        return text
    signature = inspect.signature(thing)
    lines = ",\n    ".join(str(parameter).replace("'", "") for parameter in signature.parameters.values())
    return f"{name}(\n    {lines},\n)"
