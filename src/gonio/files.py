"""Atomic writes of files and folders."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from .errors import InputError, MachineError


def check_file(path: str | Path) -> Path:
    """The file that `path` will become (links resolved); raises InputError before hours are spent on it."""
    target = Path(path).expanduser()
    try:
        if target.is_symlink():
            target = target.resolve()
        looped = target.is_symlink()  # Python 3.13 and later; earlier versions raise
    except (OSError, RuntimeError):
        looped = True
    if looped:
        raise InputError("this symbolic link points to itself", str(path), "remove it, or choose another name")
    folder = target.parent
    if not folder.is_dir():
        hint = f"mkdir -p '{folder}', or choose another"
        raise InputError(f"the folder '{folder}' does not exist", str(path), hint)
    if target.is_dir():
        raise InputError("this is a folder, expected a file name", str(path), "name a file, such as a.exr")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"no permission to write in '{folder}'", str(path), "choose another folder with -o")
    return target


def check_folder(folder: str | Path) -> Path:
    """The folder, if it exists or can be created; otherwise raises InputError before anything is computed."""
    folder = Path(folder).expanduser()
    if not folder.is_dir():
        if folder.exists():
            raise InputError(f"'{folder}' is a file", str(folder), "choose another folder with -o")
        check_file(folder)
        try:  # a folder that is reported as writable may still refuse
            folder.mkdir()
            folder.rmdir()
        except OSError as error:
            what = f"cannot write: {error.strerror or error}"
            raise InputError(what, str(folder), "choose a folder that can be written to") from error
        return folder
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"no permission to write in '{folder}'", str(folder), "choose another folder with -o")
    return folder


def write_whole(
    path: str | Path, content: bytes | Callable[[Path], None], rescue: bool = True, durable: bool = True
) -> Path:
    """Write a file atomically: at every moment `path` is either the old file or the complete new one.

    content  the bytes, or a function that writes to the file name it is given (which has the same suffix)
    durable  flush to the disk first, so that the file is complete even after a power failure
    rescue   if the file cannot be written, write it to the temporary folder, so that hours of work are not lost
    Raises MachineError if the disk is full; its text names the rescued file. No partial file remains next to `path`.
    """
    target = check_file(path)
    # In the same folder and hence on the same file system, where renaming is atomic.
    temporary = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        if callable(content):
            content(temporary)
            if durable:
                with open(temporary, "rb") as file:
                    os.fsync(file.fileno())
        else:
            with open(temporary, "wb") as file:
                file.write(content)
                file.flush()
                if durable:
                    os.fsync(file.fileno())  # a full disk may be reported only here
        os.replace(temporary, target)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        what = "the disk is full" if full else f"cannot write: {error.strerror or error}"
        rescued = _rescued(target.name, content) if rescue else None
        hint = "free some space, or choose another folder with -o; nothing was written"
        hint = f"it was saved as {rescued}: move it from there" if rescued else hint
        raise MachineError(what, str(path), hint) from error
    finally:
        temporary.unlink(missing_ok=True)
    return target


def _rescued(name: str, content: bytes | Callable[[Path], None]) -> Path | None:
    """The content in a new temporary folder; None if it cannot be written there either."""
    folder = None
    try:
        folder = Path(tempfile.mkdtemp(prefix="gonio-"))
        if callable(content):
            content(folder / name)
        else:
            (folder / name).write_bytes(content)
        return folder / name
    except OSError:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
        return None


def write_all(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write all files to a temporary folder, then move them; existing files of the folder are preserved."""
    part = folder.absolute().with_name(f".{folder.name}.{os.getpid()}.part")
    try:
        part.mkdir()
        for name, content in files.items():
            with open(part / name, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        if not folder.exists():
            os.replace(part, folder)
        else:
            for name in files:
                os.replace(part / name, folder / name)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        what = "the disk is full" if full else f"cannot write: {error.strerror or error}"
        kind = MachineError if full else InputError
        raise kind(what, str(folder), "nothing was written; choose another folder with -o") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
