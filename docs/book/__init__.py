"""What makes the book of docs/: its pages from the code, and an extension of Sphinx."""
