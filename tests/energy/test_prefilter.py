"""Environments blurred for the split sum: against brute force, by laws that a blur keeps, and with errors as stated."""

from __future__ import annotations

import json

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.energy.tables import prefilter
from gonio.energy.tables.baked import load
from gonio.pictures import images
from scipy.ndimage import map_coordinates

HEIGHT, WIDTH = 64, 128


def directions(height, width):
    """Texel centres of a latitude-longitude map, z up, row 0 toward +z; and their solid angles."""
    theta = (np.arange(height)[:, None] + 0.5) / height * np.pi
    phi = (np.arange(width)[None] + 0.5) / width * 2 * np.pi
    w = np.stack(np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)), -1)
    edges = np.cos(np.arange(height + 1) / height * np.pi)
    return w, np.broadcast_to((edges[:-1] - edges[1:])[:, None] * 2 * np.pi / width, (height, width))


def environment(height=HEIGHT):
    """A lamp off the axes, a ring of light about x, and a gradient, in three colours."""
    w, _ = directions(height, 2 * height)
    lamp = np.exp(-40.0 * (1.0 - w @ np.array([0.48, 0.6, 0.64])))
    return np.stack([0.2 + 5.0 * lamp, 0.5 + 0.4 * np.sin(3.0 * np.arccos(w[..., 0])), 1.0 + 0.6 * w[..., 2]], -1)


def between(light, parts):
    """The map as renderers read it, at parts x parts places a texel: linear, round in azimuth, held at the poles."""
    round_ = np.concatenate([light[:, -1:], light, light[:, :1]], axis=1)
    rows, columns = [(np.arange(n * parts) + 0.5) / parts - 0.5 for n in light.shape[:2]]
    places = np.meshgrid(np.clip(rows, 0, light.shape[0] - 1), columns + 1.0, indexing="ij")
    return np.stack([map_coordinates(round_[..., c], places, order=1) for c in range(light.shape[2])], -1)


DENSITIES = {
    "ggx": lambda c2, a: a**2 / (c2 * (a**2 - 1.0) + 1.0) ** 2,
    "beckmann": lambda c2, a: np.exp((1.0 - 1.0 / c2) / a**2) / c2**2,
}


def by_brute_force(light, n, alpha, ndf="ggx", parts=8):
    """int L i.n D(h) di / int i.n D(h) di at o = n over every texel, divided (Karis2013)."""
    w, solid = directions(parts * light.shape[0], parts * light.shape[1])
    cos = w @ n
    density = DENSITIES[ndf](np.maximum(0.5 + 0.5 * cos, 1e-12), alpha)
    weight = np.where(cos > 0.0, cos * density * solid, 0.0)
    return (between(light, parts) * weight[..., None]).sum((0, 1)) / weight.sum()


