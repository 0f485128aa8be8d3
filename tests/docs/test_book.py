"""The book: what it is made of is complete, and it builds without a warning."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from book import api, bibliography, errors, families, gallery, links, models, strips, text
from gonio.shaders import bundle
from gonio.viewer import page, stage

import browser

ROOT = Path(__file__).parents[2]


def test_every_page_is_a_chapter() -> None:
    index = (ROOT / "docs/index.md").read_text(encoding="utf-8")
    listed = {line for block in re.findall(r":::\{toctree\}\n(.*?):::", index, re.DOTALL) for line in block.split()}
    pages = (page.relative_to(ROOT / "docs") for page in (ROOT / "docs").rglob("*.md"))
    made = {"models", "reference", "gallery", "project"}  # by the book, and listed by it
    names = {page.with_suffix("").as_posix() for page in pages if page.parts[0] not in made}
    cards = {name.rpartition("/")[0] for name in links.CARDS}  # whose first page lists the others of its folder
    assert {name for name in names - listed if name.rpartition("/")[0] not in cards} == {"index"}


def test_every_public_name_has_its_place() -> None:
    listed = {name for names in api.TOPICS.values() for name in names.split()}
    classes = {model.__name__ for model in go.models().values()}
    assert set(go.__all__) - listed - classes == set()
    assert "go.render" in str(api.pages()["reference/api/rendering-and-plots.md"])


def test_every_family_and_member_has_its_place() -> None:
    pages = families.pages()
    assert "## smith-correlated" in str(pages["reference/families/masking-term.md"])
    assert "## reciprocity" in str(pages["reference/families/law.md"])


@pytest.mark.slow
def test_errors_are_listed_with_their_remedies() -> None:
    messages = list(errors.messages())
    assert len(messages) > 300
    assert any(message.what.startswith("unknown fit") and "nearest known name" in message.hint for message in messages)


def test_the_bibliography_is_plain_text() -> None:
    """No braces and no commands of BibTeX are left."""
    for key in bibliography.known():
        assert not re.search(r"[{}]|\\[\"'`^~a-zA-Z]", bibliography.citation(key)), key


@pytest.mark.parametrize(
    ("path", "page"),
    [
        ("docs/models/conductor.md", "reference/models/conductor.md"),
        ("examples/README.md", "gallery/index.md"),
        ("examples/prism", "gallery/prism.md"),
        ("examples/prism/README.md", "gallery/prism.md"),
        ("CONTRIBUTING.md", "project/contributing.md"),
        ("src/gonio/__init__.py", None),
    ],
)
def test_links_out_of_the_docs_lead_to_pages_of_the_book(path: str, page: str | None) -> None:
    assert links.target(ROOT / path) == page


def test_the_gallery_has_every_example() -> None:
    folders = {path.name for path in (ROOT / "examples").iterdir() if path.is_dir() and path.name[0] not in "._"}
    assert {example.folder for example in gallery.examples()} == folders


def test_every_model_but_a_few_has_a_strip_of_five_different_balls() -> None:
    every = strips.all_series()
    assert set(go.models()) - set(every) == {"measured", "shifted-gamma"}  # a table, and one ball in `gonio view`
    assert all(len({label for label, _ in balls}) == 5 for balls in every.values())


def test_a_page_names_the_values_of_its_strip() -> None:
    page = str(models._strip("phong"))
    assert "/strips/phong.jpg" in page and "From left to right: p 7.5, 15, 30, 60, 120." in page


def test_a_strip_shows_its_parameter() -> None:
    """Darker to brighter over the albedo of Lambert's model."""
    picture = strips.strip(strips.all_series()["lambert"], size=(100, 26), spp=4)
    means = [picture[10:16, x - 4 : x + 4].mean() for x in (19, 34, 50, 66, 81)]
    assert means == sorted(means) and means[-1] > 4.0 * means[0]


