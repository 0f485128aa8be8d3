"""A check of whether the Lambda of a distribution matches its D.

The facets that are visible from wo fill the projected area of the surface (Heitz2014, eq. 14), so

    int D(m) max(wo . m, 0) dm = (1 + Lambda(wo)) cos theta_o.

A wrong Lambda satisfies every other law as long as it only reduces the light, because D and the density of normals are
correct.
"""

from __future__ import annotations

import numpy as np

from ...errors import GonioError
from ...material import BSDF
from ...material.parameters import pair_of
from ...ops import backend
from ...optics import roughness
from ...optics.ndf import distribution
from .. import directions
from ..subject import Subject

THETA = (30.0, 60.0, 75.0, 84.0)
AZIMUTHS = (0.0, 50.0)
NODES = 512, 128  # in tan theta / alpha, by equal steps of its arctangent, and in azimuth
MISMATCH = 0.01  # of 1 + Lambda: the errors of Gonio's tables and of published approximations are at most half of it


def mismatch(subject: Subject) -> str:
    """A description of the largest difference between 1 + Lambda and the projected area of D; "" if they agree, or if
    there is no such distribution."""
    model = subject.model
    ndf, alpha = getattr(model, "ndf", None), getattr(model, "alpha", None)
    if not isinstance(model, BSDF) or ndf is None or not str(getattr(model, "masking", "")).startswith("smith"):
        return ""
    widths = pair_of(alpha)
    if not all(isinstance(one, int | float) and one > 2.0 * roughness.SMOOTH for one in widths):
        return ""
    wo = np.concatenate([directions.at(np.array(THETA), phi) for phi in AZIMUTHS])
    try:
        stated, area = _areas(distribution(ndf), (float(widths[0]), float(widths[1])), wo)
    except (GonioError, TypeError):  # the laws report a distribution that raises
        return ""
    off = np.abs(stated / np.maximum(area, 1e-12) - 1.0)
    row = int(np.argmax(off))
    if not off[row] > MISMATCH:
        return ""
    theta = directions.angles(wo[row])[0]
    return (
        f"the masking does not match the distribution: 1 + Lambda is {stated[row]:.4g} at {theta:.3g} degrees, but the "
        f"facets of D that face this direction have {area[row]:.4g} times the projected area of the surface"
    )


def _areas(ndf: object, alpha: tuple[float, float], wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """1 + Lambda for wo (N, 3), and the projected area of the facets of D divided by cos theta_o, (N,) each."""
    types = backend.types("float64")
    pair = types.vec2(*(backend.float_of(one, types) for one in alpha))
    # slopes at equal steps of an angle: dense where D is large, and up to the horizon
    angle = (np.arange(NODES[0]) + 0.5) * (0.5 * np.pi / NODES[0])
    phi = (np.arange(NODES[1]) + 0.5) * (2.0 * np.pi / NODES[1])
    t, p = (part.ravel() for part in np.meshgrid(angle, phi, indexing="ij"))
    x, y = alpha[0] * np.tan(t) * np.cos(p), alpha[1] * np.tan(t) * np.sin(p)
    m = np.stack([-x, -y, np.ones_like(x)], -1) / np.sqrt(1.0 + x * x + y * y)[:, None]
    # dx dy = m.z^3 dm, and dx dy = alpha_x alpha_y tan t / cos^2 t dt dphi
    solid = m[:, 2] ** 3 * alpha[0] * alpha[1] * np.tan(t) / np.cos(t) ** 2
    solid *= (angle[1] - angle[0]) * (phi[1] - phi[0])
    density = backend.to_numpy(ndf.D(backend.vector_of(m, 3, types), pair), len(m))  # type: ignore[attr-defined]
    projected = np.maximum(wo @ m.T, 0.0) @ (np.asarray(density, float) * solid) / wo[:, 2]
    stated = backend.to_numpy(ndf.Lambda(backend.vector_of(wo, 3, types), pair), len(wo))  # type: ignore[attr-defined]
    return 1.0 + np.asarray(stated, float), projected
