"""Measured tables as stored, one file per kind. Each can be evaluated, sampled and written into a shader."""
