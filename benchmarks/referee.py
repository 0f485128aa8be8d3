"""The verifier on materials written without knowledge of the laws: detection of wrong ones, false alarms on sound ones.

    python benchmarks/referee.py [--only first.smooth,second.delta,...] [--quick] [--seeds 1]

For wrong materials: the law that failed first, its grade, and the named cause next to the one that the author recorded.
For sound ones, with each seed: any law that fails is a false alarm.
"""

from __future__ import annotations

import argparse
import importlib
import statistics
import sys
import time
from pathlib import Path
from typing import NamedTuple

from gonio.verify import Report, verify

TESTS = Path(__file__).resolve().parents[1] / "tests"
FOLDERS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh")


class Case(NamedTuple):
    """A material, or the name of a plugin in a file, and its author's description."""

    name: str
    target: object
    fault: str
    cause: str
    sound: bool


def cases(only: str = "") -> list[Case]:
    """All cases, in the order of the files."""
    sys.path.insert(0, str(TESTS))
    found = []
    for folder in FOLDERS:
        for path in sorted((TESTS / f"mutants/{folder}").glob("*.py")):
            part = path.stem
            if only and f"{folder}.{part}" not in only.split(","):
                continue
            module = importlib.import_module(f"mutants.{folder}.{part}")
            plugins = {cls: name for name, cls in getattr(module, "PLUGINS", {}).items()}
            for kind in ("MUTANTS", "SOUND"):
                for cls in getattr(module, kind, []):
                    target = f"{path}:{plugins[cls]}" if cls in plugins else cls()
                    texts = getattr(cls, "fault", ""), getattr(cls, "cause", "")
                    found.append(Case(f"{folder}.{part}.{cls.__name__}", target, *texts, kind == "SOUND"))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--seeds", type=int, default=1)
    options = parser.parse_args()
    caught = wrong = alarms = judged = 0
    seconds = []
    for case in cases(options.only):
        for seed in range(1, (options.seeds if case.sound else 1) + 1):
            start = time.perf_counter()
            report: Report = verify(case.target, quick=options.quick, seed=seed)  # type: ignore[arg-type]
            seconds.append(time.perf_counter() - start)
            fails = ", ".join(f"{v.law} {v.grade or ''}".strip() for v in report.failures)
            if case.sound:
                judged += 1
                alarms += not report.passed
                if not report.passed:
                    print(f"ALARM  {case.name}, seed {seed}: {fails}", flush=True)
                continue
            wrong += 1
            caught += not report.passed
            word = "caught" if fails else "MISSED"
            causes = "; ".join(v.cause for v in report.failures if v.cause and not v.cause.startswith("follows"))
            print(f"{word} {case.name}: {fails or case.fault}", flush=True)
            if case.cause or causes:
                print(f"       meant {case.cause or '-'} | named {causes or '-'}", flush=True)
    if wrong:
        print(f"caught {caught} of {wrong} ({caught / wrong:.1%})")
    if judged:
        print(f"false alarms: {alarms} in {judged} trials of sound materials")
    print(f"a trial: median {statistics.median(seconds):.1f} s, at most {max(seconds):.1f} s")


if __name__ == "__main__":
    main()
