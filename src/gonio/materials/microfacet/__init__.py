"""Metals and glass: microfacet models with a distribution of normals, a masking term and a Fresnel reflectance."""
