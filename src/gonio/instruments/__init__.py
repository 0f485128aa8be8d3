"""Measure materials with a virtual goniometer, from photographs of a sphere, or by fitting a scene to a picture."""
