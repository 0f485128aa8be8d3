"""Preparation of the standard streams: closed streams are opened, and any file name can be printed."""

from __future__ import annotations

import codecs
import io
import os
import sys
from typing import TextIO


class OutputError(OSError):
    """The standard output cannot be written, because the disk is full or the output is closed."""


class _Output(io.TextIOWrapper):
    """A standard output whose errors are distinguished from those of files."""

    def write(self, text: str) -> int:
        try:
            return super().write(text)
        except OSError as error:
            raise _told(error) from error

    def flush(self) -> None:
        try:
            super().flush()
        except OSError as error:
            raise _told(error) from error


def _told(error: OSError) -> OSError:
    """The error as `OutputError`, unless it is a closed pipe."""
    return error if isinstance(error, BrokenPipeError) else OutputError(error.errno, error.strerror)


def prepare() -> None:
    """Open standard streams that are closed, as by `>&-`, and print invalid text in file names as raw bytes.

    Otherwise, the next file to be opened would become the standard output, and output would be printed to it. Printing
    to a closed output fails, as on a full disk.
    """
    for number, mode in ((0, os.O_RDONLY), (1, os.O_RDONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            opened = os.open(os.devnull, mode)  # opens the lowest free number, usually this one
            if opened != number:
                os.dup2(opened, number)
                os.close(opened)
    codecs.register_error("gonio", _replaced)
    sys.stdin = sys.stdin or io.TextIOWrapper(io.FileIO(0, closefd=False))  # type: ignore[arg-type]
    sys.stdout = _stream(sys.stdout, sys.__stdout__, 1, _Output)
    sys.stderr = _stream(sys.stderr, sys.__stderr__, 2, io.TextIOWrapper)


def _stream(stream: TextIO | None, own: TextIO | None, number: int, kind: type[io.TextIOWrapper]) -> TextIO:
    """A stream that prints to a file descriptor, in place of a closed stream or Python's own.

    Any other stream is returned unchanged: a second wrapper would close its buffer when garbage-collected.
    """
    if stream is None:
        raw = io.BufferedWriter(io.FileIO(number, "w", closefd=False))
        return kind(raw, "utf-8", "gonio")
    if stream is not own or not isinstance(stream, io.TextIOWrapper):
        return stream
    return kind(
        stream.buffer,
        stream.encoding,
        "gonio",
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def _replaced(error: UnicodeError) -> tuple[str | bytes, int]:
    """Invalid text in file names as raw bytes, and characters that the terminal's encoding lacks as escapes."""
    try:
        return codecs.lookup_error("surrogateescape")(error)
    except UnicodeError:
        return codecs.lookup_error("backslashreplace")(error)


def silence(*streams: TextIO) -> None:
    """Discard all buffered and future output of the streams."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in streams:
        os.dup2(nowhere, stream.fileno())
