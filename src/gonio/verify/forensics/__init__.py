"""Explanations of failed laws: ratios, factors, causes, diagnosis and reproduction."""
