"""Calls with tensors of PyTorch (passed by DLPack) or arrays of JAX (passed as NumPy arrays), with gradients.

value = gold.eval(wo, wi, parameters={"alpha": alpha})     # tensors in, a tensor out
value.sum().backward()                                     # alpha.grad, wo.grad, wi.grad
drawn = gold.sample(wo, u, parameters={"alpha": alpha})    # a Sample of tensors, with gradients at fixed u

Neither library is imported unless one of its tensors is given. Dr.Jit computes the values on the CPU; they are returned
on the device of wo. Gradients are of first order, in reverse mode, for which the formula is evaluated once more.
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
from .parameters import Material
from .sample import Sample

Tensor: TypeAlias = Any  # a tensor of a library that need not be installed
LIBRARIES = {"torch": "torch", "jax": "jax", "jaxlib": "jax"}  # libraries by the first part of a type's module


def library(*values: object) -> str:
    """The library of the first tensor among the values, "torch" or "jax"; "" if there is none."""
    for value in values:
        name = LIBRARIES.get(type(value).__module__.partition(".")[0], "")
        if name:
            return name
    return ""


class Call(NamedTuple):
    """A call of a material with arrays in place of tensors. `other` is wi, or u for "sample".

    material, name   the material and its method, "eval", "pdf" or "sample"
    paths            paths of the parameters that are given besides wo and `other`
    mode, precision  as in `eval`
    rows             function (wo, other, name) that returns wo and other as arrays (N, 3), and the shape of the results
    """

    material: Material
    name: str
    paths: tuple[str, ...]
    mode: Mode
    precision: Precision
    rows: Callable[[Any, Any, str], tuple[np.ndarray, np.ndarray, tuple[int, ...]]]

    def values(self, arrays: Sequence[np.ndarray]) -> list[np.ndarray]:
        """The results for wo, `other` and the parameters: one array, or the fields of a `Sample`."""
        wo, other, *given = arrays
        leaves = {leaf.path: leaf for leaf in tree.leaves(self.material)}
        plain = {
            path: _plain(value, leaves[path].parameter.kind) for path, value in zip(self.paths, given, strict=True)
        }
        formula = getattr(tree.replace(self.material, plain), self.name)
        result = formula(wo, other, precision=self.precision, **({} if self.name == "pdf" else {"mode": self.mode}))
        return [np.asarray(value) for value in _fields(result)]

    def shapes(self, arrays: Sequence[Any]) -> list[tuple[tuple[int, ...], type]]:
        """Shapes and types of the results for arrays of the given arrays' shapes."""
        wo, other = (np.broadcast_to(np.array([0.0, 0.0, 1.0]), tuple(x.shape)) for x in arrays[:2])
        shape = self.rows(wo, other, self.name)[2]
        number: type = np.float64 if self.precision == "float64" else np.float32
        vector, scalar, mask = ((*shape, 3), number), (shape, number), (shape, np.bool_)
        results = {"eval": [vector], "pdf": [scalar], "sample": [vector, vector, scalar, mask, scalar]}
        return results[self.name]

    def pullback(self, arrays: Sequence[np.ndarray], cotangents: Sequence[np.ndarray | None]) -> list[np.ndarray]:
        """The gradients of the sum of the results times their cotangents, with respect to wo, `other` and the
        parameters. Each has the shape of its argument.

        cotangents  one array per result; None for a result without gradients
        """
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
            result = getattr(bound, self.name)(*directions, *([] if self.name == "pdf" else [self.mode]))
            total = dr.zeros(types.float, count)
            for field, cotangent in zip(_fields(result), cotangents, strict=True):
                if cotangent is not None and dr.grad_enabled(field):
                    weights = np.asarray(cotangent, np.float64).reshape(count, -1)
                    columns = [backend.float_of(np.ascontiguousarray(column), types) for column in weights.T]
                    total += sum(c * w for c, w in zip(_components(field), columns, strict=True))
            if dr.grad_enabled(total):
                dr.backward(dr.sum(total))
            gradients = [*directions, *values.values()]
            parts = [[np.asarray(dr.grad(part).numpy(), float) for part in _components(one)] for one in gradients]
        return [_like(part, given) for part, given in zip(parts, arrays, strict=True)]


def _fields(result: Any) -> list[Any]:
    """The fields of a `Sample`, or the only result of another method."""
    return list(result) if isinstance(result, Sample) else [result]


def _components(value: backend.Array) -> list[backend.Array]:
    return list(value) if backend.drjit().is_vector_v(value) else [value]


def _plain(value: np.ndarray, kind: str) -> Any:
    """The value of a parameter from an array: a number, three numbers of a color, two widths, or one value per ray."""
    if value.ndim == 0:
        return float(value)
    if value.shape == ((3,) if kind == "spectrum" else (2,)) and kind in ("spectrum", "alpha"):
        return tuple(map(float, value))
    return tuple(value.T) if kind == "alpha" and value.ndim == 2 else value


