"""The command line: thin verbs over the rooms below, no logic of its own.

Nothing heavy is imported at the top, so that `gonio --help` stays under a quarter of a second: each verb imports what
it needs when it runs. Errors are printed in one place, `app.main`.

Exit codes: 0 done, 1 a verdict of "fails", 2 bad usage or input, 3 a fault of the machine, 130 ended by Ctrl-C.
"""

from __future__ import annotations

from . import pictures  # noqa: F401  each registers its verbs, and the help lists them in that order

# isort: split
from . import materials, support, tables  # noqa: F401
from .app import main, run

__all__ = ["main", "run"]
