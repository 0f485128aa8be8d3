"""Acceleration only: shapes in the kernel, tables of lamps, a grid of lights."""
