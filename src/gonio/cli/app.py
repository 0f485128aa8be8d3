"""The `gonio` command itself: its options, its errors and its exit codes."""

from __future__ import annotations

import json
import os
import sys
from typing import Annotated, Any

import typer

from ..errors import GonioError, GonioWarning, InputError

app = typer.Typer(
    name="gonio",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 verdict fails, 2 bad usage or input, 3 fault of the machine, 130 Ctrl-C.",
)

INTERRUPTED = 130  # what a shell reports of a program that Ctrl-C ended: 128 + SIGINT

PICTURES, MATERIALS, SUPPORT = "Pictures", "Materials", "Support"


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
    debug: Annotated[bool, typer.Option("--debug", help="Show a traceback where Gonio fails.")] = False,
) -> None:
    """A laboratory for the scattering of light by materials."""
    if debug:
        os.environ["GONIO_DEBUG"] = "1"


def _fail(error: GonioError, as_json: bool) -> int:
    """Print an error in three lines at most (what, where, hint), or as JSON; its exit code."""
    if as_json:
        parts = {"what": error.what, "where": error.where, "hint": error.hint, "code": error.code}
        print(json.dumps({"error": parts}))
        return error.code
    from rich.console import Console
    from rich.text import Text

    text = Text("error: ", style="bold red").append(" ".join(error.what.split()), style="default not bold")
    for name, line in (("   in: ", error.where), (" hint: ", error.hint)):
        if line:
            text.append(f"\n{name}", style="bold cyan").append(" ".join(line.split()), style="default not bold")
    Console(stderr=True, highlight=False, soft_wrap=True).print(text)
    return error.code


def _show_warning(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
    """Our own warnings are for the user, in one line; those of libraries are for their authors."""
    if issubclass(category, GonioWarning) or os.environ.get("GONIO_DEBUG"):
        print(f"warning: {message}", file=sys.stderr)


def run(arguments: list[str] | None) -> int:
    as_json = "--json" in (sys.argv[1:] if arguments is None else arguments)
    try:
        code = app(arguments, prog_name="gonio", standalone_mode=False)
        sys.stdout.flush()
        if code == INTERRUPTED:  # Typer's answer to a KeyboardInterrupt; a render that kept its picture exits itself
            print("ended by Ctrl-C; nothing was written", file=sys.stderr)
        return code if isinstance(code, int) else 0
    except GonioError as error:
        return _fail(error, as_json)
    except BrokenPipeError:  # `gonio schema | head`: whoever read us has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if hasattr(error, "format_message"):  # a usage error of the argument parser
            if not error.format_message():  # `gonio` alone: the help has been printed
                return 2
            return _fail(_usage_error(error), as_json)
        if os.environ.get("GONIO_DEBUG"):
            raise
        what = f"Gonio failed: {type(error).__name__}: {str(error).strip().splitlines()[0] if str(error) else ''}"
        failure = GonioError(what, "", "this is a fault of Gonio; run `gonio --debug ...` and report what it prints")
        failure.code = 3
        return _fail(failure, as_json)


def _usage_error(error: Any) -> InputError:
    command = error.ctx.command_path if getattr(error, "ctx", None) else "gonio"
    message = error.format_message()
    return InputError(message, "", "" if "Did you mean" in message else f"see `{command} --help`")


def main(arguments: list[str] | None = None) -> None:
    """The `gonio` command."""
    import warnings

    warnings.showwarning = _show_warning
    warnings.simplefilter("always", GonioWarning)
    sys.exit(run(arguments))
