"""NumPy: a Python file of float64 arrays, the reference for other implementations."""

from __future__ import annotations

from ._python import Python


class NumPy(Python):
    """A Python file for NumPy."""

    name = "numpy"
    title = "Python with NumPy"
    precision = "Values are float64."
    decorator = '@np.errstate(all="ignore")'
    imports = '''
import numpy as np

exp, log, sin, cos, floor, isfinite, copysign = map(_each, (np.exp, np.log, np.sin, np.cos, np.floor, np.isfinite,
                                                            np.copysign))
sqrt, minimum, maximum, atan2, where = map(_each, (np.sqrt, np.minimum, np.maximum, np.arctan2, np.where))
erf = _each(np.vectorize(math.erf, otypes=[float]))


def _numbers(values, like=None):
    """An array of float64."""
    return np.asarray(values, dtype=np.float64)


def _stored(values):
    """The values of a table."""
    return np.array(values)


def _texel(stored, index, like):
    """Entries of a table, of the type of `like`."""
    return stored[index]


def _integers(x):
    return x.astype(np.int64)


def _broadcast(*arrays):
    return np.broadcast_arrays(*arrays)


def _stack(arrays):
    return np.stack(arrays, axis=-1)
'''