def _like(components: list[np.ndarray], given: np.ndarray) -> np.ndarray:
    """Gradients, one array per component, summed to the shape of the given argument."""
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


def called(call: Call, kind: str, wo: Tensor, other: Tensor, parameters: Mapping[str, Tensor]) -> Any:
    """The result of a call as a tensor, or a `Sample` of tensors, with gradients for all tensors.

    kind        "torch" or "jax"
    parameters  path -> tensor
    Raises InputError for a path that is not that of a number or color.
    """
    known = {leaf.path for leaf in tree.leaves(call.material) if leaf.parameter.numeric}
    for path in parameters:
        if path not in known:
            what = f"'{path}' is not a number or color of {type(call.material).__name__}"
            raise InputError(what, f"{call.name}: parameters", f"give some of {', '.join(sorted(known))}")
    results = (_by_torch if kind == "torch" else _by_jax)(call, [wo, other, *parameters.values()])
    return Sample(*results) if call.name == "sample" else results[0]


def over_cosine(kind: str, value: Tensor, wi: Tensor) -> Tensor:
    """`value` / |cos theta_i|, and 0 at cos theta_i = 0, with gradients."""
    if kind == "torch":
        import torch as library

        given = library.as_tensor(wi)
    else:
        import jax.numpy as library

        given = library.asarray(wi)
    cos = abs(given[..., 2:])
    return library.where(cos > 0.0, value / library.where(cos > 0.0, cos, 1.0), 0.0)


def _by_torch(call: Call, given: list[Tensor]) -> tuple[Tensor, ...]:
    import torch

    wo = next(x for x in given if isinstance(x, torch.Tensor))
    tensors = [x if isinstance(x, torch.Tensor) else torch.as_tensor(x, dtype=wo.dtype) for x in given]

    def arrays(some: Sequence[Tensor]) -> list[np.ndarray]:
        return [np.from_dlpack(x.detach().cpu().contiguous()) for x in some]

    class Values(torch.autograd.Function):  # type: ignore[misc]
        @staticmethod
        def forward(context: Any, *some: Tensor) -> tuple[Tensor, ...]:
            context.save_for_backward(*some)
            results = tuple(torch.from_dlpack(np.array(value)).to(wo.device) for value in call.values(arrays(some)))
            context.mark_non_differentiable(*(value for value in results if value.dtype == torch.bool))
            return results

        @staticmethod
        @torch.autograd.function.once_differentiable  # type: ignore[misc]
        def backward(context: Any, *cotangents: Tensor) -> tuple[Tensor, ...]:
            some = context.saved_tensors
            weights = [None if c.dtype == torch.bool else arrays([c])[0] for c in cotangents]
            gradients = call.pullback(arrays(some), weights)
            pairs = zip(gradients, some, strict=True)
            return tuple(torch.from_dlpack(g).to(device=x.device, dtype=x.dtype) for g, x in pairs)

    results: tuple[Tensor, ...] = Values.apply(*tensors)
    return results


def _by_jax(call: Call, given: list[Tensor]) -> tuple[Tensor, ...]:
    import jax

    arrays = [jax.numpy.asarray(x) for x in given]
    shapes = tuple(jax.ShapeDtypeStruct(shape, dtype) for shape, dtype in call.shapes(arrays))

    def values(*some: np.ndarray) -> tuple[np.ndarray, ...]:
        known = call.values([np.asarray(x) for x in some])
        return tuple(value.astype(like.dtype) for value, like in zip(known, shapes, strict=True))

    @jax.custom_vjp
    def run(*some: Tensor) -> tuple[Tensor, ...]:
        return tuple(jax.pure_callback(values, shapes, *some))

    def back(some: tuple[Tensor, ...], cotangents: tuple[Tensor, ...]) -> tuple[Tensor, ...]:
        # the cotangent of a mask has no values, and a callback takes none
        weights = [None if like.dtype == bool else c for c, like in zip(cotangents, shapes, strict=True)]

        def gradients(weights: Sequence[Tensor | None], *x: Tensor) -> tuple[np.ndarray, ...]:
            known = [np.asarray(v) for v in x]
            pulled = call.pullback(known, [None if w is None else np.asarray(w) for w in weights])
            return tuple(g.astype(v.dtype) for g, v in zip(pulled, known, strict=True))

        like = tuple(jax.ShapeDtypeStruct(x.shape, x.dtype) for x in some)
        return tuple(jax.pure_callback(gradients, like, weights, *some))

    run.defvjp(lambda *some: (run(*some), some), back)
    results: tuple[Tensor, ...] = run(*arrays)
    return results
