"""Layered materials: a coat over a base, OpenPBR and the two Disney models."""
