"""The material that reads a table of measured values."""
