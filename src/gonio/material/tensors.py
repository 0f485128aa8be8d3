"""Tensors of PyTorch, exchanged by DLPack, and arrays of JAX, exchanged as NumPy arrays, with gradients.

value = gold.eval(wo, wi, parameters={"alpha": alpha})     # tensors in, a tensor out
value.sum().backward()                                     # alpha.grad, wo.grad, wi.grad

Neither library is imported unless one of its tensors is given. Values are computed by Dr.Jit on the CPU and returned on
the device of wo. Gradients are those of reverse mode, of first order, for which the formula is evaluated once more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..errors import InputError
from ..ops import Mode, Precision, backend
from ..owner import COMPUTING
from . import binding, tree
from .parameters import Floats, Material

Tensor: TypeAlias = Any  # of a library that need not be installed
LIBRARIES = {"torch": "torch", "jax": "jax", "jaxlib": "jax"}  # by the first part of a type's module


def library(*values: object) -> str:
    """ "torch" or "jax" if a value is a tensor of that library, else ""."""
    for value in values:
        name = LIBRARIES.get(type(value).__module__.partition(".")[0], "")
        if name:
            return name
    return ""


class Call(NamedTuple):
    """A call of a material with arrays in place of tensors.

    material, name   the material, and "eval" or "pdf"
    paths            the parameters that are given beside wo and wi
    mode, precision  as in `eval`
    rows             function (wo, wi, name) of the arrays (N, 3) of both and of the shape of the results
    """

    material: Material
    name: str
    paths: tuple[str, ...]
    mode: Mode
    precision: Precision
    rows: Callable[[Any, Any, str], tuple[np.ndarray, np.ndarray, tuple[int, ...]]]

    def values(self, arrays: Sequence[np.ndarray]) -> Floats:
        """The result for wo, wi and the parameters."""
        wo, wi, *given = arrays
        leaves = {leaf.path: leaf for leaf in tree.leaves(self.material)}
        plain = {
            path: _plain(value, leaves[path].parameter.kind) for path, value in zip(self.paths, given, strict=True)
        }
        mode = {"mode": self.mode} if self.name == "eval" else {}
        formula = getattr(tree.replace(self.material, plain), self.name)
        return np.asarray(formula(wo, wi, precision=self.precision, **mode))

    def shape(self, arrays: Sequence[Any]) -> tuple[int, ...]:
        """The shape of the result for arrays of these shapes."""
        wo, wi = (np.broadcast_to(np.array([0.0, 0.0, 1.0]), tuple(x.shape)) for x in arrays[:2])
        shape = self.rows(wo, wi, self.name)[2]
        return (*shape, 3) if self.name == "eval" else shape

    def pullback(self, arrays: Sequence[np.ndarray], cotangent: np.ndarray) -> list[np.ndarray]:
        """The gradients by wo, wi and the parameters, in their shapes, of the sum of the result times a cotangent."""
        dr, types = backend.drjit(), backend.types(self.precision)
        first, second, shape = self.rows(arrays[0], arrays[1], self.name)
        count = math.prod(shape)
        with COMPUTING:
            directions = [backend.vector_of(np.broadcast_to(w, (count, 3)), 3, types) for w in (first, second)]
            leaves = {leaf.path: leaf for leaf in tree.leaves(self.material)}
            values: dict[str, backend.Array] = {}
            for path, array in zip(self.paths, arrays[2:], strict=True):
                parameter = leaves[path].parameter
                value = _plain(array, parameter.kind)
                # an angle is bound as its cosine and sine
                values[path] = (backend.float_of if parameter.kind == "angle" else parameter.bind)(value, types)
            dr.enable_grad(directions, values)
            bound = binding.bind_to(tree.replace(self.material, values), types)
            result = getattr(bound, self.name)(*directions, *([self.mode] if self.name == "eval" else []))
            if dr.grad_enabled(result):
                weights = np.asarray(cotangent, np.float64).reshape(count, -1)
                columns = [backend.float_of(np.ascontiguousarray(column), types) for column in weights.T]
                dr.backward(dr.sum(sum(c * w for c, w in zip(_components(result), columns, strict=True))))
            gradients = [*directions, *values.values()]
            parts = [[np.asarray(dr.grad(part).numpy(), float) for part in _components(one)] for one in gradients]
        return [_like(part, given) for part, given in zip(parts, arrays, strict=True)]


def _components(value: backend.Array) -> list[backend.Array]:
    return list(value) if backend.drjit().is_vector_v(value) else [value]


def _plain(value: np.ndarray, kind: str) -> Any:
    """A number, three numbers of a color, two widths, or an array with one value per ray."""
    if value.ndim == 0:
        return float(value)
    if value.shape == ((3,) if kind == "spectrum" else (2,)) and kind in ("spectrum", "alpha"):
        return tuple(map(float, value))
    return tuple(value.T) if kind == "alpha" and value.ndim == 2 else value


def _like(components: list[np.ndarray], given: np.ndarray) -> np.ndarray:
    """Gradients, one array per component, summed to the shape of what was given."""
    columns = np.broadcast_arrays(*components)
    gradient = np.stack(columns, axis=-1)  # (rows, components)
    size = given.shape[-1] if given.ndim and given.shape[-1] == gradient.shape[1] else 1
    gradient = gradient if size > 1 else gradient.sum(1, keepdims=True)
    rows = given.size // size
    if rows == 1:
        gradient = gradient.sum(0)
    elif len(gradient) != rows:  # rows that were repeated along an axis
        raise InputError("gradients of arrays that are repeated along an axis", "eval", "expand them first")
    return gradient.reshape(given.shape).copy()


def called(call: Call, kind: str, wo: Tensor, wi: Tensor, parameters: Mapping[str, Tensor]) -> Tensor:
    """The result as a tensor of the library `kind`, with gradients by all tensors."""
    known = {leaf.path for leaf in tree.leaves(call.material) if leaf.parameter.numeric}
    for path in parameters:
        if path not in known:
            what = f"'{path}' is no number or color of {type(call.material).__name__}"
            raise InputError(what, f"{call.name}: parameters", f"give some of {', '.join(sorted(known))}")
    return (_by_torch if kind == "torch" else _by_jax)(call, [wo, wi, *parameters.values()])


def _by_torch(call: Call, given: list[Tensor]) -> Tensor:
    import torch

    wo = next(x for x in given if isinstance(x, torch.Tensor))
    tensors = [x if isinstance(x, torch.Tensor) else torch.as_tensor(x, dtype=wo.dtype) for x in given]

    def arrays(some: Sequence[Tensor]) -> list[np.ndarray]:
        return [np.from_dlpack(x.detach().cpu().contiguous()) for x in some]

    class Values(torch.autograd.Function):  # type: ignore[misc]
        @staticmethod
        def forward(context: Any, *some: Tensor) -> Tensor:
            context.save_for_backward(*some)
            return torch.from_dlpack(np.array(call.values(arrays(some)))).to(wo.device)

        @staticmethod
        @torch.autograd.function.once_differentiable  # type: ignore[misc]
        def backward(context: Any, cotangent: Tensor) -> tuple[Tensor, ...]:
            some = context.saved_tensors
            gradients = call.pullback(arrays(some), arrays([cotangent])[0])
            pairs = zip(gradients, some, strict=True)
            return tuple(torch.from_dlpack(g).to(device=x.device, dtype=x.dtype) for g, x in pairs)

    return Values.apply(*tensors)


def _by_jax(call: Call, given: list[Tensor]) -> Tensor:
    import jax

    arrays = [jax.numpy.asarray(x) for x in given]
    dtype = np.float64 if call.precision == "float64" else np.float32
    shape = jax.ShapeDtypeStruct(call.shape(arrays), dtype)

    @jax.custom_vjp
    def run(*some: Tensor) -> Tensor:
        return jax.pure_callback(lambda *x: call.values([np.asarray(v) for v in x]).astype(dtype), shape, *some)

    def back(some: tuple[Tensor, ...], cotangent: Tensor) -> tuple[Tensor, ...]:
        def gradients(cotangent: Tensor, *x: Tensor) -> tuple[np.ndarray, ...]:
            known = [np.asarray(v) for v in x]
            pulled = call.pullback(known, np.asarray(cotangent))
            return tuple(g.astype(v.dtype) for g, v in zip(pulled, known, strict=True))

        shapes = tuple(jax.ShapeDtypeStruct(x.shape, x.dtype) for x in some)
        return tuple(jax.pure_callback(gradients, shapes, cotangent, *some))

    run.defvjp(lambda *some: (run(*some), some), back)
    return run(*arrays)
