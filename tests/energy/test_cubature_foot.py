"""The quadrature sees the foot of a narrow lobe that reaches into a cell far wider than the lobe."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.energy.albedo import cubature
from gonio.verify import directions, subject


@pytest.mark.parametrize("alpha", [3e-4, 1e-3])
def test_a_narrow_beckmann_lobe_reflects_all_that_comes(alpha: float) -> None:
    mirror = subject.of(go.Conductor(alpha=alpha, ndf="beckmann", fresnel="one"))
    wo = directions.single(directions.at(np.array([33.56, 60.0, 75.0]), 37.0))
    found = cubature.integrate(mirror.sample, mirror.power(), wo, 3e-5)
    assert np.abs(found.value - 1.0).max() < 1e-4
