"""Tables on disk: axes, flips, what the manifest claims, and what is refused."""

from __future__ import annotations

import json
import re
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.energy.albedo import quadrature
from gonio.energy.albedo.monte_carlo import Sampling
from gonio.energy.tables import bake as baking
from gonio.energy.tables import baked as baked_files
from gonio.energy.tables.axes import Axes
from gonio.render import tables

ROOT = Path(__file__).parents[2]


def read_png(path):
    import mitsuba as mi
    from gonio.bridge import engine

    engine.load("cpu")
    return np.array(mi.Bitmap(str(path)))


def test_axes_are_texel_centres_and_rows_are_roughness():
    baked = baking.bake("ggx", ["E", "Eavg", "dfg"], size=16)
    centres = (np.arange(16) + 0.5) / 16
    np.testing.assert_allclose(baked.arrays["mu"], centres)
    assert baked.arrays["E"][12, 3] == pytest.approx(
        float(quadrature.moments("ggx", "smith-correlated", centres[3], centres[12] ** 2).white), abs=1e-12
    )
    np.testing.assert_allclose(baked.arrays["dfg"].sum(-1), baked.arrays["E"], rtol=1e-12)
    assert baked.arrays["E_avg"].shape == (16,)


@pytest.mark.long
def test_the_manifests_error_is_within_a_factor_3_of_the_truth():
    baked = baking.bake("ggx", ["E"], size=64)
    mu, roughness = baked.arrays["mu"], baked.arrays["roughness"]
    truth = quadrature.moments("ggx", "smith-correlated", mu, roughness[:, None] ** 2, nodes=(110, 90)).white
    actual = np.abs(baked.arrays["E"] - truth).max()
    assert actual / 3 < baked.manifest["error"]["E"]["max"] < actual * 3


@pytest.mark.slow
def test_a_stretched_layout_interpolates_within_2e_3():
    for masking in ("smith-correlated", "smith-separable", "schlick-direct", "schlick-ibl"):
        baked = baking.bake("ggx", ["E"], size=64, masking=masking, layout="stretched")
        assert baked.manifest["error"]["E"]["interpolation"] < 2e-3


@pytest.mark.sample(2)
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


@pytest.mark.parametrize("flip", [True, False])
def test_the_homeworks_split_sum_is_a_picture_too(tmp_path, flip):
    baked = tables.bake("ggx", tmp_path / "t", layout="homework", lut=["dfg"], resolution=8, flip=flip, store="1-E")
    assert {file.name for file in (tmp_path / "t").iterdir()} >= {"dfg.png", "tables.npz"}
    expected = np.round(baked.arrays["dfg"][:: -1 if flip else 1] * 255)
    picture = read_png(tmp_path / "t" / "dfg.png")
    np.testing.assert_array_equal(picture[..., :2], expected)
    assert not picture[..., 2].any()


def test_a_folder_reads_back_what_was_written(tmp_path):
    baked = tables.bake("beckmann", tmp_path / "t", resolution=8)
    found = baked_files.load(tmp_path / "t")
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
    assert glass.arrays["E"].shape == (8, 8, 3)


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["linear", "stretched"])
def test_two_widths_add_the_azimuth_as_an_axis(layout):
    baked = baking.bake("beckmann", size=5, aspect=0.4, azimuths=3, layout=layout)
    assert baked.manifest["dims"]["E"] == ["phi", "roughness", "mu"]
    assert baked.arrays["E"].shape == (3, 5, 5)
    assert baked.arrays["dfg"].shape == (3, 5, 5, 2)
    assert set(baked.manifest["axes"]) == {"phi", "roughness", "mu"}
    phi, roughness = baked.arrays["phi"], baked.arrays["roughness"]
    mu = baked.arrays["mu"] if layout == "linear" else baked.arrays["mu"][2, 3]
    metal = go.Conductor(alpha=(roughness[3] ** 2, 0.4 * roughness[3] ** 2), ndf="beckmann", fresnel="one")
    drawn = go.albedo(metal, mu[4], phi[2], method="sampling", samples=1 << 17)
    assert baked.arrays["E"][2, 3, 4] == pytest.approx(drawn.value[0, 0], abs=5 * drawn.error[0, 0] + 1e-5)


