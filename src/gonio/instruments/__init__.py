"""Instruments that measure materials: a virtual goniometer, photographs of a sphere, and fits to pictures."""
