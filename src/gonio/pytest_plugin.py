"""The pytest plugin: a fixture, and test items for the materials named on the command line.

    def test_glass(gonio_verify):
        gonio_verify("glass.py:Glass")

    pytest --gonio glass.py:Glass --gonio mitsuba:roughplastic --gonio-quick

If Gonio is installed, every run of pytest loads this file. It therefore imports nothing from Gonio until it is used.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from .verify import Report, Verdict

__all__ = ["gonio_verify"]


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("gonio", "laws of materials (Gonio)")
    group.addoption(
        "--gonio",
        action="append",
        default=[],
        metavar="TARGET",
        help="a test for each law of FILE.py:CLASS, mitsuba:PLUGIN or a model; repeatable",
    )
    group.addoption("--gonio-quick", action="store_true", help="a first look, in seconds")


@pytest.fixture
def gonio_verify() -> Callable[..., Report]:
    """The function `check`, which fails the test if a material violates a law: gonio_verify(material)."""
    return check


def check(
    target: Any,
    quick: bool = True,
    law: str | Sequence[str] | None = None,
    breaks: Mapping[str, float] | Collection[str] = (),
    **more: Any,
) -> Report:
    """Test a material, and fail the test with the text of the report if the material violates a law.

    target  a material, or the name of a target, as for `gonio verify`
    quick   whether to use fewer samples
    law     the name of a law, or several names; None for all laws
    breaks  names of the laws that the material may violate, or a mapping from these names to the largest allowed
            violation; the test also fails if the material satisfies one of these laws
    more    further keyword arguments of `gonio.verify`: deep, seed, timeout, memory, isolated
    Returns the report.
    If the material can be named or pickled, it is tested in a separate process, so that a crash does not end pytest.
    """
    __tracebackhide__ = True
    from .errors import InputError
    from .verify import verify

    try:
        report = verify(target, quick=quick, law=law, **{"isolated": True, **more})
    except InputError as error:
        if error.where != "isolated" or "isolated" in more:
            raise
        report = verify(target, quick=quick, law=law, isolated=False, **more)  # for a class local to the test
    complaints = _complaints(report, breaks)
    if complaints:
        pytest.fail("\n".join([str(report), *complaints]), pytrace=False)
    return report


def _complaints(report: Report, breaks: Mapping[str, float] | Collection[str]) -> list[str]:
    complaints = []
    broken = set()
    for verdict in report.failures:
        broken.add(verdict.law)
        if verdict.law not in breaks:
            complaints.append(f"{verdict.law} is violated: {'; '.join(verdict.why)}")
            continue
        most = breaks[verdict.law] if isinstance(breaks, Mapping) else None
        if most is not None and (verdict.figure is None or not abs(verdict.figure) <= most):
            complaints.append(
                f"{verdict.law} is violated ({verdict.shown or 'no figure'}; at most {most:g} is allowed)"
            )
    asked = {verdict.law for card in report.cards for verdict in card.verdicts}
    complaints += [
        f"{name} is declared as violated, but holds" for name in breaks if name in asked and name not in broken
    ]
    return complaints


# --------------------------------------------------------------------------- --gonio


@pytest.hookimpl(tryfirst=True)  # before -k and -m select
def pytest_collection_modifyitems(session: pytest.Session, config: pytest.Config, items: list[pytest.Item]) -> None:
    targets = dict.fromkeys(config.getoption("--gonio"))
    if not targets:
        return
    from .verify.laws import laws

    for target in targets:
        group = Target.from_parent(session, name=f"gonio {target}", nodeid=f"gonio {target}", target=target)
        group.children = [LawItem.from_parent(group, name=name) for name in laws()]
        items += group.children


class Target(pytest.Collector):
    """A target, tested once against all selected laws."""

    def __init__(self, *, target: str, **more: Any) -> None:
        super().__init__(**more)
        self.target = target
        self.children: list[LawItem] = []
        self._report: Report | Exception | None = None

    def collect(self) -> Iterable[LawItem]:
        return self.children

    def report(self) -> Report:
        if self._report is None:
            from .verify import verify

            chosen = [item.name for item in self.session.items if item.parent is self]
            try:
                self._report = verify(self.target, quick=self.config.getoption("--gonio-quick"), law=chosen)
            except Exception as error:
                self._report = error
        if isinstance(self._report, Exception):
            raise self._report
        return self._report


class LawItem(pytest.Item):
    """One law of a target."""

    parent: Target

    def runtest(self) -> None:
        verdict = self.parent.report()[self.name]
        if verdict.failed:
            raise Broken(verdict)
        if verdict.status in ("does not apply", "not tried"):
            pytest.skip(f"{verdict.status}: {'; '.join(verdict.why)}")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        if isinstance(excinfo.value, Broken):
            return _text(excinfo.value.verdict)
        from .errors import GonioError

        return str(excinfo.value) if isinstance(excinfo.value, GonioError) else super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return self.config.rootpath, None, f"{self.parent.name}: {self.name}"


class Broken(Exception):
    """Raised if a law does not hold."""

    def __init__(self, verdict: Verdict) -> None:
        self.verdict = verdict
        super().__init__(verdict.law)


def _text(verdict: Verdict) -> str:
    from .verify.ci import places

    return "\n".join([f"{verdict.law}: {verdict.title}", *(f"  {line}" for line in places.words(verdict))])
