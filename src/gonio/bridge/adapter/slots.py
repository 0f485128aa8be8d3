"""The sources of a plugin's parameter values: Dr.Jit numbers and colors, or textures.

Numbers and colors are opaque, so changing a value does not recompile kernels. Textures are evaluated at each hit. The
roughness may be given as `alpha`, or as `alpha_x` and `alpha_y`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

import drjit as dr
import numpy as np

from ... import ops
from ...errors import InputError
from ...material import Parameter
from ...material.parameters import IndexParameter
from ...optics.dispersion import DispersiveIndex
from ..types import Float, Mask, OfVariant, Properties, SurfaceInteraction, Texture
from .variant import Variant

Plain: TypeAlias = OfVariant  # a number, a color or a pair of alphas, as a material's constructor takes them


class NamedPreset(NamedTuple):
    """A preset: its short name and its values."""

    name: str
    values: Mapping[str, Plain]


class Slot:
    """A numeric parameter of a plugin.

    values    opaque values, by property ("alpha", or "alpha_x" and "alpha_y")
    textures  textures, by property
    curves    dispersive indices of refraction, by property: eta at each nanometer
    plain     plain numbers within the range of the parameter; for a texture, its lowest and highest value
    """

    def __init__(self, variant: Variant, props: Properties, parameter: Parameter, location: str, preset: NamedPreset):
        self.variant, self.parameter, self.location = variant, parameter, location
        self.values: dict[str, Float] = {}
        self.textures: dict[str, Texture] = {}
        self.curves: dict[str, Float] = {}
        self.names = self._names(props)
        plain = [self._read(props, name, preset) for name in self.names]
        self.plain: Plain = (plain[0], plain[1]) if len(plain) == 2 else plain[0]

    def _names(self, props: Properties) -> list[str]:
        name = self.parameter.name
        both = [f"{name}_x", f"{name}_y"]
        if self.parameter.kind != "alpha" or not any(one in props for one in both):
            return [name]
        if not all(one in props for one in both) or name in props:
            raise InputError(f"give {name}, or both {both[0]} and {both[1]}", self.location)
        return both

    def _read(self, props: Properties, name: str, preset: NamedPreset) -> Plain:
        """Read a property, or else the value of the preset or the default, into `values` or `textures`."""
        parameter, variant = self.parameter, self.variant
        kinds = variant.mi.Properties.Type
        if name in props:
            given = props.type(name)
            if given == kinds.String and isinstance(parameter, IndexParameter):
                return self._constant(name, parameter.coerce(str(props[name]), self.location))
            if given == kinds.String:
                raise InputError(f"'{props[name]}' given, a number or a texture expected", self.location)
            if given in (kinds.Float, kinds.Integer):
                return self._constant(name, float(props[name]))
            if given == kinds.Color:
                color = np.asarray(props[name], dtype=float).ravel()
                if not variant.spectral:
                    return self._constant(name, color)
                # Mitsuba's own conversion of colors to spectra is exact for reflectances, and clamps an index to 1
                if np.max(color) > 1.0:
                    return self._through_rgb(name, color)
                self._texture(name, props.get_unbounded_texture(name))
                return color  # a color does not vary over the surface
            return self._texture(name, props.get_unbounded_texture(name))
        if parameter.required and name not in preset.values:
            raise InputError("missing", self.location, parameter.doc)
        value = preset.values.get(name, parameter.default)
        if np.ndim(value) == 0 or not variant.spectral:
            return self._constant(name, value)
        measured = variant.measured(preset.name, name) if name in preset.values else None
        if measured is None:
            return self._through_rgb(name, value)
        self.textures[name] = measured
        return value

    def _through_rgb(self, name: str, value: Any) -> Plain:
        """A spectrum for a color that may exceed 1, as indices of refraction do."""
        if np.min(value) < 0.0:
            what = f"{np.min(value):g} given, but a negative color has no spectrum"
            raise InputError(what, self.location, "render it in an RGB variant, such as llvm_ad_rgb")
        self.parameter.check(value, self.location)
        self.textures[name] = self.variant.through_rgb(value)
        return value  # type: ignore[no-any-return]

    def _constant(self, name: str, value: Plain) -> Plain:
        self.parameter.check(value, self.location)
        if self.parameter.kind == "angle" and value == 0:
            return value  # a constant, so no code for a rotation is compiled
        if self.variant.spectral and isinstance(value, DispersiveIndex) and value.constants.disperses:
            self.curves[name] = self.variant.dispersion(value.constants)
        if self.parameter.kind == "spectrum":
            self.values[name] = self.variant.constant(value)
        else:
            self.values[name] = self.variant.mi.Float(float(value))
        dr.make_opaque(self.values[name])
        return value

    def _texture(self, name: str, texture: Texture) -> Plain:
        if self.parameter.kind == "spectrum":
            color = self.variant.uniform(texture)
            if color is not None:
                self.values[name] = color
                return np.broadcast_to(np.asarray(color).ravel(), 3)
        self.textures[name] = texture
        span = getattr(texture, "span", None)  # Gonio's textures have this method
        if span is not None:
            for plain in span:
                self.parameter.check(plain if self.parameter.kind == "spectrum" else float(plain[0]), self.location)
            return span if self.parameter.kind == "spectrum" else span[:, 0]
        span = np.array([max(self.parameter.low, 0.0), min(self.parameter.high, 1.0)])
        return np.tile(span[:, None], 3) if self.parameter.kind == "spectrum" else span

    @property
    def varies(self) -> bool:
        """Whether the value differs between points of the surface."""
        return any(texture.is_spatially_varying() for texture in self.textures.values())

    def now(self) -> Plain:
        """The current values as numbers, clamped to the range of the parameter; `plain` for textures and curves."""
        if self.textures or self.curves or self.variant.spectral or not self.values:
            return self.plain
        parameter = self.parameter
        values = [
            np.clip(np.asarray(dr.detach(v), float).ravel(), parameter.low, parameter.high)
            for v in self.values.values()
        ]
        if parameter.kind == "spectrum":
            return tuple(np.broadcast_to(values[0], 3).tolist())
        return tuple(float(value[0]) for value in values) if len(values) == 2 else float(values[0][0])

    def at(
        self, si: SurfaceInteraction, active: Mask, separates: bool = False, outer: Float | None = None
    ) -> OfVariant:
        """The value at a surface interaction, in the form that `Parameter.bind` returns.

        separates  whether a dispersive index is evaluated at the first wavelength of the ray
        outer      index of refraction outside the surface, by which an index is divided
        """
        kind = self.parameter.kind
        result = dict(self.values)
        for name, curve in self.curves.items() if separates else ():
            result[name] = self.variant.interpolated(curve, si.wavelengths[0], active)
        for name, texture in self.textures.items():
            result[name] = texture.eval(si, active) if kind == "spectrum" else texture.eval_1(si, active)
        if outer is not None and isinstance(self.parameter, IndexParameter):
            return result[self.parameter.name] / outer
        if kind == "alpha":
            return ops.vec2(result[self.names[0]], result[self.names[-1]])
        if kind == "angle":
            return ops.vec2(*reversed(ops.sincos(*result.values()))) if result else None
        return result[self.parameter.name]
