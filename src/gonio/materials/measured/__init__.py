"""The material that a table of measured values is."""
