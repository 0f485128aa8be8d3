"""Every formula that the book sets is an expression here, evaluated beside its model."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import gonio as go
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
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


@pytest.mark.parametrize("name", [name for name, lines in formulas.RUN.items() if "f = " in lines])
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
