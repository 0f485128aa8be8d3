"""Metals and glass as microfacets with a distribution, a masking term and a Fresnel reflectance."""
