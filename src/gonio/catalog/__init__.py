"""Materials from texts and files: the notation, the library of named materials, documents, and user files."""
