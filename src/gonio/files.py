"""Atomic writes of files and folders."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import stat
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NoReturn

from .errors import GonioError, InputError, MachineError

MAX_NAME = 255  # bytes of a file's name, on nearly all file systems
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def check_current_folder() -> None:
    """Raise InputError if the current folder has been deleted, because C++ libraries would then end the process."""
    try:
        os.getcwd()
    except OSError as error:
        raise InputError(f"no current folder: {_reason(error)}", "", "cd to a folder that exists") from None


def check_file(path: str | Path) -> Path:
    """The file to be written, with symbolic links resolved. Raises InputError if the file cannot be written.

    Called before a long computation, so that an unusable path is reported at once.
    """
    target = Path(os.path.expanduser(path))
    try:
        if target.is_symlink():
            target = target.resolve()
        looped = target.is_symlink()  # since Python 3.13; earlier versions raise
    except RuntimeError:
        looped = True
    except (OSError, ValueError) as error:
        looped = getattr(error, "errno", None) == errno.ELOOP
        if not looped:
            raise InputError(f"no usable file name: {_reason(error)}", str(path), "choose another name") from None
    if looped:
        raise InputError("this symbolic link points to itself", str(path), "remove it, or choose another name")
    folder = target.parent
    if not os.path.isdir(folder):
        hint = f"mkdir -p '{folder}', or choose another"
        raise InputError(f"the folder '{folder}' does not exist", str(path), hint)
    if os.path.isdir(target):
        raise InputError("this is a folder, expected a file name", str(path), "name a file, such as a.exr")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"no permission to write in '{folder}'", str(path), "choose another folder with -o")
    return target


def changeable_by_others(path: Path) -> bool:
    """Whether a user other than this one and root may change a file or folder. False on systems without `getuid`.

    If this user is root, files owned by another user are accepted: in a container, that owner is often the same person.
    """
    if not hasattr(os, "getuid"):
        return False
    status = path.stat()
    shared = stat.S_IWOTH if status.st_gid == os.getgid() else stat.S_IWOTH | stat.S_IWGRP
    foreign = os.getuid() not in (0, status.st_uid) and status.st_uid != 0
    return foreign or bool(status.st_mode & shared)


def check_folder(folder: str | Path, parents: bool = False) -> Path:
    """The path of a folder that exists or can be created. Raises InputError otherwise.

    parents  whether its parent folders may be missing too; `write_all` creates them
    """
    folder = Path(os.path.expanduser(folder))
    if parents and not os.path.lexists(folder.parent):
        check_folder(folder.parent, parents=True)
        return folder
    if not os.path.isdir(folder):
        if os.path.exists(folder):
            raise InputError(f"'{folder}' is a file", str(folder), "choose another folder with -o")
        check_file(folder)
        try:  # the system may report a folder as writable that is not
            folder.mkdir()
            folder.rmdir()
        except OSError as error:
            what = f"cannot write: {error.strerror or error}"
            raise InputError(what, str(folder), "choose a folder that can be written to") from error
        return folder
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"no permission to write in '{folder}'", str(folder), "choose another folder with -o")
    return folder


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def with_ending(path: Path, ending: str, start: str = "") -> Path:
    """The path of a file in the same folder, with `start` before the name and `ending` after it.

    If the new name exceeds the limit of file systems, it is truncated, and a checksum of the whole name is added.
    """
    if not path.name:  # "." or "/"
        return path / (start + ending)
    name, room = os.fsencode(path.name), MAX_NAME - len(os.fsencode(start + ending))
    if len(name) > room:
        name = name[: room - 9] + f"-{zlib.crc32(name):08x}".encode()
    return path.with_name(start + os.fsdecode(name) + ending)


written: list[Path] = []  # results of this process, which a terminated command lists


def write_whole(
    path: str | Path, content: bytes | Callable[[Path], None], rescue: bool = True, durable: bool = True
) -> Path:
    """Write a file atomically: at any time, `path` is either the old file or the complete new one.

    content  the bytes, or a function that writes them to a temporary path, which it receives; the suffix is the same
    rescue   whether to save the content elsewhere if `path` cannot be written: in a new folder beside it, in the
             current folder or among the temporary files
    durable  whether to flush the file to the disk first, so that even a power failure cannot leave a partial file
    Raises MachineError if the file cannot be written, InputError if the path cannot name a file. The error states where
    the content was saved instead; `path` is left unchanged.
    """

    def fill(file: Path) -> None:
        if callable(content):
            content(file)
        else:
            file.write_bytes(content)

    try:
        target = check_file(path)
    except InputError as error:
        if not rescue:
            raise
        _rescue(error, Path(path), fill)
    # The temporary file is in the same folder, hence on the same file system, where a rename is atomic.
    suffix = target.suffix if len(target.suffix) <= 16 else ""
    temporary = with_ending(target, f".{os.getpid()}.part{suffix}", ".")
    try:
        fill(temporary)
        if durable:
            with open(temporary, "rb") as file:
                os.fsync(file.fileno())  # a full disk may be reported only here
        os.replace(temporary, target)
    except OSError as error:
        failure = _failure(error, path)
        if not rescue:
            raise failure from error
        _rescue(failure, target, fill, elsewhere=error.errno in _FULL)
    finally:
        _remove(temporary)
    if rescue:
        written.append(target)
    return target


def _failure(error: OSError, path: str | Path) -> MachineError:
    what = "the disk is full" if error.errno in _FULL else f"cannot write: {error.strerror or error}"
    hint = "free some space, or choose another folder with -o; nothing was written"
    return MachineError(what, str(path), hint)


def _remove(file: Path) -> None:
    with contextlib.suppress(OSError):  # its folder may be gone; an error here would hide that of the rescue
        file.unlink()


def _rescue(failure: GonioError, target: Path, fill: Callable[[Path], None], elsewhere: bool = False) -> NoReturn:
    """Save the content elsewhere and raise the failure, with the new path as its hint.

    fill       writes the file or folder to the path that it receives
    elsewhere  whether to skip the target's folder, because its disk is full
    """
    place = keep_elsewhere(target, fill, elsewhere)
    hint = failure.hint if place is None else f"it is kept as {place}: move it from there"
    raise type(failure)(failure.what, failure.where, hint)


def keep_elsewhere(target: Path, fill: Callable[[Path], object], elsewhere: bool = False) -> Path | None:
    """Save a file or folder under the target's name in a new folder, and return its path.

    The new folder is created beside the target, in the current folder or among the temporary files. Returns None if
    writing to all of these fails.

    fill       writes the file or folder to the path that it receives
    elsewhere  whether to skip the target's folder, because its disk is full
    """
    import tempfile  # its import takes 2 ms, and this is rarely needed

    places: list[Callable[[], str | Path]] = [lambda: target.parent, Path.cwd, tempfile.gettempdir]
    for place in places[1:] if elsewhere else places:
        folder = None
        try:
            folder = Path(tempfile.mkdtemp(prefix="gonio-", dir=place()))
            file = folder / (with_ending(target, "").name if target.name else "files")
            fill(file)
            return file
        except OSError:
            if folder is not None:
                shutil.rmtree(folder, ignore_errors=True)
    return None


def write_all(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write several files to a folder; a new folder appears only when it is complete.

    The files are first written to a temporary folder and then moved. Other files in an existing folder are preserved.
    Missing parent folders are created.

    files  content of each file by its name
    Raises MachineError if the folder cannot be written; the error states where the files were saved instead.
    """

    def fill(into: Path) -> None:
        into.mkdir()
        for name, content in files.items():
            with open(into / name, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())

    part = None
    try:
        part = with_ending(folder.absolute(), f".{os.getpid()}.part", ".")
        part.parent.mkdir(parents=True, exist_ok=True)
        fill(part)
        if not folder.exists():
            os.replace(part, folder)
        else:
            for name in files:
                os.replace(part / name, folder / name)
        written.append(folder)
    except OSError as error:
        _rescue(_failure(error, folder), folder, fill, elsewhere=error.errno in _FULL)
    finally:
        if part is not None:
            shutil.rmtree(part, ignore_errors=True)
