"""The surfaces that the goniometer builds: their slopes, their periods, their files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.instruments.goniometer.run import surface_of
from gonio.instruments.surfaces.base import Patch, Surface, of_heights
from gonio.instruments.surfaces.gaussian import Gaussian
from gonio.instruments.surfaces.heightfield import Heightfield
from gonio.instruments.surfaces.spheres import SIDE, Spheres
from gonio.instruments.surfaces.vgroove import VGroove
from gonio.pictures import images


def heights(folder: Path, values: np.ndarray, name: str = "heights.exr") -> str:
    picture = values if values.ndim == 3 else np.repeat(values[..., None], 3, axis=2)
    images.write(folder / name, picture.astype(np.float32))
    return str(folder / name)


def slopes(patch: Patch) -> np.ndarray:
    """Of all triangles, along x and y."""
    a, b, c = (patch.vertices[patch.faces[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    return -normal[:, :2] / normal[:, 2:]


def test_slopes_of_a_gaussian_surface_are_beckmann_s() -> None:
    alpha = 0.3
    found = slopes(Gaussian(alpha=alpha).patch(np.random.default_rng(1)))
    assert np.mean(found**2) == pytest.approx(0.5 * alpha**2, rel=0.01)
    for axis in (0, 1):  # a Gaussian's fourth moment is 3 variances squared
        moments = np.mean(found[:, axis] ** 2), np.mean(found[:, axis] ** 4)
        assert moments[1] / moments[0] ** 2 == pytest.approx(3.0, rel=0.03)
    assert abs(np.corrcoef(found.T)[0, 1]) < 0.02


@pytest.mark.parametrize("surface", [Gaussian(squares=64), VGroove()], ids=str)
def test_facets_face_upward_and_stay_below_the_top(surface: Surface) -> None:
    patch = surface.patch(np.random.default_rng(1))
    a, b, c = (patch.vertices[patch.faces[:, corner]] for corner in range(3))
    assert np.cross(b - a, c - a)[:, 2].min() > 0.0
    assert patch.vertices[:, 2].max() <= patch.top + 1e-12
    assert np.all(patch.vertices[:, :2].max(axis=0) > 0.5 * np.asarray(patch.size))  # nothing is cut at the walls


def test_a_map_s_last_row_is_followed_by_its_first() -> None:
    values = np.random.default_rng(2).standard_normal((6, 8))
    patch = of_heights(values, spacing=0.5)
    assert patch.size == (4.0, 3.0)
    z = {(round(x, 6), round(y, 6)): height for x, y, height in patch.vertices}
    for y in np.arange(-1.5, 1.6, 0.5):
        assert z[-2.0, y] == z[2.0, y]
    for x in np.arange(-2.0, 2.1, 0.5):
        assert z[x, -1.5] == z[x, 1.5]


def test_grooves_take_the_shares_of_the_distribution() -> None:
    sigma = 0.4
    found = VGroove(sigma=sigma).slopes(256)
    theta = np.linspace(0.0, np.radians(89.0), 100_001)
    density = np.exp(-0.5 * (theta / sigma) ** 2) * np.sin(theta)
    for power in (1, 2):
        assert np.mean(found**power) == pytest.approx(np.sum(theta**power * density) / density.sum(), rel=5e-3)


def test_all_grooves_have_one_slope_where_one_is_given() -> None:
    found = slopes(VGroove(slope=0.6).patch(np.random.default_rng(1)))
    assert np.allclose(np.abs(found[:, 0]), np.tan(0.6)) and np.allclose(found[:, 1], 0.0)


def test_hemispheres_cover_their_share_without_touching() -> None:
    surface = Spheres(coverage=0.4)
    places = surface._places(np.random.default_rng(3))
    assert len(places) * np.pi / SIDE**2 == pytest.approx(0.4, abs=0.5 * np.pi / SIDE**2)
    apart = np.abs(places[:, None] - places)
    squares = np.square(np.minimum(apart, SIDE - apart)).sum(axis=-1)
    assert squares[~np.eye(len(places), dtype=bool)].min() > 4.0


def test_a_map_that_does_not_close_is_mirrored(tmp_path: Path) -> None:
    ramp = np.tile(np.arange(16.0), (16, 1))
    wave = np.sin(np.arange(16) * 2.0 * np.pi / 16.0) + np.zeros((16, 1))
    rng = np.random.default_rng(1)
    assert Heightfield(heights(tmp_path, ramp, "ramp.exr")).patch(rng).size == (32.0, 16.0)
    assert Heightfield(heights(tmp_path, wave, "wave.exr")).patch(rng).size == (16.0, 16.0)


def test_spacing_and_scale_change_slopes_alone(tmp_path: Path) -> None:
    file = heights(tmp_path, np.random.default_rng(1).standard_normal((8, 8)))
    rng = np.random.default_rng(1)
    plain, steep = Heightfield(file).patch(rng), Heightfield(file, spacing=0.5, scale=3.0).patch(rng)
    assert steep.size == plain.size and np.allclose(slopes(steep), 6.0 * slopes(plain))


def spoilt(kind: str) -> np.ndarray:
    values = np.random.default_rng(1).standard_normal((8, 8, 1)).repeat(3, axis=2)
    if kind == "nan":
        values[2, 3] = np.nan
    elif kind == "inf":
        values[2, 3] = -np.inf
    elif kind == "colour":
        values[..., 1] *= 2.0
    return {"one": values[:1, :1], "huge": np.zeros((4, 1025, 3))}.get(kind, values)


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("nan", "1 of 64 heights are not finite"),
        ("inf", "1 of 64 heights are not finite"),
        ("one", "1 x 1 pixels, 4 to 1024"),
        ("huge", "1025 x 4 pixels, 4 to 1024"),
        ("colour", "the three channels differ"),
    ],
)
def test_a_map_that_is_none_is_refused(kind: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=says) as caught:
        Heightfield(heights(tmp_path, spoilt(kind))).patch(np.random.default_rng(1))
    assert caught.value.where.endswith("heights.exr")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("gausian", "unknown surface 'gausian'"),
        ("gaussian:alpha=-.1", "from 0 to 3 expected"),
        ("gaussian:alpha=nan", "from 0 to 3 expected"),
        ("gaussian:alpha=wide", "from 0 to 3 expected"),
        ("gaussian:squares=64.5", "a whole number from 16"),
        ("gaussian:alfa=.1", "no parameter 'alfa'"),
        ("vgroove:slope=2", "from 0 to 1.5 rad"),
        ("spheres:coverage=.9", "from 0 to 0.5"),
        ("heightfield", "heightfield needs file"),
    ],
)
def test_a_surface_that_is_unknown_or_out_of_range_is_refused(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        surface_of(text)


def test_a_surface_is_named_with_its_parameters() -> None:
    assert surface_of("gaussian:alpha=.5,length=4") == Gaussian(alpha=0.5, length=4.0)
    assert surface_of("gaussian(alpha=.5)", ["squares=64"]) == Gaussian(alpha=0.5, squares=64)
    assert surface_of("heightfield:file=a.exr,spacing=2") == surface_of("a.exr", ["spacing=2"])
    assert str(Gaussian(alpha=0.5)) == "gaussian(alpha=0.5)" and str(VGroove()) == "vgroove"


OWN = """
from dataclasses import dataclass
import numpy as np
from gonio.instruments.surfaces.base import Surface, of_heights, parameter

