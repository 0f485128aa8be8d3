"""The virtual gonioreflectometer: energy, theory, standard errors, formats."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.errors import InputError
from gonio.instruments.goniometer.plan import axis_of, beside_lamp, between
from gonio.instruments.goniometer.readings import SMALLEST, Rough, Tracing, gathered, projected
from gonio.instruments.goniometer.run import DETECTOR, facet_of, surface_of
from gonio.instruments.goniometer.specimen import Model
from gonio.measure import compare, read
from gonio.measure.report import describe
from gonio.measure.tables.angles import pairs
from gonio.measure.tables.base import Measurement
from gonio.measure.tables.half_difference import HalfDifference, centres
from gonio.measure.tables.samples import Samples
from gonio.pictures import images

SMALL = "gaussian:squares=64"
VIEWS = [0.0, 20.0, 40.0, 60.0, 75.0]


def values(table: Measurement) -> np.ndarray:
    return vars(table)["values"]


# ---------------------------------------------------------------------- light is counted


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "surface", ["gaussian:alpha=1,squares=64", "vgroove:sigma=.6", "spheres:coverage=.1", "heights.exr"]
)
def test_mirrors_return_all_light_from_any_side(surface: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # a small period with high walls: light leaves it sideways most of the time
    rough = np.random.default_rng(1).standard_normal((16, 16, 1)).repeat(3, axis=2)
    images.write("heights.exr", rough.astype(np.float32))
    found = go.measure(
        surface=surface, theta_i=[0.0, 60.0, 88.0], theta_r=VIEWS, phi=[0.0, 180.0], samples=1 << 15, patches=8
    )
    for first, later, lost in zip(found.first, found.later, found.lost, strict=True):
        assert first + later == pytest.approx(1.0, abs=2e-3)
        assert lost < 2e-3 and 0.0 < later < 1.0


@pytest.mark.slow
def test_a_turned_start_of_the_period_changes_nothing() -> None:
    heights = np.random.default_rng(4).standard_normal((24, 24))
    found = []
    for shift in (0, 11):
        rough = Rough(_Map(np.roll(heights, shift, (0, 1))), go.Mirror(), DETECTOR, Tracing(1 << 16, 8, 1))
        rough.prepare(np.radians([80.0]))
        found.append(rough.first[0, 0])
    assert found[0] == pytest.approx(found[1], abs=5e-3)
    assert found[0] < 0.9  # it is rough, and light is low


class _Map:
    """A surface of some heights."""

    random = False

    def __init__(self, heights: np.ndarray) -> None:
        self.heights = heights

    def patch(self, rng: np.random.Generator) -> object:
        from gonio.instruments.surfaces.base import of_heights

        return of_heights(self.heights)


@pytest.mark.slow
def test_a_facet_s_albedo_counts_at_every_bounce() -> None:
    kept = {}
    for albedo in (1.0, 0.5):
        found = go.measure(
            surface="vgroove:slope=1",
            facet=go.Mirror(albedo=albedo),
            theta_i=[0.0],
            theta_r=[0.0],
            phi=[0.0],
            samples=1 << 15,
        )
        kept[albedo] = np.array([found.first[0], found.later[0]])
    assert kept[0.5][0] == pytest.approx(0.5 * kept[1.0][0], rel=1e-5)
    assert kept[0.5][1] < 0.26 * kept[1.0][1]  # two bounces or more


def test_projected_solid_angles_sum_to_pi() -> None:
    assert 2.0 * projected(40).sum() == pytest.approx(np.pi, rel=1e-3)


def test_the_detector_s_cone_has_its_size() -> None:
    side, half = 60, np.radians(6.0)
    solid = projected(side)
    _, cone = gathered(np.zeros((1, side, 2 * side), np.float32), solid, half)
    middle = cone.reshape(side, 2 * side)[0, side]
    assert middle == pytest.approx(np.pi * np.sin(half) ** 2, rel=0.05)


# ---------------------------------------------------------------------- against closed forms


def test_a_flat_lambertian_surface_is_lambert_and_errors_are_honest() -> None:
    found = go.measure(
        surface="gaussian:alpha=0,squares=16", facet="lambert:albedo=.8", theta_i=[0.0, 45.0], theta_r=VIEWS,
        phi=[0.0, 90.0, 180.0], samples=1 << 18, solid_angle=0.02,
    )  # fmt: skip
    f, error = values(found.table), found.table.beside["error"]
    assert f.mean() == pytest.approx(0.8 / np.pi, rel=0.01)
    off = ((f - 0.8 / np.pi) / error)[..., 0]
    assert 0.6 < np.sqrt(np.mean(off[:, 1:] ** 2)) < 1.8  # Student's t of 7 degrees of freedom: 1.18
    assert np.array_equal(f, found.table.beside["first"])


@pytest.mark.slow
def test_the_first_bounce_of_a_gaussian_surface_is_beckmann_s() -> None:
    lights, azimuths = [0.0, 30.0, 60.0], [0.0, 90.0, 180.0]
    found = go.measure(
        surface="gaussian:alpha=.3,squares=256",
        theta_i=lights,
        theta_r=VIEWS,
        phi=azimuths,
        samples=1 << 18,
        solid_angle=0.02,
    )
    theory = Model(go.Conductor(alpha=0.3, ndf="beckmann", fresnel="one"), 0.02)
    axes = [np.radians(axis) for axis in (lights, VIEWS, azimuths)]
    cos = np.cos(axes[1])[:, None]
    off = found.table.beside["first"][..., 0] * cos - theory.f(*pairs(*axes))[:, 0].reshape(3, 5, 3) * cos
    peak = (theory.f(*pairs(*axes))[:, 0].reshape(3, 5, 3) * cos).max(axis=(1, 2))
    assert np.all(np.abs(off).max(axis=(1, 2)) < 0.06 * peak)
    assert np.all(np.sqrt(np.mean(off**2, axis=(1, 2))) < 0.025 * peak)


@pytest.mark.slow
def test_the_first_bounce_is_beckmann_s_within_three_percent() -> None:
    lights, views, azimuths = [0.0, 30.0, 60.0], np.arange(0.0, 88.0, 2.5), np.arange(0.0, 181.0, 15.0)
    found = go.measure(
        surface="gaussian:alpha=.3", theta_i=lights, theta_r=views, phi=azimuths, samples=4_000_000, patches=96
    )
    model = go.Conductor(alpha=0.3, ndf="beckmann", fresnel="one")
    axes = [np.radians(axis) for axis in (lights, views, azimuths)]
    cos = np.cos(axes[1])[:, None]
    theory = Model(model, DETECTOR).f(*pairs(*axes))[:, 0].reshape(*map(len, axes)) * cos
    off = np.abs(found.table.beside["first"][..., 0] * cos - theory)
    assert np.all(off.max(axis=(1, 2)) < 0.03 * theory.max(axis=(1, 2)))
    assert np.allclose(np.add(found.first, found.later), 1.0, atol=2e-3)


@pytest.mark.slow
def test_one_bounce_among_grooves_is_oren_and_nayar_s() -> None:
    albedo, sigma, light = 0.8, 0.5, np.radians(30.0)
    views, azimuths = np.arange(10.0, 71.0, 10.0), [0.0, 60.0, 120.0, 180.0]
    found = go.measure(
        surface=f"vgroove:sigma={sigma}", facet=f"lambert:albedo={albedo}", theta_i=[30.0], theta_r=views,
        phi=azimuths, samples=4_000_000,
    )  # fmt: skip
    r, phi = np.meshgrid(np.radians(views), np.radians(azimuths), indexing="ij")
    a, b, c, s2 = np.maximum(light, r), np.minimum(light, r), np.cos(phi), sigma**2  # OrenNayar1994, sec. 4.3
    c1 = 1.0 - 0.5 * s2 / (s2 + 0.33)
    c2 = 0.45 * s2 / (s2 + 0.09) * np.where(c >= 0.0, np.sin(a), np.sin(a) - (2.0 * b / np.pi) ** 3)
    c3 = 0.125 * s2 / (s2 + 0.09) * (4.0 * a * b / np.pi**2) ** 2
    theory = albedo / np.pi * (c1 + c * c2 * np.tan(b) + (1.0 - np.abs(c)) * c3 * np.tan(0.5 * (a + b)))
    off = found.table.beside["first"][0, ..., 0] / theory - 1.0
    assert abs(off.mean()) < 0.02 and np.abs(off).max() < 0.06


# ---------------------------------------------------------------------- the same again


@pytest.mark.slow
def test_a_seed_gives_the_same_values_and_another_others() -> None:
    def found(seed: int) -> np.ndarray:
        return values(
            go.measure(
                surface=SMALL, theta_i=[40.0], theta_r=VIEWS, phi=[180.0], samples=8192, patches=8, seed=seed
            ).table
        )

    assert np.array_equal(found(1), found(1)) and not np.array_equal(found(1), found(2))


# ---------------------------------------------------------------------- models as any file


@pytest.mark.sample(1)
@pytest.mark.parametrize("suffix", [".bsdf", ".astm", ".zbsdf"])
def test_a_measured_table_is_what_convert_writes(suffix: str, tmp_path: Path) -> None:
    go.measure(go.Measured("sample"), tmp_path / f"a{suffix}")
    compare.convert("sample", tmp_path / f"b{suffix}")
    a, b = (read(tmp_path / f"{name}{suffix}") for name in "ab")
    assert np.array_equal(values(a), values(b))


@pytest.mark.slow
def test_a_model_s_cells_hold_its_values_at_their_middles(tmp_path: Path) -> None:
    gold = go.Conductor.preset("Au", alpha=0.2)
    found = go.measure(gold, tmp_path / "gold.binary")
    table = read(tmp_path / "gold.binary")
    assert isinstance(table, HalfDifference) and found.error is None and found.cells == 90 * 90 * 180
    wo, wi = centres((90, 90, 180))
    some = np.random.default_rng(1).choice(np.flatnonzero(np.minimum(wo[:, 2], wi[:, 2]) > 1e-3), 5000)
    exact = gold.f(wo[some], wi[some], precision="float64")
    assert np.allclose(table.values.reshape(-1, 3)[some], exact, rtol=1e-9, atol=1e-12)


@pytest.mark.slow
def test_what_a_table_of_one_value_for_both_orders_loses_is_said(tmp_path: Path) -> None:
    def notes(material: str, name: str) -> str:
        return " ".join(go.measure(material, tmp_path / name).notes)

    assert "swapping the two directions changes f by" in notes("phong", "a.binary")
    assert "swapping" not in notes("phong", "a.gonio") + notes("oren-nayar", "b.binary")
    assert "also transmits" in notes("dielectric", "d.gonio") and "transmits" not in notes("phong", "a.gonio")


def test_noise_is_as_large_as_asked_and_its_error_is_known() -> None:
    plain, noisy = (go.measure("lambert", table="samples", noise=noise) for noise in (0.0, 0.05))
    off = values(noisy.table) / values(plain.table) - 1.0
    assert off.std() == pytest.approx(0.05, rel=0.05) and abs(off.mean()) < 2e-3
    assert noisy.error == pytest.approx(0.05, rel=0.1)
    assert "error" not in plain.table.beside


def test_a_detector_sees_the_mean_over_its_cone() -> None:
    gold, wide = go.Conductor(alpha=0.2), 0.05
    wo, wi = np.array([[0.0, 0.6, 0.8]]), np.array([[0.0, -0.6, 0.8]])
    rng = np.random.default_rng(1)
    cos = 1.0 - rng.random(40_000) * wide / (2.0 * np.pi)
    phi, sin = rng.random(40_000) * 2.0 * np.pi, np.sqrt(1.0 - cos * cos)
    x, y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.8, -0.6])
    seen = np.outer(sin * np.cos(phi), x) + np.outer(sin * np.sin(phi), y) + np.outer(cos, wo[0])
    brute = np.average(gold.f(seen, wi, precision="float64")[:, 0], weights=seen[:, 2])
    assert Model(gold, wide).f(wo, wi)[0, 0] == pytest.approx(brute, rel=5e-3)
    assert Model(gold, None).f(wo, wi)[0, 0] > 1.05 * brute


# ---------------------------------------------------------------------- where the detector cannot stand


@pytest.mark.slow
def test_cells_behind_the_lamp_are_invalid_or_left_out(tmp_path: Path) -> None:
    go.measure("lambert", tmp_path / "a.binary", blocked=10.0)
    table = read(tmp_path / "a.binary")
    assert isinstance(table, HalfDifference)
    assert np.all(table.values[:, :5] < 0.0) and np.any(table.values[:, 5] > 0.0)  # theta_d below 5 degrees
    found = go.measure("lambert", tmp_path / "a.brdf", blocked=10.0)
    samples = read(tmp_path / "a.brdf")
    assert isinstance(samples, Samples) and found.blocked > 0.0
    assert between(*samples.pairs()).min() >= np.radians(10.0) - 1e-9


def test_tables_without_gaps_hold_the_value_of_the_rim() -> None:
    model = go.Conductor(alpha=0.1)
    found = go.measure(model, blocked=20.0, theta_i=[0.0, 30.0], theta_r=[0.0, 5.0, 30.0, 60.0], phi=[0.0, 180.0])
    f = values(found.table)[..., 0]
    rim = model.f([np.sin(np.radians(20.0)), 0.0, np.cos(np.radians(20.0))], [0.0, 0.0, 1.0], precision="float64")
    assert f[0, 1, 0] == pytest.approx(rim[0, 0], rel=1e-6)
    assert any("--blocked angle" in note for note in found.notes)


def test_a_blocked_direction_moves_to_the_rim_and_stays_above() -> None:
    rng = np.random.default_rng(1)
    wi = rng.standard_normal((500, 3))
    wi[:, 2] = np.abs(wi[:, 2]) + 0.05
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    moved = beside_lamp(wi.copy(), wi, np.radians(15.0))
    assert np.allclose(between(moved, wi), np.radians(15.0)) and moved[:, 2].min() > 0.0
    assert np.array_equal(beside_lamp(wi, wi, 0.0), wi)


# ---------------------------------------------------------------------- files


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".gonio", ".bsdf", ".brdf"])
def test_a_surface_is_written_in_any_format(suffix: str, tmp_path: Path) -> None:
    found = go.measure(
        surface=SMALL, facet="conductor:Au", output=tmp_path / f"a{suffix}", samples=4096, patches=8, solid_angle=0.05
    )
    table = read(tmp_path / f"a{suffix}")
    red, _, blue = go.Measured(str(tmp_path / f"a{suffix}")).eval([0.0, 0.0, 1.0], [0.1, 0.0, 0.995])[0]
    assert red > 1.5 * blue > 0.0  # gold
    kept = suffix == ".gonio"
    assert ("error" in table.beside) == ("first" in table.beside) == kept
    assert kept or any("no place for standard errors" in note for note in found.notes)


@pytest.mark.slow
def test_gonio_files_keep_errors_and_info_tells_of_them(tmp_path: Path) -> None:
    path = tmp_path / "a.gonio"
    found = go.measure("lambert", path, table="samples", noise=0.1)
    table = read(path)
    assert np.allclose(table.beside["error"], found.table.beside["error"], rtol=1e-6)
    assert describe(path)["error"] == pytest.approx(found.error, rel=1e-3)
    compare.convert(path, tmp_path / "b.gonio")
    assert np.array_equal(read(tmp_path / "b.gonio").beside["error"], table.beside["error"])


def test_errors_of_another_shape_are_refused(tmp_path: Path) -> None:
    made = go.measure("lambert", table="samples", noise=0.1).table
    made.beside["error"] = made.beside["error"][1:]
    from gonio.measure.formats.own import Own

    with pytest.raises(InputError, match="error has shape"):
        Own().read(Own().write(made), "a.gonio")


def test_few_angles_are_measured_each_and_many_on_a_grid() -> None:
    few = go.measure(surface=SMALL, theta_i=[7.0, 50.0], theta_r=[0.0, 30.0], phi=[0.0], samples=1024, solid_angle=0.05)
    assert few.incidence == pytest.approx((7.0, 50.0))
    many = Rough(surface_of(SMALL), go.Mirror(), 0.05, Tracing(1024, 8, 1))
    many.prepare(np.linspace(0.0, 0.5 * np.pi, 1000))
    assert 10 < len(many.lights) < 20 and many.lights[-1] == pytest.approx(np.radians(89.0))


@pytest.mark.slow
def test_later_bounces_alone_can_be_measured() -> None:
    asked = {
        "surface": "vgroove:slope=.9",
        "theta_i": [0.0],
        "theta_r": VIEWS,
        "phi": [90.0, 180.0],
        "samples": 1 << 14,
    }
    every, first, later = (go.measure(bounces=bounces, **asked) for bounces in ("all", "first", "later"))
    assert np.allclose(values(every.table), values(first.table) + values(later.table), rtol=1e-4, atol=1e-6)
    assert np.allclose(values(first.table), every.table.beside["first"])


def test_the_command_measures_and_says_so_in_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a.gonio"
    arguments = "measure --surface gaussian -p squares=32 -p alpha=.2 --facet conductor:Au --theta-i 0,30"
    arguments += f" --samples 2000 -o {out}"
    for extra in ([], ["--json"]):
        with pytest.raises(SystemExit) as caught:
            cli.main([*arguments.split(), *extra])
        assert caught.value.code == 0
        said = capsys.readouterr().out
    about = json.loads(said)
    assert (
        about["output"] == str(out) and about["kind"] == "angles" and about["incidence"] == pytest.approx([0.0, 30.0])
    )
    assert about["title"] == "gaussian(alpha=0.2,squares=32) of conductor:Au"
    assert read(out).source["facet"].startswith("conductor(eta=")
    assert read(out).shape["theta_i"] == 2


# ---------------------------------------------------------------------- what is refused


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({}, "nothing to measure"),
        ({"material": "lambert", "surface": SMALL}, "a material and a surface"),
        ({"material": "lambertt"}, "unknown material"),
        ({"material": "mirror"}, "a delta lobe"),
        ({"material": "conductor(alpha=(.1,.4))"}, "anisotropic"),
        ({"material": "lambert", "bounces": "first"}, "bounces of a material"),
        ({"material": "lambert", "noise": -0.1}, "0 to 1 expected"),
        ({"material": "lambert", "blocked": 90.0}, "0 to 60 expected"),
        ({"material": "lambert", "table": "sphere"}, "unknown kind of table"),
        ({"material": "lambert", "theta_i": []}, "no angles"),
        ({"material": "lambert", "theta_r": [95.0]}, "0 to 89.95 expected"),
        ({"material": "lambert", "phi": [float("inf")]}, "0 to 180 expected"),
        ({"material": "lambert", "theta_i": [10.0], "output": "a.binary"}, "its own directions"),
        ({"material": "lambert", "table": "samples", "output": "a.binary"}, "hold tables of kind half-difference"),
        ({"material": "lambert", "output": "a.npz"}, "cannot be written"),
        ({"material": "lambert", "output": "a.tif"}, "not a measurement format"),
        ({"surface": SMALL, "solid_angle": 0.0}, "more than 0"),
        ({"surface": SMALL, "solid_angle": -1.0}, "more than 0"),
        ({"surface": SMALL, "solid_angle": 1e-9}, "half angle"),
        ({"surface": SMALL, "solid_angle": 1e-4, "table": "half-difference"}, "GB"),
        ({"surface": SMALL, "facet": "mirrror"}, "unknown material"),
        ({"surface": SMALL, "facet": "dielectric"}, "transmits light"),
        ({"surface": SMALL, "facet": "conductor(alpha=(.1,.4))"}, "anisotropic"),
        ({"surface": SMALL, "samples": 1}, "1000 to"),
        ({"surface": SMALL, "samples": 1 << 30, "theta_i": [0.0]}, "67108864 rays on each patch"),
        ({"surface": 5}, "a surface expected"),
        ({"surface": SMALL, "seed": -1}, "0 to"),
        ({"surface": SMALL, "bounces": "third"}, "all, first, later expected"),
    ],
)
def test_what_cannot_be_measured_is_refused(
    options: dict, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=says):
        go.measure(**options)
    assert list(tmp_path.iterdir()) == []


def test_angles_are_listed_or_stepped() -> None:
    assert axis_of("0,30,60", "theta_i") == [0.0, 30.0, 60.0]
    assert axis_of("0:85:5", "theta_i") == pytest.approx(np.arange(0.0, 86.0, 5.0))
    assert axis_of("10:0:5", "theta_i") == [] and axis_of(None, "theta_i") is None
    for text in ("a", "0:10", "0:10:0", "0:10:-1", "0:nan:1", "0:1e30:1e-9"):
        with pytest.raises(InputError, match="angles expected"):
            axis_of(text, "theta_i")


def test_facets_are_smooth_where_nothing_else_is_said() -> None:
    assert facet_of("conductor:Au") == go.Conductor.preset("Au", alpha=0.0)
    assert facet_of("conductor:Au,alpha=.3") == go.Conductor.preset("Au", alpha=0.3)
    assert facet_of("lambert:albedo=.8") == go.Lambert(0.8)
    assert facet_of("lambert:albedo=.8,.5,.2") == go.Lambert((0.8, 0.5, 0.2))
    assert facet_of("mirror") == go.Mirror()
    assert facet_of("ward").alpha == go.models()["ward"]().alpha  # which cannot be smooth
    compensated = facet_of("kulla-conty(base=conductor(alpha=.2,preset=Au))")
    assert compensated == go.KullaConty(go.Conductor.preset("Au", alpha=0.2))
    assert facet_of("alum-bronze") == go.material("alum-bronze")


def test_the_smallest_detector_is_said() -> None:
    with pytest.raises(InputError, match="half angle") as caught:
        Rough(surface_of(SMALL), go.Mirror(), 1e-7, Tracing(1000, 8, 1))
    least = 2.0 * np.pi * (1.0 - np.cos(np.radians(SMALLEST)))
    assert f"{least:.2g}" in str(caught.value.hint)
