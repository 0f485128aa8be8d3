"""Clusters of worker processes on this machine or on several, with Dask, which is imported when a cluster is opened.

    with Cluster(workers=4):                          # processes of this machine
    with Cluster("tcp://10.0.0.7:8786"):              # the workers that have joined that scheduler

If a worker fails, freezes or cannot be reached, another worker repeats its part. The first result is used, because all
results are bit-identical. If a part fails because of its input, it is not repeated, and the job fails. A worker with a
different version of Gonio or a different kind of processor would not give bit-identical results; it is rejected with an
error that names the worker.
"""

from __future__ import annotations

import contextlib
import gc
import importlib.util
import json
import logging
import os
import queue
import statistics
import subprocess
import sys
import time
import warnings
from collections import deque
from collections.abc import Generator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import garbage
from ..errors import GonioError, GonioWarning, InputError, MachineError
from . import executor, reachable
from .kept import Arrays

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster
    from distributed.security import Security

INSTALL = "pip install 'gonio[cluster]'"
POLL_INTERVAL = 0.2  # seconds between checks of the workers and for an interrupt
PARTS_PER_WORKER = 4  # parts submitted per worker: one to compute, and others to continue with while results are sent
MAX_DELAY = 5.0  # seconds by which a part may exceed its longest expected time before it is submitted again
MAX_SLOWDOWN = 3.0  # longest expected time of a part, as a multiple of the median time
SILENT_AFTER = 8.0  # seconds without a heartbeat after which a worker gets no more parts
FROZEN_AFTER = 30.0  # seconds without a heartbeat after which a local worker is killed and replaced
MAX_COPIES = 5
MAX_FETCHED = 64  # maximum number of results fetched at once
FETCH_TIMEOUT = 20.0  # seconds that fetching these results may take
MAX_LOSSES = 3  # number of workers that may be lost during the same part; if one more is lost, the part is the cause
CONNECT_TIMEOUT = 10.0  # seconds to wait for a scheduler to answer
JOIN_TIMEOUT = 60.0  # seconds to wait for the first worker
START_INTERVAL = (
    30.0  # seconds between starts of workers beyond the number of cores: each start occupies a core for 2.5 s
)


