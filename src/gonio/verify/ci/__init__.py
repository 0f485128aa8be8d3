"""A report for continuous integration: JUnit, SARIF, GitHub's annotations, a baseline of known failures.

    gonio verify glass.py:Glass --junit laws.xml --sarif laws.sarif --baseline laws.json

One format a file. Each takes a report and gives text; who writes it where is the command line's business.
"""
