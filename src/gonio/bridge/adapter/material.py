"""A material in a Mitsuba scene, whose parameters are read from properties of a plugin and bound at hit points."""

from __future__ import annotations

import warnings

import drjit as dr

from ...errors import InputError, did_you_mean
from ...material import BSDF, binding, guide_search, tree
from ...materials.combined.two_sided import TwoSided
from ..native import MitsubaBSDF
from ..types import BSDFPlugin, Float, Mask, OfVariant, Properties, SurfaceInteraction, TraversalCallback
from .slots import NamedPreset, Slot
from .variant import Variant


def plugin_name(model_name: str) -> str:
    """The name of a model's plugin: that of "blinn-phong" is `gonio_blinn_phong`."""
    return "gonio_" + model_name.replace("-", "_")


class PlacedMaterial:
    """A material and the sources of its parameter values.

    model    the material with plain values, from which its properties are determined; a texture is represented by its
             range, and a nested Mitsuba plugin by a `MitsubaBSDF`
    slots    source of the value of each numeric parameter
    inner    plugins of the nested materials: Mitsuba's plugins, and Gonio's with their placed materials
    derived  quantities derived from the parameters, computed once if the parameters are the same at every hit
    """

    def __init__(self, variant: Variant, props: Properties, model: type[BSDF]) -> None:
        self.variant, self.name = variant, plugin_name(model.name)
        preset = _preset(props, model)
        sides = props.get("two_sided", False)
        if not isinstance(sides, bool):
            raise InputError(f"'{sides}' given, true or false expected", f"{self.name}.two_sided")
        self.slots: dict[str, Slot] = {}
        self.inner: dict[str, tuple[BSDFPlugin, PlacedMaterial | MitsubaBSDF]] = {}
        values: dict[str, OfVariant] = {}
        for name, parameter in model.parameters().items():
            location = f"{self.name}.{name}"
            if parameter.inner:
                self.inner[name] = self._child(props, name)
                held = self.inner[name][1]
                values[name] = held.model if isinstance(held, PlacedMaterial) else held
            elif parameter.numeric:
                self.slots[name] = Slot(variant, props, parameter, location, preset)
                values[name] = self.slots[name].plain
            else:
                values[name] = props.get(name, preset.values.get(name, parameter.default))
                parameter.check(values[name], location)
        unknown = list(props.unqueried())
        if unknown:
            hint = did_you_mean(unknown[0], [*model.parameters(), "two_sided"])
            raise InputError(f"unknown property '{unknown[0]}'", self.name, hint)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the slots have already issued these warnings
            self.model: BSDF = model(**values)
        if variant.channels != 3 and any(inner.only_rgb for _, inner in tree.walk(self.model)):
            what = f"{self.model.name} supports only red, green and blue, but {variant.mi.variant()} is set"
            raise InputError(what, self.name, "render in an RGB variant, such as llvm_ad_rgb")
        for name in ("absorption", "priority"):
            if name in self.slots and self.slots[name].varies:
                raise InputError("a texture given, but the interior has no uv coordinates", f"{self.name}.{name}")
        self.sides = TwoSided(self.model) if sides and not (self.model.transmits or self.model.back_differs) else None
        self.derived: OfVariant = None
        self.derive()

    def _child(self, props: Properties, name: str) -> tuple[BSDFPlugin, PlacedMaterial | MitsubaBSDF]:
        child = props.get(name, None)
        if not isinstance(child, self.variant.mi.BSDF):
            raise InputError(f"no material '{name}' given", self.name)
        return child, getattr(child, "placed", None) or MitsubaBSDF(child)

    def derive(self) -> None:
        """Compute the derived quantities once, if the parameter values are the same at every hit."""
        self.derived = None
        if self.varies and self.model.needs_uniform:
            what = "a texture given, but this base needs tables, which are computed for colors and numbers"
            raise InputError(what, f"{self.name}.base", "conductor and dielectric take textures")
        guide_search.prepare(self.model)  # here, because no guide can be computed while an integrator records a loop
        if self.model.derives and not self.varies:
            self.derived = binding.evaluate_derived(
                self.at(dr.zeros(self.variant.mi.SurfaceInteraction3f), True, inner=True)
            )

    @property
    def varies(self) -> bool:
        """Whether a parameter of this material or of a nested one differs between hits.

        This is the case for textures, and for spectra, which are evaluated at the wavelengths of the ray.
        """
        return (
            self._by_wavelength
            or any(slot.textures or slot.curves for slot in self.slots.values())
            or any(isinstance(held, MitsubaBSDF) or held.varies for _, held in self.inner.values())
        )

    @property
    def _by_wavelength(self) -> bool:
        """Whether the model depends on the wavelengths of the rays."""
        return self.variant.spectral and self.model.reads_wavelengths

    @property
    def disperses(self) -> bool:
        """Whether an index of refraction of this material or of a nested one depends on the wavelength."""
        return any(slot.curves for slot in self.slots.values()) or any(
            isinstance(held, PlacedMaterial) and held.disperses for _, held in self.inner.values()
        )

    def at(
        self,
        si: SurfaceInteraction,
        active: Mask,
        separates: bool = False,
        outer: Float | None = None,
        inner: bool = False,
    ) -> BSDF:
        """The model, whose parameters are bound to their values at a surface interaction.

        separates  whether a dispersive index is evaluated at the first wavelength of the ray
        outer      index of refraction outside the surface, by which the indices inside are divided
        inner      whether this material is nested in another, which then determines whether both sides are shaded
        """
        values = {name: slot.at(si, active, separates, outer) for name, slot in self.slots.items()}
        for name, (_, held) in self.inner.items():
            values[name] = (
                held.at(si, active) if isinstance(held, MitsubaBSDF) else held.at(si, active, separates, outer, True)
            )
        if self._by_wavelength:
            values["wavelengths"] = self.variant.spectrum(si.wavelengths)
        if self.model.reads_surface:
            x, y = si.sh_frame.s, si.sh_frame.t
            values["surface"] = (dr.dot(si.dp_du, x), dr.dot(si.dp_dv, x), dr.dot(si.dp_dv, y))
        # The derived quantities have been computed for indices relative to vacuum.
        bound = binding.bound_copy(self.model, values, self.derived if outer is None else None)
        return binding.bound_copy(self.sides, {"base": bound}) if self.sides is not None and not inner else bound

    def traverse(self, callback: TraversalCallback) -> None:
        """Report every value that can be changed to Mitsuba, through the callback."""
        flag = self.variant.mi.ParamFlags.Differentiable
        for slot in self.slots.values():
            for name, value in {**slot.values, **slot.textures}.items():
                callback.put(name, value, flag)
        for name, (plugin, _) in self.inner.items():
            callback.put(name, plugin, flag)

    def changed(self) -> None:
        """Update everything that depends on the values; called after a change."""
        for slot in self.slots.values():
            dr.make_opaque(*slot.values.values())
        if self.follows:
            self.model = self.now()
            self.sides = TwoSided(self.model) if self.sides is not None else None
        self.derive()

    @property
    def follows(self) -> bool:
        """Whether the model must have the current parameter values.

        This is the case if tables are computed from them, or if they can switch off layers, for which no code is then
        generated.
        """
        layers = any(leaf.parameter.off is not None for leaf in tree.leaves(self.model))
        return layers or bool(self.model.fixed)

    def now(self) -> BSDF:
        """The model with the current values of the parameters that are constant over the surface."""
        inner = {name: held.now() for name, (_, held) in self.inner.items() if isinstance(held, PlacedMaterial)}
        return tree.rebuild(self.model, {**{name: slot.now() for name, slot in self.slots.items()}, **inner})


def _preset(props: Properties, model: type[BSDF]) -> NamedPreset:
    """The preset named by the properties, or a preset without values if they name none."""
    known = model.presets()
    if "preset" not in props or not known:
        return NamedPreset("", {})
    made = model.preset(props["preset"])
    key = next(key for key, preset in known.items() if all(getattr(made, n) == v for n, v in preset.values.items()))
    return NamedPreset(key, known[key].values)
