"""The sentences of verdicts: numbers that can be told apart, limits in the figure's unit, one report per exception."""

from __future__ import annotations

import dataclasses
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.verify import verify
from gonio.verify.laws.pdf import Pdf
from gonio.verify.lobe_checks import distinct
from gonio.verify.run import decide
from gonio.verify.subject import of
from gonio.verify.verdict import FAIL, PASS, Card, Finding, Verdict


class BrighterAtNormal(go.Dielectric):
    """Smooth glass whose reflection exceeds that of Fresnel's equations toward the normal."""

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        s = super().sample(wo, u, mode)
        return s._replace(weight=s.weight * go.ops.where(wo.z * s.wi.z > 0.0, 1.0 + 2e-3 * go.ops.abs(wo.z), 1.0))


class OneRow(go.BSDF):
    """`eval` returns a single row, whatever it is asked."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return go.ops.vec3(0.1, 0.1, 0.1)

    def __getattribute__(self, name: str) -> Any:
        if name == "eval":
            return lambda wo, wi, mode="radiance", precision=None: np.full((1, 3), 0.1)
        return super().__getattribute__(name)


def test_numbers_have_the_digits_that_tell_them_apart() -> None:
    assert distinct(0.040001, 0.04) == ("0.040001", "0.04")
    assert distinct(0.5, 0.25) == ("0.5", "0.25")
    assert len(set(distinct(1.0, np.nextafter(1.0, 2.0)))) == 2


def test_fresnels_figures_differ() -> None:
    verdict = verify(BrighterAtNormal(1.5, 0.0), quick=True, law="delta")["delta"]
    (line,) = [line for line in verdict.why if "Fresnel's equations" in line]
    value, expected = line.split()[1], line.split("give ")[1].split()[0]
    assert verdict.failed and float(value) != float(expected), line


def test_a_limit_has_the_unit_of_the_figure() -> None:
    finding = Finding(1.835, 1e-3, "", shown="integral of the pdf = 2.835, wo at 0, 0 degrees", allowed="1.001")
    verdict = decide(Pdf(), of(go.Lambert()), finding, 1e-4, 1)
    assert verdict.why == ["integral of the pdf = 2.835, wo at 0, 0 degrees; at most 1.001 is allowed"]


def test_an_exception_that_several_laws_meet_is_reported_once() -> None:
    report = verify(of(OneRow()), quick=True, law=["reciprocity", "isotropy", "linearity"])
    failed = [verdict for verdict in report.cards[0].verdicts if verdict.failed]
    assert len(failed) == 3 and all("eval returned shape" in verdict.why[0] for verdict in failed)
    assert [verdict.cause for verdict in failed] == ["", *["a consequence of the failure of the reciprocity law"] * 2]
    assert str(report).count("eval returned shape") == 1


@pytest.mark.parametrize(("threshold", "same"), [(0.005, True), (0.0005, False), (0.05, False)])
def test_a_card_is_judged_again_only_where_a_p_value_lies_between(threshold: float, same: bool) -> None:
    card = Card(of(go.Lambert()), [], p_values=[0.001, 0.02, 0.9], threshold=0.01)
    assert card.decided_by(threshold) == same


def test_a_failure_without_a_known_cause_says_so() -> None:
    verdict = Verdict(3, "energy", "albedo <= 1", FAIL, figure=1.2)
    assert verdict.cause_in_words.startswith("unknown")
    assert dataclasses.replace(verdict, cause="the cosine twice").cause_in_words == "the cosine twice"
    assert dataclasses.replace(verdict, figure=None).cause_in_words == ""  # an exception tells itself
    assert dataclasses.replace(verdict, status=PASS).cause_in_words == ""
