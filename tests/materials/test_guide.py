"""Sampling of materials that have only an `eval`: density, variance, and what a guide is found for."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.bridge import engine
from gonio.errors import InputError
from gonio.material import guide_search, tree
from gonio.ops import backend, dot, exp, sqr, vec3, where
from gonio.verify import verify


def hidden(material: go.BSDF, **facts: Any) -> go.BSDF:
    """The material without its own pdf and sample."""
    cls = type(material)
    names = {"pdf": go.BSDF.pdf, "sample": go.BSDF.sample, "__module__": __name__, **facts}
    return type("Hidden" + cls.__name__, (cls,), names)(**{n: getattr(material, n) for n in material.parameters()})


def test_values_of_drjit_are_numbers_and_colors_of_numpy() -> None:
    mi = engine.load()
    given = go.Conductor(
        eta=mi.Color3f(0.2, 0.9, 1.1),
        k=mi.Color3f(mi.Float([1.0, 2.0]), 3.0, 4.0),
        albedo=mi.Float(0.5),
        alpha=mi.Float(0.3),
    )
    plain = tree.plain_values(given)
    np.testing.assert_allclose(plain.eta, [0.2, 0.9, 1.1], rtol=1e-6)
    np.testing.assert_allclose(plain.k, [[1.0, 3.0, 4.0], [2.0, 3.0, 4.0]])
    assert isinstance(plain.albedo, float) and plain.albedo == 0.5
    assert plain.alpha == pytest.approx((0.3, 0.3))


class Retro(go.BSDF):
    """A narrow lobe straight back to the viewer."""

    width: go.Number = go.number(0.05, "of the lobe", low=0.01, high=0.5)  # wider ones gain light

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        away = wo - wi
        lobe = exp(-dot(away, away) / sqr(self.width))
        return vec3(1.0, 0.7, 0.2) * where((wo.z > 0.0) & (wi.z > 0.0), lobe * wi.z, 0.0)


class Through(go.BSDF):
    """A broad lobe that all goes to the other side, from below another one than from above."""

    @property
    def transmits(self) -> bool:
        return True

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        share = where(wo.z > 0.0, 0.3, 0.2 * wi.z * wi.z)
        return vec3(1.0, 1.0, 1.0) * where(wo.z * wi.z < 0.0, share * go.ops.abs(wi.z), 0.0)


class OneWay(go.BSDF):
    """Lit only from below."""

    @property
    def back_differs(self) -> bool:
        return True

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return vec3(0.5, 0.5, 0.5) * where((wo.z < 0.0) & (wi.z < 0.0), -wi.z * go.ops.inv_pi, 0.0)


class Sectors(go.BSDF):
    """Alternate sectors of 45 degrees of the azimuth between the two directions; black toward the normal itself."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        cos, sin = wo.x * wi.x + wo.y * wi.y, wo.x * wi.y - wo.y * wi.x
        even = sqr(cos * cos - sin * sin) > sqr(2.0 * cos * sin)
        return vec3(0.8, 0.8, 0.8) * where((wo.z > 0.0) & (wi.z > 0.0) & even, wi.z * go.ops.inv_pi, 0.0)


def _at(degrees: float, azimuth: float = 0.3) -> list[float]:
    a, b = np.radians(degrees), azimuth
    return [float(np.sin(a) * np.cos(b)), float(np.sin(a) * np.sin(b)), float(np.cos(a))]


def _relative_variance(material: go.BSDF, wo: list[float], seed: int = 3) -> tuple[float, float]:
    """(albedo, variance of a sample's weight over its square)."""
    u = np.random.default_rng(seed).random((1 << 15, 3))
    weight = np.asarray(material.sample(wo, u).weight, float).mean(1)
    return float(weight.mean()), float(weight.var() / weight.mean() ** 2)


SMOOTH = [
    go.Conductor.preset("Au", alpha=0.05),
    go.Conductor.preset("Au", alpha=0.3, ndf="beckmann"),
    go.Conductor.preset("Au", alpha=1.0),
    go.Conductor.preset("Au", alpha=(0.1, 0.4), rotation=0.7),
    go.OrenNayar(sigma=0.5),
    go.Mix(go.Conductor.preset("Au", alpha=0.1), go.Lambert(0.5)),
]


