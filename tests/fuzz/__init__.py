"""Mutated input for every reader: `make fuzz`, or python tests/fuzz/run.py [TARGET ...] [--count N] [--seed N].

A reader is one declaration in `targets.py`: seeds, how to call it, and what it may raise. A worker process reads one
input after the other; it is started anew behind an input that it did not survive. Found and saved are crashes, inputs
that take longer than SECONDS, tracebacks that are no GonioError, and more memory than 4 times the input and 200 MB.
What was found and mended stays in `corpus/TARGET`, and tests/test_fuzz.py reads it all.
"""
