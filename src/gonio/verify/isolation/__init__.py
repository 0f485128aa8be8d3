"""Tests in a monitored child process, so that a crash of a BSDF is a finding."""
