"""`gonio report`: figures, a document, and words that are never lost."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import gonio as go
import pytest
from gonio.cli import app
from gonio.errors import InputError
from gonio.render.options import RenderOptions
from gonio.report import document, entries, listing, printing, words
from gonio.viewer import contact_sheet

import browser

LIST = """
title = "Lab 2"
author = "A. Student"
spp = 1
size = "12x8"

[[figure]]
type = "study"
vary = ["scene.shapes.0.material.p=4,16"]
name = "powers"
caption = "The power $p$ of the highlight."
text = "A larger $p$ is a *smaller* highlight."

[[figure]]
type = "bake"
resolution = 4
lut = ["E"]

[[figure]]
type = "check"
work = "f.csv"
against = "lambert(albedo=0.5)"
"""


def rows_of_lambert(folder: Path) -> None:
    (folder / "f.csv").write_text("0,0,1,0,0,1,0.15915494\n0,0,1,0.6,0,0.8,0.15915494\n")


@pytest.mark.slow
def test_a_list_becomes_one_document_whose_words_are_never_lost(scene: Path, capsys: pytest.CaptureFixture) -> None:
    (scene / "report.toml").write_text(LIST)
    rows_of_lambert(scene)
    assert app.run(["report", str(scene), "--json"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert first["new_words"] and first["unchanged"] == 0 and first["unused"] == []
    folder = Path("ball-report")
    names = [Path(path).name for path in first["figures"]]
    assert names == ["powers.png", "tables-of-ggx.png", "check-of-f-csv.csv"]
    text = (folder / "report.md").read_text()
    assert (
        text.startswith("# Lab 2\n\nA. Student\n") and "![The power $p$ of the highlight.](figures/powers.png)" in text
    )
    page = (folder / "report.html").read_text()
    assert page.count("data:image/png") == 2 and "<td>right</td>" in page and 'src="http' not in page
    assert "gonio study . --vary scene.shapes.0.material.p=4,16 --spp 1 --size 12x8" in page

    edited = "# My own title\n\nMy words about $k_d$.\n\n![One](figures/powers.png)\n"
    (folder / "report.md").write_text(edited)
    picture = (folder / "figures/powers.png").stat().st_mtime_ns
    assert app.run(["report", str(scene)]) == 0
    told = capsys.readouterr().out
    assert (folder / "report.md").read_text() == edited
    assert (folder / "figures/powers.png").stat().st_mtime_ns == picture  # nothing that it shows has changed
    assert "not shown there: ![Directional albedo" in told and "figures/tables-of-ggx.png" in told
    assert "My own title" in (folder / "report.html").read_text()

    raw = json.loads((scene / "scene.json").read_text())
    raw["scene"]["shapes"][0]["material"]["kd"] = [0.9, 0.1, 0.1]
    (scene / "scene.json").write_text(json.dumps(raw))
    assert app.run(["report", str(scene)]) == 0
    assert (folder / "figures/powers.png").stat().st_mtime_ns != picture


def test_edited_words_are_never_lost(tmp_path: Path) -> None:
    rows_of_lambert(tmp_path)
    (tmp_path / "mine.toml").write_text('[[figure]]\ntype = "check"\nwork = "f.csv"\nagainst = "lambert(albedo=0.5)"\n')
    made = go.report(tmp_path / "mine.toml", output=tmp_path / "r", title="T")
    assert made.new_words and made.words.read_text().startswith("# T\n") and "<td>right</td>" in made.output.read_text()
    made.words.write_text("# Mine\n\nMy words.\n")
    again = go.report(tmp_path / "mine.toml", output=tmp_path / "r", title="T")
    assert not again.new_words and again.words.read_text() == "# Mine\n\nMy words.\n"
    assert "My words." in again.output.read_text() and len(again.unused) == 1


@pytest.mark.slow
def test_options_list_figures_too(scene: Path, tmp_path: Path) -> None:
    grid = "scene.shapes.0.material.p=4,16;scene.shapes.0.material.kd=0.1,0.5"
    options = {"spp": 1, "size": (8, 8), "output": tmp_path / "r", "exposure": -2.0}
    made = go.report(scene, study=[grid], plot=["albedo=lambert(albedo=0.2);lambert"], title="T", **options)
    assert [path.suffix for path in made.figures] == [".png"] * 3 and made.new_words
    assert made.words.read_text().startswith("# T\n")
    assert "from top to bottom, kd from left to right" in made.words.read_text()


def test_the_example_is_a_list() -> None:
    file = Path(__file__).parents[2] / "examples/lab2.toml"
    content = listing.listing(str(file), {}, False, False)
    for figure in content.figures:
        verb, *rest = shlex.split(figure.command(RenderOptions()))[1:]
        assert verb == figure.type and rest and figure.caption and figure.text
        if isinstance(figure, entries.Study):
            cells = [contact_sheet.parse_variation(text) for text in figure.vary]
            assert 3 <= len(contact_sheet.cells_of(cells)) <= 6
        if (folder := file.parent / getattr(figure, "scene", "")).is_dir():
            assert (folder / "scene.json").exists() or not getattr(figure, "scene", "")


WRONG = {
    "unknown type": ('[[figure]]\ntype = "stduy"', "#/figure/0/type", "did you mean 'study'?"),
    "unknown key": ('[[figure]]\ntype = "plot"\nmodle = ["phong"]', "#/figure/0/modle", "did you mean 'model'?"),
    "missing key": ('[[figure]]\ntype = "study"', "#/figure/0", 'add "vary"'),
    "unknown material": ('[[figure]]\ntype = "plot"\nmodel = ["phongg"]', "#/figure/0", "did you mean 'phong'?"),
    "unknown path": ('[[figure]]\ntype = "study"\nvary = ["radios=1"]', "#/figure/0", ""),
    "one name twice": (
        '[[figure]]\ntype="bake"\nname="a"\n[[figure]]\ntype="bake"\nname="a"',
        "#/figure/1/name",
        "first",
    ),
    "no TOML": ("[[figure]\n", "report.toml", "double quotes"),
    "no figures": ("figure = []", "#/figure", "[[figure]]"),
    "code": ('[[figure]]\ntype = "plot"\nmodel = ["ward.py:Ward"]', "#/figure/0/model/0", "--allow-code"),
    "outside": ('[[figure]]\ntype = "render"\nscene = "../other"', "#/figure/0/scene", "--allow-outside"),
    "missing work": ('[[figure]]\ntype = "check"\nwork = "g.csv"', "#/figure/0", "check the path"),
}


@pytest.mark.parametrize("problem", WRONG)
def test_a_wrong_list_is_one_clear_error(problem: str, scene: Path, capsys: pytest.CaptureFixture) -> None:
    text, where, hint = WRONG[problem]
    (scene / "report.toml").write_text(text)
    assert app.run(["report", str(scene)]) == 2
    told = capsys.readouterr().err
    assert len(told.strip().splitlines()) <= 3 and "report.toml" in told
    assert where in told and hint in told, told
    assert not (Path("ball-report") / "report.md").exists()


def test_words_that_show_a_missing_picture_are_an_error_before_anything_is_made(scene: Path) -> None:
    folder = Path("ball-report")
    folder.mkdir()
    (folder / "report.md").write_text("# A\n\n![mine](figures/mine.png)\n")
    with pytest.raises(InputError, match=r"no file 'figures/mine\.png'") as error:
        go.report(scene, spp=1)
    assert error.value.where.endswith("report.md:3") and not (folder / "figures").exists()


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("![a](https://example.org/a.png)", "is not a file"),
        ("![a](/etc/passwd)", "is not a picture"),
        ("![a](../a.png)", "no file"),
        (r"$\nonsense{x}$", "cannot be set"),
    ],
)
def test_what_a_page_cannot_show_is_an_error_with_its_line(text: str, what: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=what) as error:
        document.page(f"# A\n\n{text}\n", tmp_path)
    assert error.value.where.endswith("report.md:3")


def test_a_page_contains_its_pictures(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"a picture")
    (tmp_path / "t.csv").write_text("a,b\n1,2\n")
    page = document.page("![a](a.png)\n\n[t](t.csv)\n", tmp_path)
    assert 'src="data:image/png;base64,YSBwaWN0dXJl"' in page and "<td>2</td>" in page
    with pytest.raises(InputError, match=r"'t\.csv' is not a picture"):
        document.page("![t](t.csv)\n", tmp_path)


def test_a_picture_behind_a_link_out_of_the_folder_is_not_shown(tmp_path: Path) -> None:
    (tmp_path / "secret.png").write_bytes(b"x")
    (tmp_path / "report").mkdir()
    (tmp_path / "report/a.png").symlink_to(tmp_path / "secret.png")
    with pytest.raises(InputError, match="outside the report's folder"):
        document.page("![a](a.png)", tmp_path / "report")


def test_html_in_words_is_text_and_prices_are_no_formulas(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text('p,"<b>f</b>"\n4,0.6\n')
    page = document.page("# <script>x</script>\n\nIt costs $5 or $6, and $k_d$.\n\n[A table](a.csv)\n", tmp_path)
    assert "<script>" not in page and "<b>f" not in page and "costs $5 or $6" in page
    assert page.count('<img class="inline"') == 1 and "<th>p</th>" in page


def test_references_are_those_that_are_shown() -> None:
    text = "![a](b.png) `![c](d.png)`\n\n    ![e](f.png)\n\n[t](g.csv) [web](h.html)\n"
    assert [tuple(one) for one in words.references(text)] == [(1, "b.png"), (5, "g.csv")]


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.skipif(browser.executable() is None, reason="NOT TRIED: no Chromium on the PATH")
def test_the_page_is_printed(tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text(document.page("# A report\n\nWords.\n", tmp_path))
    pdf = printing.write_pdf(tmp_path / "report.html", tmp_path / "report.pdf")
    assert pdf.read_bytes().startswith(b"%PDF")


def test_without_a_browser_the_error_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(printing.shutil, "which", lambda name: None)
    monkeypatch.setattr(printing.os.path, "isfile", lambda name: False)
    with pytest.raises(go.MachineError) as error:
        printing.browser()
    assert "report.html" in error.value.hint


def test_a_refused_report_leaves_no_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        go.report("lambert", study=["nothing=1,2"], output=tmp_path / "report")
    assert not (tmp_path / "report").exists()
