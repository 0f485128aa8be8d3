"""The version, in the one place where the code has it."""

__version__ = "0.1.0"
