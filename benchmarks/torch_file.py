"""The time of an emitted PyTorch file compared with Dr.Jit on the same material, in one process on all cores.

    python benchmarks/torch_file.py [--count 10000000] [--rounds 5]

The file's `eval` is traced to one graph and compiled (`make_fx`, then `torch.compile`, which needs a C++ compiler). The
directions are stored component by component, as in Dr.Jit. The two alternate; times are CPU times of this process.

Dr.Jit reuses the memory of freed arrays. glibc returns large blocks to the system, and clearing their pages again takes
as long as the evaluation itself; here it is told to retain them, as do the allocators that PyTorch's tuning guide
recommends. `--fresh` leaves glibc's defaults.
"""

from __future__ import annotations

import argparse
import ctypes
import statistics
import time
import types
from collections.abc import Callable
from typing import Any

import gonio as go
import drjit as dr
import numpy as np
import torch
from gonio.ops import backend
from torch.fx.experimental.proxy_tensor import make_fx

GOLD = go.Conductor.preset("Au", alpha=0.3)


M_TRIM_THRESHOLD, M_MMAP_MAX = -1, -4  # from glibc's malloc.h


def main(count: int, rounds: int, fresh: bool) -> None:
    """Print the median times of the two, and their ratio."""
    if not fresh:
        malloc = ctypes.CDLL(None).mallopt
        kept = malloc(M_MMAP_MAX, 0) and malloc(M_TRIM_THRESHOLD, 2**31 - 1)
        print("freed memory is used again" if kept else "this allocator takes no options")
    w = np.random.default_rng(1).normal(size=(2, 3, count)).astype(np.float32)
    w[:, 2] = np.abs(w[:, 2])
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    file: Any = types.ModuleType("gold")
    exec(compile(go.emit(GOLD, "torch"), "gold.py", "exec"), file.__dict__)
    given = [torch.from_numpy(v).T for v in w]
    traced = torch.compile(make_fx(lambda wo, wi: file.eval(wo, wi))(*given))
    kind = backend.types("float32")
    bound, directions = GOLD.bind(kind), [kind.vec3(v) for v in w]
    dr.eval(directions)

    def kernel() -> Any:
        value = bound.eval(*directions)
        dr.eval(value)
        dr.sync_thread()
        return value

    runs: list[Callable[[], Any]] = [lambda: traced(*given), kernel]
    ours, theirs = (np.asarray(run()).astype(float) for run in runs)  # the first call compiles
    difference = np.max(np.abs(ours - theirs.reshape(3, -1).T) / np.maximum(np.abs(ours), 1e-6))
    times = [[_seconds(run) for run in runs] for _ in range(rounds)]
    medians = [statistics.median(column) for column in zip(*times, strict=True)]
    ratio = statistics.median(first / second for first, second in times)
    print(
        f"{count:,} pairs: PyTorch {medians[0]:.3f} s, Dr.Jit {medians[1]:.3f} s, ratio {ratio:.2f}; {difference:.1e}"
    )


def _seconds(run: Callable[[], Any]) -> float:
    began = time.process_time()
    run()
    return time.process_time() - began


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--count", type=int, default=10_000_000)
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--fresh", action="store_true", help="each result in pages that the system clears anew")
    given = options.parse_args()
    main(given.count, given.rounds, given.fresh)
