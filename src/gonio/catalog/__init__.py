"""Materials from strings and files: the notation, the library of named materials, documents, and user files."""
