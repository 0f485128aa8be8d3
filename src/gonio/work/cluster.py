"""Many processes, here or on many machines, by Dask. Dask is asked for only when a cluster is.

    with Cluster(workers=4):                          # processes of this machine
    with Cluster("tcp://10.0.0.7:8786"):              # whatever has joined that scheduler

The part of a worker that fails, freezes or cannot be reached is done again by another one, and the first answer counts,
since all answers have the same bits. A part that fails by its input fails the job, and is not tried again. A worker of
another version of Gonio, or with another processor, would not give the same bits, and is refused by name.
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

from ..errors import GonioError, GonioWarning, InputError, MachineError
from . import executor, garbage, reachable
from .kept import Arrays

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster
    from distributed.security import Security

INSTALL = "pip install 'gonio[cluster]'"
LOOK = 0.2  # seconds between two looks at who is alive and whether somebody wants to stop
AHEAD = 4  # parts that each worker is given: one that it does, and what it goes on with while answers travel
PATIENCE = 5.0  # seconds that a part may take longer than others before another worker is asked for it too
FEW = 3.0  # times the median of the others that it may take
SILENT = 8.0  # seconds without a sign of life after which a worker is given nothing more
FROZEN = 30.0  # and after which one of this machine is ended, and another started
MOST_COPIES = 5
TOGETHER = 64  # results taken at once
FETCH = 20.0  # seconds for that
DEATHS = 3  # of workers while they did a part, after which it is the part's fault
ANSWER = 10.0  # seconds for a scheduler to answer
NOBODY = 60.0  # seconds to wait for the first worker
PACE = 30.0  # seconds between starts of workers that have no core of their own: a start takes one of two cores 2.5 s


class Cluster:
    """Workers of this machine, or those of a Dask scheduler; a context manager, inside which they do the parts.

    address  of a scheduler, "tcp://host:8786" or "tls://..."
    workers  so many processes of this machine instead; as many as it has cores at once, the others one by one while
             the job goes on, since they take from those at work
    security what Dask wants for a scheduler with TLS; Dask's own configuration where None
    wait     seconds to wait for the first worker of a scheduler, which is told; then MachineError
    Raises InputError for both or neither, and for what is no address, MachineError where Dask is missing or nobody
    answers.
    """

    remote = True

    def __init__(
        self,
        address: str | None = None,
        *,
        workers: int | None = None,
        security: Security | None = None,
        wait: float = NOBODY,
    ) -> None:
        if (address is None) == (workers is None):
            raise InputError("a cluster is an address or a number of workers", "cluster", "give one of the two")
        if workers is not None and workers < 1:
            raise InputError(f"{workers} workers asked for", "--workers", "give 1 or more")
        if not wait >= 0.0:
            raise InputError(f"{wait} seconds to wait for a worker", "wait", "give 0 or more")
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
        self._told = False  # that it waits for a worker
        self._stack = contextlib.ExitStack()
        self.silent: dict[str, float] = {}  # seconds since each worker gave a sign of life, when it was last looked at
        self.restarts = self.copies = 0

    # ------------------------------------------------------------------ open and close

    def __enter__(self) -> Cluster:
        import dask
        from distributed import LocalCluster
        from distributed.security import Security

        quiet: dict[str, object] = {"distributed.scheduler.allowed-failures": 1000}
        quiet |= {"distributed.comm.timeouts.connect": "10s", "distributed.admin.low-level-log-length": 0}
        # A worker that computes does not answer for a while; one that is frozen has its parts done by others anyway.
        quiet |= {"distributed.scheduler.worker-ttl": "300s"}
        self._stack.enter_context(dask.config.set(quiet))
        garbage.pause()  # Dask has threads
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
            logging.getLogger("distributed").setLevel(logging.CRITICAL)  # the errors are told here, in one line
            self._client = _client(self._address, security=self._security, timeout=ANSWER, set_as_default=False)
        except Exception as error:  # whatever a library makes of what answers
            self.close()
            text = " ".join(str(error).split())[:200]
            what = f"no scheduler answers: {text}"
            raise MachineError(what, str(self._address or "--workers"), "see docs/cluster.md") from error
        self._stack.enter_context(executor.using(self))
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End what was started here."""
        for process in self._processes:
            process.kill()
        self._stack.close()
        for one in (self._client, self._local):
            if one is not None:
                with contextlib.suppress(Exception):  # it may be gone already
                    one.close(timeout=2)
        for process in self._processes:
            process.wait()
        self._client = self._local = None
        self._processes = []

    def _start(self) -> subprocess.Popen[bytes]:
        """A worker of this machine."""
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
            process.stdin.flush()  # and open it stays: when it ends, this process has, and so does the worker
        return process

    # ------------------------------------------------------------------ who is there

    @property
    def size(self) -> int:
        """How many workers there are, or are to be."""
        return self._wanted or max(len(self._alive()), 1)

    def _workers(self) -> dict[str, Any]:
        assert self._client is not None
        return dict(self._client.scheduler_info(n_workers=-1)["workers"])

    def _alive(self) -> list[str]:
        """Workers that have given a sign of life."""
        self.silent = {name: time.time() - one["last_seen"] for name, one in self._workers().items()}
        return [name for name, seconds in self.silent.items() if seconds < SILENT]

    def _check(self) -> Iterator[None]:
        """Wait for the first worker, and look around while there is none. Raise MachineError where none comes, and one
        that names a worker with another version, before it is given anything."""
        if self._wanted is not None:
            return
        assert self._client is not None
        started = time.monotonic()
        while not self._alive():
            if not self._told:
                self._told = True
                text = f"no worker has joined {self._address} yet: waiting for one, {self._wait:g} s at most"
                warnings.warn(text, GonioWarning, stacklevel=2)
            if time.monotonic() - started > self._wait:
                what = f"no worker has joined the scheduler within {self._wait:g} s"
                raise MachineError(what, str(self._address), f"start `dask worker {self._address}`")
            time.sleep(LOOK)
            yield
        from . import worker

        own = worker.about()
        for name, other in self._client.run(worker.about_or_why, on_error="return").items():
            worker.compare(own, other, str(name))

    # ------------------------------------------------------------------ the work

    def run(
        self, function: executor.Function, arguments: Sequence[tuple[executor.Argument, ...]], files: Mapping[str, Path]
    ) -> Generator[tuple[int, Arrays], None, None]:
        """As `Executor.run`; (-1, {}) where nothing was done for a while."""
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
        """Files by content, once to each worker, also to those that join later."""
        assert self._client is not None
        from . import worker

        for name, path in files.items():
            if name not in self._sent:
                self._client.register_plugin(worker.File(name, path.read_bytes()), name=f"gonio-{name}")
                self._sent.add(name)

    def _revive(self) -> None:
        """Start a worker in place of one that has died, end one that is frozen, and start one that is still to come."""
        if any(seconds > FROZEN for seconds in self.silent.values()):
            names = {str(one["name"]) for one in self._workers().values() if time.time() - one["last_seen"] > FROZEN}
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
        if len(self._processes) < (self._wanted or 0) and time.monotonic() - self._begun > more * PACE:
            self._processes.append(self._start())