def test_a_live_page_opens_with_color_in_the_studio(tmp_path: Path) -> None:
    opened = models.opening("conductor", tmp_path)
    assert opened.lights == (stage.STUDIO,)
    assert opened.materials["m0"].bsdf.k == go.Conductor.preset("Au").k  # type: ignore[attr-defined]
    assert len(opened.rows[0].balls) == 5


def test_a_material_of_a_file_has_a_live_page(tmp_path: Path) -> None:
    opened = models.opening("measured", tmp_path)
    assert page.export(opened, tmp_path / "measured.html").stat().st_size > 1e5
    (parameter,) = bundle(opened.materials["m0"].bsdf, "glsl").manifest["parameters"]
    assert parameter["value"].endswith("examples/three-forms/rough-copper.gonio")


@pytest.mark.slow
def test_a_random_model_is_shown_by_its_mean(tmp_path: Path) -> None:
    """Its table has the value of many other walks, and the albedo that Kulla-Conty restores to a white metal."""
    white = go.material("conductor(alpha=0.6,fresnel=one)")
    table = models.averaged(go.RandomWalk(base=white), tmp_path, estimates=64)
    a = np.radians([[20.0], [50.0]])
    wo, wi = [np.hstack([sign * np.sin(a), 0.0 * a, np.cos(a)]) for sign in (1.0, -0.4)]
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    count = 20_000
    others = go.RandomWalk(base=white, seed=1000.0 + np.arange(2.0 * count))
    expected = np.asarray(others.eval(np.tile(wo, (count, 1)), np.tile(wi, (count, 1)))).reshape(count, 2, 3).mean(0)
    assert np.allclose(table.eval(wo, wi), expected, rtol=0.1)
    assert abs(float(go.albedo(table, 0.7).value.mean()) - 1.0) < 0.03


def test_docstrings_become_markdown() -> None:
    doc = "One line with a|b.\n\n    code = 1\n\nname   its meaning\n       goes on\nother  another"
    shown = text.markdown(doc)
    assert "One line with a\\|b." in shown and "```text\ncode = 1\n```" in shown
    assert "| `name` | its meaning goes on |" in shown and "| `other` | another |" in shown


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the book without its live pages; links, formulas, headings and pictures give no warning."""
    if importlib.util.find_spec("sphinx") is None:
        pytest.skip("NOT BUILT: the extra `book` is not installed")
    folder = tmp_path_factory.mktemp("book")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", ROOT / "docs", folder]
    done = subprocess.run(command, env={**os.environ, "GONIO_BOOK": "quick"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.slow
def test_the_book_loads_nothing_from_the_network(built: Path) -> None:
    """Scripts, styles, frames, pictures and fonts are files of the book."""
    loading = r"<(?:script|iframe|img|source|object)\b[^>]*?\b(?:src|data)=\"(?:https?:)?//|"
    loading += r"<link\b[^>]*\brel=\"(?:stylesheet|preload|icon)\"[^>]*\bhref=\"(?:https?:)?//"
    pages = list(built.rglob("*.html"))
    assert len(pages) > 150
    assert [page.name for page in pages if re.search(loading, page.read_text(encoding="utf-8"))] == []
    styles = (path.read_text(encoding="utf-8") for path in built.rglob("*.css"))
    assert not any(re.search(r"url\([\"']?(?:https?:)?//|@import", style) for style in styles)


@pytest.mark.slow
@pytest.mark.browser
def test_the_search_of_the_book_opened_from_disk_finds_words_and_options(built: Path) -> None:
    requests, messages = [], []
    with browser.chromium() as chromium:
        page = chromium.new_page()
        page.on("request", lambda request: requests.append(request.url))
        page.on("console", lambda message: messages.append(message.text))
        page.on("pageerror", lambda error: messages.append(str(error)))
        for word in ("Kulla-Conty", "E_avg", "--until-error", "GGX"):
            page.goto(f"{(built / 'search.html').as_uri()}?q={word}")
            page.wait_for_selector("#search-results .search-summary")
            page.wait_for_selector("#search-results li a")
    assert messages == []
    assert [url for url in requests if not url.startswith(("file:", "data:"))] == []
