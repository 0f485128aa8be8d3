"""Every verb writes the same bytes in every process, whatever the hash seed and the number of threads."""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

import gonio as go
import pytest

GONIO = Path(sys.executable).with_name("gonio")
COMMANDS = {
    "bake": "bake ggx --size 8 -o out",
    "bake a material": "bake coat --lut E,Eavg -p base=lambert --size 8 -o out",
    "fit": "fit table.gonio -m lambert -m oren-nayar -o out/fit.json",
    "verify": "verify conductor --quick --json",
    "verify to a page": "verify oren-nayar --quick --report out",
    "view": "view conductor lambert -o out/page.html",
    "emit": "emit kulla-conty --bundle out/bundle",
    "emit Python": "emit disney2015 --language numpy -o out/a.py",
    "measure": "measure conductor -p alpha=0.3 -o out/a.gonio",
    "compress": "compress table.gonio -o out/small.gonio",
    "convert": "convert table.gonio -o out/a.binary",
    "plot": "plot conductor -o out/a.png",
    "plot as SVG": "plot conductor --kind slice -o out/a.svg",
    "plot as PDF": "plot conductor -o out/a.pdf",
    "explain": "explain openpbr",
    "schema": "schema scene",
}
TIMES = re.compile(rb'"seconds": *[-0-9.e]+|\b[0-9]+(\.[0-9]+)? m?s\b')  # that something took


def written(folder: Path, command: str, seed: int) -> dict[str, str]:
    """The hash of every file that a process writes, and of what it prints."""
    (folder / "out").mkdir(parents=True)
    table = folder / "table.gonio"
    table.write_bytes((folder.parent / "table.gonio").read_bytes())
    own = {**os.environ, "PYTHONHASHSEED": str(seed), "OMP_NUM_THREADS": str(1 + seed % 2), "GONIO_CACHE": str(folder)}
    done = subprocess.run([GONIO, *command.split()], cwd=folder, env=own, capture_output=True, check=False)
    assert done.returncode in (0, 1), done.stderr.decode()
    files = {str(p.relative_to(folder)): p.read_bytes() for p in (folder / "out").rglob("*") if p.is_file()}
    files["what it prints"] = done.stdout
    return {name: hashlib.sha256(TIMES.sub(b"", data)).hexdigest() for name, data in files.items()}


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_every_process_writes_the_same_bytes(name: str, tmp_path: Path) -> None:
    go.measure("oren-nayar", output=tmp_path / "table.gonio")
    first, *others = [written(tmp_path / str(seed), COMMANDS[name], seed) for seed in range(3)]
    for other in others:
        assert other == first
