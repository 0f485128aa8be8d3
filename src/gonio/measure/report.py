"""A description of a measurement file: `gonio info`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from ..material.angular_range import AngularRange
from . import SAMPLE, format_of, parted, read
from .compare import asymmetry
from .formats.base import contents
from .tables.base import ANGLES, Measurement


def describe(file: str | os.PathLike[str]) -> dict[str, Any]:
    """Describe the table in a file.

    Returns its format, kind, dimensions and range of values, the range of measured angles ("known"), its flaws, the
    albedo by viewing angle, and the deviation from reciprocity.

    If the file has several materials and none is named, the result contains only their names ("items").
    Raises InputError under the same conditions as `read`.
    """
    text, item = parted(os.fspath(file))
    path = Path(os.path.expanduser(text))
    if not item and text != SAMPLE:
        data = contents(path)
        items = format_of(path, data).items(data, str(path))
        if len(items) > 1:
            return {"path": str(path), "format": format_of(path, data).name, "items": items}
    table = read(file)
    albedo = table.albedos()
    low, high = table.range
    return {
        "path": os.fspath(file),
        "format": table.source.get("format") or (SAMPLE if text == SAMPLE else format_of(path).name),
        "kind": table.name,
        "title": table.title,
        "dimensions": table.shape,
        "isotropic": table.isotropic,
        "wavelengths": None if table.wavelengths is None else [float(nm) for nm in table.wavelengths],
        "range": [low, high],
        "known": {name: list(ends) for name, ends in table.angular_range._asdict().items()},
        "flaws": table.flaws,
        "error": _typical_error(table),
        "albedo": {
            "angles": [float(angle) for angle in ANGLES],
            "rgb": [[float(x) for x in row] for row in albedo],
            "highest": float(albedo.max()),
        },
        "reciprocity": asymmetry(table),
        "source": {key: value for key, value in table.source.items() if key != "format"},
    }


def _typical_error(table: Measurement) -> float | None:
    """The median relative standard error of the values; None if the table has no standard errors."""
    error, values = table.beside.get("error"), vars(table).get("values")
    if error is None or values is None or not np.any(values > 0.0):
        return None
    return float(np.median(error[values > 0.0] / values[values > 0.0]))


def lines(about: dict[str, Any]) -> list[tuple[str, str]]:
    """The description as rows of text, each a pair (name, value)."""
    if "items" in about:
        return [("format", about["format"]), ("holds", ", ".join(about["items"]))]
    nm = about["wavelengths"]
    channels = "one, gray" if about["dimensions"].get("channel") == 1 else "red, green, blue"
    if nm is not None:
        channels = f"{len(nm)} wavelengths, {nm[0]:g} to {nm[-1]:g} nm" if len(nm) > 1 else f"one, {nm[0]:g} nm"
    low, high = about["range"]
    rows = [
        ("format", f"{about['format']}, a table of kind {about['kind']}"),
        ("title", about["title"]),
        ("dimensions", " x ".join(f"{count} {axis}" for axis, count in about["dimensions"].items())),
        ("channels", channels),
        ("directions", "isotropic" if about["isotropic"] else "anisotropic"),
        ("values", f"{low:.5g} to {high:.5g}"),
        ("measured", str(AngularRange(*map(tuple, about["known"].values())))),
    ]
    if about["error"] is not None:
        rows.append(("error", f"{100.0 * about['error']:.3g} % (median of the relative standard errors)"))
    for flaw, share in about["flaws"].items():
        rows.append((flaw, f"{100.0 * share:.3g} % of the values, left unchanged" if share else "none"))
    low, high = about["known"]["view"]
    for angle, row in zip(about["albedo"]["angles"], about["albedo"]["rgb"], strict=True):
        if low <= angle <= high:
            rows.append((f"albedo at {angle:g}", "  ".join(f"{x:.4f}" for x in row)))
    highest = about["albedo"]["highest"]
    rows.append(("energy", f"albedo of at most {highest:.4g}" + (", a gain of energy" if highest > 1.0 else "")))
    rows.append(
        ("reciprocity", f"swapping the two directions changes f by {100.0 * about['reciprocity']:.3g} % on average")
    )
    return [(what, text) for what, text in rows if text]
