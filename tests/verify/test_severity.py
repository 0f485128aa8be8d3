"""What a failure does to a picture: against closed forms, and graded as docs/verify.md says."""

from __future__ import annotations

import json
from typing import Any, ClassVar

import gonio as go
import numpy as np
import pytest
from gonio.material import Sample
from gonio.ops import where
from gonio.verify import estimators, severity, verify
from gonio.verify.severity import Bias, Grade
from gonio.verify.subject import of

from broken.facets import HalfVectorPdf, NoMasking, RightFacets
from broken.surfaces import (
    CosineTwice,
    HalfTheHemisphere,
    NanAtTheNormal,
    NoCosine,
    NoLobeProbability,
    OnePercentMore,
    OtherLobeWeights,
    RightDiffuse,
    RightLobes,
    RowAverage,
)


class Brighter(RightDiffuse):
    """eval is 5 % more than what `sample` weighs."""

    factor: ClassVar[float] = 1.05

    def _shape(self, wo: Any, wi: Any) -> Any:
        return self.factor * RightDiffuse._shape(self, wo, wi)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        s = RightDiffuse.sample(self, wo, u)
        return s._replace(weight=self.albedo * where(s.pdf > 0.0, 1.0, 0.0))


class ABitBrighter(Brighter):
    """The same by a two-thousandth."""

    factor = 1.0005


class PdfBelow(RightDiffuse):
    """pdf claims a tenth of all samples below the surface, and says the truth above it."""

    def pdf(self, wo: Any, wi: Any) -> Any:
        return RightDiffuse.pdf(self, wo, wi) + where((wo.z > 0.0) & (wi.z < 0.0), 0.1 * abs(wi.z) / np.pi, 0.0)


def sampling(material: go.BSDF, part: estimators.Part = "all") -> Bias:
    return estimators.sampling_bias(of(material), part)


def test_views_are_shares_of_the_hemisphere() -> None:
    for sides in ((1,), (1, -1)):
        wo, mass = severity.views(sides)
        assert mass.sum() == pytest.approx(1.0) and len(wo) == 16 * len(sides)
        # the cosine-weighted mean of the cosine is 2/3
        assert mass @ np.abs(wo[:, 2]) == pytest.approx(2.0 / 3.0, abs=5e-3)


@pytest.mark.sample(1)
@pytest.mark.parametrize("sound", [RightDiffuse, RightFacets, RightLobes, go.Mirror, go.TwoSided])
def test_a_sound_material_has_no_bias(sound: type) -> None:
    material = sound(go.Lambert()) if sound is go.TwoSided else sound()
    bias = sampling(material)
    assert bias.grade is Grade.INVISIBLE and bias.average < 3e-4


@pytest.mark.slow
def test_brighter_eval_than_weight() -> None:
    bias = sampling(Brighter())
    assert bias.average == pytest.approx(0.05 / 1.05, rel=0.02) and bias.kind == "lost"
    assert bias.worst == pytest.approx(bias.average, rel=0.02) and bias.share == pytest.approx(1.0)
    assert bias.grade is Grade.VISIBLE and "a loss of 4.8 % of the reflected light" in bias.words
    assert sampling(ABitBrighter()).grade is Grade.INVISIBLE


@pytest.mark.slow
def test_the_fault_is_told_apart_by_weights_and_pdf() -> None:
    assert sampling(Brighter(), "weights").average > 0.04 and sampling(Brighter(), "pdf").average < 1e-3
    assert sampling(HalfVectorPdf(), "pdf").average > 0.5 and sampling(HalfVectorPdf(), "weights").average < 1e-3


@pytest.mark.slow
def test_half_a_hemisphere_loses_half_where_only_samples_are_followed() -> None:
    bias = sampling(HalfTheHemisphere())
    assert bias.average == pytest.approx(0.5, abs=0.01) and bias.kind == "lost"
    assert bias.both is not None and bias.both < 1e-3  # light samples find the other half


def test_the_lobes_probability() -> None:
    # the diffuse lobe's samples are found 1.1 times as often, the narrow one's .9 times, against the pdf's half each
    found = estimators.estimate(of(OtherLobeWeights()))
    c = (np.arange(4000) + 0.5) / 4000
    wide, narrow = c / np.pi, 21.0 / (2.0 * np.pi) * c**20
    expected = np.mean(0.8 * 2.0 * c * (0.55 * wide + 0.45 * narrow) / (0.5 * (wide + narrow)))
    assert np.allclose(found.sampled[:3], expected, rtol=3e-3)
    assert np.allclose(found.value, 0.8, rtol=1e-3)


@pytest.mark.slow
def test_weights_without_bound_are_noise() -> None:
    # E[eval / pdf of the lobe picked] is int eval: nothing is lost, but the narrow lobe's weights go as cos^-19
    bias = sampling(NoLobeProbability(), "weights")
    assert bias.grade is Grade.NOISE and "individual samples carry more than" in bias.words


