"""Files of measured materials: what is written is read back, and what is damaged is one error."""

from __future__ import annotations

import io
import pickle
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.measure import SAMPLE, compare, read, report
from gonio.measure.formats import networks, npz, rgl
from gonio.measure.formats.base import Format
from gonio.measure.formats.merl import SCALE
from gonio.measure.formats.npz import written
from gonio.measure.formats.own import Own
from gonio.measure.tables import angles, half_difference, samples
from gonio.measure.tables.base import Measurement
from gonio.ops import Direction, Spectrum

pytestmark = pytest.mark.long  # the files that it reads are made first


class Stand(Measurement):
    """A material in the place of a measurement, to be tabulated."""

    def __init__(self, model: go.BSDF) -> None:
        super().__init__("a model")
        self.model = model

    def value(self, wo: Direction, wi: Direction) -> Spectrum:
        return self.model.eval(wo, wi)


PAINT = go.mix(go.Conductor.preset("Cu", alpha=0.35), go.Lambert((0.1, 0.16, 0.42)), 0.5)


def formats() -> dict[str, Format]:
    return {name: one for name, one in Format.family.all().items() if one.writes}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The sample in every format that can be written."""
    folder = tmp_path_factory.mktemp("formats")
    found = {}
    for name, one in formats().items():
        found[name] = folder / f"a{one.suffixes[0]}"
        compare.convert(SAMPLE, found[name])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", formats())
def test_what_is_written_is_read_back_with_the_error_that_was_said(name: str, files: dict[str, Path]) -> None:
    sample, table = read(SAMPLE), read(files[name])
    assert table.name == formats()[name].resampled(sample).name
    said = compare.difference(sample, table, seed=1)
    again = compare.difference(sample, table, seed=2)
    assert said == pytest.approx(again, rel=0.25, abs=1e-9)
    assert said < {"astm": 0.2, "cornell": 0.2}.get(name, 0.05)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", formats())
def test_a_second_writing_changes_nothing(name: str, files: dict[str, Path]) -> None:
    one = formats()[name]
    table = read(files[name])
    kept = one.resampled(table)
    assert kept is table
    again = one.read(one.write(kept), "again")
    for part, values in table.arrays().items():
        np.testing.assert_allclose(np.asarray(again.arrays()[part], float), np.asarray(values, float), rtol=2e-6)


def test_invalid_cells_of_merl_are_kept_and_are_no_light(files: dict[str, Path]) -> None:
    table = read(files["merl"])
    assert table.flaws["invalid"] == pytest.approx(0.248, abs=0.002)
    raw = np.frombuffer(files["merl"].read_bytes(), "<f8", offset=12)
    assert (raw == -1.0).mean() == pytest.approx(table.flaws["invalid"])
    assert table.range[0] >= 0.0
    model = go.Measured(str(files["merl"]))
    wo, wi = half_difference.centres((20, 20, 20))
    lit = np.minimum(wo[:, 2], wi[:, 2]) > 0.0
    assert model.eval(wo[lit], wi[lit]).min() >= 0.0


def test_merl_is_exact_at_the_middle_of_cells() -> None:
    model = go.Conductor.preset("Au", alpha=0.2)
    merl = formats()["merl"]
    table = merl.read(merl.write(merl.resampled(Stand(model))), "gold")
    wo, wi = half_difference.centres((90, 90, 180))
    pick = np.random.default_rng(0).choice(np.flatnonzero(np.minimum(wo[:, 2], wi[:, 2]) > 1e-9), 20_000)
    expected = model.eval(wo[pick], wi[pick], precision="float64")
    np.testing.assert_allclose(table.rgb(wo[pick], wi[pick]), expected, rtol=1e-11)


@pytest.mark.slow
def test_a_whole_turn_of_phi_d_tells_a_direction_from_its_opposite(tmp_path: Path) -> None:
    shape = (90, 90, 360)
    planes = np.ones((3, *shape))
    planes[:, :, :, 180:] = 3.0
    path = tmp_path / "whole.binary"
    path.write_bytes(struct.pack("<3i", *shape) + planes.tobytes())
    table = read(path)
    wo, wi = half_difference.pair_at(np.full(2, 0.3), np.full(2, 0.5), np.radians([90.0, 270.0]))
    np.testing.assert_allclose(table.rgb(wo, wi) / wi[:, 2:], np.array([[1.0], [3.0]]) * SCALE, rtol=1e-12)
    assert not table.reciprocal


def test_reciprocity_halves_a_table_of_angles() -> None:
    table = angles.sampled(Stand(go.Lambert(0.5)).rgb, 7, 5)
    assert table.reciprocal and table.arrays()["values"].shape == (28, 5, 3)
    again = Own().read(Own().write(table), "x")
    assert isinstance(again, angles.Angles)
    np.testing.assert_array_equal(again.values, table.values)
    one_way = angles.Angles(
        (table.theta_i, table.theta_r, table.phi), table.values * np.arange(1.0, 8.0)[:, None, None, None]
    )
    assert not one_way.reciprocal and one_way.arrays()["values"].shape == (7, 7, 5, 3)


def test_spectra_become_colours_and_back() -> None:
    from gonio.measure import colours

    nm = np.arange(400.0, 701.0, 10.0)
    np.testing.assert_allclose(np.ones(31) @ colours.to_rgb(nm), 1.0, rtol=1e-12)
    red, blue = (np.exp(-0.5 * ((nm - peak) / 20.0) ** 2) @ colours.to_rgb(nm) for peak in (620.0, 450.0))
    assert red.argmax() == 0 and blue.argmax() == 2
    rgb = np.array([0.2, 0.5, 0.1])
    np.testing.assert_allclose(rgb @ colours.to_spectrum(nm) @ colours.to_rgb(nm), rgb, rtol=1e-9)


def test_info_says_what_is_known_of_a_file(files: dict[str, Path]) -> None:
    about = report.describe(files["merl"])
    assert about["dimensions"] == {"theta_h": 90, "theta_d": 90, "phi_d": 180, "channel": 3}
    assert about["reciprocity"] < 1e-9 and 0.2 < about["albedo"]["highest"] < 0.9
    expected = go.albedo(PAINT, float(np.cos(np.radians(30.0)))).value
    np.testing.assert_allclose(about["albedo"]["rgb"][2], np.ravel(expected), rtol=0.03)


# --------------------------------------------------------------------------- damaged files


def damaged(name: str, data: bytes) -> dict[str, bytes]:
    """A file's bytes, spoilt in many ways."""
    flipped = bytearray(data)
    for at in np.random.default_rng(5).integers(0, min(len(data), 400), 12):
        flipped[at] ^= 1 << int(at % 8)
    return {
        "empty": b"",
        "half": data[: len(data) // 2],
        "one byte short": data[:-1],
        "longer": data + b"7 7 7\n",
        "flipped": bytes(flipped),
        "zeros": b"\0" * len(data[:4096]),
        "text": b"hello " * 100,
        "pickle": pickle.dumps({"a": 1}),
        "not finite": data.replace(b"0.", b"nan ", 3),
    }


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", [*formats(), "networks"])
def test_a_damaged_file_is_one_error(name: str, files: dict[str, Path], tmp_path: Path) -> None:
    one = Format.family.get(name)
    data = files[name].read_bytes() if name in files else written({"x/kernel0": np.ones((6, 21))})
    for how, spoilt in damaged(name, data).items():
        path = tmp_path / f"bad{one.suffixes[0]}"
        path.write_bytes(spoilt)
        try:
            read(f"{path}:x" if name == "networks" else path)
        except InputError as error:
            assert str(path) in str(error), how
        else:
            # a flipped digit is another number, a missing last line end or a longer comment no harm
            assert how in ("flipped", "one byte short", "not finite"), how


def bomb() -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file:
        file.writestr("manifest.npy", b"\0" * (1 << 29))
    return stream.getvalue()


def claiming(shape: tuple[int, ...], descr: str = "<f8") -> bytes:
    stream = io.BytesIO()
    header = repr({"descr": descr, "fortran_order": False, "shape": shape}).encode().ljust(117) + b"\n"
    with zipfile.ZipFile(stream, "w") as file:
        file.writestr("manifest.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + b"\0" * 64)
    return stream.getvalue()


@pytest.mark.parametrize(
    "archive",
    [
        bomb,
        lambda: claiming((2**60,)),
        lambda: claiming((-8,)),
        lambda: claiming((8,), "|O"),
        lambda: claiming((8,), "<f8,<f8"),
    ],
)
def test_no_claim_of_an_archive_is_believed(archive: Callable[[], bytes], tmp_path: Path) -> None:
    path = tmp_path / "a.gonio"
    path.write_bytes(archive())
    with pytest.raises(InputError, match=r"a\.gonio"):
        read(path)


def test_a_tensor_of_endless_size_is_refused(files: dict[str, Path]) -> None:
    data = bytearray(files["rgl"].read_bytes())
    at = data.index(b"vndf") + 4 + 2 + 1 + 8
    data[at : at + 8] = struct.pack("<Q", 2**60)
    with pytest.raises(InputError, match="claims 1152921504606846976"):
        formats()["rgl"].read(bytes(data), "x")
    data[at - 8 : at] = struct.pack("<Q", 2**63)
    with pytest.raises(InputError, match="the file has"):
        formats()["rgl"].read(bytes(data), "x")


@pytest.mark.parametrize("wavelengths", [(700.0, 550.0, 400.0), (400.0, 550.0, 550.0), (400.0, np.nan, 700.0)])
def test_wavelengths_that_do_not_increase_are_refused(wavelengths: tuple[float, ...], files: dict[str, Path]) -> None:
    fields = rgl.tensors(files["rgl"].read_bytes(), "x")
    spectral = {**fields, "wavelengths": np.array(wavelengths, np.float32), "spectra": fields["rgb"]}
    with pytest.raises(InputError, match="the wavelengths do not increase"):
        formats()["rgl"].read(rgl.written(spectral), "x")


@pytest.mark.parametrize("name", ["vndf", "luminance"])
@pytest.mark.parametrize("factor", [0.0, -1.0])
def test_a_density_without_light_is_refused(name: str, factor: float, files: dict[str, Path]) -> None:
    fields = rgl.tensors(files["rgl"].read_bytes(), "x")
    with pytest.raises(InputError, match=f"{name} is a density"):
        formats()["rgl"].read(rgl.written({**fields, name: fields[name] * np.float32(factor)}), "x")


def test_a_network_is_evaluated_at_the_centers_of_merls_cells() -> None:
    """A network whose value is exp(1 + y) - 1, with y of the difference vector."""
    weights = {
        "kernel0": np.zeros((6, 21)), "bias0": np.zeros(21), "kernel1": np.eye(21), "bias1": np.zeros(21),
        "kernel2": np.zeros((21, 3)), "bias2": np.zeros(3),
    }  # fmt: skip
    weights["kernel0"][4, 0] = weights["bias0"][0] = 1.0
    weights["kernel2"][0] = 1.0
    values, lit = networks.tabulated({name: part.astype(np.float32) for name, part in weights.items()})
    theta_d, phi_d = np.radians(np.arange(90) + 0.5)[:, None], np.radians(np.arange(180) + 0.5)
    expected = np.expm1(1.0 + np.sin(theta_d) * np.sin(phi_d))
    np.testing.assert_allclose(values[40], np.broadcast_to(expected[..., None], (90, 180, 3)), rtol=1e-5)
    theta_h = np.pi / 2 * (40.5 / 90) ** 2
    above = np.cos(theta_h) * np.cos(theta_d) > np.abs(np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d))
    np.testing.assert_array_equal(lit[40], above)


def test_a_merl_file_without_a_valid_cell_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "dark.binary"
    path.write_bytes(struct.pack("<3i", 90, 90, 180) + np.full(3 * 90 * 90 * 180, -1.0).tobytes())
    with pytest.raises(InputError, match="every cell is invalid"):
        read(path)
    path.write_bytes(struct.pack("<3i", 90, 90, 180) + np.full(3 * 90 * 90 * 180, np.nan).tobytes())
    with pytest.raises(InputError, match="are not finite"):
        read(path)
    path.write_bytes(struct.pack("<3i", 90, -90, 180) + b"\0" * 64)
    with pytest.raises(InputError, match="90 x -90 x 180"):
        read(path)


def test_a_wrong_count_in_a_text_is_said() -> None:
    text = b"# t\n3\n400 500 600\n" + b"0.1 0 0.1 0 1 1 1\n" * 9
    with pytest.raises(InputError, match="a multiple of 7 expected"):
        formats()["cornell"].read(text + b"0.1 0 0.1\n", "x")
    with pytest.raises(InputError, match="NUM_POINTS says 5, 9 rows"):
        rows = b"0.1,0,0.1,0,1\n" * 9
        formats()["astm"].read(b"NUM_POINTS 5\nVARS=theta_i,phi_i,theta_s,phi_s,BRDF\n" + rows, "x")


# --------------------------------------------------------------------------- real files


def test_the_shared_files_are_read_with_their_faults(shared: Path) -> None:
    data = shared / "data"
    sunflower = read(data / "rgl" / "cg_sunflower_rgb.bsdf")
    assert sunflower.flaws["negative"] == pytest.approx(0.264, abs=1e-3)
    satin = report.describe(data / "rgl" / "satin_rosaline_rgb.bsdf")
    assert satin["albedo"]["rgb"][7][0] == pytest.approx(1.11, abs=0.01)
    cayman = read(data / "cornell" / "cayman.brdf")
    assert cayman.shape == {"sample": 1439, "channel": 31}
    assert len(report.describe(data / "nbrdf" / "merl.npz")["items"]) == 13
    with pytest.raises(InputError, match="did you mean 'chrome'"):
        read(f"{data / 'nbrdf' / 'merl.npz'}:crome")


def test_an_axis_without_entries_is_refused_in_every_kind_of_table(files: dict[str, Path], tmp_path: Path) -> None:
    tables = {table.name: table for table in map(read, files.values())}
    tables["samples"] = samples.Samples(np.linspace(0.1, 1.0, 40).reshape(10, 4), np.ones((10, 3)))
    assert len(tables) >= 4
    for kind, table in tables.items():
        file = {name: np.asarray(part) for name, part in npz.arrays(Own().write(table), kind).items()}
        for name in set(file) - {"manifest"}:
            for axis in range(file[name].ndim):
                content = written({**file, name: np.take(file[name], [], axis=axis)})
                with pytest.raises(InputError, match=f"the array {name} of shape .* is empty"):
                    Own().read(content, kind)


@pytest.mark.parametrize("title", ["", "Garnet Red"])
@pytest.mark.parametrize("name", ["cornell", "astm"])
def test_a_title_stays_as_it_is(name: str, title: str) -> None:
    one = formats()[name]
    table = samples.sampled(go.Lambert(0.5).eval, samples.plan()[::40], title=title)
    for _ in range(2):
        table = one.read(one.write(table), "x")
        assert table.title == title


def test_gray_values_are_reported_as_gray(tmp_path: Path) -> None:
    path = tmp_path / "gray.astm"
    directions = samples.plan()[::40]
    path.write_bytes(formats()["astm"].write(samples.Samples(directions, np.full((len(directions), 1), 0.2))))
    rows = dict(report.lines(report.describe(path)))
    assert rows["channels"] == "one, gray" and "title" not in rows