@pytest.mark.slow
@pytest.mark.parametrize("material", SMOOTH, ids=lambda m: m.name)
def test_a_guide_is_no_noisier_than_sampling_by_hand(material: go.BSDF) -> None:
    for degrees in (20.0, 65.0):
        albedo, by_hand = _relative_variance(material, _at(degrees))
        found, guided = _relative_variance(hidden(material), _at(degrees))
        assert guided <= 1.2 * by_hand + 1e-4
        assert found == pytest.approx(albedo, abs=4.0 * albedo * np.sqrt((by_hand + guided) / (1 << 15)) + 1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("material", [hidden(SMOOTH[1]), Retro(), Through(), OneWay()])
def test_what_a_guide_says_is_what_it_does(material: go.BSDF) -> None:
    report = verify(material, law="pdf", quick=True)
    assert report.passed, str(report)


# not the mix: at alpha = 0, which the laws try, its metal is a mirror, of which a guide knows nothing
GUIDED = [*map(hidden, SMOOTH[:5]), Retro(), Through(), OneWay()]


@pytest.mark.slow
@pytest.mark.parametrize("material", GUIDED, ids=lambda m: m.name)
def test_a_guided_material_passes_every_law_of_sampling(material: go.BSDF) -> None:
    for law in ("pdf", "energy", "calls", "precision"):
        report = verify(material, law=law)
        assert report.passed, str(report)


@pytest.mark.long
def test_lobes_off_the_mirror_direction_are_found() -> None:
    for width in (0.02, 0.3):
        assert _relative_variance(Retro(width=width), _at(50.0))[1] < 0.02
    assert _relative_variance(Through(), _at(50.0))[1] < 0.02


@pytest.mark.slow
def test_parameters_that_vary_over_the_surface_have_slices_of_their_own() -> None:
    rays = 3 * 4096
    alpha = np.tile([0.08, 0.3, 0.6], rays // 3)
    rough = hidden(go.Conductor(alpha=alpha))
    wo = np.tile(_at(40.0), (rays, 1))
    drawn = rough.sample(wo, np.random.default_rng(1).random((rays, 3)))
    assert [axis.slices for axis in guide_search.guide_of(rough).axes] == [guide_search.VARYING]
    for k in range(3):
        albedo, by_hand = _relative_variance(go.Conductor(alpha=float(alpha[k])), _at(40.0))
        weight = np.asarray(drawn.weight, float)[k::3, 0]
        assert weight.mean() == pytest.approx(albedo, abs=0.02)
        assert weight.var() / weight.mean() ** 2 < by_hand
    np.testing.assert_allclose(rough.pdf(wo, drawn.wi)[drawn.pdf > 0], drawn.pdf[drawn.pdf > 0], rtol=1e-6)


def test_a_colour_that_varies_takes_no_slices_where_it_moves_no_light() -> None:
    colours = np.random.default_rng(1).random((64, 3))
    assert guide_search.guide_of(hidden(go.Lambert(colours))).axes == ()


def test_a_black_material_is_sampled_by_the_cosine() -> None:
    drawn = hidden(go.Lambert(0.0)).sample(_at(30.0), np.random.default_rng(1).random((64, 3)))
    assert np.all(drawn.weight == 0.0)
    np.testing.assert_allclose(drawn.pdf, drawn.wi[:, 2] / np.pi, rtol=1e-6)


def test_a_black_slice_has_a_density_too() -> None:
    around = np.random.default_rng(4).normal(size=(1 << 16, 3))
    wi = np.abs(around / np.linalg.norm(around, axis=1, keepdims=True)) * np.sign(around) ** [1, 1, 0]
    for degrees in (0.0, 1.0):
        total = 2.0 * np.pi * Sectors().pdf(np.tile(_at(degrees), (len(wi), 1)), wi).mean()
        assert total == pytest.approx(1.0, abs=0.05)


def test_light_from_one_side_is_sampled_on_that_side() -> None:
    u = np.random.default_rng(1).random((64, 3))
    below = OneWay().sample([0.6, 0.0, -0.8], u)
    assert np.all(below.wi[:, 2] < 0.0) and np.all(below.pdf > 0.0)
    assert np.all(OneWay().sample([0.6, 0.0, 0.8], u).pdf == 0.0)


def test_a_recorded_guide_says_what_the_computed_one_does() -> None:
    rough = hidden(go.Conductor(alpha=0.3))
    wo = np.tile(_at(40.0), (256, 1))
    drawn = rough.sample(wo, np.random.default_rng(1).random((256, 3)), precision="float64")
    graph = rough.record("pdf")
    unused = {name: np.zeros((3, 1)) for name in ("self_eta", "self_k", "self_albedo")}  # a pdf does not ask for them
    found = graph.evaluate(wo=wo.T, wi=np.asarray(drawn.wi).T, self_alpha=np.full((2, 1), 0.3), **unused)
    np.testing.assert_allclose(found, rough.pdf(wo, drawn.wi, precision="float64"), rtol=1e-9)


def test_equal_materials_share_a_guide() -> None:
    assert guide_search.guide_of(Retro(width=0.2)) is guide_search.guide_of(Retro(width=0.2))


def test_a_material_with_its_own_pdf_keeps_it() -> None:
    assert not go.OrenNayar.guided
    np.testing.assert_allclose(go.OrenNayar().pdf(_at(30.0), _at(60.0)), 0.5 / np.pi, rtol=1e-6)


def test_a_guide_cannot_be_found_inside_a_loop_and_says_so() -> None:
    import drjit as dr

    types = backend.types("float32")
    retro = Retro(width=0.123)

    def body(i: Any, total: Any) -> tuple[Any, Any]:
        wo = types.vec3(0.0, 0.0, 1.0)
        return i + 1, total + retro.pdf(wo, wo)

    with pytest.raises(RuntimeError) as caught:
        dr.while_loop((types.module.UInt32(0), types.float(0.0)), lambda i, total: i < 2, body, mode="symbolic")
    assert isinstance(caught.value.__cause__, InputError) and "before the loop" in caught.value.__cause__.hint


def test_a_lent_guide_is_the_lenders() -> None:
    class Gray(go.BSDF):
        """A matte material."""

        albedo: go.Spectrum = go.spectrum(0.5, "reflectance", high=1.0)

        def eval(self, wo, wi, mode="radiance"):
            return go.ops.where((wo.z > 0) & (wi.z > 0), self.albedo * wi.z / 3.0, 0.0)

    lender, other = Gray(), Gray(albedo=np.linspace(0.0, 1.0, 8)[:, None] * np.ones(3))
    guide_search.lend(lender, other)
    assert guide_search.guide_of(other) is guide_search.guide_of(lender)
