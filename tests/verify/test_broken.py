"""The law that the verifier can fail: every classic mistake is caught, and by the law that is meant to catch it."""

from __future__ import annotations

import gonio as go
import pytest
from gonio.verify import verify

from broken.facets import FACETS
from broken.glass import GLASS
from broken.limits import LIMITS
from broken.surfaces import SURFACES
from broken.third_edition import THIRD

CONTROLS = [*FACETS, *SURFACES, *GLASS, *LIMITS, *THIRD]
BROKEN = [cls for cls in CONTROLS if cls.caught_by]
SOUND = [cls for cls in CONTROLS if not cls.caught_by]


def test_there_are_enough_controls_and_every_judging_law_has_one() -> None:
    assert len(BROKEN) >= 20
    caught = {cls.caught_by for cls in BROKEN}
    expected = {
        "positivity",
        "reciprocity",
        "energy",
        "pdf",
        "weight",
        "isotropy",
        "linearity",
        "gradients",
        "precision",
        "limits",
    }
    assert caught == expected


LONG = {"BelowTheHorizon", "AreaOfOneWidth"}  # both hemispheres; a guide per pair of widths
CONTROLS = [pytest.param(cls, marks=pytest.mark.slow) if cls.__name__ in LONG else cls for cls in BROKEN]


@pytest.mark.sample(1)
@pytest.mark.parametrize("control", CONTROLS, ids=lambda cls: cls.__name__)
def test_the_mistake_is_caught_by_the_law_meant_to_catch_it(control: type) -> None:
    report = verify(control(), quick=True, law=[control.caught_by])
    verdict = report[control.caught_by]
    assert verdict.failed and not report.passed
    assert report.exit_code == (4 if verdict.grade == "invisible" else 1)
    assert verdict.why and verdict.command and verdict.meaning


@pytest.mark.slow
@pytest.mark.parametrize(
    "control",
    # rough glass is judged whole among the models too, and takes longest
    [
        pytest.param(cls, marks=pytest.mark.slow if cls in THIRD or cls.__name__ == "RightGlass" else ())
        for cls in SOUND
    ],
    ids=lambda cls: cls.__name__,
)
def test_the_sound_twin_passes_every_law(control: type) -> None:
    report = verify(control(), quick=True)
    assert report.passed, str(report)


def test_a_mistake_in_an_inner_material_is_caught_too() -> None:
    inner = next(cls for cls in BROKEN if cls.caught_by == "gradients" and cls in FACETS)
    verdict = verify(go.mix(go.Lambert(), inner(), 0.5), quick=True, law=["gradients"])["gradients"]
    assert verdict.failed and "b.alpha" in str(verdict.worst)
