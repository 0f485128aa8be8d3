"""A user's file that is saved is shown anew; one that is broken is named on the page, over the last good picture."""

from __future__ import annotations

import gc
import json
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from gonio.viewer import page, server, stage
from gonio.viewer.stage import Stage
from gonio.viewer.watch import POLL_SECONDS, Watch
from live_server import next_frame, read, running, speak, wait_for

import browser

WARD = '''"""Ward's gloss."""
from gonio import ops
import gonio as go
from gonio.ops import inv_pi, safe_div, sqr, where
from gonio.optics.frame import half_vector


class Ward(go.BSDF):
    """Ward's isotropic gloss (Ward1992)."""

    kd: go.Colour = go.spectrum(0.3, "diffuse albedo", high=1.0)
    ks: go.Colour = go.spectrum(0.3, "specular albedo", high=1.0)
    slope: go.Number = go.number(0.3, "root mean square slope", low=0.01, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        h = half_vector(wo, wi)
        above = (wo.z > 0.0) & (wi.z > 0.0)
        tan2 = safe_div(1.0 - sqr(h.z), sqr(h.z))
        lobe = ops.exp(-tan2 / sqr(self.slope)) / (4.0 * sqr(self.slope))
        lobe = lobe * safe_div(inv_pi, ops.sqrt(ops.maximum(wo.z * wi.z, 0.0)))
        return where(above, (self.kd * inv_pi + self.ks * lobe) * wi.z, 0.0)
'''

BROKEN = {  # what is changed, and what the page says: where, what, remedy
    "no Python": ("(wi.z > 0.0)\n", "(wi.z > 0.0\n", "ward.py:17", "was never closed", "fix it"),
    "no such class": ("class Ward", "class Wart", "ward.py", "no class 'Ward'", "did you mean 'Wart'?"),
    "fails when it is run": ("class Ward", "sqr(beta)\nclass Ward", "ward.py:8", "name 'beta' is not defined", ""),
    "fails in eval": ("half_vector(wo, wi)", "half_vector(wo)", "ward.py:16", "TypeError: ", "correct the formula"),
    "if on a value": ("        tan2", "        if h.z > 0: pass\n        tan2", "ward.py:18", "Python `if`", "where("),
    "if on an array": (
        "        tan2", "        if __import__('numpy').ones(2) > 0: pass\n        tan2",
        "ward.py:18", "ambiguous", "where(",
    ),
    "wrong kind": ("return where(above, ", "return above\n        (above, ", "ward.py:15", "eval returned a bool", ""),
    "unknown parameter": ("self.kd", "self.kdd", "ward.py:21", "no attribute 'kdd'", "correct the formula"),
    "out of range": ("number(0.3", "number(3.0", "ward.py", "3 given", ""),
    "not there": ("from gonio import ops", "import beta", "ward.py:2", "No module named 'beta'", ""),
}  # fmt: skip


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "ward.py"
    path.write_text(WARD)
    return path


def shown(file: Path) -> Stage:
    return stage.of_targets([f"{file}:Ward"])


def slope(what: Stage) -> float:
    return what.materials["m0"].bsdf.slope


# --------------------------------------------------------------------------- the files


@pytest.mark.slow
def test_a_file_of_the_same_size_saved_at_once_is_loaded_anew(file: Path) -> None:
    code = shown(file).code
    for value in ("0.4", "0.5", "0.6"):
        file.write_text(WARD.replace("number(0.3", f"number({value}"))
        assert slope(code.run()) == float(value)
    assert not list(file.parent.glob("__pycache__"))


@pytest.mark.slow
def test_what_it_imports_from_its_folder_is_followed(file: Path) -> None:
    (file.parent / "lobes").mkdir()
    (file.parent / "lobes" / "__init__.py").write_text("from . import wide\n")
    wide = file.parent / "lobes" / "wide.py"
    wide.write_text("SLOPE = 0.5\n")
    text = WARD.replace("class Ward", "from lobes.wide import SLOPE\n\nclass Ward")
    file.write_text(text.replace('0.3, "root', 'SLOPE, "root'))
    what = shown(file)
    assert slope(what) == 0.5
    assert {path.name for path in what.code.files} == {"ward.py", "__init__.py", "wide.py"}
    wide.write_text("SLOPE = 0.6\n")
    assert slope(what.code.run()) == 0.6
    wide.write_text("SLOPE = 0.7 +\n")
    with pytest.raises(Exception) as caught:
        what.code.run()
    assert what.code.located(caught.value).where == "wide.py:1"
    wide.write_text("SLOPE = 0.7\n")
    assert slope(what.code.run()) == 0.7


