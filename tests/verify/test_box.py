"""At which values of the parameters a material is tried."""

from __future__ import annotations

from typing import Any

import gonio as go
import pytest
from gonio.verify import box, ranges, subject, verify
from gonio.verify.effort import EFFORTS


class BrightCoat(go.BSDF):
    """Right at its defaults; the albedo is 1.6 times too large where the coat is above .9."""

    albedo: go.Colour = go.spectrum(0.5, "share of light that is reflected", low=0.0, high=1.0)
    coat: go.Number = go.number(0.2, "share that is coated", low=0.0, high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        more = go.ops.where(self.coat > 0.9, 1.6, 1.0)
        return self.albedo * (more * go.ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * go.ops.inv_pi, 0.0))


class Unbounded(go.BSDF):
    """A range without an upper end."""

    tint: go.Colour = go.spectrum(0.8, "share of light that is reflected", low=0.0, high=1.0)
    gain: go.Number = go.number(0.25, "of what is given back", low=0.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return self.tint * (self.gain * go.ops.where((wo.z > 0.0) & (wi.z > 0.0), wi.z * go.ops.inv_pi, 0.0))


def test_a_scan_finds_where_something_begins() -> None:
    one = subject.of(BrightCoat())
    found = box.jumps(one, ranges.axes(one), 1)
    assert any(0.88 < jump.get("coat", 0.0) < 0.95 for jump in found)
    assert box.jumps(subject.of(go.Lambert(0.5)), ranges.axes(subject.of(go.Lambert(0.5))), 1) == []


@pytest.mark.slow
def test_a_mistake_in_a_corner_of_the_ranges_is_caught_and_placed() -> None:
    verdict = verify(BrightCoat(), quick=True, law="energy")["energy"]
    assert verdict.failed and verdict.why[0].startswith("at ") and "coat = " in verdict.why[0]
    assert "--param coat=" in verdict.command


@pytest.mark.slow
def test_no_range_is_invented() -> None:
    (axis,) = [a for a in ranges.axes(subject.of(Unbounded())) if a.path == "gain"]
    assert (axis.low, axis.high) == (0.0, 0.25)
    report = verify(Unbounded(), quick=True)
    assert report.passed, str(report)
    assert "gain from 0 to 0.25" in report.cards[0].covered


class Painted(go.BSDF):
    """Half the light is reflected by a facet, half by paint; it knows nothing of delta lobes, and says so."""

    metal: go.BSDF = go.bsdf("between the paint", default=go.Conductor(alpha=0.3))

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        return self.metal.eval(wo, wi, mode) * 0.5 + go.ops.where((wo.z > 0.0) & (wi.z > 0.0), 0.1 * wi.z, 0.0)


def test_an_inner_material_is_made_no_delta_lobe_where_the_outer_says_that_it_has_none() -> None:
    (alpha,) = [axis for axis in ranges.axes(subject.of(Painted())) if axis.path == "metal.alpha"]
    assert 0.0 < alpha.low < 0.03
    both = subject.of(go.TwoSided(go.Conductor(alpha=0.3)))
    (alpha,) = [axis for axis in ranges.axes(both) if axis.path == "base.alpha"]
    assert alpha.low == 0.0  # it hands on what its base says


def test_every_name_of_a_choice_is_tried() -> None:
    places = box.places(subject.of(go.Conductor(alpha=0.3)), EFFORTS["deep"], 1)
    named = [place.values for place in places if place.why == "choice"]
    assert {"ndf": "beckmann"} in named and {"fresnel": "f82"} in named and {"sampling": "bounded"} in named
    assert "ndf = beckmann" in box.covered(subject.of(go.Conductor()), places)


def test_inner_materials_are_tried_as_well_and_the_same_seed_tries_the_same() -> None:
    one = subject.of(go.mix(go.Lambert(0.3), go.Conductor.preset("Au", alpha=0.3), 0.4))
    first, second = ([place.words for place in box.places(one, EFFORTS["default"], 3)] for _ in range(2))
    assert first == second and len(first) == EFFORTS["default"].places
    assert any("b.alpha = " in words for words in first)


def test_colors_and_unequal_widths_are_tried() -> None:
    places = box.places(subject.of(go.Conductor(alpha=0.3)), EFFORTS["default"], 1)
    pairs = [place.values["alpha"] for place in places if place.why == "pair"]
    assert pairs and all(x != y for x, y in pairs)
    colors = [place.values["albedo"] for place in places if place.why == "color"]
    assert any(min(color) == 0.0 and max(color) > 0.8 for color in colors)
    assert "unequal widths" in box.covered(subject.of(go.Conductor(alpha=0.3)), places)


def test_a_fitted_width_of_each_channel_is_no_color() -> None:
    places = box.places(subject.of(go.model("shifted-gamma")()), EFFORTS["deep"], 1)
    colored = {path for place in places if place.why == "color" for path in place.values}
    assert colored == {"diffuse"}


def test_widths_and_wide_ranges_have_steps_of_equal_ratio() -> None:
    film = {axis.path: axis for axis in ranges.axes(subject.of(go.material("film-conductor")))}
    assert {path for path, axis in film.items() if axis.ratio} == {"alpha", "thickness"}  # 0 to 1 and 0 to 3000 nm
    assert film["thickness"].at(0.0) == 0.0 and film["thickness"].at(0.5) == pytest.approx(30.0)
    assert film["film_eta"].at(0.5) == 2.0


def test_the_larger_of_two_exponents_is_the_narrower() -> None:
    report = verify(go.AshikhminShirley(), quick=True, law="isotropy")
    assert report.passed, str(report)