class Cluster:
    """A context manager inside which workers on this machine, or those of a Dask scheduler, run the parts of jobs.

    address   address of a scheduler, "tcp://host:8786" or "tls://..."
    workers   number of processes to start on this machine instead. One per core starts at once; the others start one by
              one while the job runs, because each start slows down the running workers
    security  Dask's `Security` for a scheduler with TLS; None uses Dask's configuration
    wait      seconds to wait for the first worker of a scheduler; a warning is issued while there is none
    Raises InputError for both or neither of `address` and `workers`, and for an invalid address. Raises MachineError if
    Dask is not installed, if no scheduler answers, or if no worker joins it within `wait` seconds.
    """

    remote = True

    def __init__(
        self,
        address: str | None = None,
        *,
        workers: int | None = None,
        security: Security | None = None,
        wait: float = JOIN_TIMEOUT,
    ) -> None:
        if (address is None) == (workers is None):
            raise InputError("an address or a number of workers expected", "cluster", "give one of the two")
        if workers is not None and workers < 1:
            raise InputError(f"{workers} workers requested", "--workers", "give 1 or more")
        if not wait >= 0.0:
            raise InputError(f"a wait of {wait} seconds for a worker", "wait", "give 0 or more")
        if address is not None:
            reachable.check(address)
        if importlib.util.find_spec("distributed") is None:
            raise MachineError("Dask is not installed", "cluster", INSTALL)
        self._address, self._wanted, self._security, self._wait = address, workers, security, wait
        self._local: LocalCluster | None = None
        self._client: Client | None = None
        self._processes: list[subprocess.Popen[bytes]] = []
        self._begun = 0.0
        self._sent: set[str] = set()
        self._warned = False  # whether a warning has been issued that there is no worker yet
        self._stack = contextlib.ExitStack()
        self.silent: dict[str, float] = {}  # seconds since each worker's last heartbeat, at the last check
        self.restarts = self.copies = 0

    # ------------------------------------------------------------------ open and close

    def __enter__(self) -> Cluster:
        import dask
        from distributed import LocalCluster
        from distributed.security import Security

        quiet: dict[str, object] = {"distributed.scheduler.allowed-failures": 1000}
        quiet |= {"distributed.comm.timeouts.connect": "10s", "distributed.admin.low-level-log-length": 0}
        # A worker may not answer while it computes; parts of a frozen worker are given to others in any case.
        quiet |= {"distributed.scheduler.worker-ttl": "300s"}
        self._stack.enter_context(dask.config.set(quiet))
        garbage.pause()  # Dask runs threads
        self._stack.callback(garbage.resume)
        try:
            if self._wanted is not None:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    # other users of this machine must not be able to run code here
                    self._security = Security.temporary()
                    self._local = LocalCluster(
                        n_workers=0, processes=False, host="127.0.0.1", protocol="tls", security=self._security,
                        dashboard_address=None, silence_logs=50,
                    )  # fmt: skip
                self._address = self._local.scheduler_address
                self._processes = [self._start() for _ in range(min(self._wanted, _cores()))]
                self._begun = time.monotonic()
            logging.getLogger("distributed").setLevel(logging.CRITICAL)  # errors are reported below, in one line
            self._client = _client(
                self._address, security=self._security, timeout=CONNECT_TIMEOUT, set_as_default=False
            )
        except Exception as error:  # the type depends on the program that answers
            self.close()
            text = " ".join(str(error).split())[:200]
            what = f"no scheduler answers: {text}"
            raise MachineError(what, str(self._address or "--workers"), "see docs/cluster.md") from error
        self._stack.enter_context(executor.using(self))
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop the workers and the scheduler that this cluster has started, and disconnect."""
        for process in self._processes:
            process.kill()
        self._stack.close()
        for one in (self._client, self._local):
            if one is not None:
                with contextlib.suppress(Exception):  # it may already be gone
                    one.close(timeout=2)
        for process in self._processes:
            process.wait()
        self._client = self._local = None
        self._processes = []

    def _start(self) -> subprocess.Popen[bytes]:
        """Start a worker on this machine."""
        assert self._wanted is not None and self._security is not None
        code = f"import sys; sys.path[:] = {sys.path!r}; from gonio.work import worker; worker.serve()"
        process = subprocess.Popen([sys.executable, "-P", "-c", code], stdin=subprocess.PIPE, start_new_session=True)
        order: dict[str, object] = {
            "address": self._address,
            "security": self._security.get_tls_config_for_role("worker"),
        }
        order = {**order, "threads": max(2, _cores() // self._wanted)}
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(json.dumps(order).encode() + b"\n")
            process.stdin.flush()  # it stays open: when this process ends, the pipe closes and the worker ends too
        return process

    # ------------------------------------------------------------------ workers

    @property
    def size(self) -> int:
        """The number of workers, including those that have not started yet."""
        return self._wanted or max(len(self._alive()), 1)

    def _workers(self) -> dict[str, Any]:
        assert self._client is not None
        return dict(self._client.scheduler_info(n_workers=-1)["workers"])

    def _alive(self) -> list[str]:
        """The workers with a recent heartbeat."""
        self.silent = {name: time.time() - one["last_seen"] for name, one in self._workers().items()}
        return [name for name, seconds in self.silent.items() if seconds < SILENT_AFTER]

    def _check(self) -> Iterator[None]:
        """Wait for the first worker, and yield repeatedly during the wait.

        Raises MachineError if no worker joins in time, or if a worker has a different version.
        """
        if self._wanted is not None:
            return
        assert self._client is not None
        started = time.monotonic()
        while not self._alive():
            if not self._warned:
                self._warned = True
                text = f"no worker has joined {self._address} yet: waiting for one, {self._wait:g} s at most"
                warnings.warn(text, GonioWarning, stacklevel=2)
            if time.monotonic() - started > self._wait:
                what = f"no worker has joined the scheduler within {self._wait:g} s"
                raise MachineError(what, str(self._address), f"start `dask worker {self._address}`")
            time.sleep(POLL_INTERVAL)
            yield
        from . import worker

        own = worker.about()
        for name, other in self._client.run(worker.about_or_why, on_error="return").items():
            worker.compare(own, other, str(name))

    # ------------------------------------------------------------------ jobs

    def run(
        self, function: executor.Function, arguments: Sequence[tuple[executor.Argument, ...]], files: Mapping[str, Path]
    ) -> Generator[tuple[int, Arrays], None, None]:
        """Run the parts of a job on the workers, see `Executor.run`."""
        if not arguments:
            return
        for _ in self._check():
            yield -1, {}
        self._send(files)
        job = _Job(self, function, arguments)
        try:
            while job.missing or job.ready:
                job.hand_out()
                yield job.next()
                self._revive()
        finally:
            job.cancel()

    def _send(self, files: Mapping[str, Path]) -> None:
        """Send files to all workers, including those that join later; equal contents are sent only once."""
        assert self._client is not None
        from . import worker

        for name, path in files.items():
            if name not in self._sent:
                self._client.register_plugin(worker.File(name, path.read_bytes()), name=f"gonio-{name}")
                self._sent.add(name)

    def _revive(self) -> None:
        """Replace workers that have failed or frozen, and start the next of the remaining workers."""
        if any(seconds > FROZEN_AFTER for seconds in self.silent.values()):
            names = {
                str(one["name"]) for one in self._workers().values() if time.time() - one["last_seen"] > FROZEN_AFTER
            }
            for process in self._processes:
                if str(process.pid) in names:
                    process.kill()
                    process.wait()
            self.silent = {}
        for index, process in enumerate(self._processes):
            if process.poll() is not None:
                self.restarts += 1
                self._processes[index] = self._start()
        more = len(self._processes) - _cores() + 1
        if len(self._processes) < (self._wanted or 0) and time.monotonic() - self._begun > more * START_INTERVAL:
            self._processes.append(self._start())


def _client(address: str | None, **options: object) -> Client:
    """A client of the scheduler. If it cannot connect, it is marked as closed, because closing it takes 20 seconds."""
    from distributed import Client

    client = Client.__new__(Client)
    try:
        client.__init__(address, **options)  # type: ignore[misc]
    except BaseException:
        client.status = "closed"
        raise
    return client


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Job:
    """The state of the parts in one call of `run`: the submitted ones, their submission times, and the results."""

    def __init__(
        self, cluster: Cluster, function: executor.Function, arguments: Sequence[tuple[executor.Argument, ...]]
    ) -> None:
        assert cluster._client is not None
        self.cluster, self.client, self.function, self.arguments = cluster, cluster._client, function, arguments
        self.waiting = deque(range(len(arguments)))
        self.missing = set(self.waiting)
        self.out: dict[int, list[Future]] = {}
        self.since: dict[int, float] = {}
        self.losses: dict[int, int] = {}
        self.took: list[float] = []
        self.answers: queue.Queue[tuple[int, Future]] = queue.Queue()
        self.ready: deque[tuple[int, Arrays]] = deque()
        from . import worker

        self.about, self.do = worker.about(), worker.do
        self.checked_at = 0.0
        self.alive: list[str] = []

    def hand_out(self) -> None:
        """Submit enough parts for all workers, and submit parts again that take too long."""
        while self.waiting and len(self.out) < PARTS_PER_WORKER * self.cluster.size:
            self._submit(self.waiting.popleft())
        now = time.monotonic()
        if now - self.checked_at < 1.0:
            return
        self.checked_at = now
        self.alive = self.cluster._alive()
        usual = statistics.median(self.took) if self.took else 60.0
        for index in [i for i in self.out if now - self.since[i] > MAX_SLOWDOWN * usual * PARTS_PER_WORKER + MAX_DELAY]:
            if len(self.out[index]) < MAX_COPIES:
                self.cluster.copies += 1
                self._submit(index)

    def _submit(self, index: int) -> None:
        self.since[index] = time.monotonic()
        key = f"gonio-{self.function.__name__}-{id(self)}-{index}-{len(self.out.get(index, []))}-{time.time_ns()}"
        some = self.alive and len(self.alive) < len(self.cluster.silent)
        options: dict[str, Any] = {"workers": self.alive, "allow_other_workers": True} if some else {}
        future = self.client.submit(
            self.do, self.function, self.arguments[index], self.about, key=key, pure=False, **options
        )
        self.out.setdefault(index, []).append(future)
        future.add_done_callback(lambda done: self.answers.put((index, done)))

    def next(self) -> tuple[int, Arrays]:
        """The index and result of a finished part; (-1, {}) if no part has finished for a while."""
        if not self.ready:
            self._fetch()
        return self.ready.popleft() if self.ready else (-1, {})

    def _fetch(self) -> None:
        """Fetch all finished results at once; fetching them one by one would take four times as long."""
        try:
            answers = [self.answers.get(timeout=POLL_INTERVAL)]
        except queue.Empty:
            return
        with contextlib.suppress(queue.Empty):
            while len(answers) < MAX_FETCHED:
                answers.append(self.answers.get_nowait())
        done: dict[int, Future] = {}
        for index, future in answers:
            if index not in self.missing or future.cancelled():
                continue
            if future.status == "finished":
                done[index] = future
            else:
                self._failed(index, future.exception(timeout=5) or TimeoutError())
        if not done:
            return
        try:
            fetch = self.client._gather
            results = self.client.sync(fetch, list(done.values()), errors="raise", callback_timeout=FETCH_TIMEOUT)
        except Exception:  # a worker has failed or frozen, and its results are lost: each part is computed again
            for index in done:
                self._failed(index, TimeoutError())
            return
        for index, (seconds, arrays) in zip(done, results, strict=True):
            self.took.append(seconds)
            self.missing.discard(index)
            for future in self.out.pop(index, []):
                future.release()
            self.ready.append((index, arrays))

    def _failed(self, index: int, error: BaseException) -> None:
        """Submit a part again if its worker was lost; otherwise raise the error of the part."""
        from asyncio import CancelledError

        from distributed.client import FutureCancelledError
        from distributed.scheduler import KilledWorker

        lost = isinstance(error, KilledWorker | FutureCancelledError | CancelledError | TimeoutError | OSError)
        if not lost or isinstance(error, GonioError):
            raise error
        self.losses[index] = self.losses.get(index, 0) + 1
        if self.losses[index] > MAX_LOSSES:
            raise MachineError(f"{MAX_LOSSES + 1} workers were lost on one part", "cluster", "see what they print")
        self._submit(index)

    def cancel(self) -> None:
        self.missing.clear()
        with contextlib.suppress(Exception):  # the scheduler may be gone
            self.client.cancel([future for futures in self.out.values() for future in futures])
        self.out.clear()
        gc.collect()
