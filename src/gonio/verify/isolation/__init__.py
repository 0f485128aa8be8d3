"""Tests in a monitored child process, so that a crash of a BSDF becomes a finding of the report."""
