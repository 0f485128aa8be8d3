"""The schema that `gonio schema manifest` prints describes every manifest, with every key."""

from __future__ import annotations

import json
from typing import Any

import gonio as go
import jsonschema
import numpy as np
import pytest
from gonio import cli
from gonio.ops import Scalar, Table, function, lookup
from gonio.shaders import Placement, bundle, schema
from gonio.shaders.emission import Choice, shader
from gonio.shaders.functions import functions_bundle
from gonio.shaders.languages import languages
from variants import GOLD, SHAPES, written

SCHEMA = json.loads(schema.text())


def closed(part: Any) -> Any:
    """A schema without leave for keys that it does not name."""
    if isinstance(part, list):
        return [closed(one) for one in part]
    if not isinstance(part, dict):
        return part
    made = {key: closed(value) for key, value in part.items()}
    return {**made, "additionalProperties": False} if isinstance(part.get("properties"), dict) else made


def check(manifest: Any) -> None:
    jsonschema.Draft202012Validator(closed(SCHEMA)).validate(json.loads(json.dumps(manifest)))


def test_it_is_a_schema_that_the_command_line_prints(capsys: pytest.CaptureFixture[str]) -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    with pytest.raises(SystemExit) as done:
        cli.main(["schema", "manifest"])
    assert not done.value.code and json.loads(capsys.readouterr().out) == SCHEMA


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", sorted(SHAPES))
def test_it_describes_the_manifest_of_every_model(name: str) -> None:
    check(written(name).manifest)


@pytest.mark.sample(2)
@pytest.mark.parametrize("lang", languages())
def test_it_describes_the_manifest_in_every_language(lang: str) -> None:
    check(bundle(go.KullaConty(GOLD), lang, ("eval",)).manifest)


@function
def row(x: Scalar) -> Scalar:
    """A row of a table."""
    return lookup(Table("row", np.linspace(0.0, 1.0, 4)[:, None]), x)[0]


def test_it_describes_modules_and_functions() -> None:
    check(bundle([go.KullaConty(GOLD), go.Lambert()], "wgsl", placement=Placement(tables="ktx2")).manifest)
    check(shader("lambert", "glsl", Choice("eval"), Placement(half=True))[0].manifest)
    check(functions_bundle([(row, {"x": "float"})], "glsl", "Rows").manifest)


@pytest.mark.slow
@pytest.mark.parametrize("choice", [Choice("eval", fit="2"), Choice("eval", ibl=True, budget=100)])
def test_it_describes_approximations(choice: Choice) -> None:
    check(shader("conductor", "glsl", choice, Placement())[0].manifest)


@pytest.mark.parametrize(
    ("key", "value"), [("size", -1), ("version", 2), ("textures", [{"uniform": "table_a"}]), ("fields", None), ("a", 1)]
)
def test_it_refuses_what_is_no_manifest(key: str, value: object) -> None:
    wrong = {**written("lambert").manifest, key: value}
    with pytest.raises(jsonschema.ValidationError):
        check(wrong)
