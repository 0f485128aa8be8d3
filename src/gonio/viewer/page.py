"""The page of `gonio view`: its data, and the one HTML file that holds everything it needs.

The data format is described in docs/viewer.md. Shader code and tables come from `emit`; script and style are the
prebuilt ones in `static/`, made from `web/`.
"""

from __future__ import annotations

import base64
import hashlib
import html as escaping
import itertools
import json
from collections.abc import Collection, Mapping
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

from .._version import __version__
from ..energy.tables import bake
from ..errors import InputError, MachineError
from ..material import BSDF, tree
from ..material.recording import switched_off
from ..owner import alone
from ..shaders import bundle as written_for
from . import panels, stage
from .stage import PresetData, Stage, Value

Json: TypeAlias = "dict[str, object]"  # what becomes JSON, as docs/viewer.md describes it


class VariantData(TypedDict):
    """A material with some choices made, as shader code.

    off  paths of weights at whose value of nothing it was written: it does for balls that have them so
    """

    key: str
    choices: dict[str, Value]
    off: list[str]
    manifest: Json
    text: str
    tables: dict[str, str]


class MaterialData(TypedDict):
    """A material of the page."""

    id: str
    title: str
    presets: list[PresetData]
    variants: list[VariantData]


class PageData(TypedDict):
    """All that the page is made from."""

    version: int
    generator: str
    title: str
    mode: str
    socket: str | None
    revision: int
    materials: list[MaterialData]
    scene: Json
    display: Json
    notes: list[str]
    dfg: Json


VERSION = 1
STATIC = Path(__file__).parent / "static"
# Bilinear lookups are off by 1e-3 (RMS); at low roughness, where B rises within mu < .05, by up to 6e-2.
DFG_SIZE = 64
# What `energy.curves` lays along x, y, z of its tables, and what a texel holds, by the start of their names.
TABLES = {
    "missing_turned_": (["sqrt(alpha_min / alpha_max)", "sqrt(alpha_max)"], "coefficients of 1 - E(mu, phi)"),
    "missing_glass_": (["roughness", "F0^(1/4)"], "coefficients of 1 - E(mu)"),
    "missing_": (["roughness", "group of four"], "coefficients of 1 - E(mu), F = 1"),
    "lobe_glass_": (["u", "roughness", "F0^(1/4)"], "mu^2 below which the share u of the missing light lies"),
    "lobe_": (["u", "roughness"], "mu^2 below which the share u of the missing light lies"),
}


@alone
def page_data(what: Stage, socket: str | None = None, revision: int = 0) -> PageData:
    """The page's data, as JSON holds it.

    socket    where the live reference is reached, such as "/ws?token=..."; None for a page without a server
    revision  how often the stage was made anew before
    Raises InputError where a model cannot be written as shader code.
    """
    used = {row.material for row in what.rows}
    return {
        "version": VERSION,
        "generator": f"gonio {__version__}",
        "title": what.title,
        "mode": "export" if socket is None else "live",
        "socket": socket,
        "revision": revision,
        "materials": [
            material_data(key, m, _switched_on(what, key), socket is None)
            for key, m in what.materials.items()
            if key in used
        ],
        "scene": {
            "rows": [
                {
                    "label": row.label,
                    "material": row.material,
                    "balls": [{"label": ball.label, "set": ball.values} for ball in row.balls],
                }
                for row in what.rows
            ],
            "lights": list(what.lights),
            "camera": what.framed(),
            "spacing": stage.SPACING,
            "mesh": "sphere",
        },
        "display": {"tone": "none", "exposure": 0.0},
        "notes": list(what.notes),
        "dfg": split_sum_data(),
    }


def _switched_on(what: Stage, key: str) -> set[str]:
    """Paths of the weights that are not off on some ball of a material."""
    material = what.materials[key].bsdf
    balls = [ball.values for row in what.rows if row.material == key for ball in row.balls]
    return {
        leaf.path
        for leaf in tree.leaves(material)
        if leaf.parameter.off is not None
        and any(not leaf.parameter.is_off(values.get(leaf.path, leaf.value)) for values in balls)
    }


def material_data(key: str, material: stage.Material, on: Collection[str] = (), whole: bool = True) -> MaterialData:
    """A material with its presets and one variant for every combination of its choices, the model's own first.

    on     paths of weights that its balls switch on
    whole  add variants with every layer, for a page that nobody writes another for
    """
    names = list(material.choices)
    combinations = [dict(zip(names, c, strict=True)) for c in itertools.product(*material.choices.values())]
    variants = [variant_data(material.bsdf, choices, on) for choices in combinations]
    if whole and any(variant["off"] for variant in variants):
        every = switched_off(material.bsdf)
        variants += [variant_data(material.bsdf, choices, every) for choices in combinations]
    return {"id": key, "title": material.title, "presets": stage.presets(material.bsdf), "variants": variants}