def _client(address: str | None, **options: object) -> Client:
    """A client of the scheduler; where it cannot connect, it is kept from waiting 20 seconds for a farewell."""
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
    """The parts of one call of `run`: which are out, to whom, since when."""

    def __init__(
        self, cluster: Cluster, function: executor.Function, arguments: Sequence[tuple[executor.Argument, ...]]
    ) -> None:
        assert cluster._client is not None
        self.cluster, self.client, self.function, self.arguments = cluster, cluster._client, function, arguments
        self.waiting = deque(range(len(arguments)))
        self.missing = set(self.waiting)
        self.out: dict[int, list[Future]] = {}
        self.since: dict[int, float] = {}
        self.deaths: dict[int, int] = {}
        self.took: list[float] = []
        self.answers: queue.Queue[tuple[int, Future]] = queue.Queue()
        self.ready: deque[tuple[int, Arrays]] = deque()
        from . import worker

        self.about, self.do = worker.about(), worker.do
        self.looked = 0.0
        self.alive: list[str] = []

    def hand_out(self) -> None:
        """Give each worker enough to do, and what takes too long to a second one."""
        while self.waiting and len(self.out) < AHEAD * self.cluster.size:
            self._submit(self.waiting.popleft())
        now = time.monotonic()
        if now - self.looked < 1.0:
            return
        self.looked = now
        self.alive = self.cluster._alive()
        usual = statistics.median(self.took) if self.took else 60.0
        for index in [i for i in self.out if now - self.since[i] > FEW * usual * AHEAD + PATIENCE]:
            if len(self.out[index]) < MOST_COPIES:
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
        """A part that is done; (-1, {}) where none is for a while."""
        if not self.ready:
            self._fetch()
        return self.ready.popleft() if self.ready else (-1, {})

    def _fetch(self) -> None:
        """Take what is done from the workers that have it, all at once: one by one takes four times as long."""
        try:
            answers = [self.answers.get(timeout=LOOK)]
        except queue.Empty:
            return
        with contextlib.suppress(queue.Empty):
            while len(answers) < TOGETHER:
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
            results = self.client.sync(fetch, list(done.values()), errors="raise", callback_timeout=FETCH)
        except Exception:  # one of the workers died, or froze, with what it had: ask for each again, elsewhere
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
        """Raise what the part itself has raised; give it to another where its worker was lost."""
        from asyncio import CancelledError

        from distributed.client import FutureCancelledError
        from distributed.scheduler import KilledWorker

        lost = isinstance(error, KilledWorker | FutureCancelledError | CancelledError | TimeoutError | OSError)
        if not lost or isinstance(error, GonioError):
            raise error
        self.deaths[index] = self.deaths.get(index, 0) + 1
        if self.deaths[index] > DEATHS:
            raise MachineError(f"{DEATHS + 1} workers were lost over one part", "cluster", "see what they print")
        self._submit(index)

    def cancel(self) -> None:
        self.missing.clear()
        with contextlib.suppress(Exception):  # the scheduler may be gone
            self.client.cancel([future for futures in self.out.values() for future in futures])
        self.out.clear()
        gc.collect()
