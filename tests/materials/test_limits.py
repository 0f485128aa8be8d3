"""What is switched off changes nothing: a weight of 0 hides its layer, a film of no thickness or contrast is none."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.material.binding import bind
from gonio.ops import backend

ROUNDINGS = 8 * np.finfo(np.float64).eps
BASE = {"base_color": (0.9, 0.6, 0.3), "specular_roughness": 0.3}
BASES: dict[str, dict[str, Any]] = {
    "gray metal": {**BASE, "base_metalness": 1.0, "base_weight": 0.6, "specular_color": (0.9, 0.8, 1.0)},
    "dielectric": BASE,
    "coated": {**BASE, "base_metalness": 0.5, "coat_weight": 1.0, "coat_roughness": 0.1},
    "glass": {**BASE, "transmission_weight": 1.0},
}


def values(material: go.BSDF) -> np.ndarray:
    w = np.random.default_rng(11).normal(size=(2, 200, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.02
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    return material.eval(w[0], w[1], precision="float64")


@pytest.mark.parametrize("limit", [{"thin_film_thickness": 0.0}, {"thin_film_ior": 1.0}])
def test_a_film_that_is_not_there_adds_no_reflectance(limit: dict[str, float]) -> None:
    types = backend.types("float64")
    filmed = go.OpenPBR(**BASES["gray metal"], thin_film_weight=1.0, **limit)
    model = bind(filmed, lambda parameter, value: parameter.bind(value, types))
    cos, one = (backend.float_of(x, types) for x in (np.linspace(0.01, 1.0, 50), 1.0))
    eta, k = types.vec3(0.2, 0.9, 2.0), types.vec3(3.0, 2.0, 1.0)
    added = backend.to_numpy(model.film_change(cos, eta, k, one), 50)
    assert np.abs(added).max() <= ROUNDINGS
    assert np.abs(backend.to_numpy(model.metal(cos, one, one) - model.bare_metal(cos), 50)).max() <= ROUNDINGS


@pytest.mark.slow
@pytest.mark.parametrize("base", BASES)
def test_a_film_that_is_not_there_changes_nothing(base: str) -> None:
    bare = values(go.OpenPBR(**BASES[base]))
    outside = 1.6 if base == "coated" else 1.0  # the coat's own index lies over the film
    for limit in ({"thin_film_thickness": 0.0}, {"thin_film_ior": outside}):
        filmed = values(go.OpenPBR(**BASES[base], thin_film_weight=1.0, **limit))
        np.testing.assert_allclose(filmed, bare, rtol=ROUNDINGS, atol=ROUNDINGS * float(bare.max()))


def layers() -> list[tuple[str, str, str]]:
    """(model, weight that may be off, parameter of its layer) by their names: coat_weight and coat_roughness."""
    found = []
    for name in ("openpbr", "disney2015"):
        parameters = go.model(name).parameters()
        for weight, parameter in parameters.items():
            prefix = weight.removesuffix("_weight")
            if parameter.off is not None:
                found += [
                    (name, weight, other)
                    for other in parameters
                    if other.startswith(prefix)
                    and other != weight
                    and (prefix != weight or prefix in ("sheen", "clearcoat"))
                ]
    return found


@pytest.mark.sample(6)
@pytest.mark.parametrize(("model", "weight", "parameter"), layers())
def test_a_layer_of_weight_0_changes_nothing(model: str, weight: str, parameter: str) -> None:
    made = go.model(model)
    one = made.parameters()[parameter]
    off = made.parameters()[weight].off
    if not one.numeric:
        pytest.skip("a choice")
    plain = made(**{weight: off})
    default = np.mean(one.default)
    other = 0.5 * (min(max(one.low, 0.0), default) + min(one.high, 2.0 * default + 0.5))
    value = (other,) * 3 if one.kind == "spectrum" else float(other)
    np.testing.assert_allclose(values(made(**{weight: off, parameter: value})), values(plain), rtol=ROUNDINGS, atol=0.0)


LAMBERT = "lambert(albedo=.3)"
LIMITS = {
    **{f"{name}(diffuse=.3,specular=0)": LAMBERT for name in ("ward", "ward-duer", "lafortune", "shifted-gamma")},
    **{f"{name}(diffuse=.3,specular=0)": LAMBERT for name in ("cook-torrance", "he-torrance")},
    **{f"{name}(diffuse=.3,specular=0)": LAMBERT for name in ("low-smooth", "low-microfacet")},
    **{f"{name}(kd=.3,ks=0)": f"lambert(albedo={0.3 * np.pi!r})" for name in ("phong", "blinn-phong")},
    "modified-phong(kd=.3,ks=0)": LAMBERT,
    "oren-nayar(albedo=.3,sigma=0)": LAMBERT,
    "eon(albedo=.3,roughness=0)": LAMBERT,
    "coat(base=lambert(albedo=.3),index=1)": LAMBERT,
    "film-conductor(eta=.2,k=3,alpha=.3,thickness=0)": "conductor(eta=.2,k=3,alpha=.3)",
    "film-conductor(eta=.2,k=3,alpha=.3,thickness=300,film_eta=1)": "conductor(eta=.2,k=3,alpha=.3)",
    "film-dielectric(eta=1.5,alpha=.3,thickness=0)": "dielectric(eta=1.5,alpha=.3)",
    "film-dielectric(eta=1.5,alpha=.3,thickness=300,film_eta=1)": "dielectric(eta=1.5,alpha=.3)",
    "film-dielectric(eta=1.5,alpha=.3,thickness=300,film_eta=1.5)": "dielectric(eta=1.5,alpha=.3)",
    "mix(a=phong,b=conductor(alpha=.3),weight=0)": "phong",
    "mix(a=phong,b=conductor(alpha=.3),weight=1)": "conductor(alpha=.3)",
    "opacity(base=conductor(alpha=.3),opacity=1)": "conductor(alpha=.3)",
    "normal-map(base=phong,lean_x=0,lean_y=0)": "phong",
    "bump(base=phong,lean_x=0,lean_y=0)": "phong",
}


@pytest.mark.sample(5)
@pytest.mark.parametrize("limit", LIMITS)
def test_a_material_at_its_limit_is_the_material_without_it(limit: str) -> None:
    without = values(go.material(LIMITS[limit]))
    np.testing.assert_allclose(values(go.material(limit)), without, rtol=0.0, atol=ROUNDINGS * float(without.max()))