@pytest.mark.slow
def test_two_widths_swapped_are_the_table_turned():
    wide, tall = (baking.bake("ggx", ["E", "Eavg"], size=6, aspect=a, azimuths=4) for a in (0.25, 4.0))
    np.testing.assert_allclose(wide.arrays["E"], tall.arrays["E"][::-1], atol=2e-6)
    np.testing.assert_allclose(wide.arrays["E_avg"], tall.arrays["E_avg"], atol=2e-6)


@pytest.mark.slow
def test_e_avg_of_two_widths_is_the_mean_over_all_directions():
    baked = baking.bake("ggx", ["Eavg"], size=3, aspect=0.2)
    x, w = quadrature.gauss(48)
    phi = (np.arange(180) + 0.5) / 180 * 0.5 * np.pi
    for r, found in zip(baked.arrays["roughness"], baked.arrays["E_avg"], strict=True):
        e = quadrature.moments("ggx", "smith-correlated", x, r**2, 0.2 * r**2, phi[:, None]).white
        assert found == pytest.approx(float((e @ (2 * w * x)).mean()), abs=1e-5)


@pytest.mark.slow
def test_sampled_tables_of_two_widths_agree_with_the_quadrature():
    baked = baking.bake("ggx", ["E", "Eavg"], size=8, aspect=0.3, azimuths=4, sampling=Sampling("visible", 4096))
    assert baked.manifest["error"]["E"]["max"] < 5e-3
    assert baked.manifest["error"]["E_avg"]["max"] < 2e-2


@pytest.mark.slow  # of one width: the test above
def test_a_stretched_layout_of_two_widths_interpolates_within_2e_3():
    baked = baking.bake("ggx", ["E"], size=32, aspect=0.25, layout="stretched")
    assert baked.manifest["error"]["E"]["max"] < 2e-5
    assert baked.manifest["error"]["E"]["interpolation"] < 2e-3


def test_the_error_between_nodes_is_what_a_reader_of_the_table_meets():
    axes = Axes("linear", "ggx", "smith-correlated", 24)
    baked = baking.bake("ggx", ["E"], size=24)
    rng = np.random.default_rng(4)
    row, column = rng.uniform(2.0, 23.0, 4000), rng.uniform(0.0, 23.0, 4000)
    r0, c0 = np.minimum(row.astype(int), 22), np.minimum(column.astype(int), 22)
    fr, fc = row - r0, column - c0
    e = baked.arrays["E"]
    between = (e[r0, c0] * (1 - fc) + e[r0, c0 + 1] * fc) * (1 - fr)
    between += (e[r0 + 1, c0] * (1 - fc) + e[r0 + 1, c0 + 1] * fc) * fr
    exact = quadrature.moments("ggx", "smith-correlated", *axes.at(row, column)[:2]).white
    met = np.abs(between - exact).max()
    assert met / 2 < baked.manifest["error"]["E"]["interpolation"] < met * 2


@pytest.mark.slow
def test_glass_is_baked_from_both_sides_in_two_parts():
    baked = baking.bake("ggx", ["glass"], size=6)
    root, mu, roughness = (baked.arrays[n] for n in ("sqrt_f0", "mu", "roughness"))
    eta = (1 + root[8]) / (1 - root[8])
    for side, cos in (("thin", mu[4]), ("dense", -mu[4])):
        table = baked.arrays[f"E_glass_{side}"]
        assert table.shape == (16, 6, 6, 2)
        whole = go.albedo(go.Dielectric(eta, roughness[3] ** 2), cos).value[0, 0]
        assert table[8, 3, 4].sum() == pytest.approx(whole, abs=1e-3)
        kept = go.albedo(go.Dielectric(eta, roughness[3] ** 2, transmission=False), mu[4]).value[0, 0]
        if side == "thin":
            assert table[8, 3, 4, 0] == pytest.approx(kept, abs=2e-4)


def test_any_other_material_is_baked_over_the_cosine():
    baked = baking.bake(go.KullaConty(go.Lambert((0.2, 0.5, 0.9))), size=4)
    np.testing.assert_allclose(baked.arrays["E"], [[0.2, 0.5, 0.9]] * 4, atol=1e-5)
    np.testing.assert_allclose(baked.arrays["E_avg"], [0.2, 0.5, 0.9], atol=1e-5)
    assert baked.manifest["dims"] == {"E": ["mu"], "E_avg": []}


