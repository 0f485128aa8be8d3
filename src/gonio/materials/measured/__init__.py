"""The material for a table of measured values."""
