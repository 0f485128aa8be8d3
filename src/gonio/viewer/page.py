"""The page of `gonio view`: its data, and the self-contained HTML file.

The data format is described in docs/viewer.md. Shader code and tables come from `emit`; script and style are the
prebuilt files in `static/`, made from `web/`.
"""

from __future__ import annotations

import base64
import hashlib
import html as escaping
import itertools
import json
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

from .._version import __version__
from ..energy.tables import bake
from ..errors import InputError, MachineError, did_you_mean
from ..material import BSDF, tree
from ..material.recording import switched_off
from ..owner import exclusive
from ..shaders import bundle as written_for
from . import panels, stage
from .stage import PresetData, Stage, Value

Json: TypeAlias = "dict[str, object]"  # data for JSON, described in docs/viewer.md


class VariantData(TypedDict):
    """A material with some choices, as shader code.

    off     paths of weights that were off when the code was written; it applies to balls with the same weights off
    fixed   values that its tables were computed for (`BSDF.fixed`), by path; it applies to balls with the same values
    facets  [distribution, masking] of the facets that reflect, if any: selects the page's `dfg` table
    """

    key: str
    choices: dict[str, Value]
    off: list[str]
    fixed: dict[str, Value]
    facets: list[str] | None
    manifest: Json
    text: str
    tables: dict[str, str]


class MaterialData(TypedDict):
    """A material of the page."""

    id: str
    title: str
    presets: list[PresetData]
    variants: list[VariantData]


class SplitSumData(TypedDict):
    """A and B of the split sum of some facets, over mu (x) and roughness (y), at texel centers."""

    facets: list[str]
    size: list[int]
    channels: int
    data: str


class PageData(TypedDict):
    """All data of the page."""

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
    dfg: list[SplitSumData]


VERSION = 1
STATIC = Path(__file__).parent / "static"
# Bilinear lookups have an error of 1e-3 (RMS); at low roughness, where B rises within mu < 0.05, up to 6e-2.
DFG_SIZE = 64
# Axes x, y, z of the tables of `energy.curves`, and the content of a texel, by the beginning of their names.
TABLES = {
    "missing_turned_": (["sqrt(alpha_min / alpha_max)", "sqrt(alpha_max)"], "coefficients of 1 - E(mu, phi)"),
    "missing_glass_": (["roughness", "F0^(1/4)"], "coefficients of 1 - E(mu)"),
    "missing_": (["roughness", "group of four"], "coefficients of 1 - E(mu), F = 1"),
    "lobe_glass_": (["u", "roughness", "F0^(1/4)"], "mu^2 below which the fraction u of the missing light lies"),
    "lobe_": (["u", "roughness"], "mu^2 below which the fraction u of the missing light lies"),
}


@exclusive
def page_data(what: Stage, socket: str | None = None, revision: int = 0) -> PageData:
    """The data of the page, for JSON.

    socket    address of the live reference, such as "/ws?token=..."; None for a page without a server
    revision  how many times the stage was rebuilt before
    Raises InputError if a model cannot be written as shader code.
    """
    used = {row.material for row in what.rows}
    materials = [
        material_data(key, m, _switched_on(what, key), socket is None, _fixed(what, key))
        for key, m in what.materials.items()
        if key in used
    ]
    facets = {tuple(v["facets"]): None for m in materials for v in m["variants"] if v["facets"]}
    return {
        "version": VERSION,
        "generator": f"gonio {__version__}",
        "title": what.title,
        "mode": "export" if socket is None else "live",
        "socket": socket,
        "revision": revision,
        "materials": materials,
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
        "dfg": [table for ndf, masking in facets if (table := split_sum_data(ndf, masking))],
    }


def _switched_on(what: Stage, key: str) -> set[str]:
    """Paths of the weights that are on for at least one ball of a material."""
    return {
        leaf.path
        for leaf in tree.leaves(what.materials[key].bsdf)
        if leaf.parameter.off is not None
        and any(not leaf.parameter.is_off(values.get(leaf.path, leaf.value)) for values in _balls(what, key))
    }


def _fixed(what: Stage, key: str) -> list[dict[str, Value]]:
    """The distinct values on the balls of a material that its tables depend on."""
    fixed = what.materials[key].bsdf.fixed
    distinct: list[dict[str, Value]] = []
    for values in _balls(what, key):
        own = {path: value for path, value in values.items() if path in fixed}
        if own not in distinct:
            distinct.append(own)
    return distinct


def _balls(what: Stage, key: str) -> list[Mapping[str, Value]]:
    return [ball.values for row in what.rows if row.material == key for ball in row.balls]


