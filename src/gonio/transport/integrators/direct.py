"""Direct light by both strategies."""

from __future__ import annotations

from .transport import Transport


class Direct(Transport):
    """Direct light: light and BSDF sampling combined (multiple importance sampling)."""

    name = "direct"
