"""Checks of a student's work against Gonio: tables, values of f, classes, pictures, and folders of such files.

    go.check("E.png"); go.check("f.csv", "oren-nayar(sigma=0.3)", up="y"); go.check("submissions", sheet="hw4")

`run` selects the check for each kind of work, `mistakes` and `table_forms` define the known mistakes, and `sheet`
defines the tasks of the courses.
"""

from .finding import Finding, Mistake
from .report import Report
from .run import check

__all__ = ["Finding", "Mistake", "Report", "check"]
