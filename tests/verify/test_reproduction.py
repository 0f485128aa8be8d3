"""A failure of one of Mitsuba's plugins comes with a program of Mitsuba alone; `tests/docs` runs the record's."""

from __future__ import annotations

import ast

import gonio as go
import pytest
from gonio.verify import Verdict, verify
from gonio.verify.severity import Grade


def failed(target: str, law: str) -> Verdict:
    verdict = verify(target, quick=True, law=law)[law]
    assert verdict.failed
    return verdict


@pytest.mark.slow
def test_it_holds_the_plugin_and_the_figure() -> None:
    program = failed("mitsuba:principled", "energy").reproduction
    ast.parse(program)
    assert '"principled"' in program and "gonio" not in program
    assert "assert albedo < 1.0" in program
    assert len([line for line in program.splitlines() if line]) <= 20


@pytest.mark.slow
def test_only_where_there_is_a_plugin() -> None:
    class Bright(go.Lambert):
        """Reflects more than it gets."""

        def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
            return super().eval(wo, wi, mode) * 1.5

    verdict = verify(Bright(), quick=True, law="energy")["energy"]
    assert verdict.failed and verdict.reproduction == ""


@pytest.mark.slow
def test_what_a_plugin_holds_is_blamed_and_not_the_plugin() -> None:
    assert failed("mitsuba:twosided", "pdf").grade is Grade.INNER
