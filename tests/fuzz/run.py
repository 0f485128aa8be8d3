"""The program: python tests/fuzz/run.py [TARGET ...] [--count N] [--seed N]."""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import hashlib
import mmap
import os
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from random import Random

if __package__ in (None, ""):
    sys.path.insert(0, str(Path(__file__).parents[1]))

from fuzz import shader_files, untrusted  # noqa: F401  (declare more targets)
from fuzz.mutation import mutated
from fuzz.targets import HERE, TARGETS, Target

SECONDS = 5.0  # of all cores together an input may take, whatever else they do
PATIENCE = 4 * SECONDS  # after which a worker is ended
MEMORY = 200e6  # bytes, beside 4 times the input
CORPUS = HERE / "corpus"
_AT = struct.Struct("<qd")  # number of the input that is being read, and since when


def corpus(target: Target) -> list[Path]:
    """What was found before."""
    return sorted((CORPUS / target.name).glob("*"))


def made(target: Target, seed: int, number: int) -> bytes:
    """Input `number` of a run, the same in every process: first what was found before."""
    known = corpus(target)
    if number < len(known):
        return known[number].read_bytes()
    random = Random(f"{target.name} {seed} {number}")
    data = mutated(target.seeds(), target.tokens, random)
    return target.repair(data) if target.repair and random.random() < 0.8 else data


def judged(target: Target, data: bytes, folder: Path) -> str:
    """What is wrong with how an input is read, "" where nothing is."""
    from gonio.errors import GonioError

    before = _resident()
    started = time.process_time()
    try:
        target.read(data, folder)
    except GonioError as error:
        if not error.what:
            return "an error without words"
    except (Exception, SystemExit) as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {str(error)[:100]!a}"
    seconds, peak = time.process_time() - started, _peak()
    if seconds > SECONDS:
        return f"it takes {seconds:.1f} s"
    if peak - before > 4 * len(data) + MEMORY:
        return f"it takes {(peak - before) / 1e6:.0f} MB"
    return ""


