"""Rough surfaces for the virtual goniometer, one kind per file."""
