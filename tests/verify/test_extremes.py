"""Where values beyond their range occur: parameter, random number, view."""

from __future__ import annotations

from typing import ClassVar

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.optics import warp
from gonio.verify import verify
from gonio.verify.forensics import extremes


class Sheet(go.BSDF):
    """Lambert with one fault, by name."""

    fault: ClassVar[str] = ""
    kd: go.Colour = go.spectrum(0.5, "albedo", low=0.0, high=1.0)
    gain: go.Number = go.number(1.0, "exponent", low=0.0, high=200.0)

    def eval(self, wo, wi, mode="radiance"):
        value = ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)
        if self.fault == "overflow":
            value = value * ops.exp(self.gain) / ops.exp(self.gain)
        return self.kd * value

    def pdf(self, wo, wi):
        density = ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)
        return density * ops.mean(self.kd) / ops.mean(self.kd) if self.fault == "black" else density

    def sample(self, wo, u, mode="radiance"):
        wi = warp.square_to_cosine_hemisphere(u.y, u.z)
        pdf = self.pdf(wo, wi)
        if self.fault == "u":
            pdf = pdf * ops.log(u.x) / ops.log(u.x)
        return go.Sample.of_density(wi, self.eval(wo, wi) * ops.safe_div(1.0, pdf), pdf)


def cause(fault: str) -> str:
    target = type(fault.title(), (Sheet,), {"fault": fault, "__annotations__": {"fault": ClassVar[str]}})()
    (verdict,) = verify(target, law=["positivity"], quick=True).failures
    return verdict.cause


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("overflow", "only for gain = 200; possible mistake: an overflow"),
        ("black", "only for kd = 0; possible mistake: a division by it"),
        ("u", "only where the first random number is 0; possible mistake: a logarithm of u"),
    ],
)
def test_the_parameter_or_the_random_number_is_named(fault: str, words: str) -> None:
    assert words in cause(fault)


def test_a_number_is_named_only_if_it_alone_is_bad() -> None:
    u = np.array([[0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [0.5, 0.5, 0.0], [0.5, 0.5, 0.5]])
    second = np.array([False, True, False, False])
    found = extremes.of_numbers([("weight", second, u)], (0.0,), "not finite")
    assert found is not None and "weight is not finite, but only where the second random number is 0" in found.words
    assert extremes.of_numbers([("weight", second | (u[:, 2] == 0.0), u)], (0.0,), "not finite") is None
    assert extremes.of_numbers([("pdf", second, None)], (0.0,), "not finite") is None


def test_views_beyond_the_critical_angle_are_named() -> None:
    angle = np.radians(np.linspace(0.0, 180.0, 181))
    wo = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=-1)
    below = (wo[:, 2] < 0.0) & (np.abs(wo[:, 2]) < np.cos(np.radians(41.8)))
    found = extremes.of_views("weight", wo, below, "not finite", transmits=True)
    assert (
        found is not None
        and "only for wo below the surface, 42 degrees or more from the normal; possible reason: total internal"
        in found.words
    )
    assert extremes.of_views("weight", wo, below | (wo[:, 2] > 0.5), "not finite", transmits=True) is None
