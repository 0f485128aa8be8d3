"""A process that lives long: memory stays flat, what is interrupted can go on, and what is pickled arrives."""

from __future__ import annotations

import _thread
import gc
import multiprocessing
import pickle
import threading
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import garbage
from gonio.transport import passes

W = np.array([[0.0, 0.6, 0.8], [0.3, 0.0, 0.9539392]])

MATERIALS = [
    go.Conductor.preset("Au", alpha=(0.1, 0.4)),
    go.Dielectric(alpha=0.2),
    go.mix(go.Lambert(), go.Conductor.preset("Cu", alpha=0.3), 0.25),
    go.two_sided(go.Phong(kd=(0.2, 0.3, 0.4), ks=(0.1, 0.1, 0.1), p=20)),
    go.KullaConty(go.Conductor.preset("Ag", alpha=0.5)),
]


def value(material: go.BSDF) -> np.ndarray:
    return np.asarray(material.eval(W, W[::-1]))


@pytest.mark.slow
def test_materials_go_to_spawned_processes() -> None:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        for material, found in zip(MATERIALS, pool.map(value, MATERIALS), strict=True):
            assert np.array_equal(found, value(material)), material


def test_scenes_go_through_pickle(scene: Path) -> None:
    from gonio.render.request import Request
    from gonio.scene import read

    description = pickle.loads(pickle.dumps(read(scene)))
    assert description.raw == read(scene).raw and description.path == read(scene).path
    request = Request(scene, spp=2, overrides={"shapes.0.material": MATERIALS[0]})
    again = pickle.loads(pickle.dumps(request))
    assert again.overrides["shapes.0.material"].eval(W, W[::-1]) == pytest.approx(value(MATERIALS[0]))


def test_a_notebook_that_is_interrupted_can_go_on(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = go.render(scene, spp=4)
    monkeypatch.setattr(passes, "PASS_SECONDS", 0.05)
    threading.Timer(0.7, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        go.render(scene, spp=2**29)
    assert gc.isenabled()
    assert np.array_equal(go.render(scene, spp=4), whole)


def test_garbage_is_collected_again_after_an_error_and_not_before() -> None:
    with pytest.raises(ValueError), garbage.paused(), garbage.paused():
        assert not gc.isenabled()
        raise ValueError
    assert gc.isenabled()
    gc.disable()
    try:
        with garbage.paused():
            pass
        assert not gc.isenabled()  # somebody else's wish
    finally:
        gc.enable()


def test_shapes_of_another_size_compile_no_kernel(scene: Path) -> None:
    def compiled(radius: float) -> int:
        import drjit as dr

        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            go.render(
                go.Lambert(),
                spp=1,
                size=(8, 8),
                overrides={"shapes.0.radius": radius, "shapes.0.center": [radius, 1, 0]},
            )
            return len({kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel} - known)

    known: set[str] = set()
    import drjit as dr

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for radius in (0.31, 0.42, 0.53):
            dr.kernel_history_clear()
            go.render(
                go.Lambert(),
                spp=1,
                size=(8, 8),
                overrides={"shapes.0.radius": radius, "shapes.0.center": [radius, 1, 0]},
            )
            known |= {kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel}
    assert compiled(0.6180339) == 0


@pytest.mark.slow
def test_renders_in_a_loop_leave_nothing_behind(scene: Path) -> None:
    import resource

    def step(number: int) -> None:
        go.render(
            scene, spp=1, overrides={"shapes.0.material.p": 1 + number % 50, "shapes.0.radius": 0.5 + number / 200}
        )

    for number in range(20):
        step(number)
    gc.collect()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in range(60):
        step(number)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / before
    assert grown < 0.05, f"{grown:.1%} more memory after 60 renders"
