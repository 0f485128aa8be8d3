"""Directional albedo: of any material, by quadrature for microfacets, by sampling, and by walking among the facets."""

from .directional import Albedo, albedo, direction

__all__ = ["Albedo", "albedo", "direction"]
