"""Materials that stand on another; a new one is one new file in this folder: discovery finds it."""
