"""The result of a check: right, wrong or unreadable, the size of the difference, and the probable mistake."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

RIGHT, WRONG, ERROR, MISSING, BY_HAND = "right", "wrong", "input error", "not handed in", "by hand"
ANOTHER = "another model"  # the kind of work for a file of values of a model that is not the task's
EXIT_CODES = {RIGHT: 0, BY_HAND: 0, WRONG: 1, MISSING: 1, ERROR: 2}


@dataclass(frozen=True)
class Mistake:
    """A mistake in a solution.

    words  description with the formula: "k = (roughness + 1)^2 / 8 in place of alpha / 2"
    topic  location without the formula, for students who are to find the mistake themselves: "the masking term G"
    """

    words: str
    topic: str


@dataclass(frozen=True)
class Finding:
    """The result for one piece of work.

    name     the file or class
    kind     the recognized kind of work: "table of E", "values of f", ...
    status   RIGHT, WRONG, ERROR (the work could not be checked), MISSING or BY_HAND
    facts    sentences that state the basis of the comparison, and the size and location of the difference
    mistake  the probable mistake; None if it is unknown
    figures  the numbers in `facts`
    hidden   whether formulas and values of the solution are omitted
    remark   the material used for the comparison, if the command does not specify it completely; "" otherwise
    """

    name: str
    kind: str
    status: str
    facts: tuple[str, ...] = ()
    mistake: Mistake | None = None
    figures: dict[str, float] = field(default_factory=dict)
    hidden: bool = False
    remark: str = ""

    @property
    def passed(self) -> bool:
        return self.status in (RIGHT, BY_HAND)

    @property
    def exit_code(self) -> int:
        """0 if the work is right, 1 if it is wrong or missing, 2 if it cannot be read."""
        return EXIT_CODES[self.status]

    @property
    def cause(self) -> str:
        """A description of the probable mistake, or only its topic if the solution is hidden; "" if it is unknown."""
        if self.mistake is None:
            return ""
        return f"look at {self.mistake.topic}" if self.hidden else self.mistake.words

    def without_solution(self) -> Finding:
        """The finding without values and formulas of the solution."""
        facts = self.facts if self.status == ERROR else ()
        return replace(self, facts=facts, figures={}, hidden=True)

    def lines(self) -> list[str]:
        """The result as lines of text, one per fact."""
        lines = [f"{self.name}: {self.status}" + (f" ({self.kind})" if self.kind else "")]
        lines += [f"  {fact}" for fact in (*self.facts, self.remark) if fact]
        if self.cause:
            lines.append(f"  probable mistake: {self.cause}")
        elif self.status == WRONG and self.kind != ANOTHER:
            lines.append("  no known mistake explains the difference")
        return lines

    def as_dict(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "kind": self.kind,
            "status": self.status,
            "passed": self.passed,
            "facts": list(self.facts),
            "remark": self.remark,
            "cause": self.cause,
            "topic": self.mistake.topic if self.mistake else "",
            "figures": self.figures,
        }


def unreadable(name: str, why: str, hint: str = "") -> Finding:
    """The finding for work that cannot be checked, for the reason `why`."""
    return Finding(name, "", ERROR, (f"{why}: {hint}" if hint else why,))
