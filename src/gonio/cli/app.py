"""The `gonio` command: its options, error messages and exit codes."""

from __future__ import annotations

import errno
import json
import os
import re
import signal
import sys
import warnings
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from ..errors import GonioError, GonioWarning, InputError, MachineError, in_user_code, out_of_loop
from ..files import check_current_folder
from . import streams
from .signals import Ended, exit_code
from .verbs.base import MATERIALS, PICTURES, SUPPORT, Verb

_HEADINGS = re.compile(r"^\S[^:]*:", re.MULTILINE)
_NAMES = re.compile(r"^  (-\S+(?:, --\S+)?(?= |$)|[a-z][\w-]*(?=  ))", re.MULTILINE)


def _styled(text: str) -> str:
    """The help text with bold headings and colored names. Typer's own formatting, by Rich, is slow."""
    return _NAMES.sub("  \x1b[36m\\1\x1b[0m", _HEADINGS.sub("\x1b[1m\\g<0>\x1b[0m", text))


class _Command(TyperCommand):
    def make_parser(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        parser = super().make_parser(ctx)  # type: ignore[arg-type]
        from . import renamed  # imported late, because the list of verbs does not need it

        renamed.accept(parser, self.name or "")
        return parser

    def get_help(self, ctx: typer.Context) -> str:  # type: ignore[override]  # Typer has its own Click
        return _styled(super().get_help(ctx))


class _Verbs(TyperGroup):
    """The verbs as commands, each created on demand."""

    def list_commands(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        return [verb.name for verbs in _by_panel().values() for verb in verbs]

    def get_command(self, ctx: typer.Context, cmd_name: str) -> TyperCommand | None:  # type: ignore[override]
        if ctx.resilient_parsing and cmd_name not in Verb.family.all():
            return None
        one = typer.Typer(add_completion=False, rich_markup_mode=None)
        one.command(cmd_name, cls=_Command)(Verb.family.get(cmd_name).with_single_options())
        command = typer.main.get_command(one)
        assert isinstance(command, TyperCommand)
        return command

    def format_commands(self, ctx: typer.Context, formatter: object) -> None:  # type: ignore[override]
        panels = _by_panel()
        width = max(len(verb.name) for verbs in panels.values() for verb in verbs)
        for panel, verbs in panels.items():
            with formatter.section(panel):  # type: ignore[attr-defined]
                formatter.write_dl([(f"{verb.name:{width}}", verb.doc) for verb in verbs])  # type: ignore[attr-defined]

    def get_help(self, ctx: typer.Context) -> str:  # type: ignore[override]
        return _styled(super().get_help(ctx))


def _by_panel() -> dict[str, list[Verb]]:
    """The verbs by heading, in the order of the help."""
    panels: dict[str, list[Verb]] = {PICTURES: [], MATERIALS: [], SUPPORT: []}
    for verb in sorted(Verb.family.all().values(), key=lambda verb: verb.place):
        panels.setdefault(verb.panel, []).append(verb)
    return panels


app = typer.Typer(
    name="gonio",
    cls=_Verbs,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Exit codes: 0 success, 1 failed verdict, 2 invalid usage or input, 3 machine error, 4 only invisible "
    "violations, 130 ended by Ctrl-C.",
)


def _version(wanted: bool) -> None:
    if wanted:
        from .. import __version__

        print(f"gonio {__version__}")
        raise typer.Exit()


@app.callback()
def gonio(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_version, is_eager=True)
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Print the full traceback if an error occurs.")] = False,
) -> None:
    """A laboratory for the scattering of light by materials."""
    if debug:
        os.environ["GONIO_DEBUG"] = "1"


def _fail(error: GonioError, as_json: bool) -> int:
    """Print an error in at most three lines (what, where, hint), or as JSON; returns its exit code."""
    if as_json:
        parts = {"what": error.what, "where": error.where, "hint": error.hint, "code": error.code}
        print(json.dumps({"error": parts}))
        return error.code
    from rich.console import Console
    from rich.text import Text

    what = "; ".join(" ".join(line.split()) for line in error.what.splitlines() if line.strip())
    text = Text("error: ", style="bold red").append(what, style="default not bold")
    for name, line in (("   in: ", error.where), (" hint: ", error.hint)):
        if line:
            text.append(f"\n{name}", style="bold cyan").append(" ".join(line.split()), style="default not bold")
    Console(stderr=True, highlight=False, soft_wrap=True).print(text)
    return error.code


def _show_warning(message: Warning | str, category: type[Warning], *place: object, **more: object) -> None:
    """Print Gonio's own warnings, one line each. Warnings of libraries are shown only with --debug."""
    if issubclass(category, GonioWarning) or os.environ.get("GONIO_DEBUG"):
        print(f"warning: {message}", file=sys.stderr)


def run(arguments: list[str] | None, ended: Ended | None = None) -> int:
    """Run the command and return its exit code. `ended` receives the signal that ended the command, if any."""
    given = sys.argv[1:] if arguments is None else arguments
    ended = ended or Ended()
    warnings.showwarning = _show_warning
    warnings.simplefilter("always", GonioWarning)
    try:
        code = _run(given, ended)
        sys.stdout.flush()
        return code
    except BrokenPipeError:  # `gonio schema | head`: the reader has closed the pipe
        streams.silence(sys.stdout, sys.stderr)
        return 0
    except streams.OutputError as error:
        if error.errno == errno.EIO and ended.number:  # the terminal has closed
            streams.silence(sys.stdout, sys.stderr)
            return ended.code
        streams.silence(sys.stdout)
        hint = "the files that the command wrote are complete"
        return _fail(MachineError(f"the output cannot be printed: {error.strerror}", "stdout", hint), as_json=False)


def _run(given: list[str], ended: Ended) -> int:
    as_json = "--json" in given
    try:
        check_current_folder()
        code = app(given or ["--help"], prog_name="gonio", standalone_mode=False)
        if code == exit_code(signal.SIGINT):  # Typer's result for a KeyboardInterrupt; renders exit themselves
            print(ended.line, file=sys.stderr)
            return ended.code
        return InputError.code if not given else code if isinstance(code, int) else 0
    except GonioError as error:
        return _fail(error, as_json)
    except KeyboardInterrupt:  # raised outside the code in which Typer catches it
        print(ended.line, file=sys.stderr)
        return ended.code
    except (BrokenPipeError, streams.OutputError):
        raise
    except Exception as error:
        if hasattr(error, "format_message"):  # a usage error of the argument parser
            return _fail(_usage_error(error), as_json)
        return _broken(error, as_json, ended)


def _broken(error: Exception, as_json: bool, ended: Ended) -> int:
    """Print an unexpected error, as an error in the user's code or a bug in Gonio, and return its exit code. If a
    signal has arrived, for example during an import, report the signal instead."""
    if ended.number:
        print(ended.line, file=sys.stderr)
        return ended.code
    if os.environ.get("GONIO_DEBUG"):
        raise error
    cause = out_of_loop(error)
    located = cause if isinstance(cause, GonioError) else in_user_code(cause)
    if located is not None:
        return _fail(located, as_json)
    if isinstance(error, OSError) and error.filename is not None:  # a file that was removed or is unreadable
        reason = error.strerror or type(error).__name__
        return _fail(InputError(f"cannot be used: {reason}", os.fsdecode(error.filename), "check the file"), as_json)
    if isinstance(error, MemoryError):
        return _fail(MachineError("out of memory", "", "reduce the amount of data, such as --size"), as_json)
    what = f"Gonio failed: {type(error).__name__}: {str(error).strip().splitlines()[0] if str(error) else ''}"
    failure = GonioError(what, "", "this is a bug in Gonio; run `gonio --debug ...` and report its output")
    failure.code = 3
    return _fail(failure, as_json)


def _usage_error(error: Exception) -> InputError:
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "gonio"
    message = error.format_message()  # type: ignore[attr-defined]
    return InputError(message, "", "" if "Did you mean" in message else f"see `{command} --help`")
