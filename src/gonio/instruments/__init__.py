"""Instruments that measure materials: a virtual goniometer, a photographed sphere, and fits to pictures."""
