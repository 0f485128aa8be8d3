"""Negative controls: BSDFs with one classic mistake each, and the law that must catch it.

Each class says in its docstring what is wrong, and in `caught_by` which law is meant to find it. The classes named
`Right...` are their sound twins, from which they differ in the mistake alone; those must pass every law.
"""
