"""Baked tables: E, E_avg, the split sum, rough glass; their axes and files."""
