"""Entry point of `python -m gonio.cli`."""

from . import main

main()
