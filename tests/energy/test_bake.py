"""Tables on disk: axes, flips, what the manifest claims, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.energy import bake as baking
from gonio.energy import cache, quadrature
from gonio.render import tables

REFERENCE = Path(__file__).resolve().parents[3] / "shared" / "reference" / "kulla-conty"


def read_png(path):
    import mitsuba as mi
    from gonio.render import engine

    engine.load("cpu")
    return np.array(mi.Bitmap(str(path)))


def test_axes_are_texel_centres_and_rows_are_roughness():
    baked = baking.bake("ggx", ["E", "Eavg", "dfg"], size=16)
    centres = (np.arange(16) + 0.5) / 16
    np.testing.assert_allclose(baked.arrays["mu"], centres)
    assert baked.arrays["E"][12, 3] == pytest.approx(
        float(quadrature.moments("ggx", "smith-correlated", centres[3], centres[12] ** 2).whole), abs=1e-12
    )
    np.testing.assert_allclose(baked.arrays["dfg"].sum(-1), baked.arrays["E"], rtol=1e-12)
    assert baked.arrays["E_avg"].shape == (16,)


def test_the_manifests_error_is_within_a_factor_3_of_the_truth():
    baked = baking.bake("ggx", ["E"], size=64)
    mu, roughness = baked.arrays["mu"], baked.arrays["roughness"]
    truth = quadrature.moments("ggx", "smith-correlated", mu, roughness[:, None] ** 2, nodes=(110, 90)).whole
    actual = np.abs(baked.arrays["E"] - truth).max()
    assert actual / 3 < baked.manifest["error"]["E"]["max"] < actual * 3


def test_a_stretched_layout_interpolates_within_2e_3():
    for masking in ("smith-correlated", "smith-separable", "schlick-direct", "schlick-ibl"):
        baked = baking.bake("ggx", ["E"], size=64, masking=masking, layout="stretched")
        assert baked.manifest["error"]["E"]["interpolation"] < 2e-3


@pytest.mark.parametrize("store", ["E", "1-E"])
@pytest.mark.parametrize("flip", [True, False])
def test_homework_pictures_read_back_pixel_by_pixel(tmp_path, store, flip):
    baked = tables.bake("ggx", tmp_path / "t", layout="homework", store=store, flip=flip, masking="schlick-direct")
    picture = read_png(tmp_path / "t" / "E.png")
    assert picture.shape == (128, 128, 3)
    assert np.all(picture == picture[..., :1])
    value = baked.arrays["E"] if store == "E" else 1.0 - baked.arrays["E"]
    expected = np.round((value[::-1] if flip else value) * 255)
    np.testing.assert_array_equal(picture[..., 0], expected)
    average = read_png(tmp_path / "t" / "E_avg.png")
    assert np.all(average == average[:, :1])


def test_a_folder_reads_back_what_was_written(tmp_path):
    baked = tables.bake("beckmann", tmp_path / "t", size=8)
    found = baking.load(tmp_path / "t")
    for name, array in baked.arrays.items():
        np.testing.assert_array_equal(found.arrays[name], array)
    assert json.loads((tmp_path / "t" / "manifest.json").read_text())["ndf"] == "beckmann"
    assert tables.describe(tmp_path / "t")["range"]["E"][1] <= 1.0
    assert {p.name for p in (tmp_path / "t").iterdir()} == set(baked.manifest["files"])


def test_models_are_baked_with_their_own_fresnel():
    baked = baking.bake(go.Conductor.preset("Au", masking="smith-separable"), ["E", "Eavg"], size=8)
    assert baked.arrays["E"].shape == (8, 8, 3)
    assert baked.manifest["masking"] == "smith-separable"
    glass = baking.bake(go.Dielectric(1.5), ["E"], size=8)
    assert glass.arrays["E"].shape == (8, 8)


def test_altered_truncated_and_foreign_files_are_refused(tmp_path):
    tables.bake("ggx", tmp_path / "t", size=8)
    file = tmp_path / "t" / "tables.npz"
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(go.InputError, match="damaged"):
        baking.load(tmp_path / "t")
    with np.load(__import__("io").BytesIO(whole)) as opened:
        arrays = dict(opened)
    arrays["E"] = arrays["E"] * 1.01
    np.savez(file, **arrays)
    with pytest.raises(go.InputError, match="not what the manifest says"):
        baking.load(tmp_path / "t")
    with pytest.raises(go.InputError, match=r"'\.png' given"):
        baking.load(tmp_path / "t" / "E.png")
    with pytest.raises(go.InputError, match=r"no tables\.npz"):
        baking.load(tmp_path)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"size": 0}, "0 x 0"),
        ({"size": 5000}, "5000 x 5000"),
        ({"masking": "smith"}, "unknown masking"),
        ({"method": "ggx", "spp": 0}, "0 samples"),
        ({"method": "sobol"}, "unknown method"),
        ({"lut": ["F"]}, "unknown table"),
        ({"layout": "polar"}, "unknown layout"),
        ({"layout": "homework", "store": "E/2"}, "unknown 'E/2'"),
    ],
)
def test_bad_options_are_refused_and_nothing_is_written(tmp_path, options, text):
    with pytest.raises(go.InputError, match=text):
        tables.bake("ggx", tmp_path / "t", **options)
    assert not any(tmp_path.iterdir())


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "f").write_text("")
    with pytest.raises(go.InputError, match="is a file"):
        tables.bake("ggx", tmp_path / "f", size=4)


def test_a_damaged_cache_is_rebuilt_with_a_warning(tmp_path, monkeypatch):
    monkeypatch.setenv("GONIO_CACHE", str(tmp_path))
    first = cache.remember(("trial", 1), lambda: np.arange(3.0), "ggx")
    (file,) = tmp_path.glob("trial-*.npz")
    assert np.array_equal(cache.remember(("trial", 1), lambda: 1 / 0, "ggx"), first)
    file.write_bytes(b"not a table")
    with pytest.warns(go.GonioWarning, match="damaged or not ours"):
        again = cache.remember(("trial", 1), lambda: np.arange(3.0), "ggx")
    assert np.array_equal(again, first)


@pytest.mark.shared
@pytest.mark.skipif(not REFERENCE.is_dir(), reason="no shared references beside the checkout")
def test_a_public_solutions_pictures_agree_with_the_exact_table():
    centres = (np.arange(128) + 0.5) / 128
    mu, roughness = np.meshgrid(centres, centres)
    exact = quadrature.moments("ggx", "schlick-ibl", mu, roughness**2).whole[::-1]
    picture = read_png(REFERENCE / "homework_E_importance_sampled.png")[..., 0] / 255.0
    rough = roughness[::-1] >= 0.3
    assert np.sqrt(np.mean((picture - exact)[rough] ** 2)) < 0.004
    average = read_png(REFERENCE / "homework_Eavg.png")[:, 0, 0] / 255.0
    ours = quadrature.average("ggx", "schlick-ibl", centres**2)[::-1]
    assert np.abs(average - ours)[centres[::-1] >= 0.3].max() < 0.007
