"""Disney's BRDF of 2012 against its published formulas, written out in angles, and its limits."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest

from sphere import random_directions

DISNEY = go.model("disney")
WO, WI = random_directions(2000, 195, upper=True), random_directions(2000, 196, upper=True)
H = (WO + WI) / np.linalg.norm(WO + WI, axis=1, keepdims=True)
L, V, D, N = WI[:, 2], WO[:, 2], np.sum(WI * H, 1), H[:, 2]


def schlick(cos: np.ndarray) -> np.ndarray:
    return (1 - cos) ** 5


def mix(a: object, b: object, share: float) -> np.ndarray:
    return np.asarray(a) * (1 - share) + np.asarray(b) * share


def smith(w: np.ndarray, ax: float, ay: float) -> np.ndarray:
    """Over 2 (n.w), as the published code has it."""
    return 1 / (w[:, 2] + np.sqrt((w[:, 0] * ax) ** 2 + (w[:, 1] * ay) ** 2 + w[:, 2] ** 2))


def published(
    base, subsurface, metallic, specular, tint, roughness, anisotropic, sheen, sheen_tint, coat, gloss
) -> np.ndarray:
    colour = np.asarray(base) / np.mean(base)
    f0 = mix(specular * 0.08 * mix(1.0, colour, tint), base, metallic)
    fd90 = 0.5 + 2 * D**2 * roughness
    fd = (1 + (fd90 - 1) * schlick(L)) * (1 + (fd90 - 1) * schlick(V))
    fss90 = D**2 * roughness
    fss = (1 + (fss90 - 1) * schlick(L)) * (1 + (fss90 - 1) * schlick(V))
    ss = 1.25 * (fss * (1 / (L + V) - 0.5) + 0.5)
    aspect = np.sqrt(1 - anisotropic * 0.9)
    ax, ay = roughness**2 / aspect, roughness**2 * aspect
    ds = 1 / (np.pi * ax * ay * ((H[:, 0] / ax) ** 2 + (H[:, 1] / ay) ** 2 + N**2) ** 2)
    fh = schlick(D)[:, None]
    gs = smith(WI, ax, ay) * smith(WO, ax, ay)
    a2 = mix(0.1, 0.001, gloss) ** 2
    dr = (a2 - 1) / (np.pi * np.log(a2) * (1 + (a2 - 1) * N**2))
    gr = smith(WI, 0.25, 0.25) * smith(WO, 0.25, 0.25)
    body = (mix(fd, ss, subsurface)[:, None] / np.pi * np.asarray(base) + fh * sheen * mix(1.0, colour, sheen_tint)) * (
        1 - metallic
    )
    return body + (gs * ds)[:, None] * (f0 + (1 - f0) * fh) + 0.25 * coat * (gr * dr)[:, None] * (0.04 + 0.96 * fh)


@pytest.mark.parametrize(
    "dials",
    [
        (0.0, 0.0, 0.5, 0.0, 0.5, 0.0, 0.0, 0.5, 0.0, 1.0),
        (0.7, 0.2, 0.9, 0.6, 0.3, 0.8, 0.5, 0.3, 0.6, 0.4),
        (0.0, 1.0, 0.5, 1.0, 0.8, 0.3, 1.0, 1.0, 1.0, 0.0),
    ],
)
def test_it_is_the_published_code(dials: tuple[float, ...]) -> None:
    base = (0.8, 0.4, 0.1)
    names = ("subsurface", "metallic", "specular", "specular_tint", "roughness", "anisotropic")
    more = ("sheen", "sheen_tint", "clearcoat", "clearcoat_gloss")
    model = DISNEY(base, **dict(zip((*names, *more), dials, strict=True)))
    np.testing.assert_allclose(model.f(WO, WI, precision="float64"), published(base, *dials), rtol=1e-8)


def test_its_parts_add_up_to_its_value() -> None:
    model = DISNEY(0.6, 0.2, 0.3, sheen=0.5, clearcoat=0.7)
    np.testing.assert_allclose(sum(model.terms(WO, WI)), model.eval(WO, WI), rtol=2e-5)


def test_all_dials_up_gain_no_more_than_is_declared() -> None:
    model = DISNEY(1.0, specular=1.0, roughness=1.0, sheen=1.0, clearcoat=1.0)
    gain = go.albedo(model, mu=[0.02, 0.1, 0.3, 1.0]).value.max() - 1.0
    assert 0.1 < gain < model.violations()["energy"].size