def _resident() -> float:
    """Bytes in memory now; from here on the peak is counted (Linux)."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return _status("VmRSS")


def _peak() -> float:
    return _status("VmHWM")


def _status(name: str) -> float:
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith(name):
                return 1024.0 * int(line.split()[1])
    return 0.0


# ---------------------------------------------------------------------- the worker


def work(targets: Sequence[Target], seed: int, first: int, end: int, each: int, at: str) -> None:
    """Read inputs first to end, `each` of one target after the other; each finding is a line on stdout."""
    import resource
    import warnings

    warnings.simplefilter("ignore")
    faulthandler.enable()
    with tempfile.TemporaryDirectory() as folder:  # what is imported and compiled once counts for no input
        for target in targets:
            with contextlib.suppress(Exception):
                target.read(target.seeds()[0], Path(folder))
            os.chdir("/")
    out = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what readers print is not for us
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (16 << 30, resource.RLIM_INFINITY))
    with open(at, "r+b") as file, tempfile.TemporaryDirectory() as folder:
        place = mmap.mmap(file.fileno(), _AT.size)
        empty = Path(folder) / "input"
        for number in range(first, end):
            target = targets[number // each]
            data = made(target, seed, number % each)
            empty.mkdir()
            place[:] = _AT.pack(number, time.monotonic())
            wrong = judged(target, data, empty)
            os.chdir("/")
            shutil.rmtree(empty, ignore_errors=True)
            if wrong:
                print(f"{number} {wrong}", file=out, flush=True)
        place[:] = _AT.pack(end, time.monotonic())
    # The denoiser's TBB loads hwloc by RTLD_DEEPBIND, so at exit hwloc frees with libc's own `free` what `strdup` took
    # from the checking malloc of `_environment`: an abort now and then, which no process without that malloc has.
    os._exit(0)


# ---------------------------------------------------------------------- who watches it


def run(targets: Sequence[Target], seed: int, count: int, finds: Path) -> dict[str, int]:
    """Read `count` inputs of each target, in one process as long as it lives.

    Of each thing that went wrong the number of the first input; the inputs are saved in `finds`.
    """
    found: dict[str, int] = {}
    first, end = 0, count * len(targets)
    with tempfile.NamedTemporaryFile() as at:
        at.write(_AT.pack(first, time.monotonic()))
        at.flush()
        while first < end:
            lines, reason, reached = _watched(targets, seed, first, end, count, at.name)
            for line in lines:
                number, _, wrong = line.partition(" ")
                found.setdefault(wrong, int(number))
            if reason:  # the last input stands for what happens at the end
                found.setdefault(reason, min(reached, end - 1))
            first = reached + 1
    for number in found.values():
        target = targets[number // count]
        data = made(target, seed, number % count)
        (finds / target.name).mkdir(parents=True, exist_ok=True)
        (finds / target.name / hashlib.sha256(data).hexdigest()[:16]).write_bytes(data)
    return found


def _watched(
    targets: Sequence[Target], seed: int, first: int, end: int, each: int, at: str
) -> tuple[list[str], str, int]:
    """What a worker found, why it did not come to the end ("" where it did), and the input that it came to."""
    names = ",".join(target.name for target in targets)
    arguments = [sys.executable, __file__, "--work", names, *map(str, (seed, first, end, each)), at]
    Path(at).write_bytes(_AT.pack(first, time.monotonic() + 60.0))  # time to import everything
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        worker = subprocess.Popen(arguments, stdout=out, stderr=err, env=_environment())
        hangs = False
        while worker.poll() is None:
            time.sleep(0.1)
            _, since = _AT.unpack(Path(at).read_bytes())
            if time.monotonic() - since > PATIENCE:
                hangs = True
                worker.kill()
                worker.wait()
        out.seek(0)
        err.seek(0)
        lines, text = out.read().splitlines(), err.read()
    reached, _ = _AT.unpack(Path(at).read_bytes())
    if hangs:
        return lines, f"no end after {PATIENCE:g} s", reached
    if reached >= end and worker.returncode == 0:
        return lines, "", end
    code = worker.returncode
    if code == 1 and not hangs:
        raise SystemExit(f"{names}: the worker itself failed\n{text}")
    name = signal.Signals(-code).name if code < 0 else f"exit code {code}"
    frames = [line.strip() for line in text.splitlines() if line.strip().startswith("File")]
    return lines, f"{name} {frames[0] if frames else text.strip()[-200:]!a}", reached


def _environment() -> dict[str, str]:
    """Blocks of memory that were freed or overrun are noticed, where glibc has its checks."""
    environment = {**os.environ, "MALLOC_CHECK_": "3", "MALLOC_PERTURB_": "165", "PYTHONFAULTHANDLER": "1"}
    checks = next((p for p in ("/lib", "/usr/lib") for p in Path(p).glob("*-linux-gnu/libc_malloc_debug.so.0")), None)
    return environment if checks is None else {**environment, "LD_PRELOAD": str(checks)}


def main() -> int:
    if sys.argv[1:2] == ["--work"]:
        names, seed, first, end, each, at = sys.argv[2:]
        work([TARGETS[name] for name in names.split(",")], int(seed), int(first), int(end), int(each), at)
        return 0
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="all where none is named: " + ", ".join(TARGETS))
    parser.add_argument("--count", type=int, default=2000, help="inputs a target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--finds", type=Path, default=Path("out/fuzz"), help="folder for inputs that were not survived")
    given = parser.parse_args()
    bad = 0
    for name in given.targets or [name for name in TARGETS if name != "self-test"]:
        started = time.monotonic()
        found = run([TARGETS[name]], given.seed, given.count, given.finds)
        seconds = time.monotonic() - started
        print(f"{name:12} {given.count} inputs in {seconds:.0f} s: {len(found) or 'no'} finds", flush=True)
        for wrong, number in found.items():
            print(f"    input {number}: {wrong}", flush=True)
        bad += len(found)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
