"""The Sphinx extension that builds the book in docs/ and generates some of its pages from the code."""
