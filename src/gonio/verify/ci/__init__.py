"""A report for continuous integration: JUnit, SARIF, GitHub's annotations, a baseline of known failures.

    gonio verify glass.py:Glass --junit laws.xml --sarif laws.sarif --baseline laws.json

One format per file: each turns a report into text, and `outputs` writes it.
"""
