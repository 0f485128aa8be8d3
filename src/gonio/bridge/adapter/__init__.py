"""Make every Gonio model available as a Mitsuba plugin: `conductor` becomes `gonio_conductor`, and so on.

The properties of a plugin have the names of the model's parameters. Every plugin has two further properties:
`two_sided` shades both sides, without the nested call of Mitsuba's `twosided` plugin, and `preset` selects a preset, if
the model has presets.

In polarized variants, a plugin returns Mueller matrices for light that is reflected or refracted once, by a microfacet.
All other light leaves unpolarized.
"""

from __future__ import annotations

from types import ModuleType

from ...errors import InputError
from ...material import BSDF, models
from .. import plugin_search
from ..types import OfVariant, Plugin, Properties
from .material import plugin_name
from .plugin import plugin_class

__all__ = ["plugin_name", "register", "register_model"]

_classes: dict[str, OfVariant] = {}  # variant -> class of the plugins
_models: dict[str, type[BSDF]] = {}  # plugin -> the newest model of that name


def register(mi: ModuleType) -> None:
    """Register every model with the current variant, including models that are declared later."""
    BSDF.family.watch(_joined)
    if mi.variant() is not None:
        for name, model in models().items():
            _register(mi, plugin_name(name), model)


def register_model(mi: ModuleType, model: type[BSDF]) -> str:
    """The name of a model's plugin, which is registered if it is a user's class. `register` must be called before."""
    if models().get(model.name) is model:
        return plugin_name(model.name)
    name = f"gonio_own_{model.name.replace('-', '_')}"
    _register(mi, name, model)
    return name


def _joined(name: str, model: type[BSDF]) -> None:
    import mitsuba as mi

    _register(mi, plugin_name(name), model)


def _register(mi: ModuleType, name: str, model: type[BSDF]) -> None:
    variant = mi.variant()
    _models[name] = model
    if variant.startswith("scalar"):
        plugin_search.register(mi.register_bsdf, name, _refused)
        return
    if variant not in _classes:
        _classes[variant] = plugin_class(mi)
    plugin_search.register(mi.register_bsdf, name, lambda props: _classes[variant](props, _models[name]))


def _refused(props: Properties) -> Plugin:
    import mitsuba as mi

    what = f"variant {mi.variant()} works on one ray at a time, but Gonio's materials work on arrays"
    raise InputError(what, str(props.plugin_name()), "set llvm_ad_rgb, or another that starts with llvm or cuda")
