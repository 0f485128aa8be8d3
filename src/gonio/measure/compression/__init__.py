"""Compression of measured materials: one method per file, and `compress` for all of them."""
