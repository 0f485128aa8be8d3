"""What `sample` returns."""

from __future__ import annotations

from typing import Any, Generic, NamedTuple, TypeVar

D = TypeVar("D")
C = TypeVar("C")
N = TypeVar("N")


class Sample(NamedTuple, Generic[D, C, N]):
    """A direction and what it carries.

    wi      direction chosen, unit
    weight  eval / pdf; of a delta lobe, its reflectance over its probability; 0 where sampling failed
    pdf     density of wi, 1/sr; of a delta lobe, its discrete probability; 0 where sampling failed
    delta   whether wi was chosen from a delta lobe
    eta     index on wi's side over index on wo's side: 1 for reflection

    Shapes, for N rays: wi (N, 3), weight (N, channels), pdf, delta and eta (N,).
    """

    wi: D
    weight: C
    pdf: N
    delta: Any
    eta: N
