"""Several processes give bit-identical results to one, even if workers fail; what cannot travel is refused."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

import gonio as go
import numpy as np
import pytest
from gonio.catalog import notation
from gonio.errors import GonioWarning, InputError, MachineError
from gonio.render import checkpoints, tiles
from gonio.render.execute import execute
from gonio.render.prepare import prepare
from gonio.render.request import Request
from gonio.transport import passes
from gonio.transport.polarizer import PolarizedRender
from gonio.work import executor, facts, parts
from gonio.work.cluster import Cluster

if TYPE_CHECKING:
    from distributed import LocalCluster


@pytest.fixture(scope="module", autouse=True)
def distributed() -> None:
    """Without it nothing here can be tried. It takes 0.7 s to import, in each process that collects tests."""
    pytest.importorskip("distributed")


LARGE = (120, 80)  # enough lanes for many parts


def square(x: float, seconds: float = 0.0) -> dict[str, np.ndarray]:
    """A part."""
    time.sleep(seconds)
    return {"x": np.array([x * x]), "pid": np.array([os.getpid()])}


def meet(x: float, folder: str) -> dict[str, np.ndarray]:
    """A part that ends once another process, too, has begun one: the second worker may start late."""
    (Path(folder) / str(os.getpid())).touch()
    until = time.monotonic() + 120.0
    while len(os.listdir(folder)) < 2 and time.monotonic() < until:
        time.sleep(0.02)
    return square(x)


def refuse(x: float) -> dict[str, np.ndarray]:
    raise InputError(f"{x} given", "x", "give another")


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """Two workers; each test works with them by `executor.using`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("GONIO_CACHE", str(tmp_path_factory.mktemp("cache")))
        with Cluster(workers=2) as cluster, executor.using(executor.LocalExecutor()):
            yield cluster


def done(function: executor.Function, arguments: list[tuple[object, ...]]) -> dict[int, dict[str, np.ndarray]]:
    return {index: found for index, found in executor.each(function, arguments) if index >= 0}


def test_parts_are_done_by_all_and_each_is_done(two: Cluster, tmp_path: Path) -> None:
    with executor.using(two):
        found = done(meet, [(x, str(tmp_path)) for x in range(20)])
    assert [float(found[i]["x"][0]) for i in range(20)] == [x * x for x in range(20)]
    assert len({int(one["pid"][0]) for one in found.values()} - {os.getpid()}) == 2


def test_a_part_that_fails_by_its_input_is_tried_once(two: Cluster) -> None:
    with executor.using(two), pytest.raises(InputError, match="3 given") as caught:
        done(refuse, [(3,)])
    assert caught.value.hint == "give another"


@pytest.mark.slow
def test_a_worker_that_is_killed_costs_time_and_no_part(two: Cluster) -> None:
    with executor.using(two):
        count = 0
        for index, _ in executor.each(square, [(x, 0.3) for x in range(10)]):
            count += index >= 0
            if count == 2:
                two._processes[0].kill()
    assert count == 10 and two.restarts >= 1


@pytest.mark.sample(1)
@pytest.mark.parametrize("options", [{}, {"integrator": "direct", "denoise": True}])
def test_a_picture_has_the_same_bits(
    two: Cluster, scene: Path, monkeypatch: pytest.MonkeyPatch, options: dict[str, object]
) -> None:
    monkeypatch.setattr(tiles, "MAX_SAMPLES", 1)  # six parts of 64 lanes
    alone = go.render(scene, spp=5, **options)  # type: ignore[arg-type]
    with executor.using(two):
        assert np.array_equal(go.render(scene, spp=5, **options), alone)  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_study_and_a_bake_have_the_same_bits(two: Cluster, scene: Path, tmp_path: Path) -> None:
    vary = {"shapes.0.material.p": [4, 16]}
    alone = go.study(scene, vary, spp=3)
    table = go.bake("ggx", resolution=12, seed=1)
    parts.Parts("none").clear()
    os.environ["GONIO_CACHE"] += "-anew"
    with executor.using(two):
        together = go.study(scene, vary, spp=3)
        other = go.bake("ggx", resolution=12, seed=1)
    assert together._repr_png_() == alone._repr_png_()
    assert all(np.array_equal(table.arrays[name], other.arrays[name]) for name in table.arrays)


