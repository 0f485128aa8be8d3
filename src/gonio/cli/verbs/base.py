"""Verbs, the subcommands of `gonio`. A verb consists of a function with Typer annotations and a position in the help.

    @verb(MATERIALS)
    def sheen(model: Model, made: Material, as_json: Json = False) -> None:
        \"\"\"Print the sheen of a material.\"\"\"

Gonio's verbs are files in `cli/verbs`; other packages declare their verbs as entry points in the group `gonio.verbs`. A
parameter whose type is a group of options, such as `Material` or a dataclass of your own, becomes one option per field.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import is_dataclass
from typing import ClassVar, get_type_hints

from ...members import Family
from ..options import Options

PICTURES, MATERIALS, SUPPORT = "Pictures", "Materials", "Support"


class Verb:
    """A verb. The help shows `name` and `doc` under the heading `panel`, sorted by `place` and name."""

    family: ClassVar[Family[Verb]]

    def __init__(self, function: Callable[..., None], panel: str, place: int) -> None:
        self.function, self.panel, self.place = function, panel, place
        self.name = function.__name__.replace("_", "-")
        functools.update_wrapper(self, function)  # so that the source file of the verb is that of the function

    def __call__(self, *args: object, **options: object) -> None:
        self.function(*args, **options)

    @property
    def doc(self) -> str:
        """The first line of the docstring."""
        return inspect.cleandoc(self.function.__doc__ or "").partition("\n")[0]

    def with_single_options(self) -> Callable[..., None]:
        """The function with each group of options expanded to one parameter per field, as Typer expects."""
        hints = get_type_hints(self.function, include_extras=True)
        groups: dict[str, tuple[type, list[str]]] = {}
        single: list[inspect.Parameter] = []
        for parameter in inspect.signature(self.function).parameters.values():
            kind = hints[parameter.name]
            if isinstance(kind, type) and (issubclass(kind, Options) or is_dataclass(kind)):
                types = get_type_hints(kind, include_extras=True)
                groups[parameter.name] = kind, list(types)
                for name, annotation in types.items():
                    default = getattr(kind, name, parameter.empty)
                    single.append(parameter.replace(name=name, annotation=annotation, default=default))
            else:
                single.append(parameter.replace(annotation=kind))

        def verb(**values: object) -> None:
            for name, (kind, fields) in groups.items():
                values[name] = kind(**{field: values.pop(field) for field in fields})
            self.function(**values)

        verb.__doc__ = self.function.__doc__
        verb.__annotations__ = {parameter.name: parameter.annotation for parameter in single}
        verb.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
            [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in single]
        )
        return verb


def verb(panel: str, place: int = 100) -> Callable[[Callable[..., None]], Verb]:
    """Decorate a function as a verb. `place` orders the verbs under a heading; by default, the verb follows Gonio's
    own."""
    return lambda function: Verb(function, panel, place)


Verb.family = Family(
    "verb",
    "gonio.verbs",
    ["gonio.cli.verbs"],
    lambda thing: (thing.name, thing) if isinstance(thing, Verb) else None,
    "gonio",
)
