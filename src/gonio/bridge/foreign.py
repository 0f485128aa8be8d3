"""Load Mitsuba's BSDFs by name, from a dictionary or from a file, as materials.

    rough = foreign.load({"type": "roughplastic", "alpha": 0.2})
    rough.eval(wo, wi)
    rougher = tree.replace(rough, {"alpha": 0.4})

The numbers and albedos among the properties of a plugin are parameters of the material.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import ClassVar

import numpy as np

from ..catalog import outside
from ..errors import InputError, did_you_mean
from ..material import number, spectrum
from . import adapter, engine, plugin_search
from .faults.exr_threads import file_threads
from .native import MitsubaBSDF
from .types import BSDFPlugin, OfVariant, PluginDict

# For a smaller alpha, Mitsuba's documentation recommends the smooth plugin, and its float32 code becomes inaccurate.
SMALLEST_ALPHA = 1e-3
# Albedo-like properties of Mitsuba's own plugins, in [0, 1]; other colors are passed on unchanged
ALBEDOS = ("reflectance", "diffuse_reflectance", "specular_reflectance", "specular_transmittance", "base_color")


# Ranges of numeric properties of Mitsuba's own plugins, (default, low, high), from Mitsuba's documentation (version
# 3.9, "BSDFs"). A property that is not listed has no known range and is tested only at its current value.
_SHARE = (0.0, 0.0, 1.0)
_PRINCIPLED = {"roughness": (0.5, 0.0, 1.0)} | dict.fromkeys(
    ("anisotropic", "spec_trans", "spec_tint", "sheen", "sheen_tint", "flatness"), _SHARE
)
RANGES: dict[str, dict[str, tuple[float, float, float]]] = {
    "blendbsdf": {"weight": (0.5, 0.0, 1.0)},
    "mask": {"opacity": (0.5, 0.0, 1.0)},
    "principled": {**_PRINCIPLED, "metallic": _SHARE, "clearcoat": _SHARE, "clearcoat_gloss": _SHARE},
    "principledthin": {**_PRINCIPLED, "diff_trans": (0.0, 0.0, 2.0)},
    "roughconductor": {"alpha": (0.1, 0.0, 1.0)},
    "roughdielectric": {"alpha": (0.1, 0.0, 1.0)},
    "roughplastic": {"alpha": (0.1, 0.0, 1.0)},
}


class _Described(MitsubaBSDF):
    """A BSDF that is built from a dictionary and is rebuilt when a parameter changes."""

    description: ClassVar[PluginDict] = {}
    plugin: ClassVar[PluginDict] = {}  # in an instance, the dictionary with its parameter values

    @property
    def by_nature(self) -> Mapping[str, str]:
        """The laws that plugins of this kind violate by design, with the reasons."""
        return _BY_NATURE.get(str(self.description.get("type", "")), {})

    @property
    def held(self) -> dict[str, MitsubaBSDF]:
        """The nested BSDFs, as materials."""
        return {name: load(inner) for name, inner in self.description.items() if _is_bsdf(inner)}

    def rebuilt(self) -> MitsubaBSDF:
        """The material with a new instance of the plugin."""
        return load(self.plugin)

    def with_diffuse_inside(self) -> MitsubaBSDF:
        """The same plugin, in which nested BSDFs are replaced by diffuse ones."""
        return load({**self.description, **dict.fromkeys(self.held, _DIFFUSE)})

    def __post_init__(self) -> None:
        super().__post_init__()
        changed = {}
        for name, parameter in self.parameters().items():
            value = np.asarray(getattr(self, name), float)
            if value.ndim > (name in ALBEDOS):
                hint = "the properties of a plugin are single values"
                raise InputError(f"{len(value)} rows given, one value expected", name, hint)
            if not np.array_equal(value, np.asarray(parameter.default)):
                rgb = {"type": "rgb", "value": np.broadcast_to(value, 3).tolist()}
                changed[name] = rgb if name in ALBEDOS else float(value)
        object.__setattr__(self, "plugin", {**self.description, **changed})
        object.__setattr__(self, "bsdf", _built(self.plugin))


def load(description: PluginDict) -> MitsubaBSDF:
    """The BSDF described by a dictionary for `mi.load_dict`. Raises InputError if Mitsuba rejects it."""
    kind = str(description.get("type", ""))
    fields: dict[str, OfVariant] = {}
    known = RANGES.get(kind, {})
    if any(name.startswith("alpha_") for name in description):
        known = {name: ends for name, ends in known.items() if name != "alpha"}  # either alpha, or alpha_u and alpha_v
    given = {**{name: ends[0] for name, ends in known.items()}, **_albedos(_built(description)), **description}
    for name, value in given.items():
        if name in ALBEDOS and isinstance(value, int | float | tuple):
            low, high = (0.0, 1.0) if kind in _NESTS else (-np.inf, np.inf)
            fields[name] = spectrum(value, "a property of the plugin", low=low, high=high)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            _, low, high = known.get(name, (0.0, -np.inf, np.inf))
            if name.startswith("alpha") and kind in _NESTS:
                low, high = SMALLEST_ALPHA, 1.0
            fields[name] = number(value, "a property of the plugin", low=low, high=high)
    space = {**fields, "description": description, "__annotations__": dict.fromkeys(fields, "object")}
    return type(f"Mitsuba{kind.title()}", (_Described,), space)()


def _built(description: PluginDict) -> BSDFPlugin:
    """Build the plugin that a dictionary describes. Raises InputError if Mitsuba rejects it."""
    mi = mitsuba()
    kind = str(description.get("type", ""))
    _check_plugins(description, f"mitsuba:{kind}")
    try:
        with file_threads():
            bsdf = mi.load_dict(description, parallel=False)
    except Exception as error:
        raise rejected(error, kind) from None
    if not isinstance(bsdf, mi.BSDF):
        raise InputError(f"'{kind}' is a {type(bsdf).__name__}, a BSDF expected", f"mitsuba:{kind}")
    return bsdf


def _check_plugins(description: Mapping[str, object], location: str) -> None:
    """Raise InputError if a dictionary, or one nested in it, names a plugin that must not be loaded."""
    kind = description.get("type")
    if kind == "resources":
        raise InputError("'resources' given, but a BSDF has no search folders", location, "give the paths of files")
    if isinstance(kind, str) and kind not in ("rgb", "ref"):
        plugin_search.check(kind, location)
    for value in description.values():
        if isinstance(value, Mapping):
            _check_plugins(value, location)


def _albedos(bsdf: BSDFPlugin) -> dict[str, float | tuple[float, ...]]:
    """The albedos of a plugin that are constant numbers or colors."""
    import mitsuba as mi

    held = mi.traverse(bsdf)
    result = {}
    for name in ALBEDOS:
        if f"{name}.value" in held:
            values = np.asarray(held[f"{name}.value"], float).ravel()
            result[name] = float(values[0]) if values.size == 1 else tuple(map(float, values))
    return result


def _is_bsdf(value: object) -> bool:
    """Whether a property describes a BSDF; textures and spectra are dictionaries as well."""
    if not isinstance(value, Mapping):
        return False
    try:
        _built(dict(value))
    except InputError:
        return False
    return True


def plugins() -> list[str]:
    """The names of the BSDF plugins that Mitsuba ships."""
    return sorted(_NESTS)


# Mitsuba does not report the kind of a plugin without building it; these are the properties that each plugin requires.
_DIFFUSE = {"type": "diffuse"}
_NESTS: dict[str, PluginDict] = {
    "blendbsdf": {"weight": 0.5, "a": _DIFFUSE, "b": {"type": "roughconductor"}},
    "bumpmap": {"bsdf": _DIFFUSE},
    "circular": {},
    "conductor": {},
    "dielectric": {},
    "diffuse": {},
    "hair": {},
    "mask": {"opacity": 0.5, "bsdf": _DIFFUSE},
    "measured": {},
    "measured_polarized": {},
    "normalmap": {"normalmap": {"type": "rgb", "value": [0.5, 0.5, 1.0]}, "bsdf": _DIFFUSE},
    "null": {},
    "plastic": {},
    "polarizer": {},
    "pplastic": {},
    "principled": {},
    "principledthin": {},
    "retarder": {},
    "roughconductor": {},
    "roughdielectric": {},
    "roughplastic": {},
    "thindielectric": {},
    "twosided": {"bsdf": {"type": "roughconductor"}},
}

# A shading frame that is tilted relative to the surface has a preferred direction, and its cosines differ from those of
# the surface (Veach1997, section 5.3). For this reason, Mitsuba's manual calls these two plugins an approximation.
_TILTED_FRAME = {
    "isotropy": "the shading normal is tilted to one side and rotates with the surface",
    "reciprocity": "the cosine of wi is not taken with respect to the surface normal (Veach1997, section 5.3)",
    "energy": "light that the tilted frame reflects below the surface is cut off in one direction only",
}
_BY_NATURE: dict[str, dict[str, str]] = {
    "bumpmap": _TILTED_FRAME,
    "normalmap": _TILTED_FRAME,
    "hair": {
        "reciprocity": "the offset at which the ray along wo hits the fiber is fixed, but differs on the reverse path",
        "isotropy": "a fiber has an axis",
    },
}


def plugin(name: str, properties: Mapping[str, object]) -> MitsubaBSDF:
    """A plugin with a given name and properties. If it requires nested BSDFs, these are diffuse."""
    more: PluginDict = {}
    if name == "bumpmap" and "texture" not in properties:
        ramp = np.linspace(0.0, 0.2, 16, dtype=np.float32)
        heights = mitsuba().Bitmap(np.ascontiguousarray(ramp[None, :, None]))
        more = {"texture": {"type": "bitmap", "bitmap": heights, "raw": True}}
    return load({"type": name, **_NESTS.get(name, {}), **more, **properties})


_registered: dict[Path, dict[str, object]] = {}  # plugins by the path of the file that registered them


def plugin_in(target: str, properties: Mapping[str, object]) -> MitsubaBSDF | None:
    """The plugin FILE.py:NAME, where NAME is the name under which the file registers a plugin, or the plugin's class.

    Returns None if the file registers no such plugin.
    """
    path = Path(os.path.expanduser(target.rpartition(":")[0])).resolve()
    name = target.rpartition(":")[2]
    if not path.is_file() or b"mitsuba" not in path.read_bytes():
        return None
    mi = mitsuba()
    register, registered = mi.register_bsdf, _registered.setdefault(path, {})

    def record(kind: str, make: object, *more: object) -> None:
        registered[kind] = make
        register(kind, make, *more)

    vars(mi)["register_bsdf"] = record
    try:
        module = outside.module_of(path, "TARGET")
    finally:
        vars(mi)["register_bsdf"] = register
    cls = vars(module).get(name)
    if name not in registered and not outside.is_plugin(cls):
        return None
    kind = name if name in registered else _name_of(cls, registered, target.rpartition(":")[0])
    return load({"type": kind, **properties})


def _name_of(cls: object, registered: Mapping[str, object], file: str) -> str:
    """The name under which a file registers a plugin class, directly or through a function that constructs it.

    Raises InputError if the file does not register the class.
    """
    name = getattr(cls, "__name__", "")
    by_class = next((kind for kind, make in registered.items() if make is cls), "")
    if by_class:
        return by_class
    for kind in registered:
        with contextlib.suppress(InputError):  # the plugin may require properties
            if type(_built({"type": kind})) is cls:
                return kind
    known = [f"{file}:{kind}" for kind in registered]
    hint = f"name a registered plugin: {', '.join(known)}" if known else f"add mi.register_bsdf('NAME', {name})"
    raise InputError(f"the file registers no plugin of the class {name}", file, hint)


def mitsuba() -> ModuleType:
    """Load Mitsuba in an LLVM variant, and register Gonio's plugins."""
    mi = engine.load()
    if not mi.variant().startswith("llvm_"):
        what = f"variant {mi.variant()} is set, an LLVM variant expected"
        raise InputError(what, "mitsuba", "verify in another process")
    adapter.register(mi)
    mi.set_log_level(mi.LogLevel.Error)
    return mi


def rejected(error: Exception, name: str) -> InputError:
    """Convert an error of Mitsuba, raised for the dictionary of the plugin `name`, to an InputError."""
    text = " ".join(str(error).split())
    if "not found" in text and ("Plugin" in text or "plugin" in text):
        return InputError(f"Mitsuba has no plugin '{name}'", f"mitsuba:{name}", did_you_mean(name, plugins()))
    # Mitsuba's message begins with source lines and the object's description; its last sentence states the problem
    return InputError(f"Mitsuba rejects it: {'...' + text[-200:] if len(text) > 200 else text}", f"mitsuba:{name}")
