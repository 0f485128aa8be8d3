"""Compression of measured materials: one method per file, and the function `compress`, which applies them."""
