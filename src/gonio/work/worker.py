"""What runs on a worker of a cluster: parts, the files that they read, and the check that it is the same Gonio."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import logging
import os
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from pathlib import Path

import dask
from distributed import Worker, WorkerPlugin, get_worker
from distributed.security import Security

from ..errors import MachineError
from . import executor, facts
from .kept import Arrays

_one = threading.Lock()  # Dr.Jit has one owner, also where a worker was given several threads


def do(
    function: executor.Function, arguments: tuple[executor.Argument, ...], wanted: dict[str, str]
) -> tuple[float, Arrays]:
    """One part, and the seconds that it took."""
    with _one:
        gc.disable()  # see `cluster.Cluster`: garbage is collected below, in this thread
        started = time.perf_counter()
        name = ""
        with contextlib.suppress(ValueError):
            worker = get_worker()
            name = str(worker.address)
            paths = {p.content_hash: p.path for p in worker.plugins.values() if isinstance(p, File)}
            executor._files.set(paths)
        compare(wanted, about(), name)
        try:
            return time.perf_counter() - started, function(*arguments)
        finally:
            gc.collect(1)


def about() -> dict[str, str]:
    """What must be the same on all workers, by what a person calls it."""
    python = ".".join(map(str, sys.version_info[:2]))
    return {
        "version": f"{facts.versions()}, Python {python}",
        "processor": facts.processor(),
        "code of Gonio": facts.code(),
    }


def about_or_why() -> dict[str, str]:
    try:
        return about()
    except Exception as error:  # no Gonio of this kind there
        return {"version": f"none that answers ({type(error).__name__}: {error})"}


def compare(own: Mapping[str, str], other: object, name: str) -> None:
    if not isinstance(other, dict):
        raise MachineError(
            f"worker {name} has no Gonio that answers: {other}", "cluster", "there: pip install 'gonio[cluster]'"
        )
    for what, value in own.items():
        if other.get(what) != value:
            text = (
                f"has another {what}" if what == "code of Gonio" else f"has {what} {other.get(what)}, this is {value}"
            )
            raise MachineError(f"worker {name} {text}", "cluster", "its bits would differ: install the same there")


class File(WorkerPlugin):
    """Dask's worker plugin that holds one file by its content."""

    def __init__(self, content_hash: str, content: bytes) -> None:
        self.content_hash, self.content, self.path = content_hash, content, Path()

    def setup(self, worker: object) -> None:
        handle, name = tempfile.mkstemp(prefix="gonio-", dir=getattr(worker, "local_directory", None))
        with os.fdopen(handle, "wb") as file:
            file.write(self.content)
        self.path, self.content = Path(name), b""

    def teardown(self, worker: object) -> None:
        with contextlib.suppress(OSError):
            self.path.unlink()


def serve() -> None:
    """A worker of `Cluster(workers=...)`, which ends with the process that started it."""
    order = json.loads(sys.stdin.buffer.readline())

    def outlive() -> None:
        sys.stdin.buffer.read()
        os._exit(0)

    threading.Thread(target=outlive, daemon=True).start()
    import drjit as dr

    gc.disable()
    dr.set_thread_count(order["threads"])
    given = order["security"]
    security = Security(
        require_encryption=True,
        tls_ca_file=given["ca_file"],
        tls_worker_cert=given["cert"],
        tls_worker_key=given["key"],
    )

    async def work() -> None:
        with tempfile.TemporaryDirectory(prefix="gonio-worker-") as folder:
            worker = Worker(
                order["address"],
                name=str(os.getpid()),
                nthreads=1,
                memory_limit=0,
                security=security,
                protocol="tls",
                dashboard=False,
                local_directory=folder,
                death_timeout=60,
            )
            await worker
            await worker.finished()

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # the one who asks is told of errors
    # nor does anybody read Dask's logs and profiles here
    dask.config.set({"distributed.admin.low-level-log-length": 0, "distributed.worker.profile.enabled": False})
    with contextlib.suppress(KeyboardInterrupt, asyncio.CancelledError):
        asyncio.run(work())
    os._exit(0)
