"""Materials that are tables."""
