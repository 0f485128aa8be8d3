"""Code that runs on the workers of a cluster: it runs parts of jobs, provides their files, and checks versions."""

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

_one = threading.Lock()  # only one thread may use Dr.Jit, even if a worker has several


def do(
    function: executor.Function, arguments: tuple[executor.Argument, ...], wanted: dict[str, str]
) -> tuple[float, Arrays]:
    """Run one part of a job. Returns the time that it took, in seconds, and its result.

    wanted  the properties that this worker must have, as returned by `about`
    """
    with _one:
        gc.disable()  # garbage is collected below, in this thread, see `cluster.Cluster`
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
    """The properties that must be the same on all workers, by their names in errors."""
    python = ".".join(map(str, sys.version_info[:2]))
    return {
        "version": f"{facts.versions()}, Python {python}",
        "processor": facts.processor(),
        "code of Gonio": facts.code(),
    }


def about_or_why() -> dict[str, str]:
    """The result of `about`. If it fails, the reason for the failure replaces the version."""
    try:
        return about()
    except Exception as error:  # Gonio is missing on the worker, or has a different interface
        return {"version": f"none that answers ({type(error).__name__}: {error})"}


def compare(own: Mapping[str, str], other: object, name: str) -> None:
    """Raise MachineError, with the name of the worker, if its properties differ from those of this process.

    own    the result of `about` in this process
    other  the result of `about_or_why` on the worker
    """
    if not isinstance(other, dict):
        raise MachineError(
            f"Gonio does not answer on worker {name}: {other}", "cluster", "run there: pip install 'gonio[cluster]'"
        )
    for what, value in own.items():
        if other.get(what) != value:
            text = (
                f"has different {what}" if what == "code of Gonio" else f"has {what} {other.get(what)}, this is {value}"
            )
            raise MachineError(f"worker {name} {text}", "cluster", "its results would differ: install the same there")


class File(WorkerPlugin):
    """A plugin for Dask workers that provides one file, identified by a hash of its content."""

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
    """Run a worker of `Cluster(workers=...)` until the process that started it ends."""
    order = json.loads(sys.stdin.buffer.readline())

    def end_with_parent() -> None:
        sys.stdin.buffer.read()
        os._exit(0)

    threading.Thread(target=end_with_parent, daemon=True).start()
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

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # errors are reported to the client
    # Dask's logs and profiles are not used here
    dask.config.set({"distributed.admin.low-level-log-length": 0, "distributed.worker.profile.enabled": False})
    with contextlib.suppress(KeyboardInterrupt, asyncio.CancelledError):
        asyncio.run(work())
    os._exit(0)
