"""Shell completion of the names of materials, presets, laws, languages and more, without loading Dr.Jit."""

from __future__ import annotations

import typer

Offers = list[tuple[str, str]]  # completions, each with a description


def materials(incomplete: str) -> Offers:
    from ..material import models

    return _starting(incomplete, {name: _first_line(cls) for name, cls in models().items()})


def materials_and_distributions(incomplete: str) -> Offers:
    from ..optics.ndf import distributions

    return _starting(incomplete, {name: _first_line(type(d)) for name, d in distributions().items()}) + materials(
        incomplete
    )


def languages(incomplete: str) -> Offers:
    from ..shaders.languages import languages

    return _starting(incomplete, {name: language.title for name, language in languages().items()})


def surfaces(incomplete: str) -> Offers:
    from ..instruments.surfaces.base import Surface

    return _starting(incomplete, Surface.family.titles())


def laws(incomplete: str) -> Offers:
    from ..verify.laws import laws

    return _starting(incomplete, {name: law.title for name, law in laws().items()})


def presets(context: typer.Context, incomplete: str) -> Offers:
    """The presets of the material named earlier on the command line or, if none is named, of all materials."""
    from ..material import models

    first = next(iter(context.params.values()), None)
    names = [first] if isinstance(first, str) else first if isinstance(first, list) else []
    known = models()
    chosen = [known[name] for name in names if name in known] or list(known.values())
    return _starting(incomplete, {name: preset.title for cls in chosen for name, preset in cls.presets().items()})


def _starting(incomplete: str, known: dict[str, str]) -> Offers:
    return [(name, text) for name, text in known.items() if name.startswith(incomplete)]


def _first_line(cls: type) -> str:
    return (cls.__doc__ or "").strip().partition("\n")[0]
