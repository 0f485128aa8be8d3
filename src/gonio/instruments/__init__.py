"""Measure materials: with a virtual goniometer, from photographs of a sphere, and by fits to pictures."""
