"""Layers over a base: coat, OpenPBR and the two Disney models."""
