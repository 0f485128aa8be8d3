"""The laws: prove any BSDF, Gonio's, Mitsuba's or your own.

    gonio verify conductor --param alpha=0.3
    go.verify(go.Conductor(alpha=0.3)).passed

One law a file in `laws`; a new one is one new file. The room knows the BSDF protocol and nothing of any material.
"""

from __future__ import annotations

from .._callable import make_callable
from .report import Card, Report, Verdict
from .run import EFFORTS, verify

__all__ = ["EFFORTS", "Card", "Report", "Verdict", "verify"]

make_callable(__name__, verify)
