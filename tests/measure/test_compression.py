"""Measured materials in fewer bytes: what is said of them holds, and what is damaged is one error."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.measure import SAMPLE, compare, read, report
from gonio.measure.compression import network as networks
from gonio.measure.compression import sphere
from gonio.measure.compression.base import Method
from gonio.measure.formats.own import Own
from gonio.measure.tables import log_table
from gonio.measure.tables.network import Network
from gonio.shaders import bundle
from gonio.verify import verify

pytestmark = pytest.mark.long  # the files that it reads are made first


@pytest.fixture(scope="module", autouse=True)
def _small_pictures() -> Iterator[None]:
    """Spheres of few pixels under few lights: errors are a little other, and soon known."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sphere, "SIZE", 24)
        patch.setattr(sphere, "SKY", 64)
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sample as an RGL file, and a half of it."""
    made = tmp_path_factory.mktemp("compression")
    compare.convert(SAMPLE, made / "a.bsdf")
    sample = read(SAMPLE)
    half = type(sample).from_arrays({**sample.arrays(), "values": 0.5 * sample.values})
    (made / "half.gonio").write_bytes(Own().write(half))
    return made


@pytest.fixture(scope="module")
def network(folder: Path) -> Network:
    """A network that has seen the sample, though not for long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(networks, "STEPS", 150)
        patch.setattr(networks, "ROUNDS", 3)
        row = go.compress(SAMPLE, folder / "network.gonio", codec="network")[0]
    assert row.kind == "network" and row.size < 6000
    found = read(row.path)
    assert isinstance(found, Network)
    return found


@pytest.mark.sample(1)
@pytest.mark.parametrize(("method", "size"), [("log", 2048), ("log", 4096), ("lowrank", 4096)])
def test_a_table_fits_into_the_bytes_with_the_error_that_is_said(method: str, size: int, folder: Path) -> None:
    path = folder / f"{method}-{size}.gonio"
    row = go.compress(SAMPLE, path, codec=method, bytes=size)[0]
    assert path.stat().st_size == row.size <= size
    sample, table = read(SAMPLE), read(path)
    assert table.name == row.kind
    assert compare.difference(sample, table, seed=2) == pytest.approx(row.error, rel=0.25)
    assert row.error < (0.1 if size == 2048 else 0.02)
    assert go.Measured(str(path)).eval([[0.0, 0.6, 0.8]], [[0.0, -0.6, 0.8]]).min() > 0.0


@pytest.mark.slow
def test_more_bytes_err_less(folder: Path) -> None:
    errors = [go.compress(SAMPLE, folder / "more.gonio", bytes=size)[0].sphere for size in (1500, 2500, 8000)]
    assert errors == sorted(errors, reverse=True) and errors[-1] < 0.2 * errors[0]


@pytest.mark.slow
def test_several_materials_share_their_bases_in_one_file(folder: Path) -> None:
    path = folder / "both.gonio"
    rows = go.compress([SAMPLE, folder / "half.gonio"], path, codec="lowrank", bytes=4096)
    assert [row.path for row in rows] == [f"{path}:sample", f"{path}:half"]
    assert path.stat().st_size <= 2 * 4096 + 1 and report.describe(path)["items"] == ["sample", "half"]
    one, half = (read(row.path) for row in rows)
    assert one.arrays()["basis_theta_h"].tobytes() == half.arrays()["basis_theta_h"].tobytes()
    with pytest.raises(InputError, match="it has 2 materials, one expected"):
        read(path)
    with pytest.raises(InputError, match="no material 'halb' in this file"):
        read(f"{path}:halb")
    # as a material like any other
    wo, wi = np.array([[0.0, 0.6, 0.8]]), np.array([[0.0, -0.6, 0.8]])
    np.testing.assert_allclose(
        go.Measured(rows[1].path).eval(wo, wi), 0.5 * go.Measured(rows[0].path).eval(wo, wi), rtol=0.05
    )


@pytest.mark.slow
def test_visible_normals_are_rebuilt(folder: Path) -> None:
    row = go.compress(folder / "a.bsdf", folder / "a.gonio", codec="rgl")[0]
    assert row.size < 0.6 * (folder / "a.bsdf").stat().st_size and row.error < 1e-4
    old, new = read(folder / "a.bsdf"), read(row.path)
    for there, here in zip(old.vndf[0], new.vndf[0], strict=True):
        np.testing.assert_allclose(here / here.mean(), there / there.mean(), atol=1e-5 * there.max() / there.mean())
    # and written as an RGL file again
    assert compare.convert(row.path, folder / "again.bsdf").error < 1e-4


@pytest.mark.slow
def test_an_adaptive_table_stays_one_in_few_bytes(folder: Path) -> None:
    row = go.compress(folder / "a.bsdf", folder / "few.gonio", bytes=16384)[0]
    assert row.kind == "adaptive-log" and row.size <= 16384 and row.sphere < 0.02


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["cc_ibiza_sunset", "chm_mint", "irid_flake_paint1"])
def test_rgl_files_lose_nothing_with_their_visible_normals(name: str, tmp_path: Path, shared: Path) -> None:
    file = shared / "data" / "rgl" / f"{name}_rgb.bsdf"
    row = go.compress(file, tmp_path / "a.gonio", codec="rgl")[0]
    assert row.size < 0.21 * 658_952 and row.error < (1e-3 if name.startswith("irid") else 1e-5)


