"""Surfaces that the virtual goniometer can build, one file each."""
