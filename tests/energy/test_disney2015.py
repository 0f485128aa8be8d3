"""Disney's BSDF of 2015: its dials against the lobes of the paper, its furnaces, and what differs on purpose."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.verify import verify

from sphere import random_directions

Disney2015 = go.model("disney2015")
WO, WI = random_directions(400, 311, upper=True), random_directions(400, 312, upper=True)
COLOUR = (0.8, 0.5, 0.2)


@pytest.mark.long
def test_metal_is_ggx_with_schlicks_curve_of_the_base_colour() -> None:
    model = Disney2015(COLOUR, metallic=1.0, roughness=0.6, anisotropic=0.7, rotation=0.4)
    aspect = np.sqrt(1.0 - 0.9 * 0.7)  # Burley2012, and as it is in 2015
    metal = go.Metal(COLOUR, 1.0, alpha=(0.36 / aspect, 0.36 * aspect), rotation=0.4)
    expected = go.KullaConty(metal)
    got = model.eval(WO, WI, precision="float64")
    np.testing.assert_allclose(got, expected.eval(WO, WI, precision="float64"), rtol=1e-3)


@pytest.mark.slow
def test_glass_takes_the_root_of_the_base_colour_at_each_crossing() -> None:
    model = Disney2015(COLOUR, spec_trans=1.0, roughness=0.5, eta=1.4)
    glass = go.KullaConty(go.Dielectric(1.4, alpha=0.25))
    below = WI * [1.0, 1.0, -1.0]
    for wo, wi in ((WO, below), (below, WO)):
        got, clear = model.eval(wo, wi, precision="float64"), glass.eval(wo, wi, precision="float64")
        np.testing.assert_allclose(got, clear * np.sqrt(COLOUR), rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(
        model.eval(WO, WI, precision="float64"), glass.eval(WO, WI, precision="float64"), rtol=1e-4, atol=1e-9
    )


def test_a_thin_sheet_of_even_diffuse_transmission_looks_alike_on_both_sides() -> None:
    model = Disney2015(COLOUR, roughness=0.5, thin=True, diff_trans=1.0, eta=1.0)
    steep = np.minimum(WO[:, 2], WI[:, 2]) > 0.2  # an index of 1 is one of 1.001, which reflects where light grazes
    near, far = model.f(WO, WI)[steep], model.f(WO, WI * [1.0, 1.0, -1.0])[steep]
    np.testing.assert_allclose(near, far, rtol=1e-2)


def test_the_coat_leaves_the_base_as_it_is() -> None:
    """A quarter of Fresnel's lobe on top, and what it lets through below: at the normal 1 %."""
    bare, coated = Disney2015(0.5, roughness=0.9), Disney2015(0.5, roughness=0.9, clearcoat=1.0)
    wo, wi = np.array([[0.0, 0.0, 1.0]]), np.array([[0.8, 0.0, 0.6]])
    ratio = coated.eval(wo, wi)[0, 0] / bare.eval(wo, wi)[0, 0]
    assert 0.96 < ratio < 1.0


@pytest.mark.parametrize(
    "dials",
    [
        {"sheen": 1.0, "clearcoat": 1.0},
        pytest.param({"metallic": 0.5, "spec_trans": 0.5}, marks=pytest.mark.slow),
        pytest.param({"thin": True, "diff_trans": 0.7, "spec_trans": 0.3}, marks=pytest.mark.slow),
    ],
)
def test_a_white_material_keeps_all_light(dials: dict[str, float]) -> None:
    found = go.albedo(Disney2015(1.0, roughness=0.6, **dials), mu=[0.15, 0.5, 1.0], method="sampling", samples=1 << 15)
    assert np.all((found.value > 0.99) & (found.value < 1.005)), found.value


@pytest.mark.slow
def test_it_keeps_its_laws() -> None:
    model = Disney2015(COLOUR, 0.2, 0.4, 0.3, spec_trans=0.3, sheen=0.4, clearcoat=0.5)
    report = verify(model, quick=True, law=["pdf", "weight", "energy", "isotropy"], seed=3)
    assert report.passed, str(report)
