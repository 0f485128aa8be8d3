"""More than values from one call: derivatives by parameters, and values at wavelengths.

value, slope = gold.eval(wo, wi, derivatives=["alpha"])
go.Dielectric("bk7", 0.1).eval(wo, wi, wavelengths=[450.0, 550.0, 650.0])     # (N, 3), one column per wavelength
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, did_you_mean
from ..ops import backend
from ..optics.indices import DispersiveIndex
from . import binding, tree
from .parameters import Material

CHANNELS = ("r", "g", "b")

# values of a material, of which `eval` is a formula for Dr.Jit values: (bound material) -> Dr.Jit value
Formula = Callable[[Any], Any]


def slopes(material: Material, paths: Sequence[str], formula: Formula, types: backend.Types) -> list[backend.Array]:
    """The value of a formula, and its derivative by each parameter, in forward mode.

    paths  numbers and colors: "alpha", "base.albedo", or one channel of a color, "albedo.r". By a pair of widths or a
           color as a whole all of its values move together
    Raises InputError for anything else.
    """
    results = [formula(binding.bind_to(material, types))]
    dr = backend.drjit()
    for path in paths:
        leaf, channel = _leaf(material, path)
        # an angle is bound as its cosine and sine
        value = (backend.float_of if leaf.parameter.kind == "angle" else leaf.parameter.bind)(leaf.value, types)
        dr.enable_grad(value)
        moved = formula(binding.bind_to(tree.replace(material, {leaf.path: value}), types))
        one = types.float(1.0)
        direction = one if channel is None else types.vec3(*[float(k == channel) for k in range(3)])
        dr.set_grad(value, direction)
        results.append(dr.forward_to(moved) if dr.grad_enabled(moved) else moved * 0.0)
    results[0] = dr.detach(results[0])
    return results


def _leaf(material: Material, path: str) -> tuple[tree.Leaf[Any], int | None]:
    """The parameter at a path, and the channel of its color; None for all of it."""
    leaves = {leaf.path: leaf for leaf in tree.leaves(material) if leaf.parameter.numeric}
    if path in leaves:
        return leaves[path], None
    above, _, channel = path.rpartition(".")
    if channel in CHANNELS and above in leaves and leaves[above].parameter.kind == "spectrum":
        return leaves[above], CHANNELS.index(channel)
    hint = did_you_mean(str(path), list(leaves))
    raise InputError(f"'{path}' is no number or color of {type(material).__name__}", "derivatives", hint)


def at_wavelengths(
    material: Any, wavelengths: ArrayLike, formula: Formula, types: backend.Types
) -> list[backend.Array]:
    """The values of a formula at each wavelength, one Dr.Jit float each.

    wavelengths  nm, in vacuum
    Indices by name follow their dispersion, and films interfere, at each of them. Raises InputError for colors with
    different channels: three numbers are no spectrum.
    """
    nm = np.atleast_1d(np.asarray(wavelengths, float))
    if nm.ndim != 1 or not nm.size or not np.all(np.isfinite(nm) & (nm > 0.0)):
        raise InputError("wavelengths are positive numbers, (M,)", "wavelengths", "in nm, such as [450, 550, 650]")
    for leaf in tree.leaves(material):
        if leaf.parameter.kind == "spectrum" and np.ptp(np.asarray(leaf.value, float), axis=-1).max(initial=0.0) > 0.0:
            hint = "give one number for each wavelength in turn; go.refractive_index has those of metals"
            raise InputError(f"{leaf.path} has red, green and blue, which are no spectrum", "wavelengths", hint)
    results = []
    for one in nm:
        at = {
            leaf.path: float(leaf.value.constants.at(one).eta)
            for leaf in tree.leaves(material)
            if isinstance(leaf.value, DispersiveIndex)
        }
        bound = binding.bind_to(tree.replace(material, at) if at else material, types)
        length = backend.float_of(float(one), types)
        results.append(formula(_with_wavelengths(bound, types.vec3(length, length, length))))
    return results


def _with_wavelengths(bound: Any, wavelengths: backend.Array) -> Any:
    """The bound copy, inner materials' included, for rays of these wavelengths."""
    inner = {name: _with_wavelengths(one, wavelengths) for name, one in tree.children(bound).items()}
    return binding.bound_copy(bound, {**inner, "wavelengths": wavelengths}, bound._derived)