def test_pictures_of_a_third_axis_stand_below_each_other(tmp_path):
    baked = tables.bake("ggx", tmp_path / "t", lut=("E",), resolution=8, aspect=0.5, azimuths=3)
    picture = read_png(tmp_path / "t" / "E.png")
    assert picture.shape == (24, 8, 3)
    np.testing.assert_array_equal(picture[..., 0], np.round(baked.arrays["E"].reshape(24, 8) * 255))


def test_a_picture_or_an_empty_folder_is_no_table(tmp_path):
    tables.bake("ggx", tmp_path / "t", resolution=8)
    with pytest.raises(go.InputError, match=r"'\.png' given"):
        baked_files.load(tmp_path / "t" / "E.png")
    with pytest.raises(go.InputError, match=r"no tables\.npz"):
        baked_files.load(tmp_path)


def test_every_cut_and_every_changed_byte_of_a_file_is_noticed(tmp_path):
    tables.bake("ggx", tmp_path / "t", resolution=4, lut=("E",))
    file = tmp_path / "t" / "tables.npz"
    whole, truth = file.read_bytes(), baked_files.load(file)
    rng = np.random.default_rng(2)
    noticed = 0
    for trial in range(400):
        changed = bytearray(whole)
        if trial % 4:
            changed[rng.integers(len(whole))] ^= 1 << rng.integers(8)
        else:
            del changed[rng.integers(len(whole)) :]
        file.write_bytes(changed)
        try:
            found = baked_files.load(file)
        except go.InputError as error:
            assert "damaged" in error.what or "altered" in error.what
            noticed += 1
        else:  # a date or another byte that says nothing
            assert found.manifest == truth.manifest
            assert all(np.array_equal(found.arrays[name], value) for name, value in truth.arrays.items())
    assert noticed > 300


@pytest.mark.parametrize("change", ["value", "manifest", "another", "none"])
def test_an_altered_file_is_refused(tmp_path, change):
    tables.bake("ggx", tmp_path / "t", resolution=4)
    file = tmp_path / "t" / "tables.npz"
    with np.load(file) as opened:
        arrays = dict(opened)
    if change == "value":
        arrays["E"] = arrays["E"] * 1.0001
    elif change == "manifest":
        arrays["manifest"] = np.array(str(arrays["manifest"]).replace("smith-correlated", "smith-separable"))
    elif change == "another":
        arrays["extra"] = np.ones(3)
    np.savez(file, **arrays)
    if change == "none":  # packed anew, the content is the same
        baked_files.load(file)
        return
    with pytest.raises(go.InputError, match="altered: "):
        baked_files.load(file)


@pytest.mark.sample(8)
@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"resolution": 0}, "0 x 0"),
        ({"resolution": 5000}, "5000 x 5000"),
        ({"masking": "smith"}, "unknown masking"),
        ({"method": "ggx", "samples": 0}, "0 samples"),
        ({"samples": 0}, "0 samples"),
        ({"sampler": "sobol"}, "unknown points"),
        ({"method": "sobol"}, "unknown method"),
        ({"lut": ["F"]}, "unknown table"),
        ({"layout": "polar"}, "unknown layout"),
        ({"layout": "homework", "store": "E/2"}, "unknown form 'E/2'"),
        ({"layout": "homework", "aspect": 0.5}, "homework's layout"),
        ({"layout": "homework", "lut": ["E", "glass"]}, "'glass' in the homework's layout"),
        ({"aspect": 0.0}, "alpha_y / alpha_x = 0"),
        ({"aspect": 0.5, "azimuths": 0}, "0 azimuths"),
        ({"aspect": 0.5, "lut": ["glass"]}, "anisotropic glass"),
    ],
)
def test_bad_options_are_refused_and_nothing_is_written(tmp_path, options, text):
    with pytest.raises(go.InputError, match=text):
        tables.bake("ggx", tmp_path / "t", **options)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("target", "options", "text"),
    [
        (go.Conductor(), {"masking": "smith-separable"}, "masking given for a material"),
        (go.Conductor(), {"aspect": 0.5}, "aspect given for a material"),
        (go.Conductor(), {"method": "ggx"}, "Conductor by 'ggx'"),
        (go.Conductor(), {"lut": ["dfg"]}, "split sum requested for a material"),
        (go.Conductor(), {"lut": ["glass"]}, "glass requested for a Conductor"),
        (go.Conductor(), {"layout": "homework"}, "homework's layout"),
        (go.Conductor(alpha=np.array([0.1, 0.2])), {}, "one value per ray"),
        (go.Conductor(alpha=(0.0, 0.2)), {}, "alpha_y / alpha_x = inf"),
        (go.Lambert(), {"layout": "stretched"}, "Lambert by quadrature, stretched"),
        (go.Lambert(), {"lut": ["glass"]}, "table 'glass' of Lambert"),
    ],
)
def test_what_a_material_does_not_have_is_refused(tmp_path, target, options, text):
    with pytest.raises(go.InputError, match=text):
        tables.bake(target, tmp_path / "t", resolution=4, **options)
    assert not any(tmp_path.iterdir())