@pytest.mark.slow
def test_old_classes_go(file: Path) -> None:
    code = shown(file).code
    made = []
    for _ in range(4):
        what = code.run()
        page.page_data(what)
        made.append(weakref.ref(type(what.materials["m0"].bsdf)))
    del what
    gc.collect()
    assert sum(cls() is not None for cls in made) <= 1


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", list(BROKEN))
def test_an_error_names_file_line_and_remedy(file: Path, name: str) -> None:
    before, after, where, what, hint = BROKEN[name]
    assert before in WARD
    code = shown(file).code
    file.write_text(WARD.replace(before, after, 1))
    with pytest.raises(Exception) as caught:
        page.page_data(code.run())
    fault = code.located(caught.value)
    assert fault.where.startswith(where) and what in fault.what and hint in fault.hint


def test_a_file_that_is_being_written_is_waited_for(file: Path) -> None:
    code, made, faults = shown(file).code, [], []
    watch: Watch[Stage] = Watch(code, made.append, faults.append)
    watch.start()
    try:
        end, last, pause = time.monotonic() + 0.5, time.monotonic(), 0.0
        while last < end:
            file.write_text(WARD[: len(WARD) // 2])
            file.write_text(WARD.replace("number(0.3", "number(0.8"))
            pause, last = max(pause, time.monotonic() - last), time.monotonic()
        wait_for(lambda: made)
        file.unlink()
        time.sleep(0.05)
        file.write_text(WARD)
        wait_for(lambda: slope(made[-1]) == 0.3)
    finally:
        watch.stop()
    # a machine that let the writer wait for as long as the watcher does has shown it half a file at rest
    assert faults == [] or pause > POLL_SECONDS


# --------------------------------------------------------------------------- the server


def request(number: int, revision: int) -> str:
    lights = [{"type": "directional", "direction": [0, 0, 1], "irradiance": [1, 1, 1]}]
    camera = {"target": [0, 0, 0], "distance": 6, "azimuth": 0, "elevation": 0, "fov": 30}
    state = {"rows": [{"material": "m0", "balls": [{}]}], "lights": lights, "camera": camera}
    about = {"type": "scene", "id": number, "revision": revision, "width": 32, "height": 18, "spp": 4}
    return json.dumps({**about, "state": state})


def until(client: Any, kind: str) -> dict[str, Any]:
    while True:
        header, pixels = read(client.recv(20))
        if pixels is None and header["type"] == kind:
            return header
        if pixels is not None:
            client.send(json.dumps({"type": "ack", "frame": header["frame"]}))


@pytest.mark.slow
def test_the_reference_is_of_the_file_that_was_saved_last(file: Path) -> None:
    with running(shown(file)) as one, speak(one) as client:
        client.send(request(1, 0))
        header, before = next_frame(client)
        client.send(json.dumps({"type": "ack", "frame": header["frame"]}))
        file.write_text(WARD.replace('spectrum(0.3, "diffuse', 'spectrum(0.9, "diffuse'))
        assert until(client, "stage")["revision"] == 1
        client.send(request(2, 0))  # on its way when the new stage came
        client.send(request(3, 1))
        while True:
            header, after = next_frame(client)
            client.send(json.dumps({"type": "ack", "frame": header["frame"]}))
            assert header["id"] != 2
            if header["id"] == 3:
                break
        assert after[9, 16, 0] - before[9, 16, 0] == pytest.approx(0.6 / 3.14159, rel=0.05)


def test_a_page_that_comes_later_learns_what_is_wrong(file: Path) -> None:
    with running(shown(file)) as one:
        file.write_text(WARD.replace("(wi.z > 0.0)\n", "(wi.z > 0.0\n"))
        wait_for(lambda: one.application.fault)
        with speak(one) as client:
            assert read(client.recv(20))[0]["where"] == "ward.py:17"
        file.write_text(WARD)
        wait_for(lambda: one.application.renderer.revision == 1)
        with speak(one) as client:  # it came with the first stage, and is told of the newer one
            assert read(client.recv(20))[0]["revision"] == 1


# --------------------------------------------------------------------------- the page


@contextmanager
def live(what: Stage) -> Iterator[tuple[server.Server, Any]]:
    one = server.Server(server.Application(what, server.AccessControl("127.0.0.1")), "127.0.0.1", 0, quiet=True)
    thread = threading.Thread(target=one.serve_until_interrupted, daemon=True)
    thread.start()
    wait_for(lambda: one.started)
    try:
        with browser.chromium() as chromium:
            tab = chromium.new_page(viewport={"width": 800, "height": 420})
            tab.goto(one.url)
            yield one, tab
    finally:
        one.should_exit = True
        thread.join(20)


@pytest.mark.slow
def test_saving_redraws_and_an_error_stands_over_the_last_good_picture(file: Path) -> None:
    problems: list[str] = []

    def wait(tab: Any) -> Callable[[str], None]:
        return lambda condition: wait_for(lambda: tab.evaluate(condition), 60)

    with live(shown(file)) as (_, tab):
        tab.on("console", lambda m: problems.append(m.text) if m.type in ("error", "warning") else None)
        tab.on("pageerror", lambda error: problems.append(str(error)))
        tab.set_viewport_size({"width": 800, "height": 420})  # its picture is awaited three times
        until = wait(tab)
        until("window.gonio?.frames > 0")
        brightness = """gonio.converge(16).then((p) => {
          let sum = 0;
          for (let i = 0; i < p.data.length; i += 4) sum += p.data[i];
          return sum;
        })"""
        tab.evaluate(
            "gonio.setState((s) => { s.slots[0].values.ks = [0.5, 0.5, 0.5]; s.slots[0].values.kd = [0, 0, 0]; })"
        )
        tab.evaluate("gonio.setState((s) => { s.dock.open = 'lobe'; s.camera.azimuth = 0.3; })")
        before = tab.evaluate(brightness)

        # half the lobe, and the parameter kd renamed
        changed = WARD.replace("4.0 * sqr", "8.0 * sqr").replace("kd", "diffuse")
        file.write_text(changed)
        until("gonio.data.revision === 1")
        state = tab.evaluate("gonio.state")
        assert state["slots"][0]["values"] == {"ks": [0.5, 0.5, 0.5]}  # kd is gone, and with it its value
        assert state["camera"]["azimuth"] == 0.3
        names = tab.locator(".lil-name").all_inner_texts()
        assert any("diffuse" in name for name in names) and not any(name.startswith("kd") for name in names)
        tab.evaluate("gonio.setState((s) => { s.slots[0].values.diffuse = [0, 0, 0]; })")
        assert tab.evaluate(brightness) == pytest.approx(before / 2, rel=1e-3)
        assert tab.locator(".fault").is_hidden()

        file.write_text(changed.replace("        tan2", "        if h.z > 0.5: pass\n        tan2"))
        # the file may be read between its emptying and its writing, which is said until it is whole
        until("document.querySelector('.fault').innerText.includes('ward.py:18')")
        told = tab.locator(".fault").inner_text()
        assert "Python `if`" in told and "where(mask, a, b)" in told
        assert tab.evaluate(brightness) == pytest.approx(before / 2, rel=1e-3)
        assert tab.evaluate("gonio.data.revision") == 1

        file.write_text(WARD)
        until("gonio.data.revision === 2")
        assert tab.locator(".fault").is_hidden()
        tab.evaluate("gonio.setState((s) => { s.slots[0].values.kd = [0, 0, 0]; })")
        assert tab.evaluate(brightness) == pytest.approx(before, rel=1e-3)
        until("gonio.live.status.samples > 0 && !gonio.app.reference.stale")
    assert problems == []
