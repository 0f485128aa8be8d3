"""The result of `sample`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import ops
from ..errors import InputError
from ..ops import Direction, Mask, Scalar, Spectrum

if TYPE_CHECKING:  # typing.TypeVar has defaults since Python 3.13
    from typing_extensions import TypeVar

    D = TypeVar("D", default=Direction)
    C = TypeVar("C", default=Spectrum)
    N = TypeVar("N", default=Scalar)
    B = TypeVar("B", default=Mask)
else:
    from typing import TypeVar

    D, C, N, B = map(TypeVar, "DCNB")


class Sample(NamedTuple, Generic[D, C, N, B]):
    """A sampled direction with its weight. The fields have the types of the caller's arguments.

    wi      sampled direction, a unit vector
    weight  eval / pdf; for a delta lobe, its reflectance divided by its probability; 0 where sampling failed
    pdf     density of wi, 1/sr; for a delta lobe, its discrete probability; 0 where sampling failed
    delta   whether wi was chosen from a delta lobe
    eta     refractive index on wi's side divided by that on wo's side; 1 for reflection

    Shapes, for N rays: wi (N, 3), weight (N, channels), pdf, delta and eta (N,).
    """

    wi: D
    weight: C
    pdf: N
    delta: B
    eta: N

    @staticmethod
    def of_density(wi: Direction, weight: Spectrum, pdf: Scalar) -> Sample:
        """A sample of a reflection with finite density: `delta` is false and eta is 1 for all rays."""
        return Sample(wi, weight, pdf, never(pdf), ops.ones_like(pdf))


def never(like: Scalar) -> Mask:
    """A mask that is false for every ray.

    like  any value with one entry per ray, such as the pdf
    """
    return like != like


Floats: TypeAlias = "NDArray[np.floating]"
SampleArrays: TypeAlias = "Sample[Floats, Floats, Floats, NDArray[np.bool_]]"  # the result for NumPy arguments


def checked(result: object, where: str) -> Sample:
    """Validate the result of a material's `sample`, and expand plain numbers and booleans in `pdf`, `delta` and `eta`
    to one value per ray.

    where  the name of the method, for errors
    Raises InputError if the result is not a Sample, or if `delta` is not a mask.
    """
    if not isinstance(result, Sample):
        what = f"returned {type(result).__name__}, expected go.Sample"
        raise InputError(what, where, "return go.Sample(wi, weight, pdf, delta, eta)")
    delta = result.delta
    if callable(delta) or len(getattr(delta, "shape", ())) > 1:
        what = f"delta is {'a function' if callable(delta) else 'a vector'}, expected a mask with one value per ray"
        raise InputError(what, where, "give go.never(pdf) if no sample comes from a delta lobe")
    like = result.wi.x
    if isinstance(delta, bool):
        result = result._replace(delta=like == like if delta else never(like))
    numbers = {name: getattr(result, name) for name in ("pdf", "eta")}
    plain = {name: value + ops.zeros_like(like) for name, value in numbers.items() if isinstance(value, int | float)}
    return result._replace(**plain) if plain else result
