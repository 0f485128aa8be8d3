"""Names of recorded values: those of the Python variables that hold them."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import numpy as np

from .structure import is_composite

HERE = str(Path(__file__).parent)


def name_locals(function: Any, node: type[Any], outermost: CodeType) -> None:
    """Give the values of `function` the names of the Python variables that currently hold them.

    Called for every new value, so that variables bound by earlier lines are still in scope. A name in the function's
    own frame has priority over one in a plain function that it calls, and the first name over a later one. Frames are
    searched up to that of the code `outermost`.
    """
    frames = []
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_code is not outermost:
        if not frame.f_code.co_filename.startswith(HERE):
            frames.append(frame)
        frame = frame.f_back
    for depth, own in enumerate(reversed(frames)):
        for name, value in own.f_locals.items():
            if isinstance(value, node):
                if value.function is function and value.depth > depth:
                    value.name, value.depth = name.strip("_"), depth
            elif isinstance(value, _CONTAINERS):
                _name_parts(function, node, depth, value, (name,))


_CONTAINERS = (tuple, list, dict)
_PLAIN = (float, int, str, bool, type(None), np.ndarray)  # types that contain no values, checked first


def _name_parts(function: Any, node: type[Any], depth: int, value: Any, path: tuple) -> None:
    """`name_locals` for the values inside a variable, in the order and with the paths of `structure.flatten`.

    It runs for every new value and usually finds nothing unnamed, so paths are built only when a value is named.
    """
    pairs: Iterable[tuple[object, object]]
    if isinstance(value, tuple | list):
        pairs = zip(getattr(value, "_fields", None) or range(len(value)), value, strict=True)
    elif isinstance(value, dict):
        pairs = value.items()
    elif is_composite(value):
        pairs = value.__parts__().items()
    else:
        return
    for key, item in pairs:
        if isinstance(item, node):
            if item.function is function and item.depth > depth:
                item.name, item.depth = ".".join(map(str, (*path, key))).strip("_"), depth
        elif not isinstance(item, _PLAIN):
            _name_parts(function, node, depth, item, (*path, key))
