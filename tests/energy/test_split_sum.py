"""The split sum: prefiltered maps against brute force, and F0 A + B against the albedo itself."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.energy.albedo import quadrature
from gonio.energy.tables import bake, split_sum
from gonio.ops import backend

HEIGHT, WIDTH = 64, 128


def directions(height, width):
    """Texel centres of a latitude-longitude map, z up, row 0 toward +z; and their solid angles."""
    theta = (np.arange(height)[:, None] + 0.5) / height * np.pi
    phi = (np.arange(width)[None] + 0.5) / width * 2 * np.pi
    w = np.stack(np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)), -1)
    edges = np.cos(np.arange(height + 1) / height * np.pi)
    return w, np.broadcast_to((edges[:-1] - edges[1:])[:, None] * 2 * np.pi / width, (height, width))


def environment():
    """A lamp off the axes, a ring of light about x, and a gradient, in three colours."""
    w, _ = directions(HEIGHT, WIDTH)
    lamp = np.exp(-40.0 * (1.0 - w @ np.array([0.48, 0.6, 0.64])))
    return np.stack([0.2 + 5.0 * lamp, 0.5 + 0.4 * np.sin(3.0 * np.arccos(w[..., 0])), 1.0 + 0.6 * w[..., 2]], -1)


def by_brute_force(light, n, alpha):
    """int L i.n D(h) di / int i.n D(h) di at o = n over every texel (Karis2013)."""
    w, solid = directions(HEIGHT, WIDTH)
    cos = w @ n
    h = w + n
    h_n = (h @ n) / np.maximum(np.linalg.norm(h, axis=-1), 1e-9)
    density = alpha**2 / (h_n**2 * (alpha**2 - 1.0) + 1.0) ** 2
    weight = np.where(cos > 0.0, cos * density * solid, 0.0)
    return (light * weight[..., None]).sum((0, 1)) / weight.sum()


def test_prefiltered_maps_agree_with_brute_force():
    light = environment()
    levels = split_sum.prefilter(light, 5, 512)
    assert [level.shape for level in levels] == [(64, 128, 3), (32, 64, 3), (16, 32, 3), (8, 16, 3), (4, 8, 3)]
    np.testing.assert_array_equal(levels[0], light)
    for index in (2, 3, 4):  # at 1 the lobe is narrower than a few texels
        alpha = (index / 4) ** 2
        n, _ = directions(*levels[index].shape[:2])
        exact = np.array([[by_brute_force(light, v, alpha) for v in row] for row in n])
        assert np.abs(levels[index] - exact).max() < 0.02, index
        assert np.sqrt(np.mean((levels[index] - exact) ** 2)) < 0.01, index


def test_a_constant_environment_stays_constant_when_prefiltered():
    for level in split_sum.prefilter(np.full((16, 32, 3), 0.7), 4, 64):
        np.testing.assert_allclose(level, 0.7)


def test_a_prefiltered_map_knows_up_from_down_and_left_from_right():
    for axis in ((0, 0, 1), (0, 0, -1), (1, 0, 0), (0, 1, 0), (0, -1, 0)):
        w, _ = directions(HEIGHT, WIDTH)
        light = np.maximum(w @ np.array(axis), 0.0)[..., None]
        for level in split_sum.prefilter(light, 4, 128):
            n, _ = directions(*level.shape[:2])
            brightest = n.reshape(-1, 3)[np.argmax(level)]
            assert brightest @ np.array(axis) > 0.8


def test_rougher_levels_are_smoother():
    spread = [level[..., 0].std() for level in split_sum.prefilter(environment(), 5, 256)]
    assert np.all(np.diff(spread) < 0)


def test_bad_maps_are_refused():
    for shape, more in (((4, 8), {}), ((4, 8, 3), {"levels": 1}), ((4, 8, 3), {"samples": 0})):
        with pytest.raises(go.InputError):
            split_sum.prefilter(np.ones(shape), **more)


@pytest.mark.parametrize("masking", ["smith-correlated", "schlick-direct"])
@pytest.mark.parametrize("ndf", ["ggx", "beckmann"])
def test_f0_a_plus_b_is_the_albedo_with_schlicks_fresnel(ndf, masking):
    baked = bake.bake(ndf, ["dfg"], size=8, masking=masking)
    for f0 in (0.04, 0.5, 1.0):
        metal = go.Conductor(*_index(f0), ndf=ndf, masking=masking, fresnel="schlick")
        exact = bake.bake(metal, ["E"], size=8).arrays["E"][..., 0]
        np.testing.assert_allclose(baked.arrays["dfg"] @ [f0, 1.0], exact, atol=1e-6)


@pytest.mark.parametrize("alpha", [0.02, 0.3, 1.0])
def test_the_table_that_shaders_read_is_met_between_its_nodes(alpha):
    kind = backend.types("float64")
    f0 = 0.3
    metal = go.Conductor(*_index(f0), alpha=alpha, fresnel="schlick")
    bound = metal.bind(kind)
    for mu in (0.07, 0.31, 0.62, 0.97):
        whole = quadrature.moments("ggx", "smith-correlated", mu, alpha)
        wo = kind.vec3(float(np.sqrt(1 - mu * mu)), 0.0, mu)
        found = split_sum.reflected(bound, kind.vec3(f0, f0, f0), kind.float(float(whole.whole)), wo)
        exact = f0 * (whole.whole - whole.schlick) + whole.schlick
        assert found.x[0] == pytest.approx(float(exact), abs=3e-4)


def _index(f0):
    """(eta, k) of a metal with that reflectance at normal incidence, k = 0."""
    root = np.sqrt(min(f0, 1.0 - 1e-12))
    return float((1 + root) / (1 - root)), 0.0
