"""Files in which other programs describe materials, one format a file: read into Gonio's notation."""
