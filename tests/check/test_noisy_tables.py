"""Tables of E with the noise of random directions: right ones pass, mistakes are named where their form alone fits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gonio.check import Finding, tables

from .solutions import Table


def _judged(seed: int = 3, samples: int = 1024, **changes: Any) -> Finding:
    table = Table(rng=np.random.default_rng(seed), samples=samples, **changes)
    return tables.check(tables.Table("E.png", table.picture() / 255.0))


@pytest.mark.sample(1)
@pytest.mark.parametrize("k", ["figure", "text"])
@pytest.mark.parametrize("samples", [256, 1024])
def test_a_right_table_passes_with_its_noise(k: str, samples: int) -> None:
    finding = _judged(k=k, samples=samples)
    assert finding.passed and finding.figures["converged"] > 3.0, finding.lines()


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("changes", "cause"),
    [
        ({"change": "alpha = roughness"}, "alpha = roughness in place of roughness^2, in D"),
        ({"change": "alpha = roughness", "k": "text"}, "alpha = roughness in place of roughness^2, in D"),
        ({"change": "no n.m"}, "(n.m) is missing in the pdf"),
        ({"k": "(alpha + 1)^2 / 8"}, "k = (alpha + 1)^2 / 8"),
        ({"change": "transposed"}, "rows and columns exchanged"),
        ({"change": "cosine twice"}, "the cosine of the light is applied twice"),
    ],
)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_mistake_is_named_through_the_noise(seed: int, changes: dict[str, Any], cause: str) -> None:
    finding = _judged(seed, **changes)
    assert finding.status == "wrong" and finding.cause.startswith(cause), finding.lines()
    assert finding.figures["converged"] > 3.0 and not any("no form fits" in fact for fact in finding.facts)


@pytest.mark.slow
def test_a_mistake_that_hardly_differs_from_the_right_form_is_only_probable() -> None:
    finding = _judged(k="roughness / 2")
    assert finding.cause == "probably k = roughness / 2", finding.lines()


def test_a_way_to_sample_that_does_not_fit_is_not_stated_as_a_fact() -> None:
    values = Table(cosine=True).picture() / 255.0  # one set of directions for all mu, which is not stratified by mu
    finding = tables.check(tables.Table("E.png", values))
    text = " ".join(finding.facts)
    assert finding.passed and "how the directions are drawn cannot be told" in text and "denominator" not in text
