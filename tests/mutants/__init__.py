"""Wrong materials, and right but unusual ones, written without knowledge of the laws: subjects of the referee's
benchmark (`benchmarks/referee.py`), not examples to follow."""
