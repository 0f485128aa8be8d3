"""Replace thousands of materials that differ only in numeric parameters by one material.

Dr.Jit traces the code of every material of a scene, which takes 0.2 ms per material and vertex. If many shapes have
materials with the same structure, one plugin replaces all of these, and each parameter that differs is a texture, which
is indexed by the shape that was hit.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from types import ModuleType
from typing import TypeAlias

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from ...bridge import plugin_search
from ...bridge.faults.borrowed_memory import own
from ...bridge.types import Color, Float, Mask, OfVariant, PluginDict, Properties, Scene, SurfaceInteraction, Texture

Numbers: TypeAlias = tuple[float, ...]  # a number, or red, green and blue
Place: TypeAlias = tuple[str, ...]  # path of a property: the names of the enclosing plugins, then that of the property

PLUGIN = "gonio_by_shape"
_NO_TEXTURE = ("absorption", "priority")  # properties of the interior, which cannot be textures


@dataclass
class Group:
    """Materials with the same structure.

    prototype  plugin of the first material
    rows       values of the properties that may differ, one mapping per material
    shapes     index of the material of each shape, by the name of the shape
    """

    prototype: PluginDict
    rows: list[dict[Place, Numbers]] = field(default_factory=list)
    shapes: dict[str, int] = field(default_factory=dict)
    textures: dict[Place, Texture] = field(default_factory=dict)

    def plugin(self, mi: ModuleType) -> PluginDict:
        """One material for all shapes of the group. `bind` must be called when the shapes are in a scene."""
        _register(mi)
        for place, first in self.rows[0].items():
            if any(row[place] != first for row in self.rows):
                texture = mi.load_dict({"type": PLUGIN})
                texture.hold(np.array([row[place] for row in self.rows]))
                self.textures[place] = texture
        return _replaced(self.prototype, self.textures)

    def bind(self, numbers: Mapping[str, int]) -> None:
        """Bind the textures to shapes.

        numbers  the number that identifies each shape in kernels, by the name of the shape
        """
        size = 1 + max(numbers.values())
        row = np.zeros(size, np.intp)
        row[[numbers[name] for name in self.shapes]] = list(self.shapes.values())
        for texture in self.textures.values():
            texture.bind(row)


def structure(plugin: PluginDict) -> Hashable:
    """A key that is equal for plugins that differ only in numbers; None for plugins with other data, such as images."""
    parts: list[Hashable] = []
    for name, value in plugin.items():
        if isinstance(value, dict) and value["type"] != "rgb":
            inner = structure(value) if str(value["type"]).startswith("gonio_") else None
            if inner is None:
                return None
            parts.append((name, inner))
        elif name not in _NO_TEXTURE and _numbers(value) is not None:
            parts.append(name)
        else:
            parts.append((name, repr(value)))
    return tuple(parts)


def properties(plugin: PluginDict, outer: Place = ()) -> Iterator[tuple[Place, Numbers]]:
    """The numbers in which plugins with the same structure may differ."""
    for name, value in plugin.items():
        result = None if name in _NO_TEXTURE else _numbers(value)
        if result is not None:
            yield (*outer, name), result
        elif isinstance(value, dict) and value["type"] != "rgb":
            yield from properties(value, (*outer, name))


def bind(mi: ModuleType, scene: Scene, groups: Iterable[Group]) -> None:
    """Bind the textures of all groups to the shapes of a scene."""
    numbers = np.array(dr.reinterpret_array(mi.UInt32, scene.shapes_dr()))
    named = {shape.id(): int(number) for shape, number in zip(scene.shapes(), numbers, strict=True)}
    for group in groups:
        group.bind(named)


def _numbers(value: object) -> Numbers | None:
    if isinstance(value, float):
        return (value,)
    return tuple(value["value"]) if isinstance(value, dict) and value["type"] == "rgb" else None


def _replaced(plugin: PluginDict, values: Mapping[Place, Texture], outer: Place = ()) -> PluginDict:
    result: PluginDict = {}
    for name, value in plugin.items():
        here = (*outer, name)
        if here in values:
            result[name] = values[here]
        elif isinstance(value, dict) and value["type"] != "rgb":
            result[name] = _replaced(value, values, here)
        else:
            result[name] = value
    return result


def _register(mi: ModuleType) -> None:
    if mi.variant() not in _known:
        _known[mi.variant()] = _texture_class(mi)
    made = _known[mi.variant()]
    plugin_search.register(mi.register_texture, PLUGIN, lambda props: made(props))


_known: dict[str, OfVariant] = {}  # variant -> class


def _texture_class(mi: ModuleType) -> OfVariant:
    base: OfVariant = mi.Texture

    class ByShape(base):
        """A texture with one number or one color per shape."""

        def __init__(self, props: Properties) -> None:
            base.__init__(self, props)
            self.rows: NDArray[np.float64] = np.zeros((1, 1))
            self.table = mi.Float(0.0)

        def hold(self, rows: NDArray[np.float64]) -> None:
            self.rows = rows

        @property
        def span(self) -> NDArray[np.float64]:
            """The smallest and the largest value of each channel, (2, 1) or (2, 3)."""
            return np.array([self.rows.min(axis=0), self.rows.max(axis=0)])

        def bind(self, row: NDArray[np.intp]) -> None:
            """Set the row of each shape, indexed by the number of the shape in kernels."""
            self.table = own(mi.Float, self.rows[row].ravel().astype(np.float32))

        def is_spatially_varying(self) -> bool:
            return True

        def eval(self, si: SurfaceInteraction, active: Mask = True) -> Color:
            return mi.UnpolarizedSpectrum(dr.gather(mi.Color3f, self.table, self._number(si), active))

        def eval_1(self, si: SurfaceInteraction, active: Mask = True) -> Float:
            return dr.gather(mi.Float, self.table, self._number(si), active)

        def _number(self, si: SurfaceInteraction) -> OfVariant:
            return dr.reinterpret_array(mi.UInt32, si.shape)

        def to_string(self) -> str:
            return f"ByShape[{len(self.rows)} materials]"

    return ByShape
