"""The verbs, one file each. To add a verb, add a file to this folder: it is discovered automatically."""
