"""Mistakes by people who had not read the laws, and sound materials that look strange; see `tests/mutants`."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from gonio.verify import verify
from gonio.verify.severity import Grade

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from referee import Case, cases

ALL = cases()
# what no trial of values can tell, and why
MISSES = {
    "second.delta.CoatWeightUnshared": "a coat that is dimmer by a constant is a tinted one",
    "second.numerical.GlassMatched": "black at index 1 alone, which is no offence; beside it it is right",
    "second.transmitting.GlassNormalForDense": "glass that lets nothing through below index 1, and claims no furnace",
    "seventh.w5_sheets.W5WireMesh": "light through holes that is mirrored at the plane, and reciprocal",
    "fifth.plugins.StalePlastic": "only a change of its parameters while it lives would tell",
}
# right ones that fail, and why
ALARMS = {
    "fifth.toon.ToonHighlightDisk": "the cells of the test do not resolve a disk of radius 0.001 with a hard rim",
    "fifth.delta_and_thin.NegativeGlass": "a negative index refracts to the side to which a sign error would",
}
# one of each kind, whose law is fast
FEW = (
    "first.smooth.MatteCosineTwice",
    "first.plugins.EvalPdfBare",
    "second.delta.MirrorDeclaredNever",
    "second.plugins.GlassOneComponent",
    "third.smooth.ImportanceTakesOtherCosine",
    "third.corners.NoTangentAtTheNormal",
    "third.corners.UniformChoice",
    "fourth.plugins.RegularizedForGood",
    "second.sound.CornerCube",
    "second.sound.Grating",
    "fifth.delta_and_thin.SwapMirror",
)


def by_name(name: str) -> Case:
    return next(case for case in ALL if case.name == name)


def test_there_are_enough_of_both() -> None:
    assert sum(not case.sound for case in ALL) >= 120
    assert sum(case.sound for case in ALL) >= 40
    assert all(case.fault for case in ALL if not case.sound)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", FEW)
def test_a_mistake_is_caught_and_a_sound_material_passes(name: str) -> None:
    case = by_name(name)
    report = verify(case.target, quick=True)  # type: ignore[arg-type]
    assert report.passed == case.sound, f"{case.fault}\n{report}"


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "law", "words"),
    [
        ("fifth.microfacets.GGXClockwise", "isotropy", "if axes and directions rotate together"),
        ("fifth.plugins.PhongComponent", "calls", "samples of component 0 alone do not follow its pdf"),
    ],
)
def test_what_one_law_alone_tells(name: str, law: str, words: str) -> None:
    verdict = verify(by_name(name).target, quick=True, law=law)[law]  # type: ignore[arg-type]
    assert verdict.failed and words in " ".join(verdict.why), verdict.why


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("sixth.r2_panes.R2StainedGlass", "delta"),  # Beer's law on the denser side
        ("sixth.r1_steps.R1SkewedSampler", "isotropy"),  # isotropic values, sampled along axes
        ("sixth.r2_nested.R2Varnish", "linearity"),  # light passes the varnish twice
    ],
)
def test_what_one_law_alone_took_for_a_mistake(name: str, law: str) -> None:
    assert verify(by_name(name).target, quick=True, law=law).passed  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize("case", ALL, ids=lambda case: case.name)
def test_every_mistake_is_caught_and_no_sound_material_fails_visibly(case: Case) -> None:
    report = verify(case.target)  # type: ignore[arg-type]
    if case.sound and case.name not in ALARMS:
        assert not [v for v in report.failures if v.grade is not Grade.INVISIBLE], str(report)
    else:
        assert report.passed == (case.name in MISSES), f"{case.fault}\n{report}"


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "law", "seed"),
    [
        ("sixth.r2_scatter.R2WireGrid", "delta", 10),  # a lobe so dim that it may be missed
        ("sixth.r2_plugins.R2Splitter", "calls", 12),  # two lobes that are close together at grazing views
    ],
)
def test_a_sound_material_passes_at_the_seed_at_which_it_once_failed(name: str, law: str, seed: int) -> None:
    assert verify(by_name(name).target, quick=True, law=law, seed=seed).passed  # type: ignore[arg-type]
