"""The cache of tables: what is read back, what is rebuilt, and that it says so."""

from __future__ import annotations

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.energy import cache
from gonio.energy.albedo.monte_carlo import Sampling
from gonio.energy.compensation import curves
from gonio.energy.tables import bake


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("GONIO_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def never():
    raise AssertionError("built again")


def damage(path, how):
    whole = path.read_bytes()
    if how == "cut":
        path.write_bytes(whole[: len(whole) // 2])
    elif how == "empty":
        path.write_bytes(b"")
    elif how == "foreign":
        path.write_bytes(b"not a table")
    elif how == "flipped":
        path.write_bytes(whole[:200] + bytes([whole[200] ^ 4]) + whole[201:])
    else:
        np.savez(path, values=np.ones(3), name=np.array("another"), hash=np.array(cache.content_hash(np.ones(3))))


DAMAGES = ["cut", "empty", "foreign", "flipped", "another's"]


@pytest.mark.long
@pytest.mark.parametrize("how", DAMAGES)
def test_a_damaged_array_is_rebuilt_with_a_warning(folder, how):
    first = cache.remember(("trial", 1), lambda: np.arange(300.0))
    assert np.array_equal(cache.remember(("trial", 1), never), first)
    (file,) = folder.glob("trial-*.npz")
    damage(file, how)
    with pytest.warns(go.GonioWarning, match="it is rebuilt"):
        again = cache.remember(("trial", 1), lambda: np.arange(300.0))
    assert np.array_equal(again, first)
    assert np.array_equal(cache.remember(("trial", 1), never), first)  # and kept


def test_an_altered_array_is_rebuilt(folder):
    cache.remember(("trial", 1), lambda: np.arange(3.0))
    (file,) = folder.glob("trial-*.npz")
    with np.load(file) as opened:
        np.savez(file, **{**opened, "values": np.arange(3.0) + 1e-9})
    with pytest.warns(go.GonioWarning, match="altered"):
        cache.remember(("trial", 1), lambda: np.arange(3.0))


@pytest.mark.sample(1)
@pytest.mark.parametrize("how", DAMAGES)
def test_baked_tables_are_kept_and_a_damaged_one_is_baked_again(folder, monkeypatch, how):
    first = bake.cached("ggx", size=4)
    (file,) = folder.glob("baked-*.npz")
    with monkeypatch.context() as patch:
        patch.setattr(bake, "bake", lambda *args, **options: never())
        again = bake.cached("ggx", size=4)
    assert again.manifest == first.manifest
    assert all(np.array_equal(again.arrays[name], value) for name, value in first.arrays.items())
    damage(file, how)
    with pytest.warns(go.GonioWarning, match="it is rebuilt"):
        rebuilt = bake.cached("ggx", size=4)
    assert rebuilt.manifest == first.manifest


def test_a_table_in_anothers_place_is_not_taken_for_it(folder):
    bake.cached("ggx", size=4, lut=("E",))
    (first,) = folder.glob("baked-*.npz")
    bake.cached("beckmann", size=4, lut=("E",))
    (second,) = set(folder.glob("baked-*.npz")) - {first}
    second.write_bytes(first.read_bytes())
    with pytest.warns(go.GonioWarning, match="not the requested table"):
        assert bake.cached("beckmann", size=4, lut=("E",)).manifest["ndf"] == "beckmann"


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "other",
    [
        {"size": 5},
        {"masking": "schlick-ibl"},
        {"layout": "stretched"},
        {"aspect": 0.5},
        {"sampling": Sampling("ggx")},
    ],
    ids=lambda o: next(iter(o)),
)
def test_another_option_is_another_file(folder, other):
    bake.cached("ggx", lut=("E",), size=4)
    bake.cached("ggx", lut=("E",), **{"size": 4, **other})
    assert len(list(folder.glob("baked-*.npz"))) == 2


@pytest.mark.slow
def test_two_widths_of_a_material_are_part_of_its_name(folder):
    bake.cached(go.Conductor(alpha=(0.1, 0.2)), lut=("E",), size=3)
    found = bake.cached(go.Conductor(alpha=(0.1, 0.4)), lut=("E",), size=3)
    assert found.manifest["aspect"] == pytest.approx(4.0)


def test_changed_formulas_make_new_tables(folder, monkeypatch):
    cache.remember(("trial", 1), lambda: np.arange(3.0))
    monkeypatch.setattr(cache, "formulas", lambda: "other")
    assert cache.remember(("trial", 1), lambda: np.ones(1))[0] == 1.0
    assert len(list(folder.glob("trial-*"))) == 2


def test_the_hash_of_formulas_hears_code_and_not_comments():
    plain = "def f(x):\n    return x * 2.0\n"
    said = '"""A module."""\ndef f(x: float) -> float:\n    """Twice."""  # twice\n\n    return x * 2.0\n'
    assert cache._meaning(plain) == cache._meaning(said)
    assert cache._meaning(plain) != cache._meaning(plain.replace("2.0", "3.0"))


def test_every_package_that_a_table_depends_on_is_hashed():
    package = Path(cache.__file__).parents[1]
    assert {"ops", "optics", "material", "materials", "energy"} == set(cache.PACKAGES)
    assert all(list((package / name).rglob("*.py")) for name in cache.PACKAGES)


@pytest.fixture
def few_formulas(folder, monkeypatch):
    """The formulas of one package, which are read quickly."""
    monkeypatch.setattr(cache, "PACKAGES", ("ops",))
    cache.formulas.cache_clear()
    yield
    cache.formulas.cache_clear()


def test_the_hash_of_formulas_is_kept_until_a_file_changes(folder, few_formulas, monkeypatch):
    first = cache.formulas()
    with monkeypatch.context() as patch:
        patch.setattr(cache, "_meaning", lambda source: never())
        cache.formulas.cache_clear()
        assert cache.formulas() == first
    kept = (folder / "formulas.txt").read_text()
    for damaged in ("nonsense", f"{'0' * 64} {'1' * 64}", kept[:-1]):
        (folder / "formulas.txt").write_text(damaged)
        cache.formulas.cache_clear()
        assert cache.formulas() == first


def test_a_distribution_that_changed_in_its_file_makes_new_tables(folder, tmp_path):
    from gonio.catalog import outside
    from gonio.optics.ndf import NDF

    file = tmp_path / "mine.py"
    text = "from gonio.optics.ndf.ggx import GGX\n\n\nclass Mine(GGX):\n    name = 'mine'\n"
    try:
        file.write_text(text)
        outside.member(f"{file}:Mine")
        before, table = cache.origin("mine"), curves.isotropic("mine", "smith-correlated")
        assert curves.isotropic("mine", "smith-correlated") is table
        file.write_text(text + "\n    long_tailed = True  # and more\n")
        outside.member(f"{file}:Mine")
        assert cache.origin("mine") != before and cache.origin("ggx") == ()
        assert curves.isotropic("mine", "smith-correlated") is not table
    finally:
        NDF.family.remove("mine")


def test_a_folder_that_cannot_be_written_is_no_hindrance(monkeypatch):
    monkeypatch.setenv("GONIO_CACHE", "/proc/gonio")
    assert np.array_equal(cache.remember(("trial", 1), lambda: np.arange(3.0)), np.arange(3.0))


def test_nothing_half_written_is_left(folder):
    cache.remember(("trial", 1), lambda: np.arange(3.0))
    assert [p.suffix for p in folder.iterdir()] == [".npz"]


def test_tables_of_compensation_come_from_the_cache(folder):
    fresh = curves.isotropic.__wrapped__("ggx", "schlick-ibl")
    assert len(list(folder.glob("curves-*.npz"))) == 1
    again = curves.isotropic.__wrapped__("ggx", "schlick-ibl")
    assert np.array_equal(fresh.values, again.values)


def test_a_table_that_others_may_change_is_rebuilt_with_a_warning(folder: Path) -> None:
    cache.remember(("a",), lambda: np.ones(3))
    assert np.array_equal(cache.remember(("a",), never), np.ones(3))
    for place in (folder, *folder.glob("a-*")):
        before = place.stat().st_mode
        place.chmod(before | 0o002)
        with pytest.warns(go.GonioWarning, match="other users may have changed it; it is rebuilt"):
            assert np.array_equal(cache.remember(("a",), lambda: np.zeros(3)), np.zeros(3))
        place.chmod(before)
