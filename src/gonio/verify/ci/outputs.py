"""The files that a trial leaves, for people and for machines, and the baseline that it is held against."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ... import files

if TYPE_CHECKING:
    from ..report import Report
    from .baseline import Known

Name = str | Path | None


@dataclass(frozen=True)
class Outputs:
    """What to write, and what is known; None where not asked for.

    report          folder for report.html and report.json
    junit, sarif    files
    baseline        file of failures that are known; a report.json will do
    write_baseline  file for what fails, which is known from then on
    """

    report: Name = None
    junit: Name = None
    sarif: Name = None
    baseline: Name = None
    write_baseline: Name = None

    def check(self) -> Known:
        """What is known to fail. Raises InputError for what cannot be read or written, before anything is computed."""
        if self.report is not None:
            files.check_folder(self.report)
        for file in (self.junit, self.sarif, self.write_baseline):
            if file is not None:
                files.check_file(file)
        if self.baseline is None:
            return {}
        from . import baseline

        return baseline.read(Path(self.baseline))

    def write(self, found: Report, known: Known) -> None:
        """Mark what is known in the report, and write the files, each whole or not at all."""
        from .. import page
        from . import baseline, junit, sarif

        found.mended = baseline.apply(found, known)
        if self.write_baseline is not None:
            files.write_whole(self.write_baseline, baseline.text(found).encode())
            baseline.apply(found, baseline.read(Path(self.write_baseline)))
        if self.report is not None:
            page.write(found, Path(self.report))
        if self.junit is not None:
            files.write_whole(self.junit, junit.text(found).encode())
        if self.sarif is not None:
            files.write_whole(self.sarif, sarif.text(found).encode())


__all__ = ["Outputs"]
