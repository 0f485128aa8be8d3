"""Long jobs that can be interrupted and continued.

Provides files of arrays that are written atomically and detect damage, a store for the finished parts of a job, and
executors that run the parts in this process or on a cluster.
"""
