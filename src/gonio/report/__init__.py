"""`gonio report`: pictures, sheets, plots, tables and verdicts of a lab report as one document, with the student's own
words.

    listing.py   the list of figures, report.toml
    entries.py   the kinds of figures, and how each is made
    words.py     report.md, which is written once and then belongs to its author
    document.py  the page, report.html; formulas.py sets its mathematics, printing.py prints it as a PDF
"""

from __future__ import annotations

from .run import Report, report

__all__ = ["Report", "report"]