def test_reciprocity_has_its_closed_form() -> None:
    # f = mu_i / pi: int |mu_i - mu_o| mu_i / int mu_i^2 = 1 - 3/2 mu_o + mu_o^3, and 2/5 on average
    bias = verify(CosineTwice(), quick=True, law=["reciprocity"])["reciprocity"].bias
    assert bias is not None and bias.average == pytest.approx(0.4, rel=0.02)
    assert bias.worst == pytest.approx(1.0 - 1.5 * np.cos(np.radians(89.5)), rel=0.01) and bias.kind == "bias"


@pytest.mark.slow
def test_gain_and_loss_of_the_furnace() -> None:
    verdict = verify(OnePercentMore(), quick=True, law=["energy"])["energy"]
    assert verdict.bias is not None and verdict.bias.kind == "gained"
    assert verdict.bias.average == pytest.approx(0.01, rel=0.1) and verdict.grade in (Grade.SMALL, Grade.VISIBLE)
    assert any(note.startswith("gain in a white furnace: 0.0100 on average") for note in verdict.notes), verdict.notes
    lost = verify(RowAverage(), quick=True, law=["energy"])["energy"].bias
    assert lost is not None and lost.kind == "lost" and 0.02 < lost.average < 0.2
    grazing = verify(NoMasking(), quick=True, law=["energy"])["energy"].bias
    assert grazing is not None and grazing.worst > 1.0 and "89.5 degrees" in grazing.where


@pytest.mark.slow
def test_mass_of_the_pdf_where_no_sample_falls_is_noise() -> None:
    bias = sampling(PdfBelow(), "pdf")
    assert bias.grade is Grade.INVISIBLE
    from gonio.verify.laws.pdf import Pdf
    from gonio.verify.verdict import Finding

    told = Pdf().bias(of(PdfBelow()), Finding(0.1, 1e-3, ""), None, 1)  # type: ignore[arg-type]
    assert (
        told.grade is Grade.NOISE
        and "the integral of the pdf exceeds the fraction of valid samples by 10 %" in told.words
    )


def test_nan_is_a_grade_of_its_own() -> None:
    verdict = verify(NanAtTheNormal(), quick=True, law=["positivity"])["positivity"]
    assert verdict.grade is Grade.NAN and verdict.bias is not None and "isolated directions" in verdict.bias.words
    assert "wo is the normal" in verdict.cause


@pytest.mark.parametrize(
    ("average", "worst", "grade"),
    [
        (0.0009, 0.009, Grade.INVISIBLE),
        (0.0009, 0.02, Grade.SMALL),
        (0.009, 0.09, Grade.SMALL),
        (0.02, 0.09, Grade.VISIBLE),
        (0.009, 0.2, Grade.VISIBLE),
        (0.2, 0.3, Grade.BROKEN),
        (0.01, 3.0, Grade.BROKEN),
    ],
)
def test_grades(average: float, worst: float, grade: Grade) -> None:
    assert Bias(worst, average, 1.0, "", "bias").grade is grade


def test_an_effect_of_nothing_is_none() -> None:
    assert Bias(0.0, 0.0, 0.0, "wo at 1 degree", "bias").words == "none"
    assert "on average" in Bias(1e-9, 0.0, 0.0, "wo at 1 degree", "bias").words


@pytest.mark.slow
def test_the_report_holds_grades_and_a_sound_one_none() -> None:
    report = verify([Brighter(), go.Lambert(0.5)], law=["weight", "energy"])
    wrong, right = json.loads(json.dumps(report.as_dict()))["cards"]
    weight = next(v for v in wrong["verdicts"] if v["law"] == "weight")
    assert weight["grade"] == "visible" and weight["bias"]["kind"] == "lost" and weight["cause"]
    assert all(v["grade"] is None and v["bias"] is None and v["cause"] == "" for v in right["verdicts"])
    text = str(report)
    assert "FAIL visible" in text and "effect" in text and "a consequence of the failure of the weight law" in text


@pytest.mark.slow
def test_a_declared_breach_is_graded_too() -> None:
    verdict = verify(go.Phong(), law=["reciprocity"])["reciprocity"]
    assert verdict.status == "breaks as declared" and verdict.grade is not None


@pytest.mark.slow
def test_what_is_held_is_judged_alone() -> None:
    verdict = verify(go.mix(go.Lambert(), NoCosine(), 0.5), quick=True, law=["reciprocity"])["reciprocity"]
    assert (
        verdict.failed
        and verdict.grade is Grade.INNER
        and "with a correct material in its place, the law holds" in verdict.cause
    )


@pytest.mark.slow
def test_a_tilted_frame_breaks_isotropy_by_nature() -> None:
    verdict = verify("mitsuba:bumpmap", quick=True, law=["isotropy"])["isotropy"]
    assert verdict.failed and verdict.grade is Grade.BY_NATURE and "tilted" in verdict.cause
