"""Light sources: sampling, densities and emission."""
