"""Materials from strings and files: the notation, the library of published fits, documents, and user files."""
