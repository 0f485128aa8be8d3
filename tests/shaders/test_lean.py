"""Lean shaders: without what a material's own values switch off."""

from __future__ import annotations

import functools

import gonio as go
import numpy as np
import pytest
from gonio.material.recording import record, switched_off
from gonio.shaders import bundle
from gonio.shaders.manifest import numbers_of

from varnished import Varnished


def fields(made: object) -> list[str]:
    return [field["path"] for field in made.manifest["fields"]]  # type: ignore[attr-defined]


def test_what_is_off_is_not_written() -> None:
    whole, lean = bundle(Varnished(), functions=["eval"]), bundle(Varnished(), functions=["eval"], lean=True)
    assert fields(whole) == ["albedo", "varnish", "power"] and fields(lean) == ["albedo", "power"]
    assert "Written without parts that are off: varnish = 0." in lean.text
    assert "power" in whole.text and "self.power" not in lean.text
    declared = {p["path"]: (p["field"], p["off"]) for p in lean.manifest["parameters"]}
    assert declared == {"albedo": ("albedo", None), "varnish": (None, 0.0), "power": ("power", None)}


def test_what_is_on_or_asked_for_is_written() -> None:
    for made in (
        bundle(Varnished(varnish=0.2), functions=["eval"], lean=True),
        bundle(Varnished(), functions=["eval"], lean=True, on=["varnish"]),
    ):
        assert fields(made) == ["albedo", "varnish", "power"] and "self.power" in made.text


def test_inner_materials_have_switches_too() -> None:
    mixed = go.mix(Varnished(), Varnished(varnish=0.3), 0.4)
    assert switched_off(mixed) == ["a.varnish"]
    assert "b_varnish" in go.emit(mixed, functions=["eval"], lean=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("material", "share"),
    [
        (go.OpenPBR(), 0.15),
        (go.OpenPBR(base_metalness=1.0), 0.2),
        (go.OpenPBR(transmission_weight=1.0), 0.3),
        (go.model("disney2015")(), 0.3),
    ],
)
def test_of_many_layers_few_lines_are_left(material: go.BSDF, share: float) -> None:
    whole, lean = _whole(type(material)), go.emit(material, lean=True)
    assert len(lean) < share * len(whole)


@functools.cache
def _whole(cls: type[go.BSDF]) -> str:
    """The shader with all layers, which no value shapes."""
    return go.emit(cls())


@pytest.mark.slow
def test_a_lean_mirrorless_surface_is_isotropic_and_opaque() -> None:
    manifest = bundle(go.OpenPBR(), lean=True).manifest
    assert manifest["isotropic"] and not manifest["transmits"]
    whole = bundle(go.OpenPBR()).manifest
    assert not whole["isotropic"] and whole["transmits"]


@pytest.mark.slow
def test_a_weight_of_zero_leaves_no_samples_to_its_lobe() -> None:
    """The whole OpenPBR without transmission sampled the lower side: its pdf differed from Python's for all pairs."""
    go.set_precision("float64")  # until the end of the test
    material = go.OpenPBR(specular_roughness=0.3, base_metalness=0.2)
    directions = np.abs(np.random.default_rng(1).normal(size=(2, 1000, 3)))
    wo, wi = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    values = {f"self_{path}": np.asarray(v)[:, None] if np.ndim(v) else v for path, v in numbers_of(material)}
    recorded = record(material, "pdf").evaluate(wo=wo.T, wi=wi.T, **values)
    assert np.allclose(recorded, material.pdf(wo, wi), rtol=1e-12, atol=1e-12)
