"""Directional albedo: by quadrature for microfacet models, by cubature or sampling for any material, and by random
walks on the facets."""

from .directional import Albedo, albedo, direction

__all__ = ["Albedo", "albedo", "direction"]
