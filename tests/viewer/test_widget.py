"""`go.view(model)` gives a notebook the page."""

from __future__ import annotations

import gonio as go
import nbformat
import pytest
from gonio.errors import InputError
from gonio.viewer import page
from nbclient import NotebookClient


@pytest.fixture(autouse=True)
def small_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """The widget is tested without the page's script."""
    monkeypatch.setattr(page, "_script", lambda: "console.log(1)")
    monkeypatch.setattr(page, "_style", lambda: "body { margin: 0 }")


def test_a_view_holds_the_page_of_its_models() -> None:
    widget = go.view(go.Conductor.preset("Au", alpha=0.3), "lambert", height=400)
    assert widget.height == 400
    assert '"mode":"export"' in widget.html and '"socket":null' in widget.html
    assert widget.html.count('"id":"m') == 2
    assert "sandbox" in widget._esm and "allow-same-origin" not in widget._esm


def test_what_was_set_is_not_varied() -> None:
    assert go.view(go.Conductor(alpha=0.3)).html.count('"alpha":[') == 0
    assert go.view(go.Conductor()).html.count('"set":{"alpha":[') == 5


def test_wrong_arguments_are_clear_errors() -> None:
    with pytest.raises(InputError, match="a material or its name expected"):
        go.view(3.0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="height 5"):
        go.view("lambert", height=5)
    with pytest.raises(InputError, match="unknown material"):
        go.view("lambart")


def test_a_notebook_shows_the_widget() -> None:
    lines = [
        "import gonio as go",
        "from gonio.viewer import page",
        "page._script = page._style = lambda: ''",
        "go.view('lambert')",
    ]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("\n".join(lines))])
    NotebookClient(notebook, timeout=120, kernel_name="python3", store_widget_state=True).execute()
    (output,) = [o for o in notebook.cells[0].outputs if o.output_type in ("execute_result", "display_data")]
    assert "application/vnd.jupyter.widget-view+json" in output.data
    states = notebook.metadata.widgets["application/vnd.jupyter.widget-state+json"]["state"].values()
    (state,) = [s["state"] for s in states if "html" in s["state"]]
    assert "gonio-data" in state["html"]
