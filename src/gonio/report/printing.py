"""Printing of a page to a PDF file by a Chromium browser that is installed on this machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from ..errors import MachineError
from ..files import write_whole

NAMES = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge", "microsoft-edge"
)  # fmt: skip
PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
_SECONDS = 120.0


def browser() -> str:
    """The path of a browser that can print. Raises MachineError if there is none."""
    # On Windows, `which` also looks in the current folder, which is untrusted.
    known = [path for name in NAMES if (path := shutil.which(name)) and Path(path).parent != Path.cwd()]
    program = next(iter(known), None)
    program = program or next((place for place in PLACES if os.path.isfile(place)), None)
    if program is None:
        hint = "install Chromium or Chrome, or open report.html in any browser and print it to a file"
        raise MachineError("no browser found that can print a PDF", "--pdf", hint)
    return program


def write_pdf(page: Path, output: Path) -> Path:
    """Print a page to a PDF file. Raises MachineError if printing fails."""
    program = browser()
    # Chromium's sandbox does not start as root; the page runs no script, and its security policy blocks all resources.
    own = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []

    def fill(file: Path) -> None:
        with tempfile.TemporaryDirectory(prefix="gonio-") as profile:
            options = ["--headless", "--disable-gpu", "--no-first-run", "--no-pdf-header-footer", *own]
            options += [f"--user-data-dir={profile}", f"--print-to-pdf={file.absolute()}", page.absolute().as_uri()]
            try:
                done = subprocess.run([program, *options], capture_output=True, timeout=_SECONDS, check=False)
            except (OSError, subprocess.TimeoutExpired) as error:
                raise MachineError(
                    f"the browser did not print: {error}", program, "print report.html yourself"
                ) from None
            if not file.is_file() or file.stat().st_size == 0:
                last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
                raise MachineError(f"the browser did not print: {''.join(last)}", program, "print report.html yourself")

    return write_whole(output, fill, rescue=False)
