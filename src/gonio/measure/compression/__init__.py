"""Measured materials in fewer bytes: a method a file, `compress` for all of them."""
