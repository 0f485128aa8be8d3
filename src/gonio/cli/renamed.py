"""Former names of options. Each works for one release, with a warning that states the current name.

All former names are listed in `FORMER`. They do not appear in the help, in shell completion or in docs/options.md.
Delete this module after one release.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, NamedTuple


def _folder(path: str) -> str:
    return path.rstrip("/") + "/"


class Former(NamedTuple):
    """A former name and its replacement. Each is an option of a verb or, in capital letters, an argument."""

    verb: str
    old: str
    new: str
    convert: Callable[[str], str] = str  # converts a value to the form that the current option accepts


FORMER = (
    Former("bake", "--points", "--sampler"),
    Former("bake", "--size", "--resolution"),
    Former("bake", "--spp", "--samples"),
    Former("compensation", "--walks", "--samples"),
    Former("compress", "--method", "--codec"),
    Former("convert", "OUT", "--output"),
    Former("emit", "--bundle", "--output", _folder),
    Former("fit", "--from", "DATA"),
    Former("fit", "--metric", "--loss"),
    Former("measure", "--kind", "--table"),
    Former("measure", "--rays", "--samples"),
    Former("verify", "--jobs", "--workers"),
    Former("verify", "-j", "--workers"),
    Former("verify", "--limit", "--timeout"),
    Former("verify", "--report", "--output"),
    Former("verify", "--sweep", "--vary"),
)


def warn(verb: str, old: str) -> None:
    """Print a warning about a former name to stderr, with the current name."""
    former = next(one for one in FORMER if (one.verb, one.old) == (verb, old))
    example = "DIR/" if former.convert is _folder else ""
    new = f"{former.new} {example}".rstrip() if former.new.startswith("-") else f"the argument {former.new}"
    print(f"warning: gonio {verb}: {old} is now {new}; the former spelling is for one release", file=sys.stderr)


def accept(parser: Any, verb: str) -> None:
    """Make the option parser of a verb accept the former names, too."""
    for former in FORMER:
        if former.verb == verb:
            option = _FormerOption(former, parser)
            if former.old.startswith("--"):
                parser._long_opt[former.old] = option
            elif former.old.startswith("-"):
                parser._short_opt[former.old] = option
            else:
                _accept_argument(parser, option)


def _accept_argument(parser: Any, option: _FormerOption) -> None:
    """Make the parser accept one more positional argument than the verb declares, as the value of the option."""
    process = parser._process_args_for_args

    def process_with_former(state: Any) -> None:
        words = state.largs + state.rargs
        if len(words) == len(parser._args) + 1 and option.obj.name not in state.opts:
            state.largs, state.rargs = words[:-1], []
            option.process(words[-1], state)
        process(state)

    parser._process_args_for_args = process_with_former


class _FormerOption:
    """An option of the parser under its former name, which passes its value to the current option."""

    takes_value = True
    nargs = 1

    def __init__(self, former: Former, parser: Any) -> None:
        self.former, self.parser = former, parser
        self.obj: Any = getattr(parser._long_opt.get(former.new), "obj", None)

    def process(self, value: str, state: Any) -> None:
        if not self.parser.ctx.resilient_parsing:
            warn(self.former.verb, self.former.old)
        if self.former.new.startswith("-"):
            self.parser._long_opt[self.former.new].process(self.former.convert(value), state)
        else:
            state.largs.append(value)
