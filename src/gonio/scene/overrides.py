"""Overrides: set values of a scene by path, as in `gonio study --vary shapes.*.material.roughness=0.1,0.5`.

A path is a JSON pointer ("/scene/shapes/0/material/p") or a dotted path ("scene.shapes.0.material.p"). The leading
`scene` is optional, and `*` matches every item. Values are set in the raw JSON before validation, as if the file
contained them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..bridge.types import Json
from ..errors import InputError, did_you_mean, encodable
from ..material import BSDF
from .materials import described, part_of


def apply(raw: dict[str, Json], overrides: Mapping[str, object]) -> None:
    """Set the value at each path, in place. Raises InputError for an invalid path, and for a value that is not JSON."""
    for path, value in overrides.items():
        _check_text(path, path)
        _set(raw, path, _plain(value, path))


def _plain(value: object, path: str) -> Json:
    """A value in the form in which a scene file would contain it, with lists in place of tuples and arrays."""
    if isinstance(value, Mapping):
        for key in value:
            _check_text(str(key), path)
        return {str(key): _plain(item, path) for key, item in value.items()}
    if isinstance(value, BSDF):
        return described(value)  # type: ignore[return-value]  # validation accepts it unchanged
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item, path) for item in value]
    if isinstance(value, str):
        _check_text(value, path)
    if value is None or isinstance(value, str | int | float):
        return value
    raise InputError(f"{value!r} is not a scene value", f"path {path}", "give a number, a name, a list or an object")


def _check_text(text: str, path: str) -> None:
    """Raise InputError if a text from the command line is not valid UTF-8, because scene files must be UTF-8."""
    if encodable(text) != text:
        raise InputError(f"'{text}' is not valid text", f"path {path}", "write it in UTF-8")


def _set(raw: dict[str, Json], path: str, value: Json) -> None:
    steps = _steps(raw, path)
    holders: list[Json] = [raw]
    for index, step in enumerate(steps[:-1]):
        holders = [item for holder in holders for item in _below(holder, step, path, steps[:index], steps)]
    last = steps[-1]
    if last == "*":
        for holder in holders:
            for key in _keys(holder):
                _put(holder, key, value, path)
        return
    chosen = _that_take(holders, last) if "*" in steps else holders
    if not chosen:
        known = sorted({str(key) for holder in holders if isinstance(holder, dict) for key in holder})
        raise InputError(f"nothing there has the key '{last}'", f"path {path}", did_you_mean(last, known))
    for holder in chosen:
        _put(holder, last, value, path)


def _put(holder: Json, key: str, value: Json, path: str) -> None:
    if isinstance(holder, dict):
        holder[key] = value
    elif isinstance(holder, list):
        holder[_index(holder, key, path)] = value
    else:
        raise InputError(f"nothing can be set below {holder!r}", f"path {path}", "shorten the path")


def _steps(raw: dict[str, Json], path: str) -> list[str]:
    if path.startswith("/"):
        steps = [step.replace("~1", "/").replace("~0", "~") for step in path[1:].split("/")]
    else:
        steps = path.split(".")
    if not path.strip("/.") or "" in steps:
        raise InputError("an empty path", f"path '{path}'", "write e.g. shapes.0.material.roughness")
    if not path.startswith("/") and steps[0] in ("shapes", "lights", "acceleration"):
        steps.insert(0, "scene")
    return steps


def _keys(holder: Json) -> list[str]:
    if isinstance(holder, dict):
        return list(holder)
    return [str(index) for index in range(len(holder))] if isinstance(holder, list) else []


def _below(holder: Json, step: str, path: str, before: list[str], steps: list[str]) -> list[Json]:
    """The values one step below the given ones. After a `*`, values without the key are skipped."""
    if step == "*":
        return list(holder.values()) if isinstance(holder, dict) else list(holder) if isinstance(holder, list) else []
    if isinstance(holder, dict):
        if step in holder:
            return [holder[step]]
        if "*" in before:
            return []
        inner = holder.get("scene")  # a dotted path may begin with the keys of `scene`
        known = [*holder, *(inner if isinstance(inner, dict) else ())]
        raise InputError(f"no key '{step}'", f"path {path}", did_you_mean(step, [str(key) for key in known]))
    if isinstance(holder, list):
        return [holder[_index(holder, step, path)]]
    if "*" in before:
        return []
    raise InputError(f"'{'.'.join(before)}' contains nothing named '{step}'", f"path {path}", "shorten it")


def _index(holder: list[Json], step: str, path: str) -> int:
    if not step.isascii() or not step.isdecimal() or len(step) > 9 or int(step) >= len(holder):
        hint = f"0 to {len(holder) - 1}, or *" if holder else "the list is empty"
        raise InputError(f"no item '{step}' in a list of {len(holder)}", f"path {path}", hint)
    return int(step)


def _that_take(holders: list[Json], key: str) -> list[Json]:
    """The objects that have the key; if there are none, the materials that accept it."""
    with_key: list[Json] = []
    with_key += [h for h in holders if (isinstance(h, dict) and key in h) or (isinstance(h, list) and key.isdecimal())]
    if with_key:
        return with_key
    types = [(h, part_of(str(h.get("type")))) for h in holders if isinstance(h, dict)]
    return [holder for holder, cls in types if cls is not None and key in cls.known_keys()]
