"""`gonio report`: the pictures, contact sheets, plots, tables and verdicts of a lab report in one document, with the
student's own text.

    listing.py   the list of figures, report.toml
    entries.py   the kinds of figures, and the code that creates them
    words.py     report.md, which is written once and then edited only by its author
    document.py  the page, report.html; formulas.py typesets its formulas, printing.py prints it as a PDF
"""

from __future__ import annotations

from .run import Report, report

__all__ = ["Report", "report"]
