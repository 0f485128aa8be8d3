"""File formats of measured materials. Each file in this folder defines one format."""