@dataclass(frozen=True)
class Waves(Surface):
    name = "waves"
    height: float = parameter(1.0, "of a wave", 0.0, 2.0)

    def patch(self, rng):
        return of_heights(self.height * np.sin(np.arange(16) * np.pi / 8.0) * np.ones((16, 1)))
"""


def test_a_surface_in_a_file_is_named_by_it(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN)
    try:
        surface = surface_of(f"{tmp_path / 'own.py'}:Waves", ["height=.5"])
        assert str(surface) == "waves(height=0.5)" and surface.patch(np.random.default_rng(1)).top == pytest.approx(0.5)
        with pytest.raises(InputError, match="from 0 to 2 expected"):
            surface_of(f"{tmp_path / 'own.py'}:Waves", ["height=3"])
    finally:
        Surface.family.remove("waves")


def test_a_patch_that_is_none_is_refused() -> None:
    good = of_heights(np.zeros((4, 4)))
    for vertices, faces, size in (
        (good.vertices[:5], good.faces, good.size),
        (good.vertices * np.nan, good.faces, good.size),
        (good.vertices, good.faces[:0], good.size),
        (good.vertices, good.faces, (0.0, 1.0)),
    ):
        with pytest.raises(InputError, match="are not a patch"):
            Patch(vertices, faces, size, 0.0)


def test_a_surface_of_one_s_own_is_measured_by_its_name() -> None:
    @dataclass(frozen=True)
    class Steps(Surface):
        """Flat squares at two heights would not face upward: flat ones at one height."""

        name: ClassVar[str] = "steps"

        def patch(self, rng: np.random.Generator) -> Patch:
            return of_heights(np.zeros((4, 4)))

    go.register(Steps)
    try:
        found = go.measure(surface="steps", theta_i=[30.0], theta_r=[30.0, 60.0], phi=[180.0], samples=8192)
    finally:
        Surface.family.remove("steps")
    assert found.first[0] == pytest.approx(1.0) and found.later[0] == 0.0