def test_a_file_in_place_of_the_folder_and_a_missing_parent_are_refused(tmp_path):
    (tmp_path / "f").write_text("")
    with pytest.raises(go.InputError, match="is a file"):
        tables.bake("ggx", tmp_path / "f", resolution=4)
    with pytest.raises(go.InputError, match="does not exist"):
        tables.bake("ggx", tmp_path / "no" / "t", resolution=4)
    assert [p.name for p in tmp_path.iterdir()] == ["f"]


def test_a_folder_that_cannot_be_written_is_one_clear_error():
    with pytest.raises(go.InputError, match=r"cannot write|no permission"):
        tables.bake("ggx", "/proc/tables", resolution=4)


@pytest.mark.slow
def test_a_public_solutions_pictures_agree_with_the_exact_table(shared):
    reference = shared / "reference" / "kulla-conty"
    centres = (np.arange(128) + 0.5) / 128
    mu, roughness = np.meshgrid(centres, centres)
    exact = quadrature.moments("ggx", "schlick-ibl", mu, roughness**2).white[::-1]
    picture = read_png(reference / "homework_E_importance_sampled.png")[..., 0] / 255.0
    rough = roughness[::-1] >= 0.3
    assert np.sqrt(np.mean((picture - exact)[rough] ** 2)) < 0.004
    average = read_png(reference / "homework_Eavg.png")[:, 0, 0] / 255.0
    ours = quadrature.average("ggx", "schlick-ibl", centres**2)[::-1]
    assert np.abs(average - ours)[centres[::-1] >= 0.3].max() < 0.007


@pytest.mark.slow
def test_the_homeworks_pictures_follow_half_of_alpha_and_not_its_text(shared):
    """The table of docs/energy.md, in grey levels of 255; values are rounded down, as theirs are."""
    reference, centres = shared / "reference" / "kulla-conty", (np.arange(128) + 0.5) / 128
    mu, roughness = np.meshgrid(centres, centres)
    picture = read_png(reference / "homework_E_importance_sampled.png")[..., 0].astype(float)
    average = read_png(reference / "homework_Eavg.png")[:, 0, 0].astype(float)
    table = (ROOT / "docs/energy.md").read_text(encoding="utf-8")
    for masking in ("schlick-ibl", "schlick-direct", "smith-correlated"):
        error = picture - np.floor(255 * quadrature.moments("ggx", masking, mu, roughness**2).white[::-1])
        error_avg = average - np.floor(255 * quadrature.average("ggx", masking, centres**2)[::-1])
        rms, rms_avg = (np.sqrt(np.mean(part**2)) for part in (error, error_avg))
        row = [text.strip() for text in table.partition(f"\n| `{masking}`")[2].partition("\n")[0].split("|")[1:4]]
        assert row == [f"{rms:.2g}", f"{np.abs(error).max():.0f}", f"{rms_avg:.2g}"]


def test_the_command_for_the_homeworks_pictures_gives_them(shared, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for page in ("docs/energy.md", "src/gonio/cli/verbs/bake.py"):
        named = re.findall(r"^ +gonio bake --preset (homework-\w+) -o", (ROOT / page).read_text(), re.MULTILINE)
        assert named == ["homework-text", "homework-figure"]
    commands = ["bake ggx --layout homework --masking schlick-ibl -o figure"]
    with pytest.raises(SystemExit) as ended:
        cli.main(commands[0].split())
    assert not ended.value.code
    picture = read_png(shared / "reference" / "kulla-conty" / "homework_E_importance_sampled.png")[..., 0].astype(float)
    found = read_png(tmp_path / commands[0].split()[-1] / "E.png")[..., 0]
    assert np.sqrt(np.mean((picture - found) ** 2)) < 1.0  # 0.8: Gonio rounds to the nearest
