"""JAX: a Python file of arrays, with gradients; `jax.jit` and `jax.grad` can be applied to its functions."""

from __future__ import annotations

from ._python import Python


class JAX(Python):
    """A Python file for JAX."""

    name = "jax"
    title = "Python with JAX"
    precision = "Values are in double precision if `jax_enable_x64` is set."
    imports = '''
import jax
import jax.numpy as jnp
import numpy as np


def _root(x):
    """The square root, with gradient 0 where x is 0."""
    return jnp.where(x == 0.0, x, jnp.sqrt(jnp.where(x == 0.0, 1.0, x)))


exp, log, sin, cos, floor, isfinite, erf = map(_each, (jnp.exp, jnp.log, jnp.sin, jnp.cos, jnp.floor, jnp.isfinite,
                                                       jax.scipy.special.erf))
sqrt, where = _each(_root), _each(jnp.where)
minimum, maximum, atan2, copysign = map(_each, (jnp.minimum, jnp.maximum, jnp.arctan2, jnp.copysign))


def _numbers(values, like=None):
    """An array of floats: of 64 bits if JAX has them switched on."""
    return jnp.asarray(values, dtype=float)


def _stored(values):
    """The values of a table."""
    return np.array(values)


def _texel(stored, index, like):
    """Entries of a table, of the type of `like`, which is a number where the place is constant."""
    return jnp.asarray(stored, dtype=getattr(like, "dtype", float))[index]


def _integers(x):
    return x.astype(int)


def _broadcast(*arrays):
    return jnp.broadcast_arrays(*arrays)


def _stack(arrays):
    return jnp.stack(arrays, axis=-1)
'''
