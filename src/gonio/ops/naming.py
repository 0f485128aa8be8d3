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


_CONTAINERS = (tuple, list, dict)
_PLAIN = (float, int, str, bool, type(None), np.ndarray)  # types that contain no values, checked first


class LocalNames:
    """Names each value of the function being recorded after the Python variable that holds it.

    A name in the function's own frame has priority over one in a plain function that it calls, and the first name over
    a later one. Frames are searched up to the frame of the code object `outermost`.
    """

    def __init__(self, function: Any, node: type[Any], outermost: CodeType) -> None:
        self.function, self.node, self.outermost = function, node, outermost
        # for each frame, outermost first, the objects that need not be searched again, by id; references keep them
        # alive
        self._searched: list[tuple[FrameType, dict[int, object]]] = []

    def search(self) -> None:
        """Name the values that variables hold now. It is called for every new value, while earlier variables still
        exist."""
        frames = []
        frame: FrameType | None = sys._getframe(1)
        while frame is not None and frame.f_code is not self.outermost:
            if not frame.f_code.co_filename.startswith(HERE):
                frames.append(frame)
            frame = frame.f_back
        frames.reverse()
        node, function, searched = self.node, self.function, self._searched
        for depth, own in enumerate(frames):
            if depth == len(searched) or searched[depth][0] is not own:
                searched[depth:] = [(own, {})]
            done = searched[depth][1]
            for name, value in own.f_locals.items():
                if isinstance(value, node):
                    if value.function is function and value.depth > depth:
                        value.name, value.depth = name.strip("_"), depth
                elif isinstance(value, _CONTAINERS):
                    self._search_parts(depth, value, (name,), done)
        del searched[len(frames) :]

    def _search_parts(self, depth: int, value: Any, path: tuple, done: dict[int, object]) -> bool:
        """Name the values inside a variable, in the order and with the paths of `structure.flatten`.

        Returns whether they cannot change: lists and dictionaries can, so they are searched every time.
        Paths are built only when a value is named.
        """
        if id(value) in done:
            return True
        pairs: Iterable[tuple[object, object]]
        if isinstance(value, tuple | list):
            pairs = zip(getattr(value, "_fields", None) or range(len(value)), value, strict=True)
        elif isinstance(value, dict):
            pairs = value.items()
        elif is_composite(value):
            pairs = value.__parts__().items()
        else:
            return True
        stays = not isinstance(value, list | dict)
        for key, item in pairs:
            if isinstance(item, self.node):
                if item.function is self.function and item.depth > depth:
                    item.name, item.depth = ".".join(map(str, (*path, key))).strip("_"), depth
            elif not isinstance(item, _PLAIN):
                stays = self._search_parts(depth, item, (*path, key), done) and stays
        if stays:
            done[id(value)] = value
        return stays