@pytest.mark.slow
def test_a_trial_gives_the_same_report_and_keeps_what_is_done(
    two: Cluster, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from gonio.verify import trials
    from gonio.verify.isolation import child

    items = [child.Item("lambert"), child.Item("mirror"), child.Item("phong", ("p=20", "kd=0.6,0.6,0.6"))]
    task = child.Task(items, "quick", 1, ["reciprocity", "energy", "pdf"])

    def plain(report: object) -> object:
        text = json.dumps(report.as_dict())  # type: ignore[attr-defined]
        return json.loads(re.sub(r'"seconds": [\d.e-]+', '"seconds": 0', text))

    alone = child.trial(task)
    with executor.using(two):
        assert plain(trials.trial(task)) == plain(alone)
    # one after the other, stopped after the second: the next run judges the third only
    monkeypatch.setenv("GONIO_CACHE", str(tmp_path))
    task = task._replace(effort="default", laws=["reciprocity"])
    judged, really = list[str](), child.trial

    def counted(task: child.Task, **options: object) -> object:
        if len(judged) == 2 and not stopped:
            stopped.append(True)
            raise KeyboardInterrupt
        judged.append(str(task.items[0].target))
        return really(task, **options)  # type: ignore[arg-type]

    stopped: list[bool] = []
    monkeypatch.setattr(child, "trial", counted)
    with pytest.raises(KeyboardInterrupt):
        trials.trial(task)
    assert [card.passed for card in trials.trial(task).cards] == [True, True, True]
    assert judged[:3] == ["lambert", "mirror", "phong"]


def test_what_is_done_when_it_is_stopped_goes_on_alone_and_together(
    two: Cluster, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tiles, "MAX_SAMPLES", 1)
    alone = go.render(scene, spp=6)
    for other in (two, executor.LocalExecutor()):
        path, seen = tmp_path / type(other).__name__, list[int]()
        prepared = prepare(Request(scene, checkpoint=path, spp=6))
        with executor.using(two):
            stopped, _ = execute(
                prepared, report=lambda p, seen=seen: seen.append(p.done), interrupted=lambda seen=seen: seen
            )
        assert stopped == "interrupt" and path.is_file()
        lanes = checkpoints.load(path).arrays["lanes"]
        assert 0 < np.count_nonzero(lanes) < len(lanes)
        with executor.using(other), pytest.warns(GonioWarning, match="% of the pixels are done"):
            assert np.array_equal(go.resume(path), alone)


@pytest.mark.slow
def test_a_picture_goes_on_to_more_samples_by_a_crew(two: Cluster, scene: Path, tmp_path: Path) -> None:
    go.render(scene, spp=3, checkpoint=tmp_path / "c")
    with executor.using(two), pytest.warns(GonioWarning, match="3 of 7"):
        assert np.array_equal(go.resume(tmp_path / "c", spp=7), go.render(scene, spp=7))


@pytest.mark.slow
def test_files_travel_and_so_does_code_that_the_user_named(two: Cluster, scene: Path, tmp_path: Path) -> None:
    source = "import gonio as go\n\nclass Flat(go.Lambert):\n    'Flat.'\n    name = 'flat-for-cluster'\n"
    (tmp_path / "flat.py").write_text(source)
    material = notation.named(f"{tmp_path / 'flat.py'}:Flat")[0]
    alone = go.render(material, spp=2, size=(24, 16))
    with executor.using(two):
        assert np.array_equal(go.render(material, spp=2, size=(24, 16)), alone)


def test_what_cannot_travel_is_refused(two: Cluster, tmp_path: Path) -> None:
    from test_run import XML

    (tmp_path / "ball.xml").write_text(XML)
    with executor.using(two), pytest.raises(InputError, match="one machine") as caught:
        go.render(tmp_path / "ball.xml", spp=2)
    assert "--integrator path" in caught.value.hint
    polarized = SimpleNamespace(render=object.__new__(PolarizedRender), request=None)
    with pytest.raises(InputError, match="a scene with a polarizer") as caught:
        tiles.travelling(polarized)  # type: ignore[arg-type]
    assert "--integrator" not in caught.value.hint


sys.path.insert(0, str(Path(__file__).parent / "render"))


def test_another_version_is_refused_by_name(two: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    with (
        monkeypatch.context() as other,
        executor.using(two),
        pytest.raises(MachineError, match=r"worker .* gonio 9\.9"),
    ):
        other.setattr(facts, "__version__", "9.9")
        done(square, [(1,)])


@pytest.mark.parametrize(
    ("given", "what"),
    [({}, "an address or a number"), ({"workers": 0}, "0 workers"), ({"address": "tcp://127.0.0.1:1"}, "no scheduler")]
    + [
        ({"address": text}, "is not a scheduler address")
        for text in ("nonsense", "", "a b:1", "htp://a:1", "tcp://a:0", "tcp://a:99999")
    ],
)
def test_a_cluster_that_cannot_be_is_one_clear_error(
    given: dict[str, object], what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from gonio.work import cluster

    monkeypatch.setattr(cluster, "CONNECT_TIMEOUT", 0.5)
    with pytest.raises(go.GonioError, match=what), Cluster(**given):  # type: ignore[arg-type]
        pass


def test_a_cluster_counts_workers_that_have_not_started() -> None:
    assert Cluster(workers=3).size == 3


@pytest.mark.sample(1)
@pytest.mark.parametrize("greeting", [b"", b"HTTP/1.1 400 Bad Request\r\n"])
def test_what_answers_and_is_no_scheduler_is_one_error(greeting: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    from gonio.work import reachable

    monkeypatch.setattr(reachable, "CONNECT", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=lambda: server.accept()[0].send(greeting), daemon=True).start()
        start = time.monotonic()
        with pytest.raises(MachineError, match="no scheduler answers: ") as caught:
            Cluster(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        assert time.monotonic() - start < 5.0 and len(str(caught.value).splitlines()) == 2


@pytest.fixture
def scheduler() -> Iterator[LocalCluster]:
    """A scheduler that no worker has joined."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=0, processes=False, dashboard_address=None, silence_logs=50) as local:
        yield local


@pytest.mark.slow
def test_a_scheduler_without_workers_is_waited_for_and_told(scheduler: LocalCluster, scene: Path) -> None:
    with (
        Cluster(scheduler.scheduler_address, wait=0.5),
        pytest.warns(GonioWarning, match="no worker has joined .* yet: waiting for one, 0.5 s at most"),
        pytest.raises(MachineError, match=r"no worker has joined the scheduler within 0\.5 s") as caught,
    ):
        go.render(scene, spp=2, size=(24, 16))
    assert caught.value.code == 3


@pytest.mark.slow
def test_one_worker_is_a_cluster_and_of_another_version_refused(
    scheduler: LocalCluster, scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from gonio.work import worker

    scheduler.scale(1)
    with Cluster(scheduler.scheduler_address) as cluster:
        assert cluster.remote
        other = {**worker.about(), "version": "gonio 9.9"}
        monkeypatch.setattr(worker, "about_or_why", lambda: other)
        with pytest.raises(MachineError, match=r"worker .* has version gonio 9\.9"):
            go.render(scene, spp=2, size=(24, 16))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_pictures_survive_workers_that_die_at_random(scene: Path, seed: int) -> None:
    alone = go.render(scene, size=LARGE, spp=8000, seed=seed)
    chance = np.random.default_rng(seed)
    with Cluster(workers=2) as cluster:
        at = time.monotonic() + chance.uniform(0.5, 2.0)

        def look(progress: object) -> None:
            nonlocal at
            if time.monotonic() > at:
                at = time.monotonic() + chance.uniform(0.5, 2.0)
                with contextlib.suppress(ProcessLookupError):
                    os.kill(cluster._processes[int(chance.integers(2))].pid, signal.SIGKILL)

        prepared = prepare(Request(scene, size=LARGE, spp=8000, seed=seed))
        execute(prepared, report=look)
        assert cluster.restarts > 0
    assert np.array_equal(prepared.render.image(), alone)


@pytest.mark.slow
def test_a_frozen_worker_loses_nothing() -> None:
    with Cluster(workers=2) as cluster:
        count, frozen = 0, False
        for index, _ in executor.each(square, [(x, 0.5) for x in range(12)]):
            count += index >= 0
            if count == 3 and not frozen:
                frozen = True
                os.kill(cluster._processes[0].pid, signal.SIGSTOP)
        assert count == 12


class Link:
    """A line to a port of this machine that can stall: bytes are no longer carried, and nobody is told."""

    def __init__(self, port: int) -> None:
        self.stalled = threading.Event()
        self._target, self._server = port, socket.create_server(("127.0.0.1", 0))
        self.port = int(self._server.getsockname()[1])
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):  # closed
            while True:
                near = self._server.accept()[0]
                far = socket.create_connection(("127.0.0.1", self._target))
                for ends in ((near, far), (far, near)):
                    threading.Thread(target=self._carry, args=ends, daemon=True).start()

    def _carry(self, source: socket.socket, target: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                while self.stalled.is_set():
                    time.sleep(0.05)
                target.sendall(data)
            target.shutdown(socket.SHUT_WR)

    def close(self) -> None:
        self._server.close()


@pytest.mark.slow
def test_a_worker_whose_link_stalls_loses_nothing(scene: Path) -> None:
    alone = go.render(scene, size=LARGE, spp=8000)
    with Cluster(workers=1) as cluster:
        assert cluster._address is not None
        direct, port = cluster._address, int(cluster._address.rpartition(":")[2])
        link = Link(port)
        cluster._wanted, cluster._address = 2, f"tls://127.0.0.1:{link.port}"
        cluster._processes.append(cluster._start())
        cluster._address = direct
        while len(cluster._alive()) < 2:
            time.sleep(0.1)
        prepared = prepare(Request(scene, size=LARGE, spp=8000))

        def look(progress: passes.Progress) -> None:
            if progress.done > progress.wanted / 8:
                link.stalled.set()

        execute(prepared, report=look)
        assert link.stalled.is_set()
    link.stalled.clear()
    link.close()
    assert np.array_equal(prepared.render.image(), alone)
