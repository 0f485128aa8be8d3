"""A request as JSON: what a checkpoint and a worker of a cluster get."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ..catalog import notation
from ..errors import GonioError, InputError
from ..material import BSDF
from ..work.kept import Facts
from .request import Request


def described(request: Request) -> Facts:
    """A request as a file can hold it. Raises InputError for a material that this program alone knows."""
    found: Facts = {}
    for one in fields(Request):
        value = getattr(request, one.name)
        if one.name in ("checkpoint", "timeout"):
            continue
        if isinstance(value, Path):
            value = str(value.absolute()) if one.name == "output" or request.material is None else str(value)
        found[one.name] = _plain(value)
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, BSDF):
        return {"$material": notation.as_json(value)}
    if isinstance(value, Mapping):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def request_of(found: Facts, where: str, allow_code: bool) -> Request:
    """The request that `described` made. A file alone never makes Gonio run Python: `allow_code` is asked for again."""
    if not allow_code and (found.get("allow_code") or ".py:" in json.dumps(found)):
        raise InputError(
            "this render runs Python files that its scene names", where, "add --allow-code if you trust it"
        )
    try:
        values = {name: _rebuilt(value) for name, value in found.items()}
        for name in ("scene", "output"):
            values[name] = None if values[name] is None else Path(values[name])
        values["size"] = None if values["size"] is None else tuple(values["size"])
        values["gradient"] = tuple(values["gradient"])
        return Request(**values)
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, GonioError):
            raise
        raise InputError("this checkpoint is of another version of Gonio", where, "render anew") from None


def _rebuilt(value: Any) -> Any:
    if isinstance(value, dict):
        if set(value) == {"$material"}:
            return notation.from_json(value["$material"])
        return {name: _rebuilt(item) for name, item in value.items()}
    return [_rebuilt(item) for item in value] if isinstance(value, list) else value
