"""Long jobs that survive interruptions: files of arrays that are complete or rejected, parts of a job that are computed
once, and the executor that runs the parts, in this process or on a cluster."""
