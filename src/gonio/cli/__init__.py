"""The command line. Its subcommands, called verbs, contain no logic of their own, but call the packages below; each
verb is one file in `verbs`.

Nothing is imported at module level, so that every import takes place inside `main`, where Ctrl-C prints a single line.
`app` imports only small modules, and each verb imports its dependencies when it runs, so that `gonio --help` takes
little longer than the start of Python and Typer. All errors are printed by `app.run`.

Exit codes: 0 success, 1 a verdict of "fails", 2 invalid usage or input, 3 a machine error, 130 ended by Ctrl-C (143 by
SIGTERM, 129 by SIGHUP).
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .app import run as run
    from .verbs.base import Verb as Verb
    from .verbs.base import verb as verb

__all__ = ["Verb", "main", "run", "verb"]


def main(arguments: list[str] | None = None) -> None:
    """The `gonio` command."""
    import sys
    from contextlib import ExitStack

    from .. import garbage
    from . import signals, streams

    streams.prepare()
    with ExitStack() as stack:
        with signals.at_once(), garbage.paused():  # imports leave no garbage
            if (sys.argv[1:] if arguments is None else arguments)[:1] == ["verify"]:
                from ..verify.isolation import process

                stack.enter_context(process.started_ahead())
            from . import app
        with signals.as_exceptions() as ended:
            sys.exit(app.run(arguments, ended))


if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        from importlib import import_module

        if name in ("Verb", "verb"):
            return getattr(import_module(".verbs.base", __name__), name)
        if name == "run":
            return import_module(".app", __name__).run
        raise AttributeError(f"module 'gonio.cli' has no attribute '{name}'")
