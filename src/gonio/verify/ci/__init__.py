"""Output for continuous integration: JUnit, SARIF, GitHub's annotations, and a baseline of known failures.

    gonio verify glass.py:Glass --junit laws.xml --sarif laws.sarif --baseline laws.json

Each format has its own module, which converts a report to text; `outputs` writes the files.
"""
