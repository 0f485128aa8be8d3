"""The files that a run writes, and the baseline with which its report is compared."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ... import files
from ...errors import InputError

if TYPE_CHECKING:
    from ..report import Report
    from .baseline import Known

Name = str | Path | None
GRADES = ("invisible", "small", "visible")  # grades that can be tolerated, the least severe first


@dataclass(frozen=True)
class Outputs:
    """The files to write, and the baseline; None for files that are not requested.

    report          folder for report.html and report.json
    junit, sarif    files in these formats
    baseline        file of known failures, which may be a report.json
    write_baseline  file for the current failures, for later use as a baseline
    tolerate        the severest grade that does not fail a report: "invisible", "small" or "visible"; "" for none
    """

    report: Name = None
    junit: Name = None
    sarif: Name = None
    baseline: Name = None
    write_baseline: Name = None
    tolerate: str = ""

    def check(self) -> Known:
        """The known failures of the baseline. Called before anything is computed; raises InputError if a file cannot be
        read or written."""
        if self.tolerate not in ("", *GRADES):
            hint = f"give one of {', '.join(GRADES)}"
            raise InputError(f"'{self.tolerate}' is not a grade that can be tolerated", "--tolerate", hint)
        if self.report is not None:
            files.check_folder(self.report)
        for file in (self.junit, self.sarif, self.write_baseline):
            if file is not None:
                files.check_file(file)
        if self.baseline is None:
            return {}
        from . import baseline

        return baseline.read(Path(self.baseline))

    def write(self, report: Report, known: Known) -> None:
        """Mark known failures in the report, and write the files, each completely or not at all.

        known  the result of `check`
        """
        from .. import page
        from . import baseline, junit, sarif

        report.mended = baseline.apply(report, known)
        if self.write_baseline is not None:
            files.write_whole(self.write_baseline, baseline.text(report).encode())
            baseline.apply(report, baseline.read(Path(self.write_baseline)))
        if self.tolerate:
            _tolerate(report, self.tolerate)
        if self.report is not None:
            page.write(report, Path(self.report))
        if self.junit is not None:
            files.write_whole(self.junit, junit.text(report).encode())
        if self.sarif is not None:
            files.write_whole(self.sarif, sarif.text(report).encode())


def _tolerate(report: Report, most: str) -> None:
    """Mark the failures of the grade `most`, or of a less severe one, so that they do not fail the report."""
    from ..verdict import TOLERATED

    tolerated = GRADES[: GRADES.index(most) + 1]
    for verdict in report.failures:
        if verdict.grade in tolerated:
            verdict.status = TOLERATED


__all__ = ["Outputs"]
