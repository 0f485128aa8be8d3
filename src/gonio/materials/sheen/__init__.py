"""Cloth and dust: lobes that rise toward grazing angles."""
