"""PyTorch: a Python file of tensors, with gradients."""

from __future__ import annotations

from ._python import Python


class Torch(Python):
    """A Python file for PyTorch."""

    name = "torch"
    title = "Python with PyTorch"
    precision = "Values have the type and device of the directions; autograd computes gradients."
    imports = '''
import torch


def _tensor(x, like):
    return x if isinstance(x, torch.Tensor) else torch.as_tensor(x, dtype=like.dtype, device=like.device)


def _pair(function):
    """A function of two tensors or numbers; of two numbers the result is a number."""
    def apply(a, b):
        like = a if isinstance(a, torch.Tensor) else b
        if not isinstance(like, torch.Tensor):
            return function(*torch.tensor([a, b], dtype=torch.float64)).item()
        return function(_tensor(a, like), _tensor(b, like))
    return _each(apply)


def _root(x):
    """The square root, with gradient 0 where x is 0."""
    return torch.where(x == 0.0, x, torch.sqrt(torch.where(x == 0.0, 1.0, x)))


def _select(mask, a, b):
    if isinstance(mask, bool):
        return a if mask else b
    if isinstance(a, torch.Tensor) or isinstance(b, torch.Tensor) or isinstance(a, bool):
        return torch.where(mask, a, b)
    exact = float(torch.tensor(a)) == a and float(torch.tensor(b)) == b  # then any type holds them
    return torch.where(mask, *((a, b) if exact else torch.tensor([a, b], dtype=torch.float64, device=mask.device)))


def _single(function):
    """A function of a tensor or a number."""
    def apply(x):
        if isinstance(x, torch.Tensor):
            return function(x)
        return function(torch.tensor(x, dtype=torch.float64)).item()
    return _each(apply)


exp, log, sin, cos, floor, isfinite, erf, sqrt = map(_single, (torch.exp, torch.log, torch.sin, torch.cos, torch.floor,
                                                               torch.isfinite, torch.erf, _root))
where = _each(_select)
minimum, maximum, atan2, copysign = map(_pair, (torch.minimum, torch.maximum, torch.atan2, torch.copysign))


def _numbers(values, like=None):
    """A tensor of the type and device of the directions."""
    if isinstance(values, torch.Tensor):
        return values if values.is_floating_point() else values.to(torch.get_default_dtype())
    if like is None:
        return torch.as_tensor(values, dtype=torch.get_default_dtype())
    return torch.as_tensor(values, dtype=like.dtype, device=like.device)


def _stored(values):
    """The values of a table."""
    return torch.tensor(values, dtype=torch.float64)


def _texel(stored, index, like):
    """Entries of a table, of the type of `like`."""
    return (stored.to(like) if isinstance(like, torch.Tensor) else stored)[index]


def _integers(x):
    return x.to(torch.int64) if isinstance(x, torch.Tensor) else int(x)


def _broadcast(*arrays):
    like = next(a for a in arrays if isinstance(a, torch.Tensor))
    return torch.broadcast_tensors(*(_tensor(a, like) for a in arrays))


def _stack(arrays):
    """(..., channels), each channel in memory of its own, so that a compiled file writes whole vectors of it."""
    return torch.stack(arrays, dim=0).movedim(0, -1)
'''
