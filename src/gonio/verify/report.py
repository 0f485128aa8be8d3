"""The report of a run, with one card per subject, as text and as a dictionary."""

from __future__ import annotations

import dataclasses
import io
from typing import TYPE_CHECKING

from .._version import __version__
from ..errors import InputError
from . import statistics, terminal
from .laws import chosen
from .severity import Grade
from .verdict import DECLARED, NOT_TRIED, Card, Unread, Verdict

if TYPE_CHECKING:
    from rich.console import Console

SCHEMA = "gonio-verify/1"
SIGNIFICANCE = 0.01  # probability of a false rejection in a whole report


def significance(tests: int) -> float:
    """The p-value below which each of a number of tests rejects, by Sidak's correction; SIGNIFICANCE for none."""
    return statistics.sidak(SIGNIFICANCE, tests)


@dataclasses.dataclass
class Report:
    """The report of a run of `gonio verify`.

    cards      the verdicts on each subject
    seed       seed of all random numbers
    effort     name of the effort, "quick", "default" or "deep"
    tests      number of statistical tests in the whole report
    threshold  p-value below which a test rejects, by Sidak's correction
    seconds    duration of the run
    mended     failures listed in the baseline that no longer occur, as text
    unread     shaders that could not be read, although other targets were tested
    """

    cards: list[Card]
    seed: int
    effort: str
    tests: int
    threshold: float
    seconds: float = 0.0
    mended: list[str] = dataclasses.field(default_factory=list)
    unread: list[Unread] = dataclasses.field(default_factory=list)

    @property
    def passed(self) -> bool:
        return not self.unread and all(card.passed for card in self.cards)

    @property
    def exit_code(self) -> int:
        """The exit code: 0 if no law fails, 4 if every failure is invisible in pictures, 1 for other failures, and 2 if
        a shader could not be read."""
        if self.unread or self.passed:
            return InputError.code if self.unread else 0
        return 4 if all(verdict.grade is Grade.INVISIBLE for verdict in self.failures) else 1

    @property
    def failures(self) -> list[Verdict]:
        return [verdict for card in self.cards for verdict in card.verdicts if verdict.failed]

    @property
    def untried(self) -> list[str]:
        """The laws that could not be tested on this machine, or only in part."""
        verdicts = [verdict for card in self.cards for verdict in card.verdicts]
        return list(dict.fromkeys(verdict.law for verdict in verdicts if verdict.status == NOT_TRIED))

    def __getitem__(self, law: str) -> Verdict:
        """The first failing verdict on the law with this name or, if none fails, the first verdict."""
        verdicts = [card[law] for card in self.cards]
        return next((verdict for verdict in verdicts if verdict.failed), verdicts[0])

    def as_dict(self) -> dict[str, object]:
        """The contents of `report.json`."""
        return {
            "schema": SCHEMA,
            "gonio": __version__,
            "passed": self.passed,
            "seed": self.seed,
            "effort": self.effort,
            "significance": SIGNIFICANCE,
            "tests": self.tests,
            "threshold": self.threshold,
            "seconds": round(self.seconds, 3),
            "mended": list(self.mended),
            "unread": [one._asdict() for one in self.unread],
            "cards": [card.as_dict() for card in self.cards],
        }

    def show(self, console: Console) -> None:
        """Print a table for each subject, with the explanation of each failure, and a summary."""
        from rich.markup import escape

        for card in self.cards:
            terminal.show_card(card, console)
        for one in self.unread:
            console.print(f"[bold red]not read:[/] {escape(f'{one.target}: {one.words()}')}")
        for line in self.mended:
            console.print(f"fixed: {line}", markup=False)
        broken = len(self.failures)
        word = (
            f"[green]{self._holding()}[/]"
            if not broken
            else f"[bold red]{broken} {'law' if broken == 1 else 'laws'} violated[/]"
        )
        if self.unread:
            word = f"[bold red]{len(self.unread)} not read[/], {word}"
        if self.untried:
            word = " ".join(filter(None, [word, f"[bold yellow]{' and '.join(self.untried)} NOT TRIED[/]"]))
        tests = f"{self.tests} statistical tests, each at a significance level of {self.threshold:.1e} (0.01 overall)"
        asked = tests if self.tests else "no statistical tests"
        console.print(f"{word}  [dim]{self.effort}, seed {self.seed}, {asked}, {self.seconds:.1f} s[/]")

    def _holding(self) -> str:
        """ "all laws hold" or, if not all were tested, the laws that hold; also the laws violated as declared."""
        statuses = [(verdict.law, verdict.status) for card in self.cards for verdict in card.verdicts]
        judged = dict.fromkeys(law for law, _ in statuses)
        declared = dict.fromkeys(law for law, status in statuses if status == DECLARED)
        sound = [law for law in judged if law not in declared and law not in self.untried]
        if all(law.name in sound or law.name in declared for law in chosen(None)):
            return "all laws hold" + (
                f" except {' and '.join(declared)}, which {'is' if len(declared) == 1 else 'are'} violated as declared"
                if declared
                else ""
            )
        holding = f"{' and '.join(sound)} hold{'s' if len(sound) == 1 else ''}" if sound else ""
        breaking = (
            f"{' and '.join(declared)} {'is' if len(declared) == 1 else 'are'} violated as declared" if declared else ""
        )
        return ", ".join(filter(None, [holding, breaking]))

    def __str__(self) -> str:
        """The report as plain text."""
        from rich.console import Console

        out = io.StringIO()
        self.show(Console(file=out, width=120, no_color=True))
        return out.getvalue()

    def _repr_html_(self) -> str:
        """The report as HTML for a notebook."""
        from rich.console import Console

        console = Console(file=io.StringIO(), width=120, record=True, force_jupyter=False)
        self.show(console)
        return console.export_html(inline_styles=True, code_format="<pre>{code}</pre>")
