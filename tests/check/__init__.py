"""Right and wrong solutions of the courses' tasks, for `gonio check`."""
