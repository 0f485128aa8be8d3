"""Calls on NumPy arrays: any shape, many rows, derivatives, wavelengths, and Mitsuba's names of the widths."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.material import blocks, tree

GOLD = go.Conductor.preset("Au", alpha=0.3)


def directions(*shape: int) -> np.ndarray:
    w = np.random.default_rng(5).normal(size=(2, *shape, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.05
    return w / np.linalg.norm(w, axis=-1, keepdims=True)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_many_rows_have_the_bits_of_few(kind: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    wo, wi = directions(300).astype(kind)
    u = np.random.default_rng(6).random((300, 3)).astype(kind)
    few = [GOLD.eval(wo, wi), GOLD.eval(wo[0], wi), GOLD.pdf(wo, wi), *GOLD.sample(wo, u)]
    monkeypatch.setattr(blocks, "MANY", 100)
    drawn = GOLD.sample(wo, u)
    for a, b in zip(few, [GOLD.eval(wo, wi), GOLD.eval(wo[0], wi), GOLD.pdf(wo, wi), *drawn], strict=True):
        assert np.array_equal(a, b) and a.dtype == b.dtype and a.shape == b.shape and b.flags.writeable
    assert np.array_equal(GOLD.eval(wo, drawn.wi), GOLD.eval(wo, np.ascontiguousarray(drawn.wi)))


def test_wrong_values_among_many_rows_are_one_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "MANY", 100)
    wo, wi = directions(300)
    u = np.full((300, 3), 0.5)
    wi[77], u[5, 2] = 2.0, np.nan
    with pytest.raises(InputError, match=r"eval: wi: row 77 has length 3.464"):
        GOLD.eval(wo, wi)
    with pytest.raises(InputError, match="random numbers outside"):
        GOLD.sample(wo, u)
    with pytest.raises(InputError, match="299 and 300 rows"):
        GOLD.pdf(wo, wo[1:])


@pytest.mark.parametrize("rows", [1, 1 << 20])
def test_arrays_may_have_more_axes(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "MANY", rows)
    wo, wi = directions(4, 5)
    value, drawn = GOLD.eval(wo, wi), GOLD.sample(wo, np.full(3, 0.4))
    assert value.shape == (4, 5, 3) and drawn.wi.shape == (4, 5, 3) and drawn.pdf.shape == (4, 5)
    assert np.array_equal(value.reshape(-1, 3), GOLD.eval(wo.reshape(-1, 3), wi.reshape(-1, 3)))
    assert GOLD.pdf(wo[:, :1], wi).shape == (4, 5) and GOLD.pdf([0.0, 0.0, 1.0], wi).shape == (4, 5)
    with pytest.raises(InputError, match="do not broadcast"):
        GOLD.eval(wo, wi[:, :3])


@pytest.mark.parametrize(
    ("material", "path"),
    [
        (GOLD, "alpha"),
        (go.Conductor(alpha=(0.2, 0.4), rotation=0.3), "rotation"),
        (go.two_sided(GOLD), "base.alpha"),
        (go.material("lambert+ggx(alpha=.3)"), "a.albedo"),
    ],
)
def test_derivatives_are_those_of_differences(material: go.BSDF, path: str) -> None:
    wo, wi = directions(20)
    value, slope = material.eval(wo, wi, derivatives=[path], precision="float64")
    np.testing.assert_allclose(value, material.eval(wo, wi, precision="float64"), rtol=1e-13)
    held, step = tree.value_at(material, path), 1e-5
    ends = [tree.replace(material, {path: held + h}).eval(wo, wi, precision="float64") for h in (-step, step)]
    np.testing.assert_allclose(slope, (ends[1] - ends[0]) / (2.0 * step), rtol=1e-3, atol=1e-6)


def test_derivatives_by_one_channel_and_of_the_density() -> None:
    wo, wi = directions(6, 5)
    rows = go.Lambert(0.5).eval(wo, wi, derivatives=["albedo", "albedo.g"], precision="float64")
    assert rows.shape == (3, 6, 5, 3)
    np.testing.assert_allclose(rows[1], 2.0 * rows[0])
    assert np.all(rows[2][..., [0, 2]] == 0.0) and np.array_equal(rows[2][..., 1], rows[1][..., 1])
    assert GOLD.pdf(wo, wi, derivatives=["alpha"]).shape == (2, 6, 5)
    with pytest.raises(InputError, match="did you mean 'alpha'"):
        GOLD.eval(wo, wi, derivatives=["alhpa"])


def test_values_at_wavelengths_follow_the_dispersion() -> None:
    wo, wi = directions(10)
    value = go.Dielectric("bk7", 0.2).eval(wo, wi, wavelengths=[400.0, 650.0], precision="float64")
    for column, nm in zip(value.T, (400.0, 650.0), strict=True):
        plain = go.Dielectric(float(go.refractive_index("bk7", nm).eta), 0.2).eval(wo, wi, precision="float64")
        np.testing.assert_allclose(column, plain[:, 0], rtol=1e-12)
    film = go.FilmConductor(eta=0.2, k=3.0, thickness=300.0, alpha=0.3).eval(wo, wi, wavelengths=[450.0, 500.0])
    assert film.shape == (10, 2) and not np.allclose(film[:, 0], film[:, 1], rtol=1e-3)
    with pytest.raises(InputError, match="not a spectrum"):
        GOLD.eval(wo, wi, wavelengths=[500.0])
    with pytest.raises(InputError, match="positive numbers"):
        go.Lambert().eval(wo, wi, wavelengths=[-1.0])


def test_mitsubas_names_of_the_widths_are_a_pair() -> None:
    for made in (
        go.Conductor(alpha_u=0.1, alpha_v=0.3),  # type: ignore[call-arg]
        go.material("conductor(alpha_u=.1,alpha_v=.3)"),
        go.Conductor.preset("Au", alpha_u=0.1, alpha_v=0.3),
    ):
        assert made.alpha == (0.1, 0.3)  # type: ignore[attr-defined]
    with pytest.raises(InputError, match="only alpha_u given"):
        go.Conductor(alpha_u=0.1)  # type: ignore[call-arg]


def test_a_preset_given_as_a_parameter_is_hinted_at() -> None:
    for given in ({"preset": "Au"}, {"eta": "Au"}):
        with pytest.raises(InputError) as caught:
            go.Conductor(**given)  # type: ignore[arg-type]
        assert "Conductor.preset('Au'" in caught.value.hint


def test_the_width_of_a_coat_has_a_derivative() -> None:
    coat = go.Coat(go.Lambert(0.5), alpha=0.3)
    value, slope = coat.eval([0.0, 0.6, 0.8], [0.3, -0.2, (1.0 - 0.13) ** 0.5], derivatives=["alpha"])
    assert np.isfinite(slope).all() and (slope != 0.0).any() and (value > 0.0).all()
