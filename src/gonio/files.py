"""Files and folders that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

from .errors import InputError, MachineError


def check_file(path: str | Path) -> Path:
    """The file that `path` will become (links followed), or an InputError before hours are spent on it."""
    target = Path(path).expanduser()
    if target.is_symlink():
        try:
            target = target.resolve()
        except (OSError, RuntimeError) as error:  # RuntimeError up to Python 3.12
            raise InputError("this link leads nowhere but to itself", str(path), "name another file") from error
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
    """The folder, if it exists or can be made where it is named; InputError before anything is computed where not."""
    folder = Path(folder).expanduser()
    if not folder.is_dir():
        if folder.exists():
            raise InputError(f"'{folder}' is a file", str(folder), "choose another folder with -o")
        check_file(folder)
        try:  # a folder that claims to be writable need not be
            folder.mkdir()
            folder.rmdir()
        except OSError as error:
            what = f"cannot write: {error.strerror or error}"
            raise InputError(what, str(folder), "choose a folder that can be written to") from error
        return folder
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"no permission to write in '{folder}'", str(folder), "choose another folder with -o")
    return folder


def write_whole(path: str | Path, content: bytes | Callable[[Path], None]) -> Path:
    """Write a file so that at every moment `path` is the old one or the whole new one.

    content  the bytes, or a function that fills the file whose name it is given (it keeps the suffix)
    Raises MachineError where the disk is full; nothing of the new file is left then.
    """
    target = check_file(path)
    # In the same folder, hence on the same file system, where a rename is one step.
    temporary = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        if callable(content):
            content(temporary)
            with open(temporary, "rb") as file:
                os.fsync(file.fileno())
        else:
            with open(temporary, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())  # a full disk can show itself as late as here
        os.replace(temporary, target)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        what = "the disk is full" if full else f"cannot write: {error.strerror or error}"
        hint = "free some space, or choose another folder with -o; nothing was written"
        raise MachineError(what, str(path), hint) from error
    finally:
        temporary.unlink(missing_ok=True)
    return target


def write_all(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write to a folder beside, then move: a new folder appears whole, an old one keeps its other files."""
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
