"""Convert any isotropic table to an adaptive table: the warp of Dupuy2018 is computed from the values of the table."""

from __future__ import annotations

import numpy as np

from .. import colours
from .adaptive import Adaptive
from .base import Floats, Measurement

# number of viewing angles, of nodes per side of the square of normals, and of nodes per side of the square of values
VIEWS, NORMALS, PLACES = 16, 128, 48


def adapted(source: Measurement) -> Adaptive:
    """Convert a table with rotational and mirror symmetry to an adaptive table.

    D is derived from retroreflection, for which the half vector equals the direction: f(w, w) = D F G / (4 cos^2), so
    D ~ f cos^2 except for masking. Dupuy2018, sec. 3.2, refines D by iteration, which is omitted here: the warp works
    with any D, and the values compensate for its errors. sigma is the projected area of the microfacets, and
    vndf = D max(0, wo.m) / sigma.
    """
    theta_m = np.linspace(0.0, 1.0, NORMALS) ** 2 * (0.5 * np.pi)
    held = np.minimum(theta_m, 0.5 * np.pi - 0.02)
    w = np.stack([np.sin(held), 0.0 * held, np.cos(held)], -1)
    retro = source.rgb(w, w) @ colours.LUMINANCE * np.cos(held)
    ndf = np.maximum(retro, 1e-4 * max(float(retro.max()), 1e-12))
    phi_m = np.linspace(-np.pi, np.pi, NORMALS)
    theta = 0.5 * np.pi * (1.0 - (1.0 - np.linspace(0.0, 1.0, VIEWS)) ** 1.4)
    theta[-1] -= 1e-3  # eval is undefined at the horizon
    weight = 2.0 * np.pi**2 * np.sqrt(theta_m * (2.0 / np.pi)) * np.sin(theta_m)  # d omega_m / du
    mean = np.gradient(np.linspace(0.0, 1.0, NORMALS))

    def cosines(angle: Floats) -> Floats:
        """max(0, wo.m) at the nodes, (view, phi_m, theta_m)."""
        along = np.sin(angle)[:, None, None] * np.sin(theta_m) * np.cos(phi_m)[:, None]
        return np.maximum(along + np.cos(angle)[:, None, None] * np.cos(theta_m), 0.0)

    azimuth_weights = np.full(NORMALS, 1.0 / (NORMALS - 1))
    azimuth_weights[[0, -1]] *= 0.5

    def area(angle: Floats) -> Floats:
        """The projected area of the microfacets, int D max(0, wo.m) dm."""
        return np.einsum("vpt,p,t->v", cosines(angle), azimuth_weights, ndf * weight * mean)

    # at normal incidence, the projected area of the microfacets is that of the surface
    ndf = ndf / float(area(np.zeros(1))[0])
    sigma = area(theta_m)
    vndf = cosines(theta) * (ndf * weight) / np.maximum(area(theta), 1e-9)[:, None, None]
    warp = {"phi_i": np.zeros(1), "theta_i": theta, "vndf": vndf[None]}
    return _filled(source, {**warp, "ndf": np.repeat(ndf[None], 2, 0), "sigma": np.repeat(sigma[None], 2, 0)})


def _filled(source: Measurement, warp: dict[str, Floats]) -> Adaptive:
    """The adaptive table with the given warp, and with the values of `source` at its nodes."""
    from scipy.ndimage import distance_transform_edt

    blank = np.ones((1, len(warp["theta_i"]), PLACES, PLACES))
    empty = Adaptive({**warp, "luminance": blank, "values": np.repeat(blank[:, :, None], 3, axis=2)})
    wo, wi, factor = empty.nodes()
    lit = (wi[..., 2] > 1e-6) & (wo[..., 2] > 0.0) & (factor > 0.0)
    values = np.zeros((*lit.shape, 3))
    values[lit] = source.rgb(wo[lit], wi[lit]) / factor[lit][:, None]
    # below the horizon, the nearest value above it is used, so that the interpolation does not darken f
    for one, valid in zip(values, lit, strict=True):
        if valid.any():
            one[:] = one[tuple(distance_transform_edt(~valid, return_distances=False, return_indices=True))]
    luminance = np.maximum(values @ colours.LUMINANCE, 0.0)
    least = 0.02 * luminance.mean(axis=(1, 2), keepdims=True)  # so that light between black nodes is sampled too
    arrays = {"luminance": (luminance + least)[None], "values": np.moveaxis(values, -1, 1)[None]}
    return Adaptive({**warp, **arrays}, title=source.title, source=source.source)
