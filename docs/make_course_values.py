"""Write docs/course/values: reference values of f, E and E_avg for checking one's own program.

python docs/make_course_values.py            # or --check: exit code 1 if a file is out of date

Nine digits are stored: more than float32 has, at half the size of full precision.
"""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path

import numpy as np
from gonio.check import reference

FOLDER = Path(__file__).parent / "course" / "values"


def rows(text: str) -> np.ndarray:
    """The numbers of a file, (N, columns)."""
    return np.loadtxt(io.StringIO(text), delimiter=",", ndmin=2)


def made() -> dict[str, str]:
    """The text of each file, by name."""
    files = {}
    with tempfile.TemporaryDirectory() as folder:
        for path in reference.write(folder):
            text = path.read_text(encoding="utf-8")
            heading = "".join(line for line in text.splitlines(keepends=True) if line.startswith("#"))
            body = io.StringIO()
            np.savetxt(body, rows(text), fmt="%.9g", delimiter=",")
            files[path.name] = heading + body.getvalue()
    return files


def stale(files: dict[str, str]) -> list[str]:
    """Files that are missing, superfluous, or differ from `files` by more than rounding errors of another machine."""
    stored = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.glob("*.csv")}
    return [name for name in sorted({*files, *stored}) if not _same(files.get(name), stored.get(name))]


def _same(a: str | None, b: str | None) -> bool:
    if a is None or b is None:
        return False
    headings = ([line for line in text.splitlines() if line.startswith("#")] for text in (a, b))
    x, y = rows(a), rows(b)
    return next(headings) == next(headings) and x.shape == y.shape and np.allclose(x, y, rtol=1e-6, atol=1e-9)


def main() -> int:
    files = made()
    if "--check" in sys.argv:
        wrong = stale(files)
        print("".join(f"{name}: run python docs/make_course_values.py\n" for name in wrong), end="")
        return 1 if wrong else 0
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (FOLDER / name).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
