"""The command line: thin verbs over the rooms below, no logic of its own. One verb a file in `verbs`.

Nothing heavy is imported at the top, so that `gonio --help` takes little more than Python and Typer: each verb imports
what it needs when it runs. Errors are printed in one place, `app.main`.

Exit codes: 0 done, 1 a verdict of "fails", 2 bad usage or input, 3 a fault of the machine, 130 ended by Ctrl-C.
"""

from __future__ import annotations

from .app import main, run
from .verbs.base import Verb, verb

__all__ = ["Verb", "main", "run", "verb"]
