"""Judging in a watched child process, so that a crash of a BSDF is a finding."""
