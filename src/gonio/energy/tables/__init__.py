"""Baked tables of E, E_avg, the split sum and rough glass, and their axes and files."""
