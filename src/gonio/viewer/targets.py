"""Materials named on the command line, with shared options such as -p masking=schlick-direct.

A shared option is applied to every material that has the parameter, including nested materials. Otherwise, a comparison
would be misleading, because the option would affect some rows but not others. Where the parameter is ambiguous, the
option is not applied, and a note states this.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..catalog import notation, outside
from ..errors import InputError, did_you_mean
from ..material import BSDF, tree


class Named(NamedTuple):
    """A material, and the paths of the parameters that the user has set: "alpha", "base.alpha"."""

    bsdf: BSDF
    given: frozenset[str]


def named(targets: Sequence[str], options: Sequence[str] = ()) -> tuple[list[Named], list[str]]:
    """The materials, and notes about options that were not applied to one of them.

    options  options shared by all materials, each "name=value". A material's own parameter takes precedence over nested
             parameters of the same name; a choice, such as masking, is applied to all nested parameters, a number or a
             preset only if there is exactly one
    Raises InputError for an option that applies to no material.
    """
    shared = dict(map(notation.assignment, options))
    classes = [notation.taken_apart(target)[0] for target in targets]
    reached = {name for name in shared if any(_has(cls, name) for cls in classes)}
    own_ones = [f"{name}={value}" for name, value in shared.items() if name in reached]
    resolved = notation.several(targets, own_ones, nested=False)
    made, notes, unclear = [], [], {}
    for target, (cls, settings) in zip(targets, resolved, strict=True):
        one = Named(outside.probe(notation.made(cls, settings)[0]), frozenset(_paths(cls, settings)))
        own = frozenset(_paths(*notation.taken_apart(target)))
        for name, value in shared.items():
            places = _places(one.bsdf, name)
            free = [place for place in places if place not in own]
            if _has(cls, name):
                notes += [_unaffected(one.bsdf, name, free)] if free else []
            elif _clear(one.bsdf, free):
                one = _with(one, free, value)
            else:
                unclear[name] = _unclear(one.bsdf, free, value)
                notes.append(f"{unclear[name].what}: {unclear[name].hint}")
                continue
            reached |= {name} if places else set()
        made.append(one)
    for name in shared:
        if name not in reached:
            known = {path for one in made for path in _names(one.bsdf)}
            what = f"unknown parameter '{name}'"
            raise unclear.get(name) or InputError(what, f"--param {name}", did_you_mean(name, sorted(known)))
    return made, notes


def _has(cls: type[BSDF], name: str) -> bool:
    return name in cls.parameters() or (name == "preset" and bool(cls.presets()))


def _names(bsdf: BSDF) -> set[str]:
    """The valid names of options for a material: its parameters, and the paths and names of nested ones."""
    paths = {leaf.path for leaf in tree.leaves(bsdf)}
    return {*bsdf.parameters(), *paths, *(path.rpartition(".")[2] for path in paths)}


def _places(bsdf: BSDF, name: str) -> list[str]:
    """Paths of nested parameters, or presets, that an option may refer to."""
    if "." in name:
        return [leaf.path for leaf in tree.leaves(bsdf) if leaf.path == name]
    return [tree.join(path, name) for path, inner in tree.walk(bsdf) if path and _has(type(inner), name)]


def _clear(bsdf: BSDF, places: Sequence[str]) -> bool:
    """Whether an option may be set at all of these paths."""
    leaves = {leaf.path: leaf.parameter for leaf in tree.leaves(bsdf)}
    return len(places) < 2 or all(place in leaves and not leaves[place].numeric for place in places)


def _unaffected(bsdf: BSDF, name: str, places: Sequence[str]) -> str:
    return f"{name} is set on {type(bsdf).__name__} itself; {' and '.join(places)} is unchanged"


def _unclear(bsdf: BSDF, places: Sequence[str], value: str) -> InputError:
    name = places[0].rpartition(".")[2]
    what = f"{name} is ambiguous for {type(bsdf).__name__}, which has {' and '.join(places)}"
    return InputError(what, f"--param {name}", f"give one of them, such as --param {places[0]}={value}")


def _with(one: Named, places: Sequence[str], value: str) -> Named:
    values: dict[str, object] = {}
    for place in places:
        path, _, name = place.rpartition(".")
        inner = dict(tree.walk(one.bsdf))[path]
        values |= {tree.join(path, key): v for key, v in _values(inner, name, value).items()}
    return Named(tree.replace(one.bsdf, values, "--param"), one.given | values.keys()) if values else one


def _values(inner: BSDF, name: str, value: str) -> dict[str, object]:
    """The values to which an option sets the parameters of a material, by name."""
    if name in inner.parameters():
        return {name: notation.typed(inner.parameters()[name], value)}
    chosen = type(inner).preset(value)
    return {key: getattr(chosen, key) for preset in inner.presets().values() for key in preset.values}


def _paths(cls: type[BSDF], settings: Mapping[str, object]) -> set[str]:
    """The paths of the parameters in `settings`, including those of nested materials."""
    paths = set()
    for name, value in settings.items():
        parameter = cls.parameters().get(name)
        if parameter is not None and parameter.inner:
            paths |= {tree.join(name, path) for path in _paths(*_inside(value))}
        else:
            paths.add(name)
    return paths


def _inside(value: object) -> tuple[type[BSDF], dict[str, object]]:
    """Class and settings of a nested material that `notation.made` has accepted."""
    if isinstance(value, str) and not value.lstrip().startswith("{"):
        return notation.taken_apart(value.strip().strip('"'))
    if isinstance(value, str):
        value = json.loads(re.sub(r"(?<![\w.])\.(?=\d)", "0.", value))
    assert isinstance(value, Mapping)
    fields = dict(value)
    return notation.class_named(str(fields.pop("type"))), fields


__all__ = ["Named", "named"]
