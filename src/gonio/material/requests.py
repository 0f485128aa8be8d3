"""Derivatives with respect to parameters, and values at wavelengths, from one call.

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

# a call of one of a material's methods for fixed directions: (bound material) -> Dr.Jit value
Formula = Callable[[Any], Any]


def slopes(material: Material, paths: Sequence[str], formula: Formula, types: backend.Types) -> list[backend.Array]:
    """The value of a formula, followed by its derivative with respect to each parameter, in forward mode.

    paths    paths of numbers and colors, "alpha" or "base.albedo", or of one channel of a color, "albedo.r". The
             derivative for a pair of widths or a whole color is that for an equal change of all its values
    formula  function of a bound material that returns a Dr.Jit value
    Raises InputError for any other path.
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
    """The parameter at a path, and the index of the color channel in the path; None if the path names no channel."""
    leaves = {leaf.path: leaf for leaf in tree.leaves(material) if leaf.parameter.numeric}
    if path in leaves:
        return leaves[path], None
    above, _, channel = path.rpartition(".")
    if channel in CHANNELS and above in leaves and leaves[above].parameter.kind == "spectrum":
        return leaves[above], CHANNELS.index(channel)
    hint = did_you_mean(str(path), list(leaves))
    raise InputError(f"'{path}' is not a number or color of {type(material).__name__}", "derivatives", hint)


def at_wavelengths(
    material: Any, wavelengths: ArrayLike, formula: Formula, types: backend.Types
) -> list[backend.Array]:
    """The values of a formula at each wavelength, including the dispersion of named indices and interference in films.

    wavelengths  wavelengths in vacuum, nm, (M,)
    formula      function of a bound material that returns a Dr.Jit value
    Raises InputError for colors whose channels differ, because three numbers are not a spectrum.
    """
    nm = np.atleast_1d(np.asarray(wavelengths, float))
    if nm.ndim != 1 or not nm.size or not np.all(np.isfinite(nm) & (nm > 0.0)):
        raise InputError("wavelengths must be positive numbers, (M,)", "wavelengths", "in nm, such as [450, 550, 650]")
    for leaf in tree.leaves(material):
        if leaf.parameter.kind == "spectrum" and np.ptp(np.asarray(leaf.value, float), axis=-1).max(initial=0.0) > 0.0:
            hint = "give one number for each wavelength in turn; go.refractive_index has those of metals"
            raise InputError(f"{leaf.path} is a color, which is not a spectrum", "wavelengths", hint)
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
    """The bound copy for rays of these wavelengths, including its inner materials."""
    inner = {name: _with_wavelengths(one, wavelengths) for name, one in tree.children(bound).items()}
    return binding.bound_copy(bound, {**inner, "wavelengths": wavelengths}, bound._derived)
