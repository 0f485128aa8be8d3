"""What is measured, as it is stored: one file a kind. Each can be evaluated, sampled and written into a shader."""
