"""Combinations of materials: mix, sum, two-sided, normal-mapped and partly transparent ones."""
