"""Distributions of normals: normalization, Smith's terms against their defining integrals, and sampling."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.special
from gonio import ops
from gonio.errors import InputError
from gonio.ops import backend
from gonio.optics import ndf as package
from gonio.optics.ndf import distribution, distributions

from chi_square import SIGNIFICANCE, p_value
from sphere import SEED, at, hemisphere, random_directions, relative

KIND = backend.types("float64")
WIDTHS = [(0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.15, 0.6)]
DIRECTIONS, WEIGHTS = hemisphere(1000, 240)
NAMES = list(distributions())
OWN_VISIBLE = [name for name in NAMES if "visible_normal" in vars(type(distribution(name)))]


def vector(rows: np.ndarray) -> Any:
    return backend.vector_of(rows, len(np.atleast_2d(rows)[0]), KIND)


def test_discovery_finds_every_distribution() -> None:
    files = {path.stem for path in Path(package.__file__).parent.glob("*.py")}
    declared = {type(distribution(name)).__module__.rpartition(".")[2] for name in NAMES}
    assert declared == files - {"__init__", "base", "tabulated"} and len(declared) == len(NAMES)
    with pytest.raises(InputError, match="did you mean 'beckmann'"):
        distribution("beckman")


@pytest.mark.sample(2)
@pytest.mark.parametrize("alpha", WIDTHS, ids=str)
@pytest.mark.parametrize("name", NAMES)
def test_projected_density_integrates_to_one(name: str, alpha: tuple[float, float]) -> None:
    d = distribution(name).D(vector(DIRECTIONS), vector(np.array(alpha))).numpy()
    assert (d * DIRECTIONS[:, 2]) @ WEIGHTS == pytest.approx(1.0, abs=1e-8)


@pytest.mark.sample(4)
@pytest.mark.parametrize("degrees", [0.0, 20.0, 55.0, 80.0, 88.0])
@pytest.mark.parametrize("alpha", WIDTHS, ids=str)
@pytest.mark.parametrize("name", NAMES)
def test_masked_visible_area_is_the_projected_area(name: str, alpha: tuple[float, float], degrees: float) -> None:
    """int G1(v) D(m) max(0, v.m) dm = v.z (Heitz2014, eq. 14), with the exact Lambda."""
    ndf, v = distribution(name), at(degrees, 35)
    widths, m = vector(np.array(alpha)), vector(DIRECTIONS)
    visible = np.maximum(DIRECTIONS @ v, 0) * ndf.D(m, widths).numpy() @ WEIGHTS
    # the kink of max(0, v.m) leaves the quadrature this far off
    assert ndf.G1(vector(v), widths).numpy()[0] * visible == pytest.approx(v[2], rel=2e-5)


@pytest.mark.parametrize("alpha", WIDTHS, ids=str)
@pytest.mark.parametrize("name", NAMES)
def test_g1_is_one_over_one_plus_lambda(name: str, alpha: tuple[float, float]) -> None:
    ndf, v, widths = distribution(name), vector(random_directions(1000, 51)), vector(np.array(alpha))
    np.testing.assert_allclose(ndf.G1(v, widths).numpy(), 1 / (1 + ndf.Lambda(v, widths).numpy()), rtol=1e-12)


def test_densities_are_the_sheets_formulas() -> None:
    theta, a = np.linspace(0.01, 1.5, 300), 0.3
    m = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    tan2, cos4 = np.tan(theta) ** 2, np.cos(theta) ** 4
    expected = {
        "beckmann": np.exp(-tan2 / a**2) / (np.pi * a**2 * cos4),  # eq. 5
        "ggx": a**2 / (np.pi * cos4 * (a**2 + tan2) ** 2),  # eq. 6
        "student-t": 1 / (np.pi * a**2 * cos4 * (1 + tan2 / (2 * a**2)) ** 3),
    }
    for name, values in expected.items():
        got = distribution(name).D(vector(m), vector(np.array([a, a]))).numpy()
        np.testing.assert_allclose(got, values, rtol=1e-10, atol=1e-30)


def test_masking_is_the_sheets_formulas() -> None:
    theta, a = np.linspace(0.01, 1.55, 300), 0.4
    v, widths = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1), vector(np.array([a, a]))
    b = 1 / (a * np.tan(theta))
    fit = np.where(b < 1.6, (3.535 * b + 2.181 * b**2) / (1 + 2.276 * b + 2.577 * b**2), 1.0)  # eq. 8
    np.testing.assert_allclose(distribution("beckmann").G1_customary(vector(v), widths).numpy(), fit, rtol=1e-11)
    smith = 2 / (1 + np.sqrt(1 + a**2 * np.tan(theta) ** 2))  # eq. 9
    np.testing.assert_allclose(distribution("ggx").G1_customary(vector(v), widths).numpy(), smith, rtol=1e-11)
    exact = distribution("beckmann").G1(vector(v), widths).numpy()
    assert relative(fit, exact).max() < 4e-3  # what the fit costs


@pytest.mark.parametrize("name", NAMES)
def test_width_along_one_axis_acts_along_that_axis(name: str) -> None:
    d = distribution(name).D(vector(np.array([at(20, 0), at(20, 90)])), vector(np.array([0.5, 0.1]))).numpy()
    assert d[0] > 10 * d[1]


def _chi_square(pdf: Any, normals: np.ndarray) -> float:
    return p_value(normals, np.ones(len(normals), bool), lambda w: np.where(w[:, 2] > 0, pdf(vector(w)).numpy(), 0.0))[
        0
    ]


@pytest.mark.sample(2)
@pytest.mark.parametrize("alpha", [(0.01, 0.01), (0.5, 0.5), (1.0, 1.0), (0.1, 0.5)], ids=str)
@pytest.mark.parametrize("name", NAMES)
def test_sampled_normals_follow_the_density(name: str, alpha: tuple[float, float]) -> None:
    ndf, widths = distribution(name), vector(np.array(alpha))
    u = np.random.default_rng(SEED).random((100_000, 2))
    normals = ndf.sample(KIND.float(u[:, 0].copy()), KIND.float(u[:, 1].copy()), widths).numpy().T
    assert _chi_square(lambda m: ndf.pdf(m, widths), normals) > SIGNIFICANCE


@pytest.mark.sample(1)
@pytest.mark.parametrize("degrees", [0.0, 45.0, 85.0])
@pytest.mark.parametrize("alpha", [(0.1, 0.1), (1.0, 1.0), (0.1, 0.5)], ids=str)
@pytest.mark.parametrize("name", OWN_VISIBLE)
def test_visible_normals_follow_their_density_which_integrates_to_one(name: str, alpha: tuple, degrees: float) -> None:
    ndf, widths, view = distribution(name), vector(np.array(alpha)), at(degrees, 25)
    v = vector(view)
    pdf = np.where(DIRECTIONS @ view > 0, ndf.pdf_visible(v, vector(DIRECTIONS), widths).numpy(), 0)
    assert pdf @ WEIGHTS == pytest.approx(1.0, rel=2e-5)
    u = np.random.default_rng(SEED).random((100_000, 2))
    normals = ndf.sample_visible(v, KIND.float(u[:, 0].copy()), KIND.float(u[:, 1].copy()), widths).numpy().T
    assert (normals @ view).min() > -1e-9

    def facing(w: Any) -> Any:
        return ops.where(ops.dot(w, v) > 0.0, ndf.pdf_visible(v, w, widths), 0.0)

    assert _chi_square(facing, normals) > SIGNIFICANCE


@pytest.mark.parametrize("degrees", [5.0, 45.0, 75.0, 85.0])
def test_beckmanns_visible_slopes_invert_their_distribution_function(degrees: float) -> None:
    """With u2 = 1/2 the normal lies in the plane of v, and its slope x has c(x) = u1 c(cot) (Heitz2014b, sec. 5)."""
    v, u1 = at(degrees), np.linspace(0.01, 0.99, 500)
    m = distribution("beckmann").sample_visible(
        vector(v), KIND.float(u1), KIND.float(np.full(500, 0.5)), vector(np.array([1.0, 1.0]))
    )
    x = -m.numpy()[0] / m.numpy()[2]
    np.testing.assert_allclose(m.numpy()[1], 0.0, atol=1e-9)
    tan = np.tan(np.radians(degrees))

    def c(slope: Any) -> Any:
        return 0.5 * (1 + scipy.special.erf(slope)) + 0.5 * tan * np.exp(-np.square(slope)) / np.sqrt(np.pi)

    np.testing.assert_allclose(c(x) / c(1 / tan), u1, atol=1e-7)


@pytest.mark.sample(2)
@pytest.mark.parametrize("degrees", [10.0, 60.0, 85.0])
@pytest.mark.parametrize("alpha", [(0.3, 0.3), (1.0, 1.0), (0.1, 0.6)], ids=str)
def test_bounded_visible_normals_fail_less_often_and_lose_no_reflection(alpha: tuple, degrees: float) -> None:
    ggx, widths, view = distribution("ggx"), vector(np.array(alpha)), at(degrees, 25)
    v = vector(view)
    u = np.random.default_rng(SEED).random((100_000, 2))
    u1, u2 = KIND.float(u[:, 0].copy()), KIND.float(u[:, 1].copy())

    def below(m: np.ndarray) -> float:
        wi = 2 * (m @ view)[:, None] * m - view
        return float((wi[:, 2] <= 0).mean())

    bounded = below(ggx.sample_bounded(v, u1, u2, widths).numpy().T)
    assert bounded <= below(ggx.sample_visible(v, u1, u2, widths).numpy().T) + 1e-3
    # the density of all facets whose reflection is above adds up to what does not fail
    dot = DIRECTIONS @ view
    above = (dot > 0) & (2 * dot * DIRECTIONS[:, 2] > view[2])
    pdf = np.abs(dot) * ggx.bounded_per_cosine(v, vector(DIRECTIONS), widths).numpy()
    assert np.where(above, pdf, 0) @ WEIGHTS == pytest.approx(1 - bounded, abs=5e-3)
    # nothing that can be reflected is left out: the bounded density is never below the visible one there
    assert np.all(pdf[above] >= ggx.pdf_visible(v, vector(DIRECTIONS), widths).numpy()[above] * (1 - 1e-12))


def test_smiths_lambda_is_symmetric_in_side_and_grows_toward_grazing() -> None:
    widths = vector(np.array([0.3, 0.3]))
    for name in NAMES:
        lam = distribution(name).Lambda(vector(np.array([at(d) for d in (0, 30, 60, 85, 89.9)])), widths).numpy()
        mirrored = (
            distribution(name).Lambda(vector(np.array([at(180 - d) for d in (0, 30, 60, 85, 89.9)])), widths).numpy()
        )
        np.testing.assert_allclose(lam, mirrored, rtol=1e-9, atol=1e-12)
        assert np.all(np.diff(lam) >= -1e-15) and lam[0] == pytest.approx(0, abs=1e-9)
