"""`go.view(model)`: the page as a widget for JupyterLab, marimo and other applications that support anywidget."""

from __future__ import annotations

from collections.abc import Collection
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING

from ..catalog import notation
from ..catalog.material import MaterialLike, material
from ..errors import InputError, MachineError
from ..material import BSDF, tree
from ..owner import exclusive
from . import page, stage

if TYPE_CHECKING:
    from anywidget import AnyWidget

# The page is a separate document in a frame: it cannot affect the notebook's style or script.
_SCRIPT = """
function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.setAttribute("sandbox", "allow-scripts allow-downloads");
  frame.setAttribute("allow", "clipboard-write; fullscreen");
  frame.title = "Gonio";
  const show = () => {
    frame.style.cssText = `width: 100%; height: ${model.get("height")}px; border: 0; display: block;`;
    frame.srcdoc = model.get("html");
  };
  model.on("change:html", show);
  model.on("change:height", show);
  show();
  el.appendChild(frame);
  return () => {
    model.off("change:html", show);
    model.off("change:height", show);
    frame.remove();
  };
}
export default { render };
"""


@exclusive
def view(*models: MaterialLike, height: int = 640) -> AnyWidget:
    """Show the page of `gonio view` in a notebook cell, with balls, sliders and plots.

    models  anything that `go.material` accepts; by default, two rows of balls, with and without Kulla-Conty
    height  height of the cell, in CSS pixels
    Returns a widget, which the notebook displays. The page runs in the notebook's browser without a server, so there is
    no live reference. Raises InputError if a model cannot be shown, MachineError if anywidget is missing.

        go.view(go.Conductor.preset("Au"), "lambert")
    """
    try:
        import anywidget
        import traitlets
    except ImportError:
        raise MachineError("anywidget is not installed", "go.view", "pip install 'gonio[notebook]'") from None
    if not isinstance(height, Integral) or not 100 <= height <= 4000:
        raise InputError(f"height {height!r}", "go.view: height", "give a whole number of pixels, 100 to 4000")
    html = page.html(page.page_data(_stage(models)))
    members: dict[str, object] = {
        "_esm": _SCRIPT,
        "html": traitlets.Unicode(html).tag(sync=True),
        "height": traitlets.Int(int(height)).tag(sync=True),
    }
    return type("GonioView", (anywidget.AnyWidget,), members)()


def _stage(models: tuple[MaterialLike, ...]) -> stage.Stage:
    if not models:
        return stage.opening()
    bsdfs: list[BSDF] = []
    given: list[Collection[str]] = []
    for model in models:
        if isinstance(model, str | Path):
            (one,), _ = stage.shown([str(model)])
            bsdfs.append(one.bsdf)
            given.append(one.given)
        elif isinstance(model, list | tuple):
            raise InputError("a list given, a material expected", "go.view", "give them one by one: go.view(a, b)")
        else:
            bsdfs.append(material(model))
            given.append(_own(bsdfs[-1]))
    return stage.of_models(bsdfs, given)


def _own(model: BSDF) -> set[str]:
    """The parameters that differ from their defaults, and have therefore been set explicitly."""
    return {
        tree.join(path, name)
        for path, inner in tree.walk(model)
        for name in notation.settings(inner)
        if not inner.parameters()[name].inner
    }
