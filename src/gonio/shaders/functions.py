"""Functions that are not methods of a material, as shader code: table lookups, fits, area lights."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence

from .. import ops
from .._version import __version__
from ..errors import InputError
from ..ops import graph
from ..owner import exclusive
from . import text as texts
from .bundle import Bundle
from .languages import Language
from .layout import comment
from .manifest import texture
from .names import Names
from .operations import operations
from .placement import Placement
from .polyfills import POLYFILLS
from .program import Routines
from .textures import pixels

Functions = Sequence[tuple[Callable, Mapping[str, str | None]]]


class _Plain(Routines):
    """The routines of plain functions, each of which is an entry point."""

    def __init__(self, functions: Functions, single: bool) -> None:
        kinds = {name: kind for _, types in functions for name, kind in types.items() if kind is not None}

        def every(**arguments: object) -> tuple[object, ...]:
            """Calls all functions in a recording; not part of the shader."""
            return tuple(
                function(*(arguments[name] if kind else None for name, kind in types.items()))
                for function, types in functions
            )

        either = inspect.Parameter.KEYWORD_ONLY
        every.__signature__ = inspect.Signature([inspect.Parameter(name, either) for name in kinds])  # type: ignore[attr-defined]
        into = graph.Graph(POLYFILLS if single else {}, single=single)
        super().__init__(ops.record(every, types=kinds, name="every", into=into), single)
        wanted = [function.__name__ for function, _ in functions]
        self.entries = {routine.name: routine for routine in self.routines if routine.name in wanted}
        self.routines = self._reachable(self.routines)
        self.tables = self._tables()


@exclusive
def functions_bundle(functions: Functions, lang: str, title: str, placement: Placement | None = None) -> Bundle:
    """Functions as shader code, with their tables.

    functions  pairs of a function decorated with `@function` and the types of its arguments: name -> "float", "vec3",
               ..., or None for an argument that is None and determines the code
    title      the comment at the beginning of the text
    The manifest has the keys lang, shader, functions, operations and textures of a material's manifest.
    Raises InputError for a language that writes Python files.
    """
    language, place = Language.family.get(str(lang)), placement or Placement()
    place.check(language)
    if language.standalone:
        what = f"{language.name} given, a shader language expected: a Python file contains a whole material"
        raise InputError(what, "emit: lang", "such as glsl, wgsl or hlsl")
    made = _Plain(functions, language.single)
    names = Names(made, language, place)
    bindings = {id(table): place.first_binding + index for index, table in enumerate(made.tables)}
    counts = {names.routines[routine]: operations(routine) for routine in made.entries.values()}
    calls = [f"{names.routines[r]}({', '.join(_arguments(functions, name))})" for name, r in made.entries.items()]
    head = [
        *comment(f"{title}\nWritten by Gonio {__version__}."),
        "//",
        *(f"// {call}" for call in calls),
        "//",
        *texts.costs(counts),
        f"// {language.precision}",
    ]
    manifest = {
        "version": 1,
        "lang": language.name,
        "shader": f"{next(iter(made.entries))}{language.suffix}",
        "functions": {name: names.routines[routine] for name, routine in made.entries.items()},
        "operations": counts,
        "textures": [texture(table, names, bindings) for table in made.tables],
    }
    tables = {names.table(table, "table_"): pixels(table, place.bits) for table in made.tables}
    return Bundle(texts.joined(head, texts.blocks(made, names, bindings), language, place.prefix), manifest, tables)


def _arguments(functions: Functions, name: str) -> list[str]:
    """The names of an entry's arguments."""
    types = next(types for function, types in functions if function.__name__ == name)
    return [argument for argument, kind in types.items() if kind is not None]
