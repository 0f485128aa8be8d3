"""Convert requests to JSON and back, for checkpoints and for the workers of a cluster.

Like scenes, the JSON is untrusted: every key, type and range is checked.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from ..catalog import notation
from ..errors import InputError, summary
from ..material import BSDF, user_code
from ..work.kept import Facts
from .request import Request

EXCLUDED = ("checkpoint", "timeout")  # fields that are not stored: the command that continues the render sets them
STRICT = ConfigDict(strict=True, extra="forbid", arbitrary_types_allowed=True)


def described(request: Request) -> Facts:
    """Convert a request to plain values for a file. Raises InputError for a material that only this program defines."""
    values: Facts = {}
    for one in fields(Request):
        value = getattr(request, one.name)
        if one.name in EXCLUDED:
            continue
        if isinstance(value, Path):
            value = str(value.absolute()) if one.name == "output" or request.material is None else str(value)
        if one.name == "integrator" and value is not None:
            value = user_code.absolute(value)
        values[one.name] = _plain(value)
    return values


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


def request_of(given: Facts, where: str, allow_code: bool) -> Request:
    """The request from the values in a file, the inverse of `described`.

    where       the location that errors name
    allow_code  whether materials may be classes in Python files; the file itself cannot grant this
    """
    if not allow_code and (given.get("allow_code") or ".py:" in json.dumps(given)):
        raise InputError("this render runs Python files", where, "add --allow-code if you trust it")
    values = vars(validated(_fields(), given, where, "/request"))
    try:
        material = _rebuilt(values["material"])
        if not (material is None or isinstance(material, BSDF)):
            raise InputError("the material is missing", f"{where}#/request/material", "render again without it")
        request = Request(**{**values, "material": material, "overrides": _rebuilt(values["overrides"])})
    except RecursionError:
        raise InputError("the materials are nested too deeply", where, "render again without it") from None
    replace(request, output=None).check()
    return request


@functools.cache
def _fields() -> type[BaseModel]:
    """A model of the fields that `described` writes, with their types."""
    hints = get_type_hints(Request)
    hints |= {"material": dict[str, Any] | None, "overrides": dict[str, Any]}
    types: Any = {one.name: (hints[one.name], ...) for one in fields(Request) if one.name not in EXCLUDED}
    return create_model("RequestFields", __config__=STRICT, **types)


Model = TypeVar("Model", bound=BaseModel)


def validated(model: type[Model], given: Facts, where: str, pointer: str = "") -> Model:
    """Validate the facts in an untrusted file with a pydantic model.

    where    name of the file in errors
    pointer  JSON pointer to the facts in the file
    Raises InputError with the location and the expected value.
    """
    try:
        return model.model_validate_json(
            json.dumps(given)
        )  # in JSON mode, pydantic accepts lists as tuples and strings as paths
    except ValidationError as error:
        if {"missing", "extra_forbidden"} & {one["type"] for one in error.errors(include_url=False)}:
            raise InputError(
                "this checkpoint is of another version of Gonio", where, "render again without it"
            ) from None
        first = error.errors(include_url=False)[0]
        place = "/".join([pointer, *map(str, first["loc"])])
        raise InputError(
            f"not as Gonio writes it: {first['msg']}", f"{where}#{place}", "render again without it"
        ) from None
    except (RecursionError, ValueError) as error:
        raise InputError(f"not as Gonio writes it: {summary(error)}", where, "render again without it") from None


def _rebuilt(value: Any) -> Any:
    if isinstance(value, dict):
        if set(value) == {"$material"}:
            return notation.from_json(value["$material"])
        return {name: _rebuilt(item) for name, item in value.items()}
    return [_rebuilt(item) for item in value] if isinstance(value, list) else value
