"""Former spellings of options and keywords: they work, with a warning that names the present one."""

from __future__ import annotations

import inspect
from dataclasses import fields
from typing import Any

import gonio as go
import pytest
import typer
from gonio.arguments import renamed
from gonio.cli import Verb, app
from gonio.cli.renamed import FORMER, Former
from gonio.errors import InputError

LINES = {  # as little as each verb needs
    "bake": ["ggx"],
    "compensation": [],
    "compress": ["a.binary", "-o", "a.gonio"],
    "convert": ["a.exr"],
    "emit": ["lambert"],
    "fit": ["a.binary"],
    "measure": ["lambert", "-o", "a.gonio"],
    "verify": ["lambert"],
}


def command(verb: str) -> Any:
    group: Any = typer.main.get_command(app.app)
    return group.get_command(typer.Context(group), verb)


def parsed(verb: str, *words: str) -> dict[str, Any]:
    """The values of a verb's parameters, which is not run."""
    return command(verb).make_context(verb, [*LINES[verb], *words]).params


@pytest.mark.parametrize("former", FORMER, ids=lambda former: f"{former.verb} {former.old}")
def test_a_former_spelling_sets_the_present_option_and_says_so(
    former: Former, capsys: pytest.CaptureFixture[str]
) -> None:
    value = "E" if former.old == "--points" else "7"
    if not former.new.startswith("-"):
        new = parsed(former.verb, value)
    else:
        new = parsed(former.verb, former.new, former.convert(value))
    assert capsys.readouterr().err == ""
    assert parsed(former.verb, *([former.old] if former.old.startswith("-") else []), value) == new
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and told.startswith("warning: ")
    assert f"{former.verb}: {former.old} is now " in told and former.new in told


def test_former_spellings_are_not_in_the_help() -> None:
    for verb in LINES:
        shown = {word for parameter in command(verb).params for word in parameter.opts}
        assert shown.isdisjoint(one.old for one in FORMER if one.verb == verb), verb


def test_two_outputs_of_convert_are_an_error() -> None:
    with pytest.raises(Exception, match=r"extra argument"):
        parsed("convert", "b.png", "-o", "c.png")


def test_the_table_names_verbs_and_options_that_are_there() -> None:
    for former in FORMER:
        assert former.verb in Verb.family.all()
        known = {word for p in command(former.verb).params for word in (*p.opts, (p.metavar or "").strip("[]."))}
        assert former.new in known, former


def test_a_former_keyword_warns_and_works() -> None:
    @renamed(size="resolution")
    def bake(resolution: int = 4) -> int:
        return resolution

    with pytest.warns(DeprecationWarning, match="bake: size is now resolution"):
        assert bake(size=8) == 8  # type: ignore[call-arg]
    with pytest.raises(InputError, match="both size and resolution given"):
        bake(size=8, resolution=9)  # type: ignore[call-arg]


@pytest.mark.parametrize(
    ("call", "keywords", "present"),
    [
        (go.bake, {"target": "ggx", "size": 0}, "--resolution"),
        (go.bake, {"target": "ggx", "spp": 0}, "--samples"),
        (go.bake, {"target": "ggx", "points": "?"}, "--sampler"),
        (go.measure, {"material": "lambert", "rays": 1}, "--samples"),
        (go.measure, {"material": "lambert", "kind": "?"}, "--table"),
        (go.fit, {"data": "none.binary", "metric": "?"}, "loss"),
        (go.fit, {"data": "none.binary", "fixed": {"?": 1.0}}, "?"),
        (go.compress, {"source": "a", "output": "b", "method": "?"}, "codec"),
        (go.verify, {"target": "lambert", "sweep": "albedo=1..0", "isolated": False}, "--vary"),
        (go.verify, {"target": "lambert", "jobs": 0, "isolated": True}, "--workers"),
        (go.verify, {"target": "lambert", "limit": -1.0, "isolated": True}, "--timeout"),
        (go.verify, {"target": "lambert", "report": "/proc/none"}, "/proc/none"),
    ],
)
def test_former_keywords_reach_the_present_ones(call: Any, keywords: dict[str, Any], present: str) -> None:
    with pytest.warns(DeprecationWarning, match=" is now "), pytest.raises(InputError) as caught:
        call(**keywords)
    assert present in str(caught.value)


def test_render_options_are_declared_once() -> None:
    from typing import get_type_hints

    from gonio.cli.options import Rendering
    from gonio.render.options import RenderKeywords, RenderOptions
    from gonio.render.request import Request

    declared = get_type_hints(RenderOptions)
    assert get_type_hints(RenderKeywords) == declared
    assert {name: get_type_hints(Request)[name] for name in declared} == declared
    assert list(get_type_hints(Rendering)) == list(declared)
    for function in (go.render, go.study):
        parameters = inspect.signature(function).parameters
        assert {name: parameters[name].default for name in declared} == {
            field.name: field.default for field in fields(RenderOptions)
        }
