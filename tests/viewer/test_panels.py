"""A panel that somebody else wrote: two files, a Python class and its JavaScript, in a package outside of Gonio."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import pytest
from gonio.errors import InputError
from gonio.viewer import page, server, stage
from live_server import get, wait_for

import browser

PYTHON = '''"""A panel that shows one number: the albedo seen from the middle of the picked ball."""
import gonio as go


class Straight(go.Panel):
    name = "straight"
'''

SCRIPT = """
const output = document.createElement("output"); // a name of its own module's: "</script>" ends nothing
let app;

async function show() {
  const { slot, ball } = app.picked;
  const [shader, values] = [app.shaderOf(slot), app.valuesOf(slot, ball)];
  const { value } = await app.evaluator.albedo(shader, values, [0, 0, 1], { error: 1e-3 });
  output.value = value[0].toFixed(3);
}

gonio.addPanel({
  id: "straight",
  title: "Straight",
  order: 1.5,
  mount(host, given) {
    app = given;
    host.append(output);
  },
  update(change) {
    if (change.touches("slots", "selection")) show();
  },
});
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A folder that holds an installed package, as pip would have laid it down."""
    folder = tmp_path / "installed"
    about = folder / "straight_panel-1.0.dist-info"
    about.mkdir(parents=True)
    (folder / "straight_panel.py").write_text(PYTHON)
    (folder / "straight.js").write_text(SCRIPT)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: straight-panel\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[gonio.panels]\nstraight = straight_panel:Straight\n")
    return folder


@pytest.fixture
def registered(package: Path) -> Iterator[type[go.Panel]]:
    """The class of the same file, registered by a program."""
    spec = importlib.util.spec_from_file_location("straight_panel", package / "straight_panel.py")
    assert spec and spec.loader
    module = sys.modules["straight_panel"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield go.register(module.Straight)
    go.Panel.family.remove("straight")
    del sys.modules["straight_panel"]


def opened(tab: Any, messages: list[str]) -> Any:
    """The panel's output, once it has a value."""
    tab.on("console", lambda m: messages.append(m.text) if m.type in ("error", "warning") else None)
    tab.on("pageerror", lambda error: messages.append(str(error)))
    output = tab.locator(".panel-body[data-panel=straight] output")
    wait_for(lambda: output.count() and output.inner_text())
    return output


@pytest.mark.slow
def test_an_installed_package_brings_a_panel_into_an_exported_page(package: Path, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    path = os.pathsep.join([str(package), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "gonio.cli", "view", "lambert(albedo=.25)", "--export", str(file)]
    subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, check=True, capture_output=True)
    messages: list[str] = []
    with browser.chromium() as chromium:
        tab = chromium.new_page(viewport={"width": 1000, "height": 700})
        tab.goto(file.as_uri())
        tab.evaluate("() => gonio.ready")
        titles = tab.locator(".tabs button").all_inner_texts()
        assert titles[:3] == ["Lobe", "Straight", "Slices"]  # in the order that it asks for
        tab.get_by_role("tab", name="Straight").click()
        assert opened(tab, messages).inner_text() == "0.250"
        tab.goto("about:blank")  # and from a link, which is read before the panel is there
        tab.goto(f"{file.as_uri()}#s=eyJkb2NrIjp7Im9wZW4iOiJzdHJhaWdodCJ9fQ")
        assert opened(tab, messages).inner_text() == "0.250"
    assert messages == []


@pytest.mark.slow
def test_a_registered_panel_works_on_the_live_page_under_its_policy(registered: type[go.Panel]) -> None:
    what = stage.of_models([go.Lambert(albedo=0.25)], [{"albedo"}])
    one = server.Server(server.Application(what, server.AccessControl("127.0.0.1")), "127.0.0.1", 0, quiet=True)
    thread = threading.Thread(target=one.serve_until_interrupted, daemon=True)
    thread.start()
    wait_for(lambda: one.started)
    messages: list[str] = []
    try:
        policy = get(one)[1]["content-security-policy"]
        assert "unsafe" not in policy and policy.partition("script-src ")[2].partition(";")[0].count("'sha256-") == 2
        with browser.chromium() as chromium:
            tab = chromium.new_page(viewport={"width": 1000, "height": 700})
            tab.goto(one.url)
            tab.get_by_role("tab", name="Straight").click()
            output = opened(tab, messages)
            assert output.inner_text() == "0.250"
            tab.evaluate("gonio.setState((s) => { s.slots[0].values.albedo = [0.75, 0.75, 0.75]; })")
            wait_for(lambda: output.inner_text() == "0.750")
    finally:
        one.should_exit = True
        thread.join(20)
    assert messages == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("gonio.addPanel({ id: 'lobe', title: 'Another', mount() {} })", "A panel 'lobe' already exists."),
        ("gonio.addPanel({ id: 'empty', title: 'Empty' })", "A panel needs an id, a title and mount(host, app)."),
        ("gonio.addPanel({ id: }", "Unexpected token"),
    ],
)
def test_a_panel_that_fails_is_told_and_the_page_lives(
    registered: type[go.Panel], package: Path, tmp_path: Path, script: str, said: str
) -> None:
    (package / "straight.js").write_text(script)
    file = page.export(stage.of_models([go.Lambert()]), tmp_path / "page.html")
    with browser.chromium() as chromium:
        tab = chromium.new_page(viewport={"width": 800, "height": 420})
        tab.goto(file.as_uri())
        tab.evaluate("() => gonio.ready")
        wait_for(lambda: said in " ".join(tab.locator(".toast.error").all_inner_texts()))
        assert tab.evaluate("gonio.frames") > 0


def test_a_panel_without_its_script_is_a_clear_error(registered: type[go.Panel], package: Path) -> None:
    (package / "straight.js").unlink()
    with pytest.raises(InputError, match=r"straight\.js.*cannot be read: No such file"):
        page.html(page.page_data(stage.of_models([go.Lambert()])))
