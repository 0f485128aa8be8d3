"""Verdicts: declared breaches, Sidak's correction, confirmation, isolation of failures, the files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, ClassVar

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.errors import InputError
from gonio.material import KnownViolation
from gonio.verify import page, report, verify
from gonio.verify.laws import Law, chosen
from gonio.verify.run import decide
from gonio.verify.subject import of
from gonio.verify.verdict import DECLARED, PASS, Card, Finding, Trial, Verdict


class Idle(Law):
    """A law of no consequence."""

    number, name, title, meaning = 99, "energy", "a law", "nothing"


def finding(figure: float = 0.0, **more: Any) -> Finding:
    return Finding(figure=figure, tolerance=0.1, reason="because", **more)


def verdict(found: Finding, breaks: dict[str, KnownViolation] | None = None, threshold: float = 1e-3) -> Verdict:
    class Declares(go.Lambert):
        """Lambert with declared breaches."""

    Declares.known_violations = breaks or {}
    return decide(Idle(), of(Declares(0.5)), found, threshold, 1)


def test_a_figure_within_its_tolerance_passes_and_one_over_it_fails() -> None:
    assert verdict(finding(0.1)).status == "pass"
    assert verdict(finding(0.2)).status == "fail"
    assert verdict(finding(np.nan)).status == "fail"


def test_a_rejection_counts_only_when_a_second_seed_confirms_it() -> None:
    chance = verdict(finding(trials=[Trial(1e-6, "here", lambda: 0.4)]))
    assert chance.status == "pass" and "chance" in chance.notes[0]
    true = verdict(finding(trials=[Trial(1e-6, "here", lambda: 1e-5)]))
    assert true.status == "fail" and "here" in true.why[0]


def test_a_p_value_over_the_corrected_threshold_is_not_asked_again() -> None:
    def never() -> float:
        raise AssertionError

    assert verdict(finding(trials=[Trial(0.005, "here", never)])).status == "pass"


def test_a_declared_breach_is_no_failure_unless_it_is_larger_or_absent() -> None:
    declared = {"energy": KnownViolation("by nature", 0.5)}
    assert verdict(finding(0.4), declared).status == "breaks as declared"
    larger = verdict(finding(0.8), declared)
    assert larger.status == "fail" and "exceeds the declared" in larger.why[0]
    absent = verdict(finding(0.0), declared)
    assert absent.status == "fail" and "but the law holds" in absent.why[0]
    assert verdict(finding(0.0), {"energy": KnownViolation("maybe", 0.5, certain=False)}).status == "pass"
    none, of_size_0 = (verdict(finding(0.8), one) for one in ({}, {"energy": KnownViolation("by nature", 0.0)}))
    assert none.status == of_size_0.status == "fail" and len(none.why) == 1 and "with size 0" in of_size_0.why[1]


class Bright(go.Lambert):
    """Lambert with 1.3 times its light."""

    def eval(self, wo: Any, wi: Any, mode: Any = "radiance") -> Any:
        return super().eval(wo, wi, mode) * 1.3


def test_a_gain_of_the_lossless_variant_alone_is_called_that() -> None:
    dim, bright = (verify(Bright(albedo), quick=True, law="energy")["energy"] for albedo in (0.1, 1.0))
    assert dim.shown.startswith(("gain 0.29", "gain 0.30")) and dim.shown.endswith(" in a white furnace")
    assert "lossless" not in bright.shown


def test_a_statistical_rejection_is_never_what_was_declared() -> None:
    declared = {"energy": KnownViolation("by nature", 0.5)}
    both = finding(0.4, trials=[Trial(1e-6, "here", lambda: 1e-6)])
    assert verdict(both, declared).status == "fail"


@pytest.mark.slow
def test_the_threshold_is_corrected_over_the_whole_report() -> None:
    one = verify(go.Lambert(0.5), quick=True, law=["pdf"])
    two = verify([go.Lambert(0.5), go.Lambert(0.6)], quick=True, law=["pdf"])
    assert two.tests == 2 * one.tests
    assert 1.0 - (1.0 - two.threshold) ** two.tests == pytest.approx(report.SIGNIFICANCE)


def test_phong_breaks_what_it_declares_and_exits_with_0() -> None:
    found = verify(go.Phong(), quick=True, law=["reciprocity", "energy"])
    assert [v.status for v in found.cards[0].verdicts] == ["breaks as declared"] * 2
    assert found.passed and found.exit_code == 0
    dim = verify(go.Phong(kd=0.1, ks=0.0), quick=True, law=["reciprocity", "energy"])
    assert [v.status for v in dim.cards[0].verdicts] == ["pass"] * 2


@pytest.mark.slow
def test_same_seed_same_report() -> None:
    first, second = (verify(go.Conductor(alpha=0.3), quick=True, law=["pdf", "energy"], seed=5) for _ in range(2))
    assert [v.p for v in first.cards[0].verdicts] == [v.p for v in second.cards[0].verdicts]
    other = verify(go.Conductor(alpha=0.3), quick=True, law=["pdf"], seed=6)
    assert other["pdf"].p != first["pdf"].p


class Stops(go.Lambert):
    """An exception in pdf; eval is sound."""

    def pdf(self, wo: Any, wi: Any) -> Any:
        return {}["missing"]


def test_a_failing_law_hides_no_other_and_names_the_line() -> None:
    found = verify(Stops(0.5), quick=True)
    statuses = {v.law: v.status for v in found.cards[0].verdicts}
    assert statuses["pdf"] == "fail" and statuses["reciprocity"] == "pass" and statuses["linearity"] == "pass"
    assert "KeyError in" in found["pdf"].why[0] and "test_report.py:" in found["pdf"].why[0]


class Random(go.Lambert):
    """Lambert through a coin: the value is twice the mean or nothing."""

    stochastic: ClassVar[bool] = True

    def _coin(self, w: Any) -> Any:
        from gonio.verify.histogram import random_numbers

        dr = ops.backend.drjit()
        kind = ops.backend.types_like(type(w.x))
        Random.calls += 1
        index = dr.arange(kind.module.UInt32, max(dr.width(w), 1))
        return ops.where(random_numbers(kind, index, Random.calls).x < 0.5, kind.float(2.0), kind.float(0.0))

    calls: ClassVar[int] = 0

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return go.Lambert.eval.__wrapped__(self, wo, wi, mode) * self._coin(wo)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        s = go.Lambert.sample(self, wo, u, mode)
        pdf = go.Lambert.pdf(self, wo, s.wi)
        weight = self.albedo * ops.where(pdf > 0.0, self._coin(wo), 0.0)
        return s._replace(weight=weight, pdf=pdf)


@pytest.mark.slow
def test_a_stochastic_model_is_judged_by_its_expectations() -> None:
    found = verify(Random(0.5), quick=True)
    assert found.passed, str(found)
    assert found["weight"].p is not None and found["reciprocity"].p is not None
    assert found["precision"].status == "does not apply"


def test_the_files_hold_everything_and_need_nothing(tmp_path: Path) -> None:
    found = verify(go.Lambert(0.3), quick=True, law=["reciprocity", "energy", "pdf", "precision", "shader"])
    page.write(found, tmp_path / "down")
    data = json.loads((tmp_path / "down/report.json").read_text())
    assert data["schema"] == "gonio-verify/1" and data["seed"] == 1
    assert [v["law"] for v in data["cards"][0]["verdicts"]] == ["reciprocity", "energy", "pdf", "precision", "shader"]
    for v in data["cards"][0]["verdicts"][:4]:
        assert v["reason"] and v["meaning"] and v["command"].startswith("gonio verify lambert --param albedo=0.3")
    html = (tmp_path / "down/report.html").read_text()
    assert html.count("<img") == 4 and "http" not in html.replace("http://www.w3.org", "")
    assert sorted(p.name for p in (tmp_path / "down").iterdir()) == ["report.html", "report.json"]


def test_a_report_prints_as_the_terminal_shows_it() -> None:
    text = str(verify(go.Lambert(0.5), quick=True, law=["reciprocity"]))
    assert "reciprocity holds  quick" in text


def test_a_tolerance_without_end_is_not_shown() -> None:
    verdicts = [Verdict(9, "precision", "", PASS, 0.25, "0.25", tolerance) for tolerance in (1e-3, 0.0, np.inf)]
    html = page.page(report.Report([Card(of(go.Lambert()), verdicts)], 1, "quick", 0, 0.01))
    cells = [row.split("<td>")[-1].partition("<")[0] for row in html.split("<tr>") if "precision</a>" in row]
    assert cells == ["1e-03", "0", ""]


def _verdict(law: str, status: str) -> Verdict:
    return Verdict(0, law, "", status)


def test_the_summary_names_laws_that_were_not_all_judged_or_break_as_declared() -> None:
    every = [law.name for law in chosen(None)]
    cases = {
        "all laws hold": [_verdict(law, PASS) for law in every],
        "all laws hold except energy, which is violated as declared": [
            _verdict(law, DECLARED if law == "energy" else PASS) for law in every
        ],
        "pdf and weight hold": [_verdict("pdf", PASS), _verdict("weight", PASS)],
        "pdf holds, energy is violated as declared": [_verdict("pdf", PASS), _verdict("energy", DECLARED)],
        "energy is violated as declared": [_verdict("energy", DECLARED)],
    }
    for text, verdicts in cases.items():
        found = report.Report([Card(of(go.Lambert()), verdicts)], 1, "quick", 0, 0.01)
        assert str(found).splitlines()[-1].startswith(f"{text}  quick")


class SlightlyBright(go.Lambert):
    """Its weights are a hundred-thousandth too large."""

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Any:
        s = super().sample(wo, u, mode)
        return s._replace(weight=s.weight * 1.00001)


def test_an_invisible_failure_has_an_exit_code_of_its_own_and_can_be_tolerated() -> None:
    judged = verify(SlightlyBright(0.5), quick=True, law="weight")
    assert not judged.passed and judged["weight"].grade == "invisible" and judged.exit_code == 4
    tolerated = verify(SlightlyBright(0.5), quick=True, law="weight", tolerate="small")
    assert tolerated.passed and tolerated.exit_code == 0 and tolerated["weight"].status == "tolerated"
    assert "tolerated: invisible" in str(tolerated)
    with pytest.raises(InputError, match="'broken' is not a grade"):
        verify(SlightlyBright(0.5), law="weight", tolerate="broken")


class Branches(go.BSDF):
    """Python's `if` on the directions of many rays."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return ops.vec3(0.1, 0.1, 0.1) * (wi.z if wo.z > 0.0 else 0.0)


def test_a_branch_of_python_is_told_the_function_to_use_and_told_once() -> None:
    text = " ".join(str(verify(Branches(), quick=True)).split())
    assert text.count("ops.where(condition, a, b)") == 1 and "in eval" in text
    assert "the same exception (a consequence of the failure of the positivity law)" in text


def test_a_page_begins_with_what_failed() -> None:
    html = page.page(verify(SlightlyBright(0.5), quick=True, law=["weight", "isotropy"]))
    assert html.index("<section id='c0-weight'>") < html.index("<table>") < html.index("<section id='c0-isotropy'>")
