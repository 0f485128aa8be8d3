"""Threads that render, evaluate, verify and change variants get what one thread gets, to the bit."""

from __future__ import annotations

import subprocess
import sys
import threading

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.owner import COMPUTING

import one_cpu

# Every job gives arrays, the same each time; a worker draws jobs in an order of its own. Nothing is imported before the
# threads begin, so that they race for Dr.Jit and Mitsuba too.
PROGRAM = """
import asyncio, faulthandler, random, sys, threading, time
faulthandler.enable()
import numpy as np
import gonio as go

SECONDS, THREADS = float(sys.argv[1]), int(sys.argv[2])
rng = np.random.default_rng(0)

def directions(n):
    w = rng.normal(size=(n, 3))
    w[:, 2] = abs(w[:, 2])
    return w / np.linalg.norm(w, axis=1, keepdims=True)

WO, WI, U = directions(300), directions(300), rng.random((300, 3))

def variant():
    from gonio.owner import COMPUTING
    with COMPUTING:  # between the two, others would compute by the first; and Mitsuba's import is no thread's alone
        import mitsuba as mi
        mi.set_variant("llvm_ad_spectral")
        mi.set_variant("llvm_ad_rgb")
    return np.zeros(1)

def plugin():
    from gonio.owner import COMPUTING
    from gonio.bridge import foreign
    with COMPUTING:
        return foreign.load({"type": "roughplastic", "alpha": 0.2}).eval(WO, WI)

def verified():
    report = go.verify(go.Lambert(), quick=True, law=["reciprocity", "positivity"])
    return np.array([report.passed])

JOBS = {
    "gold": lambda: go.Conductor.preset("Au", alpha=0.2).eval(WO, WI),
    "gold in 64 bits": lambda: go.Conductor.preset("Au", alpha=0.3).eval(WO, WI, precision="float64"),
    "glass": lambda: np.concatenate([x.reshape(300, -1) for x in go.Dielectric(alpha=0.1).sample(WO, U)], axis=1),
    "compensated": lambda: go.KullaConty(base=go.Conductor.preset("Cu", alpha=0.4)).pdf(WO, WI),
    "emitted": lambda: np.frombuffer(go.emit(go.Phong()).encode(), np.uint8),
    "albedo": lambda: go.albedo(go.Lambert(0.5), [0.3, 1.0]).value,
    "picture": lambda: go.render(go.Conductor(alpha=0.3), size=(24, 16), spp=2),
    "path": lambda: go.render(go.Lambert(0.5), size=(16, 16), spp=2, integrator="path", seed=3),
    "plugin": plugin,
    "variant": variant,
    "verified": verified,
}
found, errors, counts, lock = {}, [], dict.fromkeys(JOBS, 0), threading.Lock()

def once(name):
    value = np.array(JOBS[name]())
    with lock:
        counts[name] += 1
        first = found.setdefault(name, value)
    if not np.array_equal(first, value):
        errors.append(f"{name} differs")

def work(number):
    draw = random.Random(number)
    end = time.monotonic() + SECONDS
    try:
        for name in draw.sample(list(JOBS), len(JOBS)):
            once(name)
        while time.monotonic() < end:
            once(draw.choice(list(JOBS)))
    except BaseException as error:
        import traceback
        errors.append(traceback.format_exc())

async def loop():
    await asyncio.gather(*(asyncio.to_thread(once, name) for name in JOBS))

threads = [threading.Thread(target=work, args=(number,)) for number in range(THREADS)]
for thread in threads: thread.start()
for thread in threads: thread.join()
asyncio.run(loop())
threaded = dict(found)
found.clear()
for name in JOBS:  # alone
    once(name)
    if not np.array_equal(threaded[name], found[name]):
        errors.append(f"{name} differs from one thread's")
print("\\n".join(errors) or "same", min(counts.values()))
sys.exit(bool(errors))
"""


@pytest.mark.slow
def test_threads_get_what_one_thread_gets() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, "1", "4"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stdout.startswith("same"), done.stdout + done.stderr


@pytest.mark.slow
def test_eight_threads_for_five_minutes() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, "300", "8"], capture_output=True, text=True, timeout=1200)
    assert done.returncode == 0 and done.stdout.startswith("same"), done.stdout + done.stderr


@pytest.mark.slow
def test_threads_on_one_cpu() -> None:
    done = one_cpu.run("import sys\nsys.argv[1:] = ['20', '8']\n" + PROGRAM)
    assert done.returncode == 0 and done.stdout.startswith("same"), done.stdout + done.stderr


def test_a_call_waits_until_another_thread_is_done() -> None:
    import time

    ended: list[float] = []
    w = np.array([[0.0, 0.0, 1.0]])

    def evaluate() -> None:
        go.Lambert().eval(w, w)
        ended.append(time.monotonic())

    thread = threading.Thread(target=evaluate)
    with COMPUTING:
        go.Lambert().eval(w, w)  # its holder may
        thread.start()
        thread.join(0.2)
        assert not ended
        released = time.monotonic()
    thread.join(60)
    assert ended and ended[0] >= released


def test_a_plugin_of_another_variant_is_refused_in_words() -> None:
    from gonio.bridge import engine, foreign

    w = np.array([[0.0, 0.0, 1.0]])
    rough = foreign.load({"type": "roughplastic"})
    before = rough.eval(w, w)
    with engine.using("llvm_ad_spectral"), pytest.raises(InputError, match="in variant llvm_ad_rgb"):
        rough.eval(w, w)
    np.testing.assert_array_equal(rough.eval(w, w), before)
