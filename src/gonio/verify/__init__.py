"""The laws: tests for any BSDF, whether Gonio's, Mitsuba's or your own.

    gonio verify conductor --param alpha=0.3
    go.verify(go.Conductor(alpha=0.3)).passed

Each law has its own file, in `laws` or in your own package, and tests a *subject*: a BSDF with given parameters (see
`subject`). This package depends on the BSDF protocol but not on any material. Names are imported on first use because
`gonio verify` starts its worker process before it imports anything itself.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

_PLACES = {"EFFORTS": "effort", "Card": "verdict", "Report": "report", "Verdict": "verdict", "verify": "run"}

if TYPE_CHECKING:
    from .effort import EFFORTS
    from .report import Report
    from .run import verify
    from .verdict import Card, Verdict
else:

    def __getattr__(name: str) -> object:
        if name in _PLACES:
            return getattr(import_module("." + _PLACES[name], __name__), name)
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


__all__ = ["EFFORTS", "Card", "Report", "Verdict", "verify"]
