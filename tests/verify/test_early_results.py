"""Results are told as soon as they are there: of each law on one card, of each card on several."""

from __future__ import annotations

from pathlib import Path

import pytest
from gonio.verify.isolation.child import Item, Task, trial

LAWS = ["positivity", "energy", "weight"]
BRIGHT = "vec3 brdf(vec3 light, vec3 view, vec3 normal) { return vec3(0.5); }\n"


@pytest.fixture
def bright(tmp_path: Path) -> str:
    """A diffuse surface of albedo pi / 2."""
    (tmp_path / "bright.glsl").write_text(BRIGHT)
    return str(tmp_path / "bright.glsl")


def test_laws_of_one_card_are_told_in_order_before_the_report(bright: str) -> None:
    events: list[str] = []
    task = Task([Item(bright)], "quick", 1, LAWS)
    report = trial(task, progress=lambda done, total, state: events.append(state.split(": ")[-1]), tell=events.append)
    told = [one for one in events if ": " in one]
    assert [one.partition(":")[0] for one in told] == LAWS
    assert told[0].startswith("positivity: holds at ") and told[1] == "energy: does not hold"
    assert events.index("positivity") < events.index(told[0]) < events.index("energy")  # between the two laws
    assert [one.status for one in report.cards[0].verdicts] == ["pass", "fail", "pass"]


@pytest.mark.slow
def test_several_cards_are_told_one_by_one(bright: str) -> None:
    told: list[str] = []
    trial(Task([Item("lambert"), Item(bright)], "quick", 1, ["energy"]), tell=told.append)
    assert [one.partition(": ")[2] for one in told] == ["holds", "fails energy"]
