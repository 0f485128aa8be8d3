"""Explanations of compiler messages in terms of BSDFs: exceeded limits, and features that a BSDF cannot have."""

from __future__ import annotations

import re
import signal

_RECURSION = re.compile(r"Recursion detected:\s+(\w+)\(\S* calling (\w+)\(")
_BUILTIN = re.compile(r"'(\w+)'\s*:\s*no matching overloaded function|'(subgroup) op'\s*:\s*requires SPIR-V")
_KINDS = {
    r"barrier|groupMemoryBarrier|memoryBarrier\w*|\w*GroupSync": "a barrier",
    r"atomic\w+|imageAtomic\w+|Interlocked\w+": "an atomic operation",
    r"imageStore": "a write to an image",
    r"dFd[xy]\w*|fwidth\w*|dd[xy]\w*": "a screen-space derivative",
    r"subgroup\w*|Wave\w+": "a subgroup operation",
}
ALONE = "a BSDF is a function of directions and parameters alone"


def explained(message: str, printed: str) -> tuple[str, str]:
    """An error and a hint for a compiler message, more specific than the message if its cause is known.

    printed  the complete output of the compiler
    """
    if "Recursion detected" in message and (pair := _RECURSION.search(printed)):
        a, b = pair.groups()
        what = f"'{a}' calls itself" if a == b else f"'{a}' and '{b}' call each other"
        return f"recursion: {what}", "use a bounded loop"
    if builtin := _BUILTIN.search(message):
        name = builtin[1] or builtin[2]
        for pattern, kind in _KINDS.items():
            if re.fullmatch(pattern, name):
                return f"{kind} ({name}) is not supported", ALONE
    if "memory exhausted" in message:  # of the parser's stack, which has 10,000 entries
        return "brackets or blocks are nested too deeply for the compiler", "reduce the nesting"
    return message, "correct the line"


def ended(code: int, printed: str, seconds: int, memory: int, size: int) -> tuple[str, str]:
    """An error and a hint for a compiler that ended without a message.

    code     exit code, or minus the number of the signal that ended the compiler
    seconds, memory, size  limits of the compiler: CPU time in seconds, memory in bytes, size of a module in bytes
    """
    shorter = "shorten the shader: its macros, loops, types and functions"
    if "bad_alloc" in printed or "MemoryError" in printed or "out of memory" in printed.lower():
        return f"the compiler needs more than {memory >> 30} GB of memory", shorter
    name = signal.Signals(-code).name if code < 0 else ""
    if name in ("SIGXCPU", "SIGKILL"):
        return f"the compiler took over {seconds} s", shorter
    if name == "SIGXFSZ":
        return f"the compiler wrote over {size >> 20} MB", shorter
    if name:
        limits = f"{seconds} s, {memory >> 30} GB"
        return f"the compiler crashed ({name}), without a message", f"it was within its limits ({limits}): {shorter}"
    return f"the compiler ended with code {code}, without a message", shorter
