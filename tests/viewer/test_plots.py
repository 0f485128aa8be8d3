"""Plots draw what the material computes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.catalog import notation
from gonio.errors import InputError
from gonio.material import models
from gonio.measure import SAMPLE, read
from gonio.viewer import curves, figures, fit_figure, fresnel_figure, lobes, plots

METAL = '{"type": "conductor", "preset": "Au", "alpha": 0.3}'


def _needed(name: str) -> tuple[list[str], str]:
    """What a material asks for: metal for every material inside of it, a preset for indices of refraction."""
    required = [p for p in models()[name].parameters().values() if p.required]
    inner = [f"{p.name}={METAL}" for p in required if p.kind == "bsdf"]
    others = [f"{p.name}=0.3" for p in required if p.kind in ("float", "alpha")]
    return inner + others, "Au" if any(p.kind == "spectrum" for p in required) else ""


# each material drawn in one way, the ways in turn, and a few in all
QUICK = {(name, plots.KINDS[i % len(plots.KINDS)]) for i, name in enumerate(models())}
QUICK |= {(name, kind) for name in ("lambert", "conductor", "dielectric", "mix", "measured") for kind in plots.KINDS}
QUICK = QUICK - {("disney2015", "lobe")} | {("disney2015", "slice")}  # nine seconds of one shape more


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "kind"),
    [
        pytest.param(name, kind, marks=() if (name, kind) in QUICK else pytest.mark.slow)
        for name in models()
        for kind in plots.KINDS
    ],
)
def test_every_material_can_be_plotted(name: str, kind: str, tmp_path: Path) -> None:
    assignments, preset = _needed(name)
    material = notation.named(name, assignments, preset)[0]
    path = plots.plot(material, kind=kind, angles=[45], output=tmp_path / "a.svg").path
    assert path is not None and path.stat().st_size > 1000
    assert list(tmp_path.iterdir()) == [path]


def test_a_curve_is_the_materials_eval_in_the_plane_of_incidence() -> None:
    one = curves.curve(go.Lambert(albedo=0.5), view=30)
    assert one.angles[0] == -90 and one.angles[-1] == 90
    assert one.mean == pytest.approx(0.5 / np.pi * np.cos(np.radians(one.angles)), abs=1e-6)
    assert one.pdf == pytest.approx(np.cos(np.radians(one.angles)) / np.pi, abs=1e-6)
    assert one.gray and one.deltas == ()


def test_a_highlight_stands_on_the_mirrors_side() -> None:
    one = curves.curve(go.Conductor.preset("Au", alpha=0.05), view=40)
    assert one.angles[one.mean.argmax()] == pytest.approx(40, abs=0.5)
    assert not one.gray


def test_smooth_glass_splits_its_power_in_two_delta_lobes() -> None:
    one = curves.curve(go.Dielectric(eta=1.5, alpha=0.0), view=30)
    (first, reflected), (second, transmitted) = sorted(one.deltas)
    assert first == pytest.approx(30, abs=0.02)
    assert second == pytest.approx(180 - np.degrees(np.arcsin(0.5 / 1.5)), abs=0.02)
    assert reflected + transmitted == pytest.approx(1, abs=1e-5)
    assert reflected == pytest.approx(0.0415, abs=1e-3)  # Fresnel at 30 degrees, index 1.5


def test_albedo_has_its_closed_forms() -> None:
    views = np.array([0.0, 45.0, 80.0])
    assert curves.albedo(go.Lambert(albedo=0.3), views) == pytest.approx(0.3, abs=1e-4)
    assert curves.albedo(go.Mirror(), views) == pytest.approx(1, abs=1e-6)
    assert curves.albedo(go.Dielectric(eta=1.5, alpha=0.0), views) == pytest.approx(1, abs=1e-5)


def test_rings_are_round_numbers_below_the_peak() -> None:
    for peak in (0.0123, 0.97, 1.0, 3.3, 42, 1e5):
        ticks = lobes._round_ticks(peak)
        assert 1 <= len(ticks) <= 5 and ticks[-1] <= peak and len(f"{ticks[0]:g}") <= 6
    assert lobes._round_ticks(0) == []


def test_image_slices_stand_side_by_side() -> None:
    figure = plots.plot(go.Lambert(0.5), "conductor(alpha=.3,eta=.2,k=3)", kind="image").figure
    assert [axes.get_title() for axes in figure.axes] == ["lambert", "conductor(alpha=.3,eta=.2,k=3)"]
    flat, metal = (np.asarray(axes.get_images()[0].get_array()) for axes in figure.axes)
    assert np.ptp(flat) == pytest.approx(0.0, abs=1e-6)
    assert metal[90, 2].min() > metal[90, 90].max()  # the highlight is at the left


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", [kind for kind in plots.KINDS if kind != "image"])
def test_materials_are_laid_over_each_other(kind: str, tmp_path: Path) -> None:
    gold = go.Conductor.preset("Au", alpha=0.3)
    drawing = plots.plot(gold, "dielectric(alpha=.2)", "dielectric(alpha=0)", kind=kind, angles=[0, 60])
    assert drawing.path is None and list(tmp_path.iterdir()) == []
    figure = drawing.figure
    legend = figure.legends[0] if figure.legends else figure.axes[0].get_legend()
    shown = [text.get_text() for text in legend.get_texts()]
    assert shown[1:3] == ["dielectric(alpha=.2)", "dielectric(alpha=0)"] and shown[0].startswith("conductor(")
    assert len(figure.axes) == (1 if kind == "albedo" else 2)
    limits = {(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes}
    assert len(limits) == 1  # the same axes
    assert drawing._repr_png_().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_drawing_leaves_the_notebooks_windows_alone() -> None:
    import matplotlib

    before = matplotlib.get_backend(auto_select=False)
    plots.plot("lambert")
    assert matplotlib.get_backend(auto_select=False) == before


@pytest.mark.parametrize(
    ("materials", "options", "message", "hint"),
    [
        (["lamberd"], {}, "unknown material", "did you mean 'lambert'?"),
        (["lambert(albdo=1)"], {}, "no parameter 'albdo'", "did you mean 'albedo'?"),
        (["lambert(preset=Au)"], {}, "no presets", "--param"),
        (["mix(a=3,b=lambert)"], {}, "is not a material", "such as lambert"),
        (["lambert"], {"kind": "lob"}, "unknown kind", "did you mean 'lobe'?"),
        (["lambert"], {"angles": [10, 90]}, "'90' is not an angle", "below 90"),
        (["lambert"], {"angles": ["x"]}, "several numbers expected", ""),
        (["lambert"], {"angles": []}, "0 angles", "such as"),
        (["lambert"], {"output": "a.gif"}, "figure format", ".png"),
        (["lambert(albedo=-1)"], {}, "-1", ""),
        (["lambert"] * 8, {}, "8 materials", "several plots"),
        ([], {}, "0 materials", ""),
    ],
)
def test_what_cannot_be_plotted_is_one_clear_error(
    materials: list[str],
    options: dict[str, object],
    message: str,
    hint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message) as caught:
        plots.plot(*materials, **options)  # type: ignore[arg-type]
    assert hint in caught.value.hint
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("index", [{"eta": 1.5}, {"eta": 0.7}, {"eta": 2.7, "k": 3.0}, {"metal": "Au"}, {}])
def test_fresnel_is_drawn_with_the_angles_that_have_names(index: dict[str, Any], tmp_path: Path) -> None:
    path = go.plot("fresnel", output=tmp_path / "a.svg", **index).path
    assert path is not None
    text = path.read_text()
    assert "Schlick minus exact" in text and "from outside" in text
    if index == {"eta": 1.5}:
        assert "Brewster 56.3" in text and "Brewster 33.7" in text and "critical 41.8" in text


def test_the_map_of_schlicks_error_is_the_difference_of_both() -> None:
    angles = np.linspace(0, 90, 31)
    errors = fresnel_figure.schlick_error(np.array([1.5]), angles)[0]
    line = fresnel_figure.Index("", "", 1.5, 0.0)
    assert errors == pytest.approx(
        fresnel_figure.approximation("schlick", angles, line) - go.fresnel(np.radians(angles), 1.5).R, abs=1e-12
    )
    assert np.abs(errors).max() == pytest.approx(0.035, abs=1e-3)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"eta": 0.0}, "eta = 0, a positive index expected"),
        ({"eta": 1.5, "k": -1.0}, "k = -1, which would amplify light"),
        ({"eta": 1.5, "metal": "Au"}, "an index and a metal"),
        ({"metal": "Aurum"}, "unknown metal 'Aurum'"),
    ],
)
def test_an_index_that_cannot_be_drawn_is_an_error(arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        go.plot("fresnel", **arguments)
    with pytest.raises(InputError, match="an index is given without fresnel"):
        go.plot("lambert", eta=1.5)


def test_a_long_subtitle_stays_inside_the_figure() -> None:
    for words in (8, 12, 18):
        figure = figures.blank(7.4, 5.0, "title", "some words " * words)
        for text in figure.texts:
            assert text.get_window_extent().x1 <= figure.bbox.x1 - 10.0
            assert text.get_window_extent().y0 >= figure.bbox.y1 - 0.85 * figure.dpi


def test_the_figure_of_a_fit_shows_measured_and_fitted_values() -> None:
    found = go.fit(read(SAMPLE), "lambert")
    figure = fit_figure.draw(found, SAMPLE).figure
    titles = [axes.get_title() for axes in figure.axes[:5]]
    assert titles[:2] == ["measured, one light", "fitted, one light"] and titles[3] == "viewed at 20 degrees"
    shown = np.asarray(figure.axes[1].images[0].get_array())[..., 0]
    y, x = np.mgrid[1.0 : -1.0 : len(shown) * 1j, -1.0 : 1.0 : len(shown) * 1j]
    normals = np.stack([x, y, np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))], -1)
    cosines = normals @ (fit_figure.LIGHT / np.linalg.norm(fit_figure.LIGHT))
    seen = (x * x + y * y < 0.9) & (shown > 0.1) & (shown < 0.99)  # neither in shadow nor clipped
    ratio = shown[seen] ** 2.2 / cosines[seen]
    assert seen.sum() > 1000 and np.ptp(ratio) < 0.01 * ratio.mean()
    albedo = np.broadcast_to(found.material.albedo, 3)
    for channel, line in enumerate(figure.axes[3].lines[1::2]):
        angles, values = line.get_data()
        np.testing.assert_allclose(values, albedo[channel] / np.pi * np.cos(np.radians(angles)), rtol=1e-4)
