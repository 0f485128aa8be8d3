"""Sheets: what is typed becomes values, every picture is shown once, at its size, in its place."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.viewer import contact_sheet, figures, sheet_layout
from gonio.viewer.figures import Drawing
from gonio.viewer.variations import Variation


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("p=4,16,64", (4, 16, 64)),
        ("a=.3,-.5,1e-3", (0.3, -0.5, 0.001)),
        ("kd=[.1,.1,.1],[0.5, 0.5, 0.5]", ([0.1, 0.1, 0.1], [0.5, 0.5, 0.5])),
        ("ndf=ggx,beckmann", ("ggx", "beckmann")),
        ('m={"type":"matte","albedo":[1,0,0]},null', ({"type": "matte", "albedo": [1, 0, 0]}, None)),
        ('name="a,b",c', ("a,b", "c")),
        ("flag=true,false", (True, False)),
        ("file=v1.5.png", ("v1.5.png",)),
        ("file=a/../b.png", ("a/../b.png",)),
        ("p=0..1", (0, 0.25, 0.5, 0.75, 1)),
        ("p=1..16", (1, 2, 4, 8, 16)),  # geometric from a factor of ten on
    ],
)
def test_values_are_split_at_commas_outside_of_brackets(text: str, values: tuple[object, ...]) -> None:
    assert contact_sheet.parse_variation(text).values == values


@pytest.mark.parametrize("text", ["p", "p=", "=3"])
def test_a_variation_that_varies_nothing_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="NAME=VALUE expected"):
        contact_sheet.parse_variation(text)


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("scene.shapes.0.material.p", "p"),
        ("/scene/shapes/0/material/eta/0", "eta[0]"),
        ("scene.shapes.*.material.kd", "kd"),
        ("alpha", "alpha"),
    ],
)
def test_labels_carry_the_last_word_of_the_path(path: str, name: str) -> None:
    assert Variation(path, ()).name == name


def test_values_are_shown_short() -> None:
    assert figures.show_value([0.1, 0.25, 1.0]) == "(0.1, 0.25, 1)"
    assert figures.show_value({"type": "matte", "albedo": 1}) == "matte"
    assert len(figures.show_value("x" * 99)) == len(figures.show_value(10**400)) == 28


def _colours(count: int) -> list[np.ndarray]:
    """Pictures of one flat colour each, told apart by their red."""
    return [np.full((90, 200, 3), (10 + 20 * i, 200, 60), np.uint8) for i in range(count)]


def _saved(drawing: Drawing, path: Path) -> Path:
    saved = drawing.save(path).path
    assert saved is not None
    return saved


def _places(sheet: Path, count: int) -> list[tuple[int, int, int]]:
    """Of each picture: its upper left corner in the sheet, and its number of pixels."""
    from PIL import Image

    pixels = np.array(Image.open(sheet).convert("RGB")).astype(int)
    found = []
    for picture in _colours(count):
        rows, columns = np.nonzero((pixels == picture[0, 0]).all(axis=2))
        assert len(rows), "a picture is missing"
        found.append((int(rows.min()), int(columns.min()), len(rows)))
    return found


def test_the_first_of_two_goes_down_and_the_second_across(tmp_path: Path) -> None:
    variations = [Variation("kd", (1, 2)), Variation("p", (4, 16, 64))]
    sheet = _saved(contact_sheet.draw(_colours(6), variations, "title", "about"), tmp_path / "a.png")
    places = _places(sheet, 6)
    tops, lefts = [place[0] for place in places], [place[1] for place in places]
    assert tops[0] == tops[1] == tops[2] < tops[3] == tops[4] == tops[5]
    assert lefts[0] == lefts[3] < lefts[1] == lefts[4] < lefts[2] == lefts[5]
    for *_, size in places:  # at one sheet pixel a picture pixel; its rim may be blended by rounding
        assert 0.95 * 90 * 200 < size <= 90 * 200


def test_no_two_pictures_overlap_in_a_sheet_of_three_parameters(tmp_path: Path) -> None:
    variations = [Variation("a", (1, 2)), Variation("b", (1, 2)), Variation("c", (1, 2, 3))]
    places = _places(_saved(contact_sheet.draw(_colours(12), variations, "t", "s"), tmp_path / "a.png"), 12)
    assert len({place[:2] for place in places}) == 12
    assert all(size > 0.95 * 90 * 200 for *_, size in places)
    first, second = max(place[0] for place in places[:6]), min(place[0] for place in places[6:])
    assert first + 90 < second  # the block of a = 1 is above that of a = 2


@pytest.mark.parametrize(("count", "columns"), [(3, 3), (4, 2), (6, 3), (5, 3), (7, 4)])
def test_a_row_is_wrapped_to_the_shape_of_a_page(count: int, columns: int) -> None:
    assert sheet_layout._columns_of_a_row(count, aspect=1.0) == columns


def test_wide_pictures_are_stacked() -> None:
    assert sheet_layout._columns_of_a_row(5, aspect=10 / 3) == 1


@pytest.mark.parametrize("suffix", [".pdf", ".svg"])
def test_sheets_can_be_vector_files(tmp_path: Path, suffix: str) -> None:
    path = _saved(contact_sheet.draw(_colours(2), [Variation("kd", (1, 2))], "title", "about"), tmp_path / f"a{suffix}")
    assert path.read_bytes()[:5] in (b"%PDF-", b"<?xml")
    assert list(tmp_path.iterdir()) == [path]


def test_same_names_are_told_apart(tmp_path: Path) -> None:
    variations = [Variation("shapes.0.material.p", (1,)), Variation("shapes.1.material.p", (1,))]
    path = _saved(contact_sheet.draw(_colours(1), variations, "t", "s"), tmp_path / "a.svg")
    assert "shapes.1.material.p" in path.read_text()


def test_too_many_pictures_are_refused_before_the_first(tmp_path: Path) -> None:
    from gonio.render.request import Request

    variations = [Variation("a", tuple(range(20))), Variation("b", tuple(range(20)))]
    with pytest.raises(InputError, match="400 pictures"):
        contact_sheet.render_sheet(Request(Path("nowhere")), variations, tmp_path / "a.png")
    with pytest.raises(InputError, match="varied twice"):
        contact_sheet.render_sheet(Request(Path("nowhere")), [Variation("a", (1,))] * 2, tmp_path / "a.png")


@pytest.mark.parametrize(
    ("text", "settings"),
    [
        ("kd,ks=(.2,.8),(.5,.5)", [{"kd": 0.2, "ks": 0.8}, {"kd": 0.5, "ks": 0.5}]),
        ("kd, ks=([.1,.2,.3],.5)", [{"kd": [0.1, 0.2, 0.3], "ks": 0.5}]),
        ("a,b,c=(1,gold,true)", [{"a": 1, "b": "gold", "c": True}]),
        ("a=(.1,.2)", [{"a": "(.1,.2)"}]),
    ],
)
def test_several_paths_vary_together(text: str, settings: list[dict[str, object]]) -> None:
    found = contact_sheet.parse_variation(text)
    assert [found.settings(value) for value in found.values] == settings
    assert found.name == ", ".join(settings[0])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("kd,ks=(.2,.8),(.5)", "'(.5)' is 1 value, 2 expected for kd, ks"),
        ("kd,ks=.2,.8", "'0.2' is one value, 2 expected"),
        ("kd,ks=(.2,.8,.1)", "is 3 values, 2 expected"),
        ("kd,=(.2,.8)", "varies no path"),
        ("kd,kd=(.2,.8)", "one twice"),
    ],
)
def test_paths_and_values_that_do_not_fit_are_refused(text: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        contact_sheet.parse_variation(text)
    assert words in caught.value.what


@pytest.mark.slow
def test_a_material_is_studied_on_a_ball(tmp_path: Path) -> None:
    """By text or as an object, with values of its own, of materials inside, tied ones, and of the scene around it."""
    vary = {"p": [4, 16], ("kd", "ks"): [(0.2, 0.8), (0.5, 0.5)]}
    sheet = go.study("phong", vary, size=(8, 8), spp=1, output=tmp_path / "a.png")
    assert sheet.cells[1] == {"p": 4, "kd": 0.5, "ks": 0.5} and len(sheet.cells) == 4
    other = go.study(go.Phong(p=3.0), {"p": [4], "kd,ks": [(0.2, 0.8)]}, size=(8, 8), spp=1)
    assert other.cells == ({"p": 4, "kd": 0.2, "ks": 0.8},)
    inside = go.study(
        "kulla-conty", {"shapes.0.material.base.alpha": [0.2], "camera.verticalFov": [20]}, size=(8, 8), spp=1
    )
    assert len(inside.cells) == 1
    with pytest.raises(InputError, match="phong has no parameter 'q'") as caught:
        go.study("phong", {"q": [1]}, size=(8, 8), spp=1)
    assert caught.value.where == "--vary q"


def test_each_picture_of_a_study_has_its_own_values() -> None:
    from gonio.catalog import notation
    from gonio.render.request import Request

    named = notation.taken_apart("kulla-conty(base=conductor(preset=Au))")
    cell = {"base.alpha": 0.4, "integrator.maxDepth": 2}
    found = contact_sheet.with_cell(Request(Path("kulla-conty")), cell, named)
    assert found.material == go.KullaConty(go.Conductor.preset("Au", alpha=0.4))
    assert found.overrides == {"integrator.maxDepth": 2}
