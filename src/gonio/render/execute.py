"""Running a prepared render to its sample count, in this process or on workers, with checkpoints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path

from ..errors import InputError
from ..scene import mitsuba_scene
from ..transport.mitsuba_render import MitsubaRender
from ..transport.passes import Progress, run
from ..work import executor
from . import checkpoints
from .checkpoints import Keeper
from .prepare import Prepared


def of_scene(prepared: Prepared) -> AbstractContextManager[None]:
    """Report errors of the plugins of a Mitsuba scene as errors of the scene inside the `with` block."""
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
    """Advance a render to its sample count, continuing an earlier run if there is a checkpoint.

    Returns the reason for the end, as `run` does, and the keeper of the checkpoints, whose `remove` is to be called
    when the picture has been written.

    temporary  path of an automatic checkpoint, used for long jobs whose request names none
    long       seconds from which a job counts as long; a minute if None
    tell       called at the start with a notice if a checkpoint was found
    """
    from ..transport import integrators, until
    from . import tiles

    request, (width, height) = prepared.request, prepared.size
    path = request.checkpoint or temporary
    unasked = request.checkpoint is None
    if path is not None:
        notice, unasked = checkpoints.earlier(path, prepared, unasked)
        if notice:
            tell(notice)
    gathered = None
    goal: int | Callable[[], int] = prepared.spp
    if isinstance(prepared.render, until.Until):
        drawing = prepared.render
        goal = lambda: drawing.goal  # noqa: E731
        if executor.current().remote:
            what = "workers render parts of a picture, and its error is that of the whole"
            raise InputError(what, "--until-error", "leave --workers or the cluster out, or give --spp in its place")
    elif executor.current().remote and prepared.render.done < prepared.spp:
        tiles.travelling(prepared)  # raises before anything is written
        assert isinstance(prepared.render, integrators.Render)
        gathered = tiles.Gathered(prepared.render, prepared.spp)
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


def execute_all(
    prepared: Sequence[Prepared],
    *,
    interrupted: Callable[[], object] = lambda: False,
    finished: Callable[[int], None] = lambda index: None,
) -> str:
    """Run several renders at once by the current executor; `finished` is called with the index of each that is done."""
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
