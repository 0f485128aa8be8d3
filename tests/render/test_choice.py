"""Choosing among running sums: short rows and long ones give what NumPy's search does."""

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.transport.lights import sky


@pytest.mark.sample(1)
@pytest.mark.parametrize("count", [2, sky.SHORT, 256])
def test_a_number_falls_between_the_sums_around_it(count):
    mi, rng = engine.load(), np.random.default_rng(count)
    chances = rng.random((5, count)) ** 8  # from all but nothing to nearly all
    chances[1] = 0.0
    chances[1, count // 2] = 1.0  # one step holds all, the others nothing
    chances[2, count // 2 :] = 0.0  # as rows of lamps are filled up
    sums = np.cumsum(chances, axis=1)
    sums /= sums[:, -1:]
    row = rng.integers(0, 5, 20_000)
    u = rng.random(20_000).astype(np.float32)
    u[:3] = 0.0, 1.0, np.float32(1 - 2**-24)
    at, into = (np.array(x) for x in sky.Choice(mi, sums).of(mi.UInt32(row), mi.Float(u)))
    at = at.astype(int)
    sums = sums.astype(np.float32)
    expected = [min(np.searchsorted(sums[r], x, side="right"), count - 1) for r, x in zip(row, u, strict=True)]
    assert np.array_equal(at, expected)
    low, high = np.where(at > 0, sums[row, at - 1], 0), sums[row, at]
    assert np.all((low <= u) & ((u < high) | (u == 1)))
    some = high > low
    assert some[3:].all()  # a step without a chance is never chosen, but by u = 1
    assert into[some] == pytest.approx(((u - low) / np.where(some, high - low, 1))[some], abs=1e-4)
    assert np.all((into >= 0) & (into <= 1))
