"""`go.view(model)` gives a notebook the page."""

from __future__ import annotations

import time

import gonio as go
import nbformat
import pytest
from gonio.errors import InputError
from gonio.viewer import page
from nbclient import NotebookClient

import browser


@pytest.fixture
def small_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """The widget is tested without the page's script."""
    monkeypatch.setattr(page, "_script", lambda: "console.log(1)")
    monkeypatch.setattr(page, "_style", lambda: "body { margin: 0 }")


@pytest.mark.usefixtures("small_page")
def test_a_view_holds_the_page_of_its_models() -> None:
    widget = go.view(go.Conductor.preset("Au", alpha=0.3), "lambert", height=400)
    assert widget.height == 400
    assert '"mode":"export"' in widget.html and '"socket":null' in widget.html
    assert widget.html.count('"id":"m') == 2
    assert "sandbox" in widget._esm and "allow-same-origin" not in widget._esm


@pytest.mark.usefixtures("small_page")
def test_what_was_set_is_not_varied() -> None:
    assert go.view(go.Conductor(alpha=0.3)).html.count('"alpha":[') == 0
    assert go.view(go.Conductor()).html.count('"set":{"alpha":[') == 5


def test_wrong_arguments_are_clear_errors() -> None:
    with pytest.raises(InputError, match="a material expected"):
        go.view(3.0)  # type: ignore[arg-type]
    for height in (5, "400", 400.5, None, float("nan")):
        with pytest.raises(InputError, match=f"height {height!r}"):
            go.view("lambert", height=height)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="one by one"):
        go.view([go.Lambert(), "lambert"])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="unknown material"):
        go.view("lambart")


def test_the_widget_draws_in_a_frame_of_its_own() -> None:
    widget = go.view("lambert", height=420)
    begin = """async ([script, html]) => {
      const module = await import("data:text/javascript;base64," + btoa(script));
      const values = { html, height: 420 };
      const el = document.body.appendChild(document.createElement("div"));
      window.end = module.default.render({ model: { get: (name) => values[name], on() {}, off() {} }, el });
      return el.firstChild.getBoundingClientRect().height;
    }"""
    with browser.page() as opened:
        problems: list[str] = []
        opened.on("console", lambda m: problems.append(m.text) if m.type == "error" else None)
        opened.on("pageerror", lambda error: problems.append(str(error)))
        assert opened.evaluate(begin, [widget._esm, widget.html]) == 420
        (frame,) = opened.frames[1:]
        end = time.monotonic() + 60
        while not frame.evaluate("window.gonio?.frames > 0"):
            assert time.monotonic() < end, problems
            time.sleep(0.05)
        assert problems == []
        with pytest.raises(Exception, match=r"SecurityError|cross-origin"):  # the page cannot reach into the notebook
            frame.evaluate("parent.document.title")
        opened.evaluate("window.end()")
        assert opened.evaluate("document.querySelectorAll('iframe').length") == 0


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