@alone
def variant_data(bsdf: BSDF, choices: Mapping[str, Value], on: Collection[str] = ()) -> VariantData:
    """Shader, manifest and tables of a model with some choices made otherwise, without the layers that are off.

    on  paths of weights that are written all the same
    """
    bundle = written_for(stage.replaced(bsdf, choices, "choices"), "glsl", lean=True, on=on)
    tables = {name: encode(values) for name, values in bundle.tables.items()}
    manifest = bundle.manifest
    for texture in manifest["textures"]:
        name = texture["uniform"].removeprefix("table_")
        axes, doc = next((what for start, what in TABLES.items() if name.startswith(start)), ([], ""))
        texture |= {"axes": axes, "doc": doc}
    code = "".join([bundle.text, *(f"{name} {data}" for name, data in sorted(tables.items()))])
    key = hashlib.sha256(code.encode()).hexdigest()[:16]
    fields = {field["path"] for field in manifest["fields"]}
    off = [p["path"] for p in manifest["parameters"] if p["off"] is not None and p["path"] not in fields]
    return {
        "key": key,
        "choices": dict(choices),
        "off": off,
        "manifest": manifest,
        "text": bundle.text,
        "tables": tables,
    }


def encode(values: NDArray[np.floating]) -> str:
    """Little-endian float32 in base64."""
    return base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode()


@lru_cache
def split_sum_data() -> Json:
    """A and B of the split sum (Karis2013) for GGX, over mu (x) and roughness (y), at texel centres."""
    values = bake.bake("ggx", lut=["dfg"], size=DFG_SIZE).arrays["dfg"]
    return {"size": [DFG_SIZE, DFG_SIZE], "channels": 2, "data": encode(values)}


# --------------------------------------------------------------------------- HTML


def html(data: PageData, policy: bool = True) -> str:
    """One file: style, data and scripts inline, no address in it that a browser would fetch.

    policy  put the Content-Security-Policy into the file itself; a server sends it as a header instead
    """
    script, style = _script(), _style()
    more = "".join(f'<script type="module">{panel}</script>\n' for panel in _panels())
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    text = text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    # a file on disk has no secret and no network; programs that drive a browser wait by evaluating text in it
    own = content_policy().replace("script-src", "script-src 'unsafe-eval'")
    meta = f'<meta http-equiv="Content-Security-Policy" content="{own}">\n' if policy else ""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"{meta}"
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="referrer" content="no-referrer">\n'
        f"<title>{escaping.escape(str(data['title']))} · Gonio</title>\n"
        f"<style>{style}</style>\n</head>\n<body>\n"
        '<div id="app"></div>\n'
        "<noscript>This page draws with WebGL 2 and needs JavaScript.</noscript>\n"
        f'<script type="application/json" id="gonio-data">{text}</script>\n'
        f"<script>{script}</script>\n{more}</body>\n</html>\n"
    )


def content_policy(socket: str = "") -> str:
    """What the page may do: run the scripts that came with it, read what the user drops, reach its own socket."""
    connect = " ".join(["blob:", "data:", *([socket] if socket else [])])
    parts = {
        "default-src": "'none'",
        "script-src": " ".join(map(_digest, (_script(), *_panels()))),
        "style-src": _digest(_style()),
        "img-src": "data: blob:",
        "worker-src": "blob:",
        "connect-src": connect,
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    return "; ".join(f"{name} {value}" for name, value in parts.items())


def _digest(text: str) -> str:
    return "'sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() + "'"


@lru_cache
def _script() -> str:
    return _inline(_static("app.js"))


def _panels() -> list[str]:
    return [_inline(script) for script in panels.scripts()]


def _inline(script: str) -> str:
    """Without what would end the element early; in a string or regular expression the backslash changes nothing."""
    return script.replace("</script", "<\\/script").replace("<!--", "<\\!--")


@lru_cache
def _style() -> str:
    return _static("app.css").replace("</style", "<\\/style")


def _static(name: str) -> str:
    try:
        return (STATIC / name).read_text(encoding="utf-8").strip()
    except FileNotFoundError:
        hint = "install Gonio again; in a checkout run `npm ci && npm run build` in web/"
        raise MachineError(f"the page's {name} is missing", str(STATIC), hint) from None


def export(what: Stage, path: Path) -> Path:
    """Write the page as one file that needs no server and no network; whole or not at all."""
    from .. import files

    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"unknown page format '{path.suffix}'", "--export", "give a name that ends in .html")
    target = files.check_file(path)
    files.write_whole(target, html(page_data(what)).encode())
    return target


__all__ = ["content_policy", "export", "html", "page_data", "variant_data"]
