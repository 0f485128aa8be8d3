"""`python -m gonio`, the command `gonio` of a given interpreter."""

from .cli import main

main()
