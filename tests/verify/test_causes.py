"""Each cause is named of a mistake that has it, and none of one that is not clean."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, ClassVar

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.material import Sample, number
from gonio.material.parameters import Value
from gonio.ops import abs, dot, safe_div, sqr, vec3, where
from gonio.optics import frame, warp
from gonio.verify import verify
from gonio.verify.forensics import channels, crowding, mixture
from gonio.verify.laws import laws
from gonio.verify.laws import pdf as pdf_law
from gonio.verify.laws import reciprocity as reciprocity_law
from gonio.verify.subject import of

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from broken.facets import (
    AlphaSquaredAgain,
    BelowTheHorizon,
    FresnelAtTheNormal,
    HalfVectorPdf,
    NoJacobianInSample,
    RightFacets,
    SwappedAxes,
)
from broken.glass import WrongScaling
from broken.surfaces import (
    AlbedoSquared,
    CosineTwice,
    HalfTheHemisphere,
    MoreAtGrazing,
    OnePercentMore,
    OneSidedCoupling,
    OtherLobeWeights,
    PdfOfTheSphere,
    RightDiffuse,
    RightLobes,
)
from referee import cases


class Weighed(RightFacets):
    """The weight is off by a factor."""

    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return 1.0 + 0.0 * wo.z

    def _weight(self, wo: Any, wi: Any, pdf: Any) -> Any:
        return RightFacets._weight(self, wo, wi, pdf) * self._factor(wo, wi, frame.half_vector(wo, wi))


class TimesPi(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return np.pi + 0.0 * wo.z


class TimesSomething(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return 1.234 + 0.0 * wo.z


class NoCosineOfTheHalfVector(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return m.z


class OtherCosine(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return safe_div(wo.z, wi.z)


class TwoPiCosine(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return 2.0 * np.pi * wi.z


class Green(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        one = 1.0 + 0.0 * wo.z
        return vec3(one, 0.5 * one, one)


class Behind(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return where(wi.x < 0.0, 0.5, 1.0)


class BeyondSixty(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return where(wo.z < 0.5, 2.0 * abs(dot(wo, m)), 1.0)


class Wavy(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return 1.0 + 0.1 * ops.sin(5.0 * wi.x + wo.y)


class NearlyACosine(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return ops.sqrt(sqr(wi.z) + 0.05)


class FresnelAtTheNormalInSample(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return self._F(wo, frame.normal_like(wo)) / self._F(wo, m)


class OtherPdf(RightFacets):
    """`pdf` alone lacks the Jacobian."""

    def pdf(self, wo: Any, wi: Any) -> Any:
        return RightFacets.pdf(self, wo, wi) * 4.0 * abs(dot(wo, frame.half_vector(wo, wi)))


class BlueGains(RightDiffuse):
    """Blue is normalised otherwise."""

    def _shape(self, wo: Any, wi: Any) -> Any:
        one = RightDiffuse._shape(self, wo, wi)
        return vec3(one, one, 1.2 * one)


class RoughnessSquared(RightDiffuse):
    """A gradient that misses the chain rule of a square."""

    rim: Value = number(0.3, "brightness of the rim", low=0.1, high=0.5)

    def _shape(self, wo: Any, wi: Any) -> Any:
        import drjit as dr

        squared = self.rim * self.rim
        if not isinstance(squared, float):  # the value of the square, the slope of the number itself
            squared = self.rim + dr.detach(squared - self.rim)
        return (1.0 - squared * wo.z * wi.z) * wi.z / np.pi


def cause(material: go.BSDF, law: str) -> str:
    verdict = verify(material, quick=True, law=[law])[law]
    assert verdict.failed
    return verdict.cause


@pytest.mark.sample(4)
class EncodedUnderVarnish(RightDiffuse):
    """A color that the formula decodes, under a white reflection that does not depend on it."""

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        both = ops.pow(self.albedo, 2.2) * 0.8 + 0.1 * (1.0 - wo.z)
        return both * where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("mistake", "law", "words"),
    [
        (TimesPi, "weight", "is pi, within"),
        (TimesSomething, "weight", "is 1.234, within"),
        (NoJacobianInSample, "weight", "is 1 / (4 (o.m)), within"),
        (NoCosineOfTheHalfVector, "weight", "is cos_m, within"),
        (OtherCosine, "weight", "is cos_o / cos_i, within"),
        (TwoPiCosine, "weight", "is 2 pi cos_i, within"),
        (Green, "weight", "is 1 / 2, only in green, within"),
        (Behind, "weight", "is 1 / 2, where wi.x < 0, within"),
        (BeyondSixty, "weight", "is 2 (o.m), where wo's angle to the normal is more than 60."),
        (AlphaSquaredAgain, "weight", "D(alpha) / D(alpha^2) of GGX"),
        (FresnelAtTheNormalInSample, "weight", "F(n.o) / F(o.m)"),
        (OtherPdf, "weight", "the pdf of samples to pdf(wo, wi) is 1 / (4 (o.m)), within"),
        pytest.param(BelowTheHorizon, "weight", "pdf(wo, wi) is 0 in transmission", marks=pytest.mark.slow),
        (CosineTwice, "reciprocity", "is cos_i / cos_o, within"),
        (FresnelAtTheNormal, "reciprocity", "F(n.o) / F(n.i)"),
        (OneSidedCoupling, "reciprocity", "g(wo) / g(wi)"),
        (WrongScaling, "reciprocity", "eta^4 in transmission"),
        (OnePercentMore, "energy", "the albedo is 1.01 for every wo"),
        (MoreAtGrazing, "energy", "is 1.02 instead of 1 where wo's angle to the normal is more than"),
        (BlueGains, "energy", "blue is 1.2 times the other channels"),
        (AlbedoSquared, "linearity", "albedo^2"),
        (EncodedUnderVarnish, "linearity", "albedo^2.2, within"),
        (SwappedAxes, "isotropy", "alpha_x and alpha_y exchanged"),
        (RoughnessSquared, "gradients", "1 / (2 rim)"),
        (Wavy, "weight", ""),
        (NearlyACosine, "weight", ""),
    ],
)
def test_a_cause_is_named_where_the_ratio_is_clean(mistake: type, law: str, words: str) -> None:
    found = cause(mistake(), law)
    assert words in found if words else found == "", found


class NarrowPdf(RightFacets):
    """pdf and weight are those of alpha^2, samples those of alpha."""

    fault: ClassVar[str] = "alpha^2"

    def pdf(self, wo: Any, wi: Any) -> Any:
        a = self._widths()
        m = frame.half_vector(wo, wi)
        from broken.facets import NDF

        density = NDF.D(m, ops.vec2(sqr(a.x), sqr(a.y))) * m.z * self._jacobian(wo, m)
        return where((wo.z > 0.0) & (wi.z > 0.0), density, 0.0)

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        s = RightFacets.sample(self, wo, u)
        return s._replace(pdf=where(s.pdf > 0.0, self.pdf(wo, s.wi), 0.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (HalfVectorPdf, "1 / (4 (o.m))"),
        (PdfOfTheSphere, "the ratio of samples to pdf is 2,"),
        (NarrowPdf, "sqrt(alpha)"),
        (OtherLobeWeights, ""),
        (RightLobes, ""),
        (RightFacets, ""),
    ],
)
def test_samples_name_the_factor_of_the_pdf(mistake: type, words: str) -> None:
    subject = of(mistake())
    wo = np.array([[0.6, 0.0, 0.8]])
    (tested,) = pdf_law._chi_square(subject, pdf_law.FEW, 1, wo)
    held = crowding.blocks(tested.cells)
    assert held is not None
    found = crowding.named(subject, tested.cells, held, 1)
    assert (found is None) if not words else (found is not None and words in found.words), found


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (OtherLobeWeights, "different probabilities in pdf and sample"),
        (RightLobes, ""),
        (HalfVectorPdf, ""),
    ],
)
def test_the_weights_of_lobes_are_named(mistake: type, words: str) -> None:
    subject = of(mistake())
    (tested,) = pdf_law._chi_square(subject, pdf_law.FEW, 1, np.array([[0.6, 0.0, 0.8]]))
    held = crowding.blocks(tested.cells)
    assert held is not None
    found = mixture.named(subject, tested.cells, held, 1)
    assert (found is None) if not words else (found is not None and words in found.words), found


class WrongSide(go.BSDF):
    """The density states 0.5 for each side of the surface, of which samples choose the upper one with 0.7."""

    @property
    def transmits(self) -> bool:
        return True

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return vec3(0.8, 0.8, 0.8) * self.pdf(wo, wi)

    def pdf(self, wo: Any, wi: Any) -> Any:
        return 0.5 * abs(wi.z) * ops.inv_pi

    def sample(self, wo: Any, u: Any, mode: str = "radiance") -> Sample:
        up = warp.square_to_cosine_hemisphere(u.y, u.z)
        wi = vec3(up.x, up.y, where(u.x < 0.7, up.z, -up.z))
        return Sample.of_density(wi, vec3(0.8, 0.8, 0.8), self.pdf(wo, wi))


def test_a_wrong_probability_of_the_sides_is_named() -> None:
    subject = of(WrongSide())
    (tested,) = pdf_law._chi_square(subject, pdf_law.FEW, 1, np.array([[0.6, 0.0, 0.8]]))
    held = crowding.blocks(tested.cells)
    assert held is not None
    found = crowding.named(subject, tested.cells, held, 1)
    assert found is not None and found.words.startswith(
        "the ratio of samples to pdf is 1.4 above the surface and 0.6"
    ), found


def test_the_chi_square_tells_place_and_size() -> None:
    subject = of(OtherLobeWeights())
    (tested,) = pdf_law._chi_square(subject, pdf_law.FEW, 1, np.array([[0.6, 0.0, 0.8]]))
    held = crowding.blocks(tested.cells)
    assert held is not None
    words = crowding.crowd(subject, held)
    # .55 / .5 where only the wide lobe is, and the noise of cells with a few hundred samples
    assert 8.0 < float(words.partition(" % more samples than the pdf predicts")[0]) < 18.0, words
    assert "of the light" in words


def test_light_that_no_sample_finds_is_placed() -> None:
    subject = of(HalfTheHemisphere())
    from gonio.verify.effort import EFFORTS
    from gonio.verify.verdict import Finding

    found = next(iter(laws()["pdf"].ratios(subject, Finding(0.0, 1.0, ""), EFFORTS["quick"], 1)))
    assert "where wi.x < 0" in found.words  # type: ignore[union-attr]


@pytest.mark.slow
def test_a_cascade_names_its_first_cause_once() -> None:
    report = verify(NoJacobianInSample(), quick=True, law=["energy", "weight"])
    assert "(o.m)" in report["weight"].cause and "failure of the weight law" in report["energy"].cause
    text = str(report)
    assert text.index("weight: ") < text.index("energy: directional")


@pytest.mark.slow
def test_what_the_examiners_named_is_named() -> None:
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from mutants.third.delta import CertainOfItself
    from mutants.third.smooth import ChoiceNumberAgain, GreyWeight, OneLobeDensity

    for cls, law, words in (
        (ChoiceNumberAgain, "pdf", "does u.x select both the lobe and its direction"),
        (GreyWeight, "weight", "the weight is gray"),
        (OneLobeDensity, "weight", "is a lobe of a mixture missing"),
        (CertainOfItself, "delta", "the pdf of delta samples is 1"),
    ):
        assert words in verify(cls(), quick=True, law=law)[law].cause, cls


@pytest.mark.slow
def test_light_that_meets_a_pigment_twice_is_no_mistake_and_a_colour_that_is_squared_is() -> None:
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from mutants.fourth.sound import BouncingLacquer

    class Squared(go.Lambert):
        """The colour counts twice, and not once."""

        def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
            return super().eval(wo, wi, mode) * self.albedo

    verdict = verify(BouncingLacquer(), quick=True, law="linearity")["linearity"]
    assert verdict.status == "pass" and any("more than once" in note for note in verdict.notes)
    assert verify(Squared(), quick=True, law="linearity")["linearity"].failed


def test_masking_that_is_not_that_of_the_distribution_is_told(own_ndfs: None) -> None:
    from gonio.optics.ndf.ggx import GGX
    from gonio.verify.forensics import masking

    class Undermasked(GGX):
        """GGX with the masking of half its width."""

        name = "undermasked"

        def Lambda(self, v: Any, alpha: Any) -> Any:
            return super().Lambda(v, ops.vec2(0.5 * alpha.x, 0.5 * alpha.y))

    assert masking.mismatch(of(go.Conductor(alpha=0.4))) == ""
    assert masking.mismatch(of(go.Conductor(alpha=(0.1, 0.6), ndf="beckmann"))) == ""
    words = masking.mismatch(of(go.Conductor(alpha=0.4, ndf=Undermasked)))
    assert words.startswith("the masking does not match the distribution")


class OneSided(Weighed):
    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return 1.0 + 0.0 * wo.z

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return super().eval(wo, wi, mode) * (1.0 + 0.2 * (wo.x * wi.y - wo.y * wi.x))


@pytest.mark.slow
def test_a_lobe_to_one_side_is_not_called_anisotropic() -> None:
    cause = verify(OneSided(), quick=True, law="isotropy")["isotropy"].cause
    assert "mirrored" in cause and "`isotropic`" not in cause


class MeanOfChannels(RightDiffuse):
    """Its rise toward grazing is that of the mean color."""

    albedo: Value = go.spectrum((0.9, 0.1, 0.0), "albedo", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        color = self.albedo + (1.0 - ops.mean(self.albedo)) * (1.0 - wo.z) * (1.0 - wi.z)
        return color * where((wo.z > 0.0) & (wi.z > 0.0), wi.z * ops.inv_pi, 0.0)


class DarkForTheViewer(Weighed):
    """A facet lobe and a base that is darker for viewers near grazing, but not for lights."""

    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return 1.0 + 0.0 * wo.z

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        base = where((wo.z > 0.0) & (wi.z > 0.0), 0.1 * wi.z * wo.z, 0.0)
        return super().eval(wo, wi, mode) + base


class DeclaredAnisotropic(RightDiffuse):
    """Values and samples are the same in all directions about the normal."""

    @property
    def isotropic(self) -> bool:
        return False


def test_anisotropy_that_neither_values_nor_samples_have_is_no_fact() -> None:
    verdict = verify(DeclaredAnisotropic(), quick=True, law="isotropy")["isotropy"]
    assert verdict.failed and "declared anisotropic, but rotation changes the values by" in " ".join(verdict.why), (
        verdict.why
    )


def test_a_color_whose_channels_mix_is_named() -> None:
    rng = np.random.default_rng(4)
    wo, wi = (np.abs(w) / np.linalg.norm(w, axis=1, keepdims=True) for w in rng.normal(size=(2, 64, 3)))
    found = channels.mixed(of(MeanOfChannels()), wo, wi)
    assert (
        found is not None
        and "the red channel of the result depends on the green and blue channels of albedo" in found.words
    )
    assert channels.mixed(of(RightDiffuse()), wo, wi) is None


def test_a_base_for_one_direction_only_is_named() -> None:
    assert reciprocity_law._difference_is_even(of(DarkForTheViewer()), 1)
    assert not reciprocity_law._difference_is_even(of(RightFacets()), 1)
    assert not reciprocity_law._difference_is_even(of(FresnelOneWay()), 1)


class FresnelOneWay(Weighed):
    """The factor of its facets is that of the viewer: what is not reciprocal has the shape of the lobe."""

    def _factor(self, wo: Any, wi: Any, m: Any) -> Any:
        return 1.0 + 0.0 * wo.z

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return super().eval(wo, wi, mode) * (0.5 + 0.5 * abs(wo.z))


LAST: list[tuple[str, str, str]] = [
    ("w1_corners.W1RotatedSample", "pdf", "the pdf of wi rotated by 2 rotation"),
    ("w1_corners.W1ClampedNumbers", "pdf", "while the second random number is below"),
    ("w1_corners.W1ForgottenHaze", "pdf", "a lobe that is missing from the pdf"),
    ("w1_empirical.W1PhongPlusTwo", "pdf", "the density of lobe 1 is 1.07"),
    ("w1_diffuse.W1UniformTheta", "pdf", "1 / sin_i, within"),
    ("w1_empirical.W1PhongFlippedUp", "pdf", "directions below the horizon that are mirrored"),
    ("w1_empirical.W1WardSquare", "energy", "the albedo at normal incidence is alpha.x^-1 alpha.y"),
    ("w1_diffuse.W1FujiiSign", "energy", "is 1 at sigma = 0"),
    ("w1_empirical.W1BlinnFourTimes", "energy", "a wrong normalization of the lobe with ks"),
    ("w1_layers.W1HalfVectorBase", "energy", "a normalization that holds only at normal incidence"),
    ("w2_plugins_a.W2PluginMaskNull", "calls", "eval_null_transmission differs from weight x pdf"),
    ("w3_forums.W3WeekendBall", "pdf", "depends on wi's angle to the normal alone"),
    ("w3_narrow.W3RotatedPdf", "pdf", "rotation, and the same for wo"),
    ("w3_engines.W3SwappedPdf", "pdf", "the pdf with wo and wi exchanged"),
    ("w2_smooth_glass.W2GlassFactorSide", "delta", "for wo inside, the factor 1 / eta^2 of radiance is inverted"),
    ("w2_smooth_glass.W2GlassFirstPower", "delta", "1 / eta in place of 1 / eta^2"),
    ("w2_smooth_glass.W2GlassWeekend", "delta", "Schlick's approximation is used at the angle of wo"),
    ("w2_panes.W2PaneOneWay", "delta", "a tint in one direction only"),
    ("w2_panes.W2MirrorOneAxis", "delta", "has the same y as wo"),
    ("w1_microfacet.W1VisibleFullDisk", "pdf", "are normals that face away from wo sampled"),
    ("w2_plugins_a.W2PluginFrosted", "pdf", "samples are drawn from visible normals"),
    ("w3_engines.W3HalfFloat", "pdf", "rounded to 11 bits"),
    ("w1_corners.W1FlooredPdf", "weight", "clamping to at least 0.1"),
    ("w4_metals.W4Iron", "pdf", "no sample fails, but the integral of the pdf is less than 1"),
    ("w5_sheets.W5FreeFilm", "energy", "1 minus the mean reflectance of the channels"),
    ("w5_sheets.W5Pane", "energy", "that of both faces of a pane"),
    ("w5_plugins.W5MiTile", "energy", "for wo below the surface, no sample carries light"),
    ("w1_corners.W1SoftTerminator", "reciprocity", "g(wo) / g(wi)"),
    ("w1_diffuse.W1OrenNegative", "positivity", "with azimuths that differ by more than 90"),
]


@pytest.mark.sample(1)
@pytest.mark.parametrize(("name", "law", "words"), LAST, ids=[name.partition(".")[2] for name, _, _ in LAST])
def test_causes_of_the_last_examiners(name: str, law: str, words: str) -> None:
    folder = "sixth" if name < "w4" else "seventh"
    module = cases(f"{folder}.{name.partition('.')[0]}")
    found = cause(next(one.target for one in module if one.name == f"{folder}.{name}"), law)  # type: ignore[arg-type]
    assert words in found, found


@pytest.mark.slow
def test_a_call_that_no_integrator_makes_explains_no_other_failure() -> None:
    """The plugin ignores the requested types, and draws its metal from a part of the unit square."""
    target = next(one.target for one in cases("sixth.w3_plugins") if one.name.endswith(".W3PluginBlend"))
    report = verify(target, quick=True, law=["calls", "energy"])  # type: ignore[arg-type]
    assert report["calls"].grade == "interface" and report["energy"].failed
    assert not report["energy"].cause.startswith("follows"), report["energy"].cause
