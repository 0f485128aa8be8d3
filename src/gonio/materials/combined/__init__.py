"""Combinations of materials: mixtures, sums, and two-sided, normal-mapped or partly transparent materials."""
