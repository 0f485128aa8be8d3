"""Subjects from the targets that a user names:

conductor                the name of a model; inner materials are also given by name: --param a=lambert
glass.py:Glass           a class in a Python file, which is executed because the user named it
glass.py:my_glass        a Mitsuba plugin that the file registers, by that name or by its class
mitsuba:roughplastic     a plugin of Mitsuba, or one in a folder listed in GONIO_PLUGINS; its properties are parameters,
                         which may also be set in the name: mitsuba:roughplastic(alpha=0.3)
plastic.xml, .json       a Mitsuba description; also as a string: '{"type": "plastic"}'
leather.bsdf             a measured material in the RGL format
chest.gltf:Wood          a material of a glTF file
gold.json                the result of a fit, or a material in Gonio's notation
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..catalog import notation, operands, outside, texts
from ..catalog.operands import Kind
from ..errors import InputError
from .subject import Subject

JUDGED = frozenset({Kind.PLUGIN, *operands.MATERIALS})


def resolve(target: str, settings: Sequence[str] = (), vary: str = "") -> list[Subject]:
    """The subjects that a target names, one per value of the parameter that varies.

    target    a string in one of the forms above
    settings  values of parameters, each "name=value"
    vary      values of one parameter: "name=low..high" (five values, in geometric progression if high / low is ten or
              more) or "name=v1,v2,..."; "" for none
    Raises InputError for unknown names; the error suggests the most similar known name.
    """
    given = dict(map(notation.assignment, settings))
    if not vary:
        return [_build(target, given)]
    name, values = _values(vary)
    return [_build(target, {**given, name: value}) for value in values]


def _values(text: str) -> tuple[str, list[str]]:
    name, value = notation.assignment(text, "--vary")
    return name, texts.range_of(value) or value.split(",")


def _build(target: str, given: dict[str, str]) -> Subject:
    kind, (head, inside) = operands.kind_of(target, JUDGED, "TARGET"), notation.split(target)
    if kind is Kind.PLUGIN and head.startswith("mitsuba:"):
        from ..bridge import foreign

        values = _properties({**texts.assignments(inside, "TARGET"), **given})
        return Subject(foreign.plugin(head.removeprefix("mitsuba:"), values), head, values)
    if kind is Kind.PLUGIN:
        return _from_file(target, given)
    if kind is Kind.CODE:
        from ..bridge import foreign

        properties = _properties({**texts.assignments(inside, "TARGET"), **given})
        plugin = foreign.plugin_in(head, properties)
        if plugin is not None:
            return Subject(plugin, head, properties)
    cls, own = notation.taken_apart(target, "TARGET")
    bsdf, values = notation.made(cls, {**own, **given})
    bsdf = outside.check_operators(bsdf)
    if kind is Kind.NAME:
        return Subject(bsdf, cls.name, values)
    # The file documents its own values; the title shows those that were assigned in addition.
    assigned = {*(name.partition(".")[0] for name in given), *texts.assignments(inside)}
    return Subject(
        bsdf, head, {name: value for name, value in values.items() if {name, name.removesuffix("_")} & assigned}
    )


# --------------------------------------------------------------------------- Mitsuba


def _properties(given: Mapping[str, str]) -> dict[str, Any]:
    return {key: _property(value) for key, value in given.items()}


def _property(text: str) -> Any:
    """A property of a plugin from the command line: a number, true or false, a color, or a name."""
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        return text
    return numbers[0] if len(numbers) == 1 else {"type": "rgb", "value": numbers}


def _from_file(target: str, given: dict[str, str]) -> Subject:
    from ..bridge import foreign
    from ..scene import mitsuba_scene

    values = _properties(given)
    path = None if target.lstrip().startswith("{") else Path(target)
    text = target
    if path is not None:
        if not path.is_file():
            raise InputError(f"no file '{target}'", "TARGET")
        if path.suffix.lower() == ".xml":
            if values:
                raise InputError("parameters of an XML file cannot be set", "--param", "change the file")
            return Subject(mitsuba_scene.load_bsdf(path), target)
        text = path.read_text(encoding="utf-8")
    try:
        description = json.loads(text)
    except ValueError as error:
        raise InputError(f"invalid JSON: {error}", target) from None
    if not isinstance(description, dict) or "type" not in description:
        raise InputError('an object with a "type" expected', target, 'such as {"type": "roughplastic", "alpha": 0.2}')
    if path is not None:
        description = mitsuba_scene.within(description, path)
    return Subject(foreign.load({**description, **values}), target, values)


__all__ = ["resolve"]
