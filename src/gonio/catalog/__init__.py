"""How a text or a file becomes a material: its notation, the library of named ones, documents, files of the user's."""
