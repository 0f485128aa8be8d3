"""Every folder of examples/ is a page of the gallery: a picture, its command, what to see, why, a study, the course."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest
import typer.main
from gonio import scene
from gonio.cli.app import app
from gonio.scene import overrides
from gonio.viewer import variations

EXAMPLES = Path(__file__).parents[2] / "examples"
FOLDERS = sorted(path for path in EXAMPLES.iterdir() if path.is_dir() and not path.name.startswith((".", "_")))
INDEX = (EXAMPLES / "README.md").read_text(encoding="utf-8")
SMALL = {"pool-caustic": 480}  # its particles need more than 64 samples, which take half an hour at full size
COMMAND = re.compile(r"^    (gonio .*)$", re.MULTILINE)


def parsed(line: str) -> tuple[str, dict[str, object]]:
    """The verb and the values of a command; a usage error where it does not know one."""
    arguments = shlex.split(line, comments=True)[1:]
    group = typer.main.get_command(app)
    with group.make_context("gonio", arguments) as context:  # type: ignore[attr-defined]
        name, command, rest = group.resolve_command(context, arguments)  # type: ignore[attr-defined]
        return name, command.make_context(name, rest, parent=context).params


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_an_example_is_a_page(folder: Path) -> None:
    page = folder / "README.md"
    assert page.exists(), f"{folder.name} has no README.md"
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# ")
    pictures = re.findall(r"!\[([^\]]+)\]\(([^)]+)\)", text)
    assert pictures and all((folder / file).exists() and alt for alt, file in pictures)
    for mark in ("**Why.**", "**Try.**", "**Course.**"):
        assert mark in text, f"{folder.name}: {mark}"
    models = re.findall(r"\]\((\.\./\.\./docs/models/[\w-]+\.md)\)", text)
    assert models and all((folder / model).exists() for model in models)


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_its_picture_is_large_and_quick_to_load(folder: Path) -> None:
    """At least 1,280 pixels wide, so that it is sharp on a page of the book, and below 250 kB."""
    from PIL import Image

    text = (folder / "README.md").read_text(encoding="utf-8")
    picture = folder / re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text)[0]
    with Image.open(picture) as image:
        assert image.width >= SMALL.get(folder.name, 1280)
    assert picture.stat().st_size < 250_000


def test_the_index_has_a_row_for_each_folder() -> None:
    """Picture and link of every example, in examples/README.md, which `docs/make_pages.py --check` keeps up to date."""
    row = re.compile(r'^\| <a href="([\w-]+)"><img src="([^"]+)".*\]\(([\w-]+)/README\.md\) \| \S', re.MULTILINE)
    rows = row.findall(INDEX)
    assert [folder for folder, _, _ in rows] == [folder.name for folder in FOLDERS]
    assert all(folder == link and (EXAMPLES / picture).exists() for folder, picture, link in rows)


@pytest.mark.sample(12)
@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_its_commands_are_ones(folder: Path) -> None:
    """Verbs, options, scenes and the paths of `--vary` are there."""
    commands = COMMAND.findall((folder / "README.md").read_text(encoding="utf-8"))
    assert len(commands) >= 2
    for line in commands:
        verb, values = parsed(line)
        words = shlex.split(line, comments=True)
        target = next(word for word in words[2:] if not word.startswith("-"))
        if not target.startswith("examples/"):
            continue  # made by the line before
        path = EXAMPLES.parent / target
        assert path.exists(), line
        if verb == "study":
            raw = json.loads((path / "scene.json").read_text(encoding="utf-8"))
            for text in values["vary"]:  # type: ignore[attr-defined]
                variation = variations.parse_variation(text)
                overrides.apply(raw, variation.settings(variation.values[0]))


@pytest.mark.parametrize("file", sorted(EXAMPLES.glob("*/print.json")), ids=lambda file: file.parent.name)
def test_the_scene_of_a_picture_reads_and_has_the_example_s_materials(file: Path) -> None:
    shown = scene.read(file)
    assert shown.warnings == []
    studio, own = (json.loads(path.read_text())["scene"]["shapes"] for path in (file, file.parent / "scene.json"))
    balls = [shape for shape in own if shape["type"] == "sphere"]
    assert [shape for shape in studio if shape["type"] == "sphere"][: len(balls)] == balls
