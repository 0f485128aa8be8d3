"""The law of limits: every model declares what its weights and thicknesses switch off, and keeps to it."""

from __future__ import annotations

import gonio as go
import pytest
from gonio.material import models
from gonio.verify import verify

from broken.limits import LayerOfNoWeightTints, LayerThatStartsWithAStep, RightUndeclared

# A parameter that switches no part off at the value at which a shader omits its code: two widths become one.
STRETCHES = {"anisotropic", "specular_roughness_anisotropy", "coat_roughness_anisotropy", "base_diffuse_roughness"}
COVERS = {"geometry_opacity"}  # 1 hides nothing
TEXTS = {
    "mix": "mix(a=phong,b=conductor(alpha=.3),weight=.3)",
    "opacity": "opacity(base=conductor(alpha=.3))",
    "coat": "coat(base=lambert(albedo=.3))",
    "normal-map": "normal-map(base=phong,lean_x=.3)",
    "bump": "bump(base=ward,lean_y=.3)",
}
LIMITED = [name for name, model in models().items() if model.limits and name not in ("openpbr", "disney2015")]


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", LIMITED)
def test_what_a_model_switches_off_changes_nothing(name: str) -> None:
    verdict = verify(go.material(TEXTS.get(name, name)), quick=True, law="limits")["limits"]
    assert verdict.status == "pass", verdict.why
    assert verdict.tolerance == 8 * 2.0**-52


@pytest.mark.slow
@pytest.mark.parametrize("name", ["openpbr", "disney2015"])
def test_what_a_layered_model_switches_off_changes_nothing(name: str) -> None:
    verdict = verify(go.material(name), quick=True, law="limits")["limits"]
    assert verdict.status == "breaks as declared", verdict.why  # of metal alone
    assert all(
        "results for number and array parameters differ" in note for note in verdict.notes if note.startswith("where")
    )


def test_every_weight_and_thickness_of_a_model_has_a_limit() -> None:
    for name, model in models().items():
        limited = {path for limit in model.limits for path in limit.values}
        for path, parameter in model.parameters().items():
            switch = parameter.off is not None or "thickness" in path or path.endswith("weight")
            if switch and path not in STRETCHES | COVERS | {"specular_weight"}:  # F0 never is exactly 0
                assert path in limited, f"{name}.{path} declares no limit"


def test_the_parameter_that_should_be_muted_is_named() -> None:
    verdict = verify(LayerOfNoWeightTints(), quick=True, law="limits")["limits"]
    assert "where coat_weight = 0, coat_color changes values by " in " ".join(verdict.why)
    assert verdict.bias is not None and verdict.bias.average > 0.001


def test_an_undeclared_weight_may_fade_out_but_not_jump() -> None:
    verdict = verify(RightUndeclared(), quick=True, law="limits")["limits"]
    assert verdict.status == "pass" and "declares no `limits`" in verdict.notes[0]
    why = verify(LayerThatStartsWithAStep(), quick=True, law="limits")["limits"].why
    assert "0.1; at most 0.001 is allowed" in why[0]


def test_a_film_on_a_colored_metal_has_limits_only_where_its_colors_are_exact() -> None:
    gold = {"eta": (0.18, 0.42, 1.37), "k": (3.4, 2.3, 1.8), "alpha": 0.2, "thickness": 400.0}
    exact = verify(go.FilmConductor(**gold), quick=True, law="limits")["limits"]
    assert exact.status == "pass" and "2 declared limits" in exact.notes[0]
    approximate = verify(go.FilmConductor(**gold, form="belcour-barla"), quick=True, law="limits")["limits"]
    assert approximate.status == "pass" and "declares no `limits`" in approximate.notes[0]
