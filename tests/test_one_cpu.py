"""Whatever an attack once found holds on a machine of one processor too."""

from __future__ import annotations

from pathlib import Path

import pytest

import one_cpu

HERE = Path(__file__).parent

# Where the finds of the attack have their tests.
FILES = [
    "test_archives.py", "test_arguments.py", "test_files.py", "test_fuzz.py", "test_signals.py", "test_threads.py",
    "models/test_contract.py", "render/test_adapter.py", "render/test_engine.py", "render/test_formats.py",
    "render/test_images.py", "render/test_lights.py", "render/test_scene_files.py", "render/test_scene_read.py",
    "viewer/test_server.py",
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES)
def test_the_finds_hold_on_one_cpu(file: str, tmp_path: Path) -> None:
    program = "import sys, pytest\nsys.exit(pytest.main(sys.argv[1:]))"
    arguments = ("-q", "-x", "-m", "not slow", "-p", "no:cacheprovider", HERE / file)
    done = one_cpu.run(program, *arguments, folder=HERE.parent, seconds=1200)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
