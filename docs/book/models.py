"""A page for each model, generated from the code: formula, live page, parameters, use, laws, shader and sources."""

from __future__ import annotations

import dataclasses
import json
import re
import tempfile
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
from gonio.measure.formats.own import Own
from gonio.measure.tables import angles
from gonio.viewer import manual, page, stage

from . import formulas, strips
from .bibliography import KEY, citation, known
from .text import cell, escaped, fenced, markdown, table

ROOT = Path(__file__).parents[2]
GROUPS = {
    "diffuse": "Diffuse",
    "empirical": "Empirical",
    "microfacet": "Microfacet models",
    "compensated": "With multiple scattering",
    "layered": "Layered",
    "sheen": "Cloth",
    "historic": "Models of published fits",
    "combined": "Composed of other materials",
    "measured": "Measured",
}
# Layers of weight 0 are omitted from the first shader, so that the figure appears within a second in software WebGL.
OPENINGS = {
    "disney2015": "disney2015(base_color=0.1,0.35,0.6,roughness=0.35)",
    "openpbr": "openpbr(base_color=0.02,0.1,0.35,specular_roughness=0.3)",
}
BELOW = "Your browser runs the shader code that is printed below."
WALKS = 256  # random estimates per cell of the table of a stochastic model
SYMBOLS = (
    "$n$ is the normal, $o$ the direction to the viewer (`wo`), $i$ the direction to the light (`wi`), $h$ the half "
    "vector, $r$ the direction $i$ reflected about $n$, and $v = o$. $f$ is in 1/sr and, unlike `eval`, does not "
    "include the cosine."
)


def pages() -> dict[str, str | bytes]:
    """All pages of models and their index."""
    return {f"reference/models/{name}.md": _page(model) for name, model in go.models().items()} | {
        "reference/models/index.md": _index()
    }


def live() -> dict[str, str | bytes]:
    """The page of `gonio view` for each model, in the studio, as a self-contained file."""
    made: dict[str, str | bytes] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in go.models():
            path = page.export(opening(name, Path(folder)), Path(folder) / f"{name}.html")
            made[f"reference/live/live/{name}.html"] = path.read_bytes()
    return made


def opening(name: str, folder: Path) -> stage.Stage:
    """The initial state of a model's live page: the material of the sheet of all models, in the studio.

    A stochastic model has no shader code; the page shows its mean in the upper row and Kulla-Conty in the lower row.
    """
    shown = go.material(OPENINGS[name]) if name in OPENINGS else strips.all_models.material(name)
    rows = [shown]
    if shown.stochastic:
        rows = [averaged(shown, folder), go.KullaConty(base=shown.base)]
    return dataclasses.replace(stage.of_models(rows), lights=(stage.STUDIO,))


