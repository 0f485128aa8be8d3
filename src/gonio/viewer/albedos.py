"""`go.albedo`, for everything that `go.material` accepts."""

from __future__ import annotations

from numpy.typing import ArrayLike

from ..catalog.material import MaterialLike, material
from ..energy.albedo import Albedo, directional
from ..owner import public


@public
def albedo(
    model: MaterialLike,
    mu: ArrayLike = 1.0,
    phi: ArrayLike = 0.0,
    *,
    method: str = "auto",
    samples: int = 1 << 16,
    seed: int = 0,
) -> Albedo:
    return directional.albedo(material(model), mu, phi, method=method, samples=samples, seed=seed)


albedo.__doc__ = (directional.albedo.__doc__ or "").replace(
    "    mu       cosine", "    model    anything that `go.material` accepts\n    mu       cosine", 1
)
