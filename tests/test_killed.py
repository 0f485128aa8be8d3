"""A job that is killed, and finds what it kept damaged, gives the bits of one that nobody disturbed."""

from __future__ import annotations

from pathlib import Path

import pytest

from killing import KINDS, trial


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["path"])
def test_a_killed_render_goes_on_to_the_same_bits(kind: str, tmp_path: Path) -> None:
    same, told = trial(kind, tmp_path, seed=1, length=0.5, kills=1)
    assert same, told


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(10))
def test_jobs_that_are_killed_at_random_times_lose_nothing(kind: str, seed: int, tmp_path: Path) -> None:
    same, told = trial(kind, tmp_path, seed, length=2.0, kills=3)
    assert same, told
