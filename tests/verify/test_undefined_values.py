"""Values that are not finite hide no other mistake, and values that are far too large end a judgment in time."""

from __future__ import annotations

from typing import Any

import gonio as go
from gonio import ops
from gonio.verify import verify


class UndefinedAlongTheNormal(go.Conductor):
    """A metal that reflects four times as much, and NaN where wo is the normal."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return super().eval(wo, wi, mode) * ops.where(wo.z > 0.9999999, ops.sqrt(-wo.z), 4.0)


def test_a_gain_is_found_beside_values_that_are_not_finite() -> None:
    report = verify(
        UndefinedAlongTheNormal(alpha=0.4, fresnel="one"), quick=True, law=["positivity", "energy", "calls"]
    )
    assert report["positivity"].failed and report["energy"].failed and report["calls"].status == "pass"
    assert "gain" in report["energy"].why[0] and report["energy"].grade == "broken", report["energy"]
    assert any("count as 0" in note for note in report["energy"].notes)


class SingularLobe(go.Lambert):
    """A lobe that is infinite along a cone."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        value = super().eval(wo, wi, mode)
        return value / ops.maximum(ops.sqr(wi.z - 0.5), 1e-12)


def test_an_integral_that_is_far_too_large_ends() -> None:
    energy = verify(SingularLobe(0.5), quick=True, law="energy")["energy"]
    assert energy.failed and "gain" in energy.why[1], energy.why


def test_values_that_no_picture_shows_may_be_0_in_float32() -> None:
    from mutants.sixth.r1_classic import R1TinyNumbers

    assert verify(R1TinyNumbers(), quick=True, law="precision").passed
