"""A distribution that gives `D` alone: Smith's Lambda and its samples come from tables that are found from it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.errors import GonioWarning, InputError
from gonio.ops import backend
from gonio.optics.ndf import NDF, distribution, tabulated

from chi_square import SIGNIFICANCE, p_value
from sphere import SEED, at, hemisphere, random_directions

KIND = backend.types("float64")
DIRECTIONS, WEIGHTS = hemisphere(600, 160)


def vector(rows: np.ndarray | tuple) -> Any:
    return backend.vector_of(np.asarray(rows), len(np.atleast_2d(rows)[0]), KIND)


def only_density(name: str) -> NDF:
    """The distribution of that name without its closed forms."""
    closed = distribution(name)

    class Alone(go.NDF):
        """D alone."""

        def D(self, m: Any, alpha: Any) -> Any:
            return closed.D(m, alpha)

    return Alone()


class GTR(go.NDF):
    """Generalized Trowbridge-Reitz (Burley2012): its shape changes with the width, and alpha.y is ignored."""

    def __init__(self, gamma: float = 1.5) -> None:
        self.gamma = gamma

    def D(self, m: Any, alpha: Any) -> Any:
        a2, g = ops.sqr(alpha.x), self.gamma
        scale = (g - 1.0) * (a2 - 1.0) / (ops.pi * (1.0 - ops.pow(a2, 1.0 - g)))
        return scale * ops.pow(a2 * ops.sqr(m.z) + ops.sqr(m.x) + ops.sqr(m.y), -g)


class Slopes(go.Stretched):
    """Student-T slopes by their density alone."""

    def density(self, n: Any) -> Any:
        z2 = ops.sqr(n.z)
        spread = z2 + 0.5 * (ops.sqr(n.x) + ops.sqr(n.y))
        return ops.inv_pi * z2 / (spread * ops.sqr(spread))


MADE: dict[str, Callable[[], NDF]] = {
    "ggx": lambda: only_density("ggx"),
    "beckmann": lambda: only_density("beckmann"),
    "slopes": Slopes,
    "gtr": GTR,
}


@pytest.mark.sample(2)
@pytest.mark.parametrize("alpha", [(0.01, 0.01), (0.3, 0.3), (1.0, 1.0), (0.1, 0.6)], ids=str)
@pytest.mark.parametrize("name", ["ggx", "beckmann", "student-t"])
def test_lambda_is_that_of_the_closed_form(name: str, alpha: tuple[float, float]) -> None:
    v, widths = vector(random_directions(4000, 61)), vector(alpha)
    found, closed = (ndf.Lambda(v, widths).numpy() for ndf in (only_density(name), distribution(name)))
    assert np.abs((1.0 + found) / (1.0 + closed) - 1.0).max() < 1e-5
    upper = np.abs(v.z.numpy()) > 0.1
    assert np.abs(found - closed)[upper].max() < 3e-5


@pytest.mark.sample(2)
@pytest.mark.parametrize("degrees", [0.0, 60.0, 85.0])
@pytest.mark.parametrize(("gamma", "alpha"), [(1.5, 0.2), (4.0, 0.5), (1.3, 0.95)])
def test_masked_visible_area_is_the_projected_area(gamma: float, alpha: float, degrees: float) -> None:
    """int G1(v) D(m) max(0, v.m) dm = v.z (Heitz2014, eq. 14), where the shape changes with the width."""
    ndf, v, widths = GTR(gamma), at(degrees, 35), vector((alpha, alpha))
    visible = np.maximum(DIRECTIONS @ v, 0) * ndf.D(vector(DIRECTIONS), widths).numpy() @ WEIGHTS
    assert ndf.G1(vector(v), widths).numpy()[0] * visible == pytest.approx(v[2], rel=1e-4)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "alpha"),
    [("ggx", (0.15, 0.6)), ("beckmann", (0.3, 0.3)), ("slopes", (0.15, 0.6)), ("gtr", (0.3, 0.3))],
    ids=str,
)
def test_normals_follow_their_densities(name: str, alpha: tuple[float, float]) -> None:
    ndf, widths = MADE[name](), vector(alpha)
    u = np.random.default_rng(SEED).random((60_000, 2))
    u1, u2 = KIND.float(u[:, 0].copy()), KIND.float(u[:, 1].copy())
    every = np.ones(len(u), bool)
    normals = ndf.sample(u1, u2, widths).numpy().T
    assert p_value(normals, every, lambda m: ndf.pdf(vector(m), widths).numpy())[0] > SIGNIFICANCE
    for degrees in (20.0, 75.0):
        view = at(degrees, 25)
        v = vector(view)
        seen = ndf.sample_visible(v, u1, u2, widths).numpy().T
        assert p_value(seen, every, lambda m, v=v: ndf.pdf_visible(v, vector(m), widths).numpy())[0] > SIGNIFICANCE
        # the visible area over the density: few samples are lost, and none weighs much
        weight = ndf.D(vector(seen), widths).numpy() * np.maximum(seen @ view, 0.0)
        weight = weight / ndf.pdf_visible(v, vector(seen), widths).numpy()
        area = ((1.0 + ndf.Lambda(v, widths)) * v.z).numpy()[0]
        assert weight.mean() == pytest.approx(area, abs=5.0 * weight.std() / len(u) ** 0.5)
        assert weight.max() < 1.3 * area and np.mean(weight == 0.0) < 0.19


def test_a_material_needs_no_more_than_d(own_ndfs: None) -> None:
    metal = go.Conductor.preset("Au", alpha=0.4, ndf=GTR)
    wo, u = np.tile(at(55, 20), (100_000, 1)), np.random.default_rng(SEED).random((100_000, 3))
    drawn = metal.sample(wo, u, precision="float64")
    integral = metal.eval(at(55, 20), DIRECTIONS, precision="float64").T @ WEIGHTS
    np.testing.assert_allclose(drawn.weight.mean(0), integral, atol=5 * drawn.weight.std() / 300)
    glass = go.Dielectric(1.5, 0.4, ndf=GTR, fresnel="one")
    assert glass.sample(wo, u, precision="float64").weight.max() < 1.3
    text = go.emit(metal)
    assert "table_normals_gtr" in text and "GTR_Lambda" in text


def test_tables_are_found_while_a_loop_is_recorded() -> None:
    import drjit as dr

    ndf, v, alpha = GTR(1.7), vector(at(60)), vector((0.3, 0.3))
    right = GTR(1.7)
    UInt = KIND.module.UInt32

    def body(i: Any, total: Any) -> tuple:
        return i + 1, total + ndf.Lambda(v, alpha)

    _, total = dr.while_loop((UInt(0), KIND.float(0)), lambda i, _: i < 2, body, mode="symbolic")
    assert total.numpy()[0] == pytest.approx(2.0 * right.Lambda(v, alpha).numpy()[0], rel=1e-12)


def test_two_widths_are_those_of_a_stretched_surface_or_the_first(own_ndfs: None) -> None:
    class Round(go.NDF):
        def D(self, m: Any, alpha: Any) -> Any:
            mean = ops.sqrt(alpha.x * alpha.y)
            return distribution("ggx").D(m, ops.vec2(mean, mean))

    meanings = [tabulated.tables_of(ndf).widths for ndf in (only_density("ggx"), Slopes(), GTR(), Round())]
    assert meanings == ["stretched", "stretched", "first", "equal"]
    assert go.Conductor(ndf=Round, alpha=0.3).ndf == "round"
    with pytest.raises(InputError, match=r"two widths given, but D of Round neither"):
        go.Conductor(ndf=Round, alpha=(0.3, 0.2))


def test_tails_are_told_from_the_table() -> None:
    slow = [MADE[name]().falls_slowly for name in ("ggx", "beckmann", "slopes", "gtr")]
    assert slow == [distribution(n).long_tailed for n in ("ggx", "beckmann", "student-t")] + [True]


def _member(**formulas: Any) -> type[NDF]:
    return type("Faulty", (go.NDF,), formulas)


@pytest.mark.parametrize(
    ("formulas", "words"),
    [
        ({}, ["has no `D`", "write D(self, m, alpha)", "your-own-material.md"]),
        ({"D": lambda self, m: m.z}, ["D of Faulty", "arguments"]),
        ({"D": lambda self, m, alpha: alpha}, ["returned a vec2", "alpha.x"]),
        ({"D": lambda self, m, alpha: m.z**alpha.x}, ["`**`", "ops.pow"]),
        ({"D": lambda self, m, alpha: m.z if m.z > 0 else 0.0}, ["`if`", "where"]),
        ({"D": lambda self, m, alpha: m.height}, ["AttributeError", "height"]),
        ({"D": lambda self, m, alpha: m.z / 0.0}, ["not finite"]),
        ({"D": lambda self, m, alpha: ops.inv_pi * (1.0 + m.x)}, ["depends on the azimuth", "write Lambda"]),
    ],
    ids=["nothing", "arguments", "pair", "power", "if", "attribute", "infinite", "azimuth"],
)
def test_what_is_missing_or_wrong_is_one_error(formulas: dict[str, Any], words: list[str], own_ndfs: None) -> None:
    with pytest.raises(InputError) as caught:
        go.Conductor(ndf=_member(**formulas))
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_density_that_is_not_normalized_is_told(own_ndfs: None) -> None:
    class Doubled(go.NDF):
        def D(self, m: Any, alpha: Any) -> Any:
            return 2.0 * distribution("ggx").D(m, alpha)

    with pytest.warns(GonioWarning, match=r"int D\(m\) m\.z dm is 2 .*, 1 expected"):
        go.Conductor(ndf=Doubled)


def test_a_clamped_cosine_in_D_changes_nothing() -> None:
    """tan^2 by max(cos^2, 1e-7) makes D rise at the horizon: it made Lambda 4,000 times too large, and metals black."""

    class Clamped(go.NDF):
        """GGX as it is often written."""

        def D(self, m: Any, alpha: Any) -> Any:
            a2, c2 = ops.sqr(alpha.x), ops.sqr(m.z)
            t2 = (1.0 - c2) / ops.maximum(c2, 1e-7)
            return ops.inv_pi / (a2 * ops.sqr(c2) * ops.sqr(1.0 + t2 / a2))

    closed, own = distribution("ggx"), Clamped()
    v = random_directions(200, upper=True)
    for width in (0.1, 0.4, 1.0):
        alpha = vector(np.full((len(v), 2), width))
        found, right = own.Lambda(vector(v), alpha), closed.Lambda(vector(v), alpha)
        np.testing.assert_allclose(1 / (1 + np.array(found)), 1 / (1 + np.array(right)), atol=2e-3)