@pytest.mark.slow
@pytest.mark.parametrize("ndf", DENSITIES)
def test_every_level_agrees_with_brute_force(ndf):
    light = environment()
    levels = prefilter.prefilter(light, ndf, 5)
    assert [level.shape for level in levels] == [(64, 128, 3), (32, 64, 3), (16, 32, 3), (8, 16, 3), (4, 8, 3)]
    np.testing.assert_array_equal(levels[0], light)
    for index, level in enumerate(levels[1:], 1):
        n = directions(*level.shape[:2])[0].reshape(-1, 3)
        some = np.unique([0, len(n) - 1, int(np.argmax(level[..., 0])), *range(3, len(n), max(1, len(n) // 6))])
        exact = np.stack([by_brute_force(light, n[i], (index / 4) ** 2, ndf) for i in some])
        np.testing.assert_allclose(level.reshape(-1, 3)[some], exact, rtol=2e-3, err_msg=f"level {index}")


def test_every_distribution_blurs_by_its_own_tail():
    light = environment()
    spread = {name: prefilter.prefilter(light, name, 4)[1][..., 0].std() for name in go.optics.ndf.distributions()}
    assert spread["ggx"] < spread["student-t"] < spread["beckmann"], spread  # the longer the tail the flatter


@pytest.mark.parametrize("height", [16, 50, 64])
def test_a_constant_environment_stays_constant(height):
    for level in prefilter.prefilter(np.full((height, 2 * height, 3), 0.7), levels=4):
        np.testing.assert_allclose(level, 0.7, rtol=1e-12)


def test_a_blur_keeps_the_mean_and_a_sun_leaves_nothing_below_zero():
    """The kernel is the same either way between two directions, so the mean over the sphere stays."""
    light = np.full((128, 256, 1), 0.1)
    light[40, 17] = 1e5  # a sun of one texel
    means = []
    for level in prefilter.prefilter(light, levels=6):
        assert level.min() >= 0.0
        means.append(float((level[..., 0] * directions(*level.shape[:2])[1]).sum()))
    # what is left is the sum over the coarser texels of the level
    np.testing.assert_allclose(means[1:4], means[0], rtol=2e-3)


def test_levels_know_up_from_down_and_left_from_right():
    for axis in ((0, 0, 1), (0, 0, -1), (1, 0, 0), (0, 1, 0), (0, -1, 0)):
        w, _ = directions(HEIGHT, WIDTH)
        for level in prefilter.prefilter(np.maximum(w @ np.array(axis), 0.0)[..., None], levels=4):
            n, _ = directions(*level.shape[:2])
            assert n.reshape(-1, 3)[np.argmax(level)] @ np.array(axis) > 0.8
            # as a screen has it, reading is the same thing
            places = np.array([axis, [0.6, 0.0, 0.8]], float)
            assert prefilter.read(level, places)[0, 0] >= prefilter.read(level, places)[1, 0] - 1e-9 or axis[2] == 1


@pytest.mark.slow
def test_the_errors_are_as_stated():
    baked = prefilter.bake(environment(), levels=4)
    for index in (1, 2, 3):
        level, stated = baked.arrays[f"level_{index}"].astype(float), baked.manifest["error"][f"level_{index}"]
        n = directions(*level.shape[:2])[0].reshape(-1, 3)
        some = np.random.default_rng(index).choice(len(n), 8, replace=False)
        exact = np.stack([by_brute_force(environment(), n[i], (index / 3) ** 2) for i in some])
        found = np.abs(level.reshape(-1, 3)[some] - exact).max() / np.sqrt(np.mean(exact**2))
        assert found < 3.0 * stated["max"] + 1e-6  # single precision
        assert stated["rms"] <= stated["max"] < 2e-3


@pytest.mark.slow
def test_a_wrong_level_is_told():
    levels = prefilter.prefilter(environment(), levels=3)
    levels[2] = 1.05 * levels[2]
    stated = prefilter.errors(levels, "ggx", "smith-correlated")
    assert stated["level_1"]["max"] < 2e-3
    assert stated["level_2"]["rms"] == pytest.approx(0.05, rel=0.02)


@pytest.mark.parametrize("alpha", [0.1, 0.6])
def test_the_split_sum_is_judged_by_the_metal_itself(alpha):
    """int L f cos di with `eval` of a white metal, in a frame of its own."""
    light = environment(32)
    o, n, t = np.array([0.36, 0.48, 0.8]), np.array([0.0, 0.8, 0.6]), np.array([1.0, 0.0, 0.0])
    frame = np.stack([t, np.cross(n, t), n])
    w, solid = [array.reshape(-1, array.shape[-1]) for array in directions(256, 512)]
    metal = go.Conductor(alpha=alpha, fresnel="one", masking="smith-separable")
    value = metal.eval(np.broadcast_to(frame @ o, w.shape), w @ frame.T, precision="float64")
    exact = (value * solid.reshape(-1, 1) * between(light, 8).reshape(-1, 3)).sum(0)
    ggx = go.optics.ndf.distribution("ggx")
    found = prefilter.EveryTexel(light, alpha).reflected(ggx, "smith-separable", o, n)
    np.testing.assert_allclose(found, exact, rtol=5e-3)


@pytest.mark.slow
def test_the_split_sum_is_exact_under_even_light_and_worse_the_rougher():
    even = prefilter.bake(np.full((32, 64, 3), 2.0), levels=3).manifest["error"]
    assert max(even[name]["split sum"] for name in ("level_1", "level_2")) < 5e-3
    stated = prefilter.bake(environment(), levels=4).manifest["error"]
    figures = [stated[f"level_{index}"]["split sum"] for index in (1, 2, 3)]
    assert 0.01 < figures[0] < figures[1] < figures[2] < 1.0


# --------------------------------------------------------------------------- as a verb


@pytest.fixture
def sky(tmp_path):
    path = tmp_path / "sky.exr"
    images.write(path, environment(16).astype(np.float32))
    return path


@pytest.mark.slow
def test_baked_levels_are_written_read_back_and_drawn(sky, tmp_path, capsys):
    folder = tmp_path / "levels"
    words = ["bake", str(sky), "--lut", "prefiltered", "--levels", "3", "--ndf", "beckmann", "-o", str(folder)]
    assert cli.run([*words, "--json"]) == 0
    manifest = json.loads(capsys.readouterr().out)
    assert manifest["ndf"] == "beckmann" and manifest["target"] == "sky.exr"
    assert [level["roughness"] for level in manifest["levels"]] == [0.0, 0.5, 1.0]
    assert sorted(p.name for p in folder.iterdir()) == sorted(manifest["files"])
    assert cli.run(["info", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["hash"] == manifest["hash"]
    assert cli.run(["info", str(folder)]) == 0
    text = capsys.readouterr().out
    assert "split sum" in text and "8 theta x 16 phi x 3" in text
    baked = load(folder)
    for name in ("level_0", "level_1", "level_2"):
        picture = images.read(folder / f"{name}.exr")
        np.testing.assert_array_equal(picture.pixels, baked.arrays[name])
        assert picture.metadata["ndf"] == "beckmann"
    expected = prefilter.prefilter(images.read(sky).pixels, "beckmann", 3)[2]
    np.testing.assert_allclose(baked.arrays["level_2"], expected, rtol=1e-6)
    assert cli.run(["plot", str(folder), "-o", str(tmp_path / "levels.png")]) == 0
    assert (tmp_path / "levels.png").stat().st_size > 1000


def test_python_bakes_the_same(sky):
    baked = go.bake(sky, levels=2)
    assert list(baked.arrays) == ["level_0", "level_1"] and baked.manifest["ndf"] == "ggx"


BAD = {
    "square": (np.ones((8, 8, 3)), "twice as wide as high"),
    "negative": (-np.ones((8, 16, 3)), "384 values are negative"),
    "infinite": (np.full((8, 16, 3), np.inf), "not finite"),
    "small": (np.ones((2, 4, 3)), "expected 4 to"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_map_is_refused_by_its_name(tmp_path, capsys, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    pixels, says = BAD[name]
    np.savez(tmp_path / "map.npz", radiance=pixels)
    assert cli.run(["bake", "map.npz", "--lut", "prefiltered", "-o", "out"]) == 2
    error = capsys.readouterr().err
    assert says in error and "map.npz" in error
    assert sorted(p.name for p in tmp_path.iterdir()) == ["map.npz"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["missing.exr"], "No such file"),
        (["ggx"], "give an environment"),
        (["sky.exr", "--levels", "1"], "give 2 to"),
        (["sky.exr", "--levels", "0"], "give 2 to"),
        (["sky.exr", "--levels", "6"], "fewer --levels"),
        (["sky.exr", "--ndf", "gxx"], "ggx"),
        (["sky.exr", "--masking", "x"], "masking"),
        (["sky.exr", "--lut", "E"], "prefiltered"),
        (["sky.exr", "--resolution", "64"], "--resolution 64 does not apply to"),
        (["sky.exr", "-o", "no/folder"], "does not exist"),
        (["screen.png"], "clipped at white"),
        (["ggx", "--lut", "E", "--levels", "3"], "--levels 3 does not apply to"),
    ],
)
def test_bad_words_exit_with_2_and_write_nothing(sky, tmp_path, capsys, monkeypatch, words, says):
    monkeypatch.chdir(tmp_path)
    images.write("screen.png", environment(16).astype(np.float32))
    before = sorted(p.name for p in tmp_path.iterdir())
    lut = [] if "--lut" in words else ["--lut", "prefiltered"]
    assert cli.run(["bake", *words, *lut, *([] if "-o" in words else ["-o", "out"])]) == 2
    assert says in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == before
