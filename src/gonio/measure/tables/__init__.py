"""Kinds of measured tables, one file per kind. Each kind can be evaluated, sampled and written into a shader."""
