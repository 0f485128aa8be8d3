"""The verbs, one file each. A new one is one new file in this folder: discovery finds it."""