def material_data(
    key: str,
    material: stage.Material,
    on: Collection[str] = (),
    complete: bool = True,
    fixed: Sequence[Mapping[str, Value]] = ({},),
) -> MaterialData:
    """A material with its presets and one variant for every combination of its choices, the model's own first.

    key       its name in the page's data
    on        paths of weights that its balls switch on
    complete  add variants with every layer, and with the choices of presets, for a page that cannot request variants
    fixed     sets of values, by path, for which its tables are computed: one variant each
    """
    presets = stage.presets(material.bsdf)
    names = list(material.choices)
    combinations: list[dict[str, Value]] = [
        dict(zip(names, c, strict=True)) for c in itertools.product(*material.choices.values())
    ]
    if complete:
        chosen = [_choices_of(preset) for preset in presets]
        combinations += [made for i, made in enumerate(chosen) if made and made not in chosen[:i]]
    wanted = [(choices, values) for choices in combinations for values in fixed]
    variants = [variant_data(material.bsdf, choices, on, values) for choices, values in wanted]
    if complete and any(variant["off"] for variant in variants):
        every = switched_off(material.bsdf)
        variants += [variant_data(material.bsdf, choices, every, values) for choices, values in wanted]
    return {"id": key, "title": material.title, "presets": presets, "variants": variants}


def _choices_of(preset: PresetData) -> dict[str, Value]:
    return {path: value for path, value in preset["set"].items() if isinstance(value, str | bool)}


@exclusive
def variant_data(
    bsdf: BSDF, choices: Mapping[str, Value], on: Collection[str] = (), fixed: Mapping[str, Value] | None = None
) -> VariantData:
    """Shader, manifest and tables of a model with other choices, without the layers that are off.

    choices  values of the choices, by path
    on       paths of weights that are written although they are off
    fixed    other values that the tables depend on, by path
    Raises InputError for paths in `fixed` on which the tables do not depend.
    """
    own = {leaf.path: leaf.value for leaf in tree.leaves(bsdf) if leaf.path in bsdf.fixed}
    if wrong := next((path for path in fixed or {} if path not in own), None):
        raise InputError(f"no table depends on '{wrong}'", "fixed", did_you_mean(wrong, sorted(own)))
    made = stage.replaced(bsdf, {**choices, **(fixed or {})}, "choices")
    bundle = written_for(made, "glsl", lean=True, on=on, arrays=False)
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
    held = {p["path"]: p["value"] for p in manifest["parameters"] if p["fixed"] and p["value"] is not None}
    for parameter in manifest["parameters"]:  # a variant has other values than the declared defaults
        if parameter["path"] in held:
            parameter["value"] = np.asarray(own[parameter["path"]], float).tolist()
    return {
        "key": key,
        "choices": dict(choices),
        "off": off,
        "fixed": held,
        "facets": _facets(made) if any(term["name"] == "D" for term in manifest["terms"]) else None,
        "manifest": manifest,
        "text": bundle.text,
        "tables": tables,
    }


def _facets(bsdf: BSDF) -> list[str] | None:
    surfaces = (inner.microsurface for _, inner in tree.walk(bsdf))
    return next(([surface.ndf, surface.masking] for surface in surfaces if surface is not None), None)


def encode(values: NDArray[np.floating]) -> str:
    """Values as little-endian float32 in base64."""
    return base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode()


@lru_cache
def split_sum_data(ndf: str, masking: str) -> SplitSumData | None:
    """A and B of the split sum (Karis2013) for a distribution and a masking term; None if they have no table."""
    try:
        values = bake.bake(ndf, lut=["dfg"], size=DFG_SIZE, masking=masking).arrays["dfg"]
    except InputError:
        return None
    return {"facets": [ndf, masking], "size": [DFG_SIZE, DFG_SIZE], "channels": 2, "data": encode(values)}


# --------------------------------------------------------------------------- HTML


def html(data: PageData, policy: bool = True) -> str:
    """One file with style, data and scripts inline, and without addresses that a browser would fetch.

    policy  include the Content-Security-Policy in the file; a server sends it as a header instead
    """
    script, style = _script(), _style()
    more = "".join(f'<script type="module">{panel}</script>\n' for panel in _panels())
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    text = text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    # a file on disk has no secret and no network; programs that drive a browser need to evaluate text in it
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
    """The Content-Security-Policy: the page may run its own scripts, read dropped files, and connect to its socket."""
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
    """The script without sequences that would end its element; in a string or regular expression `\\` has no effect."""
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
    """Write the page as one file that needs no server and no network, completely or not at all."""
    from .. import files

    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"unknown page format '{path.suffix}'", "--output", "give a name that ends in .html")
    target = files.check_file(path)
    files.write_whole(target, html(page_data(what)).encode())
    return target


__all__ = ["content_policy", "export", "html", "page_data", "split_sum_data", "variant_data"]
