"""Parse the text of a scene file: strict JSON of bounded size and depth, as plain Python values.

Python's own parser is too lenient for files that people edit by hand, because it accepts NaN and duplicate keys, of
which it uses the last. It also fails on deep nesting. This module reports each of these as an `InputError` with the
location in the file.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

from ..bridge.types import Json
from ..errors import InputError

MAX_BYTES = 64 * 2**20  # maximum size of a file; geometry and images are stored in separate files
MAX_DEPTH = 64  # the depth of the lab's scenes is 8; 64 allows nested mixes and is far below any stack limit
MAX_INTEGER = 2**53  # a double cannot represent every larger integer


def pointer(*steps: str | int) -> str:
    """A JSON pointer (RFC 6901): `pointer("scene", "shapes", 0)` is "/scene/shapes/0"."""
    return "".join("/" + str(step).replace("~", "~0").replace("/", "~1") for step in steps)


def read_json(path: Path) -> dict[str, Json]:
    """Read the object in a JSON file. Raises InputError for anything that a scene file must not contain."""
    text = _text(path)
    try:
        value = _checked(json.loads(text, object_pairs_hook=_Object, parse_constant=_NotFinite), path, ())
    except RecursionError:
        _check_depth(text, path)
        raise
    except json.JSONDecodeError as error:
        raise InputError(
            f"not valid JSON: {error.msg[0].lower()}{error.msg[1:]}",
            f"{path}:{error.lineno}:{error.colno}",
            _syntax_hint(text, error.pos),
        ) from None
    except InputError:
        raise
    except ValueError as error:  # an integer with more digits than Python can convert
        raise InputError(f"not a usable number: {error}", str(path), "give a number below 1e18") from None
    if not isinstance(value, dict):
        raise InputError(
            f"expected an object {{...}} at the top level, got {kind_of(value)}",
            f"{path}#",
            'a scene starts like {"output": {...}, "camera": {...}, ...}',
        )
    return value


def kind_of(value: object) -> str:
    """A description of a JSON value: "the string 'x'", "a list of 2", "true"."""
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, str):
        return f"the string {value[:40]!r}"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "an object"
    return f"the number {value}"


class _Object(dict[str, Json]):
    """A JSON object, with a list of its duplicate keys."""

    def __init__(self, pairs: list[tuple[str, Json]]) -> None:
        super().__init__(pairs)
        self.twice: list[str] = []
        if len(self) < len(pairs):
            earlier: set[str] = set()
            self.twice = [key for key, _ in pairs if key in earlier or earlier.add(key)]  # type: ignore[func-returns-value]


class _NotFinite(str):
    """`NaN` or `Infinity`, which Python's parser accepts although JSON does not allow them."""


def _text(path: Path) -> str:
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"the file has {size / 2**20:.0f} MiB, the limit for a scene is {MAX_BYTES // 2**20} MiB",
                str(path),
                "put geometry into a mesh file beside the scene",
            )
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", str(path), "check the path") from None
    try:
        text = data.decode("utf-8-sig")  # editors on Windows write a byte order mark
    except UnicodeDecodeError as error:
        raise InputError(
            f"not UTF-8: byte {error.start} is 0x{data[error.start]:02x}",
            str(path),
            "save the file as UTF-8 (JSON's encoding)",
        ) from None
    if not text.strip():
        raise InputError("the file is empty", str(path), "a scene is a JSON object with a camera and shapes")
    return text


def _check_depth(text: str, path: Path) -> None:
    """Raise InputError with the line at which the text is nested too deeply."""
    depth = 0
    # Strings are matched first, so that brackets in them are not counted; the JSON parser reports unclosed strings.
    for match in re.finditer(r'"(?:[^"\\]|\\.)*"|[\[{\]}]', text):
        character = match.group()
        if character in "[{":
            depth += 1
            if depth > MAX_DEPTH:
                line = text.count("\n", 0, match.start()) + 1
                raise InputError(
                    f"nested more than {MAX_DEPTH} levels deep",
                    f"{path}:{line}",
                    "a scene needs fewer than 20; is a bracket missing?",
                )
        elif character in "]}":
            depth -= 1


def _plain(value: Json) -> bool:
    """Whether a value is a finite float, like most values in a large file."""
    return type(value) is float and math.isfinite(value)


def _checked(value: Json, path: Path, steps: tuple[str | int, ...]) -> Json:
    """Convert a value to plain types. Raises InputError for the first value that JSON or a scene does not allow."""
    if _plain(value):
        return value
    if len(steps) >= MAX_DEPTH and isinstance(value, (dict, list)):
        raise RecursionError  # `read_json` reports it with the line

    def refuse(what: str, hint: str) -> NoReturn:
        raise InputError(what, f"{path}#{pointer(*steps)}", hint)

    for text in value if isinstance(value, _Object) else (value,):
        if isinstance(text, str) and not _encodable(text):
            refuse("a string holds half of a surrogate pair", "write the letter itself; the file is UTF-8")
    if isinstance(value, _Object):
        if value.twice:
            steps = (*steps, value.twice[0])
            refuse(f"the key {value.twice[0]!r} is given twice", "keep one of them")
        return {key: _checked(item, path, (*steps, key)) for key, item in value.items()}
    if isinstance(value, list):
        return [v if _plain(v) else _checked(v, path, (*steps, index)) for index, v in enumerate(value)]
    if value is None:
        refuse("expected a value, got null", "leave the key out for its default")
    if isinstance(value, _NotFinite):
        refuse(f"expected a number, got {value}", "JSON has no NaN or Infinity; give a finite number")
    if isinstance(value, float) and not math.isfinite(value):
        refuse("the number is too large", "give a number below 1e18")
    if isinstance(value, int) and abs(value) > MAX_INTEGER:
        refuse("the number is too large", "integers go up to 2^53")
    return value


def _encodable(text: str) -> bool:
    if text.isascii():
        return True
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _syntax_hint(text: str, position: int) -> str:
    before = text[:position].rstrip()
    if before.endswith(",") or text[position : position + 1] in ("]", "}"):
        return "is there a comma after the last item?"
    if text[position : position + 2] in ("//", "/*") or text[position : position + 1] == "#":
        return "JSON has no comments"
    if text[position : position + 1] == "'":
        return 'JSON strings are in double quotes: "..."'
    return "a comma, quote or bracket is missing or too many near here"


def walk(value: Json, steps: tuple[str | int, ...] = ()) -> Iterator[tuple[tuple[str | int, ...], Json]]:
    """Every value in a tree of dictionaries and lists, with the path to the value; parents come first."""
    yield steps, value
    if isinstance(value, dict):
        for key, item in value.items():
            yield from walk(item, (*steps, key))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from walk(item, (*steps, index))
