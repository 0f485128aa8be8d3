"""The laws: prove any BSDF, Gonio's, Mitsuba's or your own.

    gonio verify conductor --param alpha=0.3
    go.verify(go.Conductor(alpha=0.3)).passed

One law a file in `laws`, or in a package of your own. The room knows the BSDF protocol and nothing of any material.
"""

from __future__ import annotations

from .._callable import make_callable
from .effort import EFFORTS
from .report import Report
from .run import verify
from .verdict import Card, Verdict

__all__ = ["EFFORTS", "Card", "Report", "Verdict", "verify"]

make_callable(__name__, verify)
