"""Phong, modified Phong and Blinn-Phong."""
