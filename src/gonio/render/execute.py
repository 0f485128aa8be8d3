"""Run a prepared render until its sample count is reached, in this process or on workers, with checkpoints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..scene import mitsuba_scene
from ..transport.mitsuba_render import MitsubaRender
from ..transport.passes import Progress, run
from ..work import executor
from . import checkpoints
from .checkpoints import Keeper
from .prepare import Prepared

if TYPE_CHECKING:
    from . import tiles


def of_scene(prepared: Prepared) -> AbstractContextManager[None]:
    """Inside the `with` block, report errors of plugins in a Mitsuba scene as errors of the scene."""
    if not prepared.request.is_mitsuba:
        return nullcontext()
    return mitsuba_scene.rendering(prepared.request.scene, isinstance(prepared.render, MitsubaRender))


def execute(
    prepared: Prepared,
    *,
    temporary: Path | None = None,
    long: float | None = None,
    report: Callable[[Progress], None] = lambda progress: None,
    interrupted: Callable[[], object] = lambda: False,
    tell: Callable[[str], None] = lambda text: None,
) -> tuple[str, Keeper]:
    """Advance a render to its sample count. If there is a checkpoint, continue from it.

    Returns the reason why the render ended, as `run` does, and the writer of the checkpoints. Its `remove` must be
    called after the picture has been written.

    temporary    path of an automatic checkpoint, used for long jobs whose request names no checkpoint
    long         duration in seconds above which a job counts as long; a minute if None
    report       called with the progress after each pass
    interrupted  called after each pass; if the result is true, the render ends
    tell         called at the start with a notice if there is a checkpoint
    """
    from . import tiles

    request, (width, height) = prepared.request, prepared.size
    path = request.checkpoint or temporary
    unasked = request.checkpoint is None
    if path is not None:
        notice, unasked = checkpoints.earlier(path, prepared, unasked)
        if notice:
            tell(notice)
    goal, gathered = _goal(prepared), _gathered(prepared)
    keeper = Keeper(path, prepared if gathered is None else replace(prepared, render=gathered), unasked, long)

    def after(progress: Progress) -> None:
        keeper.after_pass(progress)
        report(progress)

    try:
        if gathered is not None:
            stopped = tiles.advance(
                [(prepared, gathered)], report=after, interrupted=interrupted, timeout=request.timeout
            )
            gathered.give()
        else:
            with of_scene(prepared):
                stopped = run(
                    prepared.render,
                    goal,
                    width * height,
                    timeout=request.timeout,
                    report=after,
                    interrupted=interrupted,
                )
        keeper.end(bool(stopped))
    finally:
        keeper.close()
    return stopped, keeper


def _goal(prepared: Prepared) -> int | Callable[[], int]:
    """The number of samples per pixel to reach; for a render until an error, a function that returns this number."""
    from ..transport import until

    render = prepared.render
    if not isinstance(render, until.Until):
        return prepared.spp
    if executor.current().remote:
        what = "workers render parts of a picture, but the error is that of the whole picture"
        raise InputError(what, "--until-error", "leave --workers or the cluster out, or give --spp instead")
    return lambda: render.goal


def _gathered(prepared: Prepared) -> tiles.Gathered | None:
    """The sums of the parts that workers will compute; None if this process renders."""
    from ..transport import integrators, until
    from . import tiles

    render = prepared.render
    if isinstance(render, until.Until) or not executor.current().remote or render.done >= prepared.spp:
        return None
    tiles.travelling(prepared)  # raises before anything is written
    assert isinstance(render, integrators.Render)
    return tiles.Gathered(render, prepared.spp)


def execute_all(
    prepared: Sequence[Prepared],
    *,
    interrupted: Callable[[], object] = lambda: False,
    finished: Callable[[int], None] = lambda index: None,
) -> str:
    """Run several renders at once on the current executor. Returns the reason why they ended, as `run` does.

    interrupted  called after each part; if the result is true, the renders end
    finished     called with the index of each render that is done
    """
    from ..transport import integrators
    from . import tiles

    jobs = []
    for one in prepared:
        tiles.travelling(one)
        assert isinstance(one.render, integrators.Render)
        jobs.append((one, tiles.Gathered(one.render, one.spp)))

    def give(number: int) -> None:
        jobs[number][1].give()
        finished(number)

    return tiles.advance(jobs, report=lambda progress: None, interrupted=interrupted, finished=give)