# ---------------------------------------------------------------------- networks


@pytest.mark.slow
def test_a_network_is_near_what_it_has_seen(network: Network) -> None:
    assert network.shape == {"weight": 675}
    assert compare.difference(read(SAMPLE), network) < 0.1


@pytest.mark.slow
def test_a_network_is_recorded_as_it_is_computed(network: Network, folder: Path) -> None:
    model = go.Measured(str(folder / "network.gonio"))
    rng = np.random.default_rng(3)
    wo, wi = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in np.abs(rng.normal(size=(2, 200, 3))))
    wi[:, 0] *= -1.0
    values = model.record("eval").evaluate(wo=wo.T, wi=wi.T)
    np.testing.assert_allclose(np.asarray(values).T, model.eval(wo, wi, precision="float64"), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(model.eval(wo, wi), model.eval(wi, wo) * wi[:, 2:] / wo[:, 2:], rtol=1e-4)


@pytest.mark.slow
def test_a_network_keeps_the_laws(network: Network, folder: Path) -> None:
    found = verify(go.Measured(str(folder / "network.gonio")), quick=True, law=["pdf", "weight", "reciprocity"])
    assert found.passed, str(found)


@pytest.mark.slow
@pytest.mark.parametrize("language", ["glsl", "wgsl", "hlsl"])
def test_a_shader_carries_the_weights(language: str, network: Network, folder: Path) -> None:
    made = bundle(go.Measured(str(folder / "network.gonio")), language, functions=("eval",))
    assert not made.tables
    assert f"{float(np.float32(network.weights['bias0'][0])):.5g}"[:6] in made.text


@pytest.mark.slow
def test_a_published_network_says_what_its_table_does(shared: Path) -> None:
    from gonio.measure.formats.npz import arrays
    from gonio.measure.tables.half_difference import centres
    from gonio.measure.tables.network import SHAPES

    path = shared / "data" / "nbrdf" / "merl.npz"
    parts = arrays(path.read_bytes(), str(path))
    network, table = Network({part: parts[f"nickel/{part}"] for part in SHAPES}), read(f"{path}:nickel")
    wo, wi = (w[::997] for w in centres((90, 90, 180)))
    lit = np.minimum(wo[:, 2], wi[:, 2]) > 1e-3
    np.testing.assert_allclose(network.rgb(wo[lit], wi[lit]), table.rgb(wo[lit], wi[lit]), rtol=2e-3, atol=1e-6)


# ---------------------------------------------------------------------- what cannot be done


def test_what_cannot_be_compressed_is_said(folder: Path) -> None:
    for words, match in (
        ({"codec": "rgl"}, "half-difference, an adaptive one expected"),
        ({"codec": "lg"}, "lg"),
        ({"bytes": 10}, "10 bytes given"),
        ({"bytes": 1100}, "1100 bytes, a table takes"),
    ):
        with pytest.raises(InputError, match=match):
            go.compress(SAMPLE, folder / "none.gonio", **words)
    with pytest.raises(InputError, match="gonio file expected"):
        go.compress(SAMPLE, folder / "none.binary")
    with pytest.raises(InputError, match="no file given"):
        go.compress([], folder / "none.gonio")
    with pytest.raises(InputError, match="same name"):
        go.compress([SAMPLE, SAMPLE], folder / "none.gonio")
    assert not (folder / "none.gonio").exists()


def test_damaged_codes_are_one_error(folder: Path) -> None:
    made = Method.family.get("log").compress([read(SAMPLE)], 2048)[0]
    parts = made.arrays()
    own, codes = Own(), parts["codes"]
    for damaged, match in (
        ({"codes": codes[:-3]}, "codes hold"),
        ({"codes": np.full(40, 255, np.uint8)}, "codes cannot be read"),
        ({"codes": log_table.packed(np.ones((40, 40, 40, 3), np.int64))}, "codes hold"),
        ({"cells": np.array([1 << 20, 1 << 20, 4])}, "cells, at most"),
        ({"scale": np.array([np.pi, np.nan, 1.0])}, "three positive numbers"),
    ):
        with pytest.raises(InputError, match=match):
            own.read(own.file_of(type(made), {**parts, **damaged}, {}), "a.gonio")


def test_whole_numbers_come_back() -> None:
    rng = np.random.default_rng(1)
    numbers = np.round(rng.normal(size=(9, 8, 7, 3)) * 10.0 ** rng.uniform(-2.0, 6.0, (9, 8, 7, 3))).astype(np.int64)
    np.testing.assert_array_equal(log_table.unpacked(log_table.packed(numbers), (9, 8, 7)), numbers)
    assert not log_table.unpacked(log_table.packed(0 * numbers), (9, 8, 7)).any()
