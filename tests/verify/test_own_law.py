"""A law of one's own, one file outside the package, is asked and reported like the others."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import gonio as go
import pytest
from gonio.verify import laws, verify

import outside

DARKNESS = '''
"""A law: no lobe is brighter than a limit."""

from dataclasses import dataclass

import numpy as np
from gonio.verify.laws import Law
from gonio.verify.laws.base import pair_in_words, pairs, worst_of
from gonio.verify.verdict import Finding


@dataclass
class Brightness:
    largest: float

    def draw(self):
        return f"<svg><text>{self.largest:.3f}</text></svg>", "The largest value that was seen."


class Dim(Law):
    """f < 10 everywhere."""

    name = "dim"
    title = "f stays below 10"
    meaning = "Highlights clip."

    def judge(self, subject, effort, seed):
        wo, wi = pairs(subject, effort.pairs, seed)
        row, size = worst_of(subject.eval(wo, wi))
        return Finding(size, 10.0, "a screen's white", worst=pair_in_words(wo[row], wi[row]), evidence=Brightness(size))
'''


@pytest.fixture
def packages(tmp_path: Path) -> Path:
    folder = tmp_path / "site"
    outside.install(folder, "darkness", DARKNESS, {"gonio.laws": "dim = darkness:Dim"})
    return folder


@pytest.mark.slow
def test_a_package_adds_a_law_by_one_file(packages: Path, tmp_path: Path) -> None:
    report = tmp_path / "report"
    done = outside.gonio(packages, "verify", "lambert", "--quick", "--json", "-o", str(report))
    assert done.returncode == 0, done.stderr
    verdicts = json.loads(done.stdout)["cards"][0]["verdicts"]
    asked = [law.name for law in laws.chosen(None)]
    assert [v["law"] for v in verdicts] == [*asked, "dim"] and verdicts[-1]["status"] == "pass"
    page = (report / "report.html").read_text()
    assert "f stays below 10" in page and "The largest value that was seen." in page


@pytest.mark.slow
def test_the_law_judges_and_its_name_is_known(packages: Path) -> None:
    done = outside.gonio(packages, "verify", "conductor", "-p", "alpha=0.01", "--quick", "--law", "dim")
    assert done.returncode == 1 and "Highlights clip." in done.stdout, done.stderr
    done = outside.gonio(packages, "verify", "lambert", "--quick", "--law", "dimm")
    assert done.returncode == 2 and "unknown law 'dimm'" in done.stderr and "did you mean 'dim'?" in done.stderr


def test_a_law_can_be_registered_in_a_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_darkness.py").write_text(DARKNESS)
    monkeypatch.syspath_prepend(tmp_path)
    name = laws.Law.family.add(importlib.import_module("my_darkness").Dim)
    try:
        report = verify(go.Lambert(0.5), quick=True, law=["reciprocity", "dim"])
        assert report["dim"].status == "pass" and report["dim"].number == 100
    finally:
        laws.Law.family.remove(name)
    with pytest.raises(go.InputError, match="unknown law 'dim'"):
        verify(go.Lambert(0.5), quick=True, law=["dim"])


def test_what_is_no_law_is_refused() -> None:
    with pytest.raises(go.InputError, match="is not a law"):
        laws.Law.family.add(go.Lambert)
