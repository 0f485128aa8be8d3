"""Every formula that the book sets is an expression here, evaluated beside its model."""

from __future__ import annotations

import math

import gonio as go
import numpy as np
import pytest
from book import formulas

# settings in which a model is its formula: Schlick's Fresnel, isotropic or not, without parts that the page leaves out
SETTINGS: dict[str, dict[str, object]] = {
    "conductor": {"fresnel": "schlick", "eta": 0.3, "k": 2.5, "alpha": 0.3},
    "metal": {"alpha": 0.3, "edge": 1.0, "r0": 0.7},
    "ward": {"alpha": (0.2, 0.4)},
    "ward-duer": {"alpha": (0.2, 0.4)},
    "ashikhmin-shirley": {"exponent": (20.0, 50.0)},
}


def directions(count: int = 50) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    cosine, azimuth = rng.uniform(0.05, 1.0, (2, count)), rng.uniform(0.0, 2.0 * math.pi, (2, count))
    sine = np.sqrt(1.0 - cosine**2)
    both = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=2)
    return both[0], both[1]


def symbols(o: np.ndarray, i: np.ndarray) -> dict[str, object]:
    h = (o + i) / np.linalg.norm(o + i, axis=1, keepdims=True)
    names: dict[str, object] = {f"{name}{axis}": v[:, k] for name, v in zip("oih", (o, i, h), strict=True)
                                for k, axis in enumerate("xyz")}  # fmt: skip
    names |= {"no": o[:, 2], "ni": i[:, 2], "nh": h[:, 2], "oh": np.sum(o * h, axis=1), "oi": np.sum(o * i, axis=1)}
    names |= {"vr": np.sum(o * i * [-1.0, -1.0, 1.0], axis=1), "pi": math.pi, "sqrt": np.sqrt, "exp": np.exp}
    return names | {"max": lambda *terms: np.maximum.reduce(np.broadcast_arrays(*terms)),
                    "min": lambda *terms: np.minimum.reduce(np.broadcast_arrays(*terms))}  # fmt: skip


ROUGH = {"alpha": 0.8, "eta": 0.3, "k": 2.5}
METAL, WHITE = go.Conductor(fresnel="schlick", **ROUGH), go.Conductor(fresnel="one", **ROUGH)
PLASTER, F_0 = go.Lambert(albedo=0.5), ((0.3 - 1.0) ** 2 + 2.5**2) / ((0.3 + 1.0) ** 2 + 2.5**2)
COMPOSED = {
    "kulla-conty": go.KullaConty(METAL, color="sheet"),
    "turquin": go.Turquin(METAL),
    "mix": go.Mix(METAL, PLASTER, weight=0.3),
    "sum": go.Sum(METAL, PLASTER),
}


@pytest.mark.parametrize("name", COMPOSED)
def test_the_formula_is_the_material_composed_of_others(name: str) -> None:
    o, i = directions()
    albedo = lambda mu: go.albedo(WHITE, mu=mu).value[:, 0]  # noqa: E731
    x, weights = np.polynomial.legendre.leggauss(16)
    mu = (x + 1.0) / 2.0
    scope: dict[str, object] = {
        "E_o": albedo(o[:, 2]),
        "E_i": albedo(i[:, 2]),
        "E_avg": np.sum(albedo(mu) * mu * weights),
    }
    scope |= {"F_avg": F_0 + (1.0 - F_0) / 21.0, "F_0": F_0, "pi": math.pi, "weight": 0.3}
    for key, one in {"f_base": METAL, "f_a": METAL, "f_b": PLASTER}.items():
        scope[key] = one.f(o, i, precision="float64")[:, 0]
    exec(formulas.RUN[name], scope)
    np.testing.assert_allclose(scope["f"], COMPOSED[name].f(o, i, precision="float64")[:, 0], rtol=1e-3)


@pytest.mark.parametrize(
    "name", [name for name, lines in formulas.RUN.items() if "f = " in lines and name not in COMPOSED]
)
def test_the_formula_is_the_model(name: str) -> None:
    model = go.models()[name](**SETTINGS.get(name, {}))
    o, i = directions()
    scope = symbols(o, i)
    for key in model.parameters():
        value = getattr(model, key)
        if key == "alpha":
            widths = (
                np.broadcast_to(np.ravel(np.asarray(value, float)), (2,)) if np.size(value) < 2 else np.ravel(value)
            )
            scope |= {"alpha": widths[0], "alpha_x": widths[0], "alpha_y": widths[1]}
        elif np.size(value) == 2:
            scope |= dict(zip(("n_x", "n_y"), np.ravel(value), strict=True))
        elif not isinstance(value, str | bool):
            scope[key] = np.ravel(np.asarray(value, float))[0]
    exec(formulas.RUN[name], scope)
    expected = model.f(o, i, precision="float64")[:, 0]
    np.testing.assert_allclose(scope["f"], expected, rtol=1e-6)


@pytest.mark.parametrize("name", list(go.models()))
def test_every_model_has_a_formula(name: str) -> None:
    assert formulas.of_model(name)
