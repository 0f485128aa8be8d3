"""Sample points: nets, means, independence."""

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.transport import sampler

mi = engine.load()
import drjit as dr  # noqa: E402  (after `load` has chosen an LLVM)


def points(name: str, count: int, pixel: int = 7, seed: int = 3, dimension: int = 5, first: int = 0) -> np.ndarray:
    key = sampler.pixel_key(mi.UInt32(pixel), mi.UInt32(seed))
    x, y = sampler.PAIRS[name](key, dr.arange(mi.UInt32, first, first + count), dimension)
    return np.stack([np.array(x), np.array(y)], axis=1)


@pytest.mark.parametrize("m", [1, 4, 6, 8, 10])
@pytest.mark.parametrize("block", [0, 1, 5])
def test_every_aligned_block_of_sobol_points_is_a_net(m: int, block: int) -> None:
    """Each dyadic rectangle of area 2^-m holds exactly one of 2^m points: a (0, m, 2)-net in base 2."""
    for pixel in range(5):
        u = points("sobol", 2**m, pixel=pixel, first=block * 2**m)
        for k in range(m + 1):
            column, row = (u[:, 0] * 2**k).astype(int), (u[:, 1] * 2 ** (m - k)).astype(int)
            assert len(set(zip(column, row, strict=True))) == 2**m


def test_the_net_test_would_catch_independent_points() -> None:
    u = (points("independent", 64) * 8).astype(int)
    assert len(set(map(tuple, u))) < 64


def test_second_sobol_dimension_is_the_pascal_matrix() -> None:
    """Against the direction numbers of the second Sobol dimension: v_1 = 1/2, v_{j+1} = v_j xor v_j/2."""
    direction = [1 << 31]
    for _ in range(31):
        direction.append(direction[-1] ^ (direction[-1] >> 1))
    rng = np.random.default_rng(1)
    for index in rng.integers(0, 2**32, 50):
        expected = 0
        for bit in range(32):
            if int(index) >> bit & 1:
                expected ^= direction[bit]
        assert int(dr.brev(sampler.pascal(mi.UInt32(int(index))))[0]) == expected


@pytest.mark.parametrize("name", sampler.PAIRS)
def test_points_lie_in_the_unit_square_with_the_right_mean(name: str) -> None:
    key = sampler.pixel_key(dr.arange(mi.UInt32, 1 << 18), mi.UInt32(11))
    u = np.stack([np.array(c, np.float64) for c in sampler.PAIRS[name](key, mi.UInt32(3), 2)])
    assert u.min() >= 0 and u.max() < 1
    # Means and correlation of 2^18 numbers have sigma (1/sqrt 12)/512 and 1/512; five of them.
    assert np.abs(u.mean(axis=1) - 0.5).max() < 5 * 0.2887 / 512
    assert abs(np.corrcoef(u)[0, 1]) < 5 / 512


@pytest.mark.parametrize("name", sampler.PAIRS)
@pytest.mark.parametrize("other", [{"pixel": 8}, {"seed": 4}, {"dimension": 6}])
def test_pixels_seeds_and_dimensions_are_decorrelated(name: str, other: dict[str, int]) -> None:
    correlations = []
    for start in range(12):
        at = {"pixel": 2 * start, "seed": 3, "dimension": 5}
        a, b = points(name, 256, **at), points(name, 256, **(at | other | {"pixel": 2 * start + ("pixel" in other)}))
        correlations += [np.corrcoef(a[:, i], b[:, j])[0, 1] for i in (0, 1) for j in (0, 1)]
    # 48 correlations of 256 pairs: sigma of each about 1/16, of their mean 1/(16 sqrt 48); five of them.
    assert np.abs(np.mean(correlations)) < 5 / 16 / np.sqrt(48)
    assert np.abs(correlations).max() < 5 / 16


def test_sobol_error_falls_faster_than_one_over_n() -> None:
    """Mean square error of a smooth integral: 1/n for independent points, far below for scrambled nets."""

    def error(name: str, n: int) -> float:
        values = [np.mean(np.prod(points(name, n, pixel=p) ** 2, axis=1)) - 1 / 9 for p in range(40)]
        return float(np.mean(np.square(values)))

    assert error("sobol", 64) < error("independent", 64) / 50
    assert error("sobol", 48) < error("independent", 48) / 5  # no power of two: still far better


@pytest.mark.parametrize("block", [0, 1, 5])
@pytest.mark.parametrize("m", [3, 6, 9])
def test_every_aligned_block_of_lattice_points_is_a_lattice(m: int, block: int) -> None:
    """The difference of any two of 2^m points is a multiple of (1, slope) / 2^m, in both coordinates mod 1."""
    u = points("lattice", 2**m, first=block * 2**m)
    steps = (u - u[0]) * 2**m
    k = np.rint(steps[:, 0]).astype(int) % 2**m
    assert sorted(k) == list(range(2**m))
    np.testing.assert_allclose(steps[:, 0] - np.rint(steps[:, 0]), 0.0, atol=2**m * 2.0**-23)
    off = (steps[:, 1] - k * (sampler.SLOPE % 2**m)) / 2**m
    np.testing.assert_allclose(off - np.rint(off), 0.0, atol=2.0**-22)


@pytest.mark.parametrize("n", [16, 24, 64, 100])
def test_lattices_err_least_for_what_is_smooth_all_round(n: int) -> None:
    def error(name: str) -> float:
        u = np.array([points(name, n, pixel=p) for p in range(60)])
        values = np.exp(np.cos(2 * np.pi * u[..., 0]) + np.sin(2 * np.pi * u[..., 1])).mean(axis=1)
        return float(np.mean((values - np.i0(1.0) ** 2) ** 2))

    assert error("lattice") < error("sobol") / 2


def test_the_callers_arrays_are_left_alone() -> None:
    key, index = mi.UInt32([1, 2]), mi.UInt32([5, 6])
    sampler.sobol_pair(key, index, 3)
    sampler.lattice_pair(key, index, 3)
    assert list(key) == [1, 2] and list(index) == [5, 6]


def test_every_sampler_is_documented() -> None:
    assert set(sampler.SAMPLERS) == set(sampler.PAIRS) and set(sampler.DEFAULT) <= set(sampler.PAIRS)
