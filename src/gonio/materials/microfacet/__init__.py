"""Metals and glass as facets with a distribution, a masking term and a Fresnel reflectance."""
