"""Explanations of a failed law: ratios, factors, causes, diagnosis and reproduction."""
