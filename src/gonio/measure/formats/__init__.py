"""Files of measured materials, one format a file of this folder; a new one is one new file: discovery finds it."""
