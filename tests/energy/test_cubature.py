"""Integrals over the sphere against closed forms."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.energy.albedo import cubature
from gonio.ops import backend
from gonio.verify import directions, subject

WO = directions.at(np.array([0.0, 40.0, 80.0, 89.5]), 10.0)


def test_the_sphere_has_its_area_and_a_cosine_its_half() -> None:
    one = subject.of(go.Lambert(0.5))
    area = cubature.integrate(one.sample, lambda o, i: ops.vec2(1.0 + 0.0 * i.z, ops.maximum(i.z, 0.0)), WO)
    np.testing.assert_allclose(area.value, np.tile([4.0 * np.pi, np.pi], (4, 1)), rtol=1e-9)


@pytest.mark.parametrize("alpha", [0.003, 0.05, 1.0])
def test_the_error_that_is_stated_covers_the_one_that_is_made(alpha: float) -> None:
    model = go.Conductor(alpha=alpha, fresnel="one")
    one = subject.of(model)
    found = cubature.integrate(one.sample, one.power(), WO, 1e-5)
    exact = go.albedo(model, mu=WO[:, 2], phi=np.radians(10.0)).value
    assert np.all(np.abs(found.value - exact) <= found.error + 2e-6)
    assert found.error.max() < 1e-3


def test_a_lobe_that_sampling_does_not_know_is_found_about_the_mirror_direction() -> None:
    class Blind(go.BSDF):
        """A narrow mirror lobe under the fall-back's cosine sampling."""

        def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
            return go.Conductor(alpha=0.01, fresnel="one").eval(wo, wi)

    one = subject.of(Blind())
    found = cubature.integrate(one.sample, one.power(), WO[1:2], 1e-4)
    assert found.value[0, 0] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("edge", [0.711119, 0.926114, 0.5])
def test_a_step_near_the_rim_of_cells_is_in_the_stated_error(edge: float) -> None:
    """Between the rim of a cell and the first of Gauss's nodes a step changes no rule of Gauss's."""

    def toon(o, i):  # type: ignore[no-untyped-def]
        return [ops.where(i.z > 0.0, i.z * ops.inv_pi * ops.where(i.z > edge, 1.0, 0.8), 0.0)]

    found = cubature.integrate(go.Lambert().sample, toon, WO[1:2], 1e-4)
    exact = 1.0 - 0.2 * edge**2
    assert abs(found.value[0, 0] - exact) < 2.0 * found.error[0, 0] + 1e-5
    assert found.error[0, 0] < 1e-3


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_the_stated_error_covers_steps_along_cells_and_across_them(tolerance: float) -> None:
    """Rings and sectors are divided along one coordinate only, a cap about a tilted axis along both."""
    axis = directions.at(np.array([35.0]), 200.0)[0]

    def ring(o, i):  # type: ignore[no-untyped-def]
        return [ops.where(i.z > 0.37, 1.0, 0.0)]

    def sectors(o, i):  # type: ignore[no-untyped-def]
        return [ops.where((i.z > 0.0) & (i.x * 0.6 + i.y * 0.8 > 0.0), i.z, 0.0)]

    def cap(o, i):  # type: ignore[no-untyped-def]
        return [ops.where(i.x * axis[0] + i.y * axis[1] + i.z * axis[2] > 0.9, 1.0, 0.0)]

    for integrand, exact in ((ring, 2.0 * np.pi * 0.63), (sectors, 0.5 * np.pi), (cap, 2.0 * np.pi * 0.1)):
        found = cubature.integrate(go.Lambert().sample, integrand, WO[1:3], tolerance)
        assert np.all(np.abs(found.value[:, 0] - exact) < found.error[:, 0] + 1e-9), integrand.__name__
        assert found.error.max() < 20.0 * tolerance


@pytest.mark.sample(1)
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_a_streak_is_resolved_to_its_dim_ends(share: float) -> None:
    """Along a streak that is a thousand times as long as wide, most of it lies between samples."""
    streak = go.Conductor(alpha=(0.0003, 0.2), rotation=5.352, fresnel="one")
    model = streak if share == 1.0 else go.mix(go.Lambert(0.6), streak, share)
    wo = directions.at(np.array([68.0, 88.0]), 37.0)
    one = subject.of(model)
    result = cubature.integrate(one.sample, one.power(), wo, 3e-4)
    for row, value in zip(wo, result.value[:, 0], strict=True):
        u = np.random.default_rng(2).random((1 << 17, 3))
        s = model.sample(np.tile(row, (len(u), 1)), u)
        weight = np.where(s.pdf > 0.0, s.weight[:, 0], 0.0)
        assert value == pytest.approx(weight.mean(), abs=4.0 * weight.std() / np.sqrt(len(u)) + 1e-3)


@pytest.mark.sample(1)
@pytest.mark.parametrize("ndf", ["beckmann", "ggx"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_the_stated_error_holds_what_no_sample_has_shown_of_a_streak(ndf: str, tolerance: float) -> None:
    """At grazing angles the streak is so thin that some of it lies in cells without a sample."""
    model = go.Conductor(alpha=(0.0003, 0.2), ndf=ndf, fresnel="one")
    wo = directions.at(np.array([60.0, 89.9]), 37.0)
    u = np.random.default_rng(2).random((1 << 19, 3))
    one = subject.of(model)
    result = cubature.integrate(one.sample, one.power(), wo, tolerance, seed=1)
    assert result.error.max() < 2e-3
    for row, value, error in zip(wo, result.value[:, 0], result.error[:, 0], strict=True):
        s = model.sample(row, u)
        weight = np.where(s.pdf > 0.0, s.weight[:, 0], 0.0)
        assert abs(value - weight.mean()) < error + 4.0 * weight.std() / np.sqrt(len(u))


def test_an_integral_far_above_1_takes_no_more_directions() -> None:
    one = subject.of(go.Conductor(alpha=0.05, fresnel="one"))
    power, counts, values = one.power(), [], []
    for factor in (1.0, 1e4):
        count = 0

        def scaled(wo: ops.Direction, wi: ops.Direction, factor: float = factor) -> list[ops.Scalar]:
            nonlocal count
            count += backend.drjit().width(wi)
            return [factor * channel for channel in power(wo, wi)]

        found = cubature.integrate(one.sample, scaled, WO, 1e-5)
        counts.append(count)
        values.append(found.value / factor)
    np.testing.assert_allclose(values[1], values[0], atol=3e-5)
    assert counts[1] < 1.5 * counts[0]
