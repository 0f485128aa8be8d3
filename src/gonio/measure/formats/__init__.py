"""Files of measured materials, one format per file in this folder; to add one, add a file."""
