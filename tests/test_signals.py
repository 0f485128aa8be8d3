"""Ctrl-C, SIGTERM and SIGHUP: one line and the exit code of a shell, whenever they come."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from gonio import files
from gonio.cli import signals

ENDING = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]

# sends the process a signal when it imports a module
SENT = """
import os, sys

class Sender:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), {number})

sys.meta_path.insert(0, Sender())
from gonio import cli
cli.main({arguments!r})
"""


def _sent(number: int, module: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    program = SENT.format(number=int(number), module=module, arguments=list(arguments))
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)


@pytest.mark.sample(1)
@pytest.mark.parametrize("number", ENDING)
@pytest.mark.parametrize("module", ["typer", "numpy"])  # while the command starts, and in the middle of a verb
def test_a_signal_while_it_loads_is_one_line(number: signal.Signals, module: str) -> None:
    done = _sent(number, module, "bake", "ggx", "--resolution", "4")
    name = "Ctrl-C" if number == signal.SIGINT else number.name
    assert done.stderr == f"ended by {name}; nothing was written\n"
    assert (done.stdout, done.returncode) == ("", 128 + number)


def test_what_a_command_has_written_is_told_when_it_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit, for example, is written before its sheet is drawn; a table of the cache is no result."""
    monkeypatch.setattr(files, "written", [])
    assert signals.Ended().line == "ended by Ctrl-C; nothing was written"
    files.write_whole(tmp_path / "cached", b"", rescue=False)
    assert signals.Ended().line == "ended by Ctrl-C; nothing was written"
    files.write_whole(tmp_path / "gold.json", b"{}")
    files.write_all(tmp_path / "tables", {"E.exr": b""})
    assert signals.Ended().line == f"ended by Ctrl-C; written before: {tmp_path / 'gold.json'}, {tmp_path / 'tables'}"


def test_nothing_is_imported_before_the_signals_are_handled() -> None:
    program = "import sys; import gonio; before = set(sys.modules); import gonio.cli; print(set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.stdout == "{'gonio.cli'}\n"


def test_an_ignored_signal_stays_ignored() -> None:
    program = (
        "import os, signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from gonio import cli\n"
        "from gonio.transport.passes import Interrupts\n"
        "with Interrupts() as interrupts:\n"
        "    os.kill(os.getpid(), signal.SIGHUP)\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        "    import time\n"
        "    for _ in range(500):\n"
        "        if interrupts.asked: break\n"
        "        time.sleep(.01)\n"
        "    print(interrupts.asked)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.stdout == f"{int(signal.SIGTERM)}\n", done.stderr
