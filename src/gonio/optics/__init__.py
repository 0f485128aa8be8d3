"""Optics of a surface: frame, reflection and refraction, Fresnel reflectance, microfacets, warps, refractive indices.

Everything here is written in the vocabulary of `gonio.ops` and is independent of materials.
"""

from . import frame, fresnel, indices, masking, ndf, special, warp

__all__ = ["frame", "fresnel", "indices", "masking", "ndf", "special", "warp"]