def averaged(model: go.BSDF, folder: Path, estimates: int = WALKS) -> go.Measured:
    """A table of the mean of many estimates of a stochastic model; writes the table's file to the folder."""

    def mean(wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
        many = dataclasses.replace(model, seed=np.repeat(np.arange(float(estimates)), len(wo)))
        values = many.eval(np.tile(wo, (estimates, 1)), np.tile(wi, (estimates, 1)))
        return np.asarray(values).reshape(estimates, len(wo), 3).mean(0)

    table = angles.sampled(mean, 24, 37)
    both = 0.5 * (table.values + table.values.swapaxes(0, 1))  # the model is reciprocal: half the variance
    file = folder / f"{model.name}.gonio"
    file.write_bytes(Own().write(angles.Angles((table.theta_i, table.theta_r, table.phi), both, title=model.name)))
    return go.Measured(str(file))


def operand(name: str) -> str:
    """A model in the notation of the command line, with required inner materials: "mix(a=lambert,b=conductor)"."""
    required = [key for key, parameter in go.models()[name].parameters().items() if parameter.required]
    inner = ["conductor"] if len(required) == 1 else ["lambert", "conductor"]
    given = ",".join(f"{key}={one}" for key, one in zip(required, inner, strict=False))
    return f"{name}({given})" if required else name


def first_line(model: type[go.BSDF]) -> str:
    """The first sentence of a model's docstring, on one line."""
    return re.split(r"\. |\.$|:", " ".join(manual.page(model).doc.split("\n\n")[0].split()))[0]


def group(model: type[go.BSDF]) -> str:
    return model.__module__.split(".")[2]


def _index() -> str:
    lines = ["# Models", "", f"Gonio has {len(go.models())} models. In the formulas, {SYMBOLS}", ""]
    for key, title in GROUPS.items():
        members = {name: model for name, model in go.models().items() if group(model) == key}
        rows = [(f"[{name}]({name}.md)", escaped(first_line(model))) for name, model in members.items()]
        lines += [f"## {title}", "", table(("model", "description"), rows), ""]
        lines += [":::{toctree}", ":hidden:", "", *members, ":::", ""]
    return "\n".join(lines)


def _page(model: type[go.BSDF]) -> str:
    name = model.name
    found = manual.page(model)
    parts = [f"# {name}", markdown(found.doc), _strip(name), "## Formula"]
    parts += [f"$$\n{line}\n$$" for line in formulas.of_model(name)] + [SYMBOLS]
    if name in formulas.RUN:
        parts.append("The formula is typeset from an expression that a test compares with the code of the model.")
    parts += ["## Parameters", _parameters(found)]
    shader = _shader(name)
    frame = f'<iframe class="live" src="../../live/{name}.html" loading="lazy" title="{name}, live"></iframe>'
    table_shown = f"In the upper row, the shader reads a table of the mean of {WALKS} random estimates per cell"
    parts += [
        "## Live",
        "You can rotate the balls, open the plot of the lobe, and move the sliders. "
        + (f"{table_shown}; the lower row shows Kulla-Conty." if model.stochastic else BELOW),
        f":::{{dropdown}} Live page of {name}\n```{{raw}} html\n{frame}\n```\n:::",
    ]
    parts += ["## Use", _use(found), "## Laws", _laws(found)]
    if shader is not None:
        title = f'GLSL, `gonio emit "{operand(name)}" --lean`'
        parts += ["## Shader code", f":::{{dropdown}} {title}\n{fenced(shader, 'glsl')}\n:::"]
    if sources := _sources(found):
        parts += ["## Sources", sources]
    return "\n\n".join(part for part in parts if part) + "\n"


def _strip(name: str) -> str:
    """The strip of balls for the main parameter, rendered by the part `reference/strips`; none in the quick book."""
    labels = strips.labels(name)
    if len(labels) < 2:
        return ""
    words = f"{labels[0].rpartition(' ')[0]} " + ", ".join(label.rpartition(" ")[2] for label in labels)
    picture = f'<img src="../../strips/{name}.jpg" loading="lazy" alt="Five balls of {name}: {words}">'
    return f"```{{raw}} html\n{picture}\n```\n\nFrom left to right: {words}."


def _parameters(found: manual.Page) -> str:
    rows = []
    for row in found.parameters:
        allowed = "<br>".join(f"`{key}`: {escaped(text)}" for key, text in row.choices.items()) or escaped(row.range)
        default = row.default if row.default == "required" else f"`{row.default}`"
        rows.append([f"`{row.name}`", row.kind, allowed, row.unit or "-", default, escaped(row.doc)])
    head = ("parameter", "kind", "range", "unit", "default", "meaning")
    return table(head, [[cell(text) for text in row] for row in rows]) if rows else "None."


def _use(found: manual.Page) -> str:
    name = found.name
    required = [row for row in found.parameters if row.default == "required"]
    if required:  # another material or a file is required
        return f"Python: `go.{found.title}`. Scenes: the type `gonio-{name}`. Mitsuba: the plugin `{found.plugin}`."
    verbs = ("view {}", "plot {} -o plot.png", "verify {}", "render {} -o ball.png")
    commands = "\n".join(f"gonio {verb.format(name)}" for verb in verbs)
    python = f"import gonio as go\n\nmaterial = go.{found.title}()\nvalue = material.eval(wo, wi)  # f cos, (N, 3)"
    xml = f'<bsdf type="{found.plugin}"/>'
    scene = json.dumps({"type": f"gonio-{name}"})
    return "\n\n".join(
        (
            fenced(commands, "bash"),
            fenced(python, "python"),
            "In a scene, and in Mitsuba after `import gonio.mitsuba`, write:",
            fenced(scene, "json"),
            fenced(xml, "xml"),
        )
    )


def _laws(found: manual.Page) -> str:
    lines = [
        f"By design, this model violates the **{law}** law: {escaped(reason)}." for law, reason in found.breaks.items()
    ]
    card = ROOT / f"docs/report-cards/{found.name}.md"
    if card.exists():
        lines.append(f"For all test results, see its [report card](../../report-cards/{found.name}.md).")
    else:
        lines.append(f"`gonio verify {found.name} -o card` tests the model and writes its report card.")
    return "\n\n".join(lines)


def _shader(name: str) -> str | None:
    try:
        return go.emit(operand(name), lean=True)
    except go.InputError:  # the model needs a file, or is stochastic
        return None


def _sources(found: manual.Page) -> str:
    source: Any = ROOT / found.source
    keys = KEY.findall(found.doc) + KEY.findall(source.read_text(encoding="utf-8"))
    cited = [key for key in dict.fromkeys(keys) if key in known()]
    return "\n".join([*(f"- {citation(key)}" for key in cited), f"- Source: `{found.source}`"])
