"""Gonio's models as Mitsuba plugins.

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")
    import gonio.mitsuba
    bsdf = mi.load_dict({"type": "gonio_conductor", "preset": "Au", "alpha": 0.2})

The order of the imports does not matter. This import sets a variant only if none is set. It registers the plugins, and
registers them again whenever the variant changes.
"""

from __future__ import annotations

from .bridge import adapter, engine

_mi = engine.load()
adapter.register(_mi)


def _variant_changed(old: str | None, new: str | None) -> None:
    adapter.register(_mi)


_mi.detail.add_variant_callback(_variant_changed)
