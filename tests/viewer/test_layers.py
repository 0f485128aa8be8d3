"""Layers that are off: not in the page's shaders until a slider switches them on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.viewer import page as page_file
from gonio.viewer import stage
from live_server import read, running, speak
from web_page import WIDE, Page

from varnished import Varnished


def bare(material: go.BSDF) -> stage.Stage:
    """One ball, with the material's own values."""
    row = stage.Row("one", "m0", (stage.Ball("ball"),))
    return stage.Stage("one ball", {"m0": stage.Material("varnished", material)}, (row,))


PAIR = ([0.6, 0.0, 0.8], [0.0, 0.28, 0.96])


def test_an_export_holds_the_short_shader_and_the_whole_one() -> None:
    short, whole = page_file.page_data(bare(Varnished()))["materials"][0]["variants"]
    assert (short["off"], whole["off"]) == (["varnish"], [])
    assert len(short["text"]) < len(whole["text"])
    only = page_file.page_data(bare(Varnished(varnish=0.2)))["materials"][0]["variants"]
    assert [variant["off"] for variant in only] == [[]]


def test_a_layer_that_one_ball_has_is_written() -> None:
    what = bare(Varnished())
    balls = (stage.Ball("bare"), stage.Ball("varnished", {"varnish": 0.5}))
    row = stage.Row("both", what.rows[0].material, balls)
    found = page_file.page_data(stage.Stage(what.title, what.materials, (row,)), socket="/ws")["materials"][0]
    assert [variant["off"] for variant in found["variants"]] == [[]]


@pytest.mark.slow
def test_a_slider_switches_a_layer_on(chrome: Any, tmp_path: Path) -> None:
    tab = chrome.new_page(viewport=WIDE)
    page = Page(tab, page_file.export(bare(Varnished()), tmp_path / "page.html"))

    def value() -> float:
        found = page.tab.evaluate("([wo, wi]) => gonio.evaluate(0, 0, wo, wi)", list(PAIR))["value"]
        return float(found[0] if isinstance(found, list) else found["0"])

    material = Varnished()
    assert page.control("varnish").count() == 1
    assert page.tab.evaluate("gonio.app.shaderOf(0).variant.off") == ["varnish"]
    assert value() == pytest.approx(float(np.ravel(material.eval(*map(np.array, PAIR)))[0]), rel=1e-5)
    page.set("s.slots[0].values.varnish = 0.5;")
    assert page.tab.evaluate("gonio.app.shaderOf(0).variant.off") == []
    right = stage.replaced(material, {"varnish": 0.5}).eval(*map(np.array, PAIR))
    assert value() == pytest.approx(float(np.ravel(right)[0]), rel=1e-5)
    page.set("s.slots[0].values.varnish = 0.0;")
    assert page.tab.evaluate("gonio.app.shaderOf(0).variant.off") == ["varnish"]
    assert page.problems == []
    tab.close()


@pytest.mark.slow
def test_a_server_writes_the_layers_that_are_on() -> None:
    wish = {"type": "choice", "material": "m0", "choices": {}}
    with running(stage.of_models([go.model("disney2015")()])) as one, speak(one) as client:
        for number, on in enumerate(([], ["sheen"])):
            client.send(json.dumps({**wish, "id": number, "on": on}))
            answer, _ = read(client.recv(30))
            assert answer["id"] == number
            assert ("sheen" in answer["variant"]["off"]) != ("sheen" in on)
            assert "clearcoat" in answer["variant"]["off"]
