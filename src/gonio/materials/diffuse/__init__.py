"""Matte surfaces: Lambert, Oren-Nayar and EON."""
