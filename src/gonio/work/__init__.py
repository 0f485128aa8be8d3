"""Long work that nothing may undo: files of arrays that are whole or refused, parts of a job that are done once, and
the crew that does them: this process, or a cluster."""
