"""Materials as text: one notation for every verb."""

from __future__ import annotations

import gonio as go
import numpy as np
import pytest
from gonio.catalog import notation
from gonio.errors import InputError
from gonio.material import BSDF, number, spectrum
from gonio.material.parameters import Value


def same(a: BSDF, b: BSDF) -> bool:
    return notation.written(a) == notation.written(b)


@pytest.mark.parametrize(
    "text",
    [
        "conductor(preset=Au,alpha=.1,ndf=beckmann)",
        " conductor( alpha = .1 , ndf = beckmann , preset = Au ) ",
        "Conductor(preset=Au, ndf=beckmann, alpha=0.1)",
    ],
)
def test_a_material_in_one_text(text: str) -> None:
    made, values = notation.named(text)
    assert same(made, go.Conductor.preset("Au", alpha=0.1, ndf="beckmann"))
    assert made.alpha == 0.1 and made.ndf == "beckmann" and np.allclose(made.eta, go.Conductor.preset("Au").eta)
    assert values["alpha"] == 0.1 and values["preset"] == "Au"


def test_parameters_beside_the_name_come_last() -> None:
    assert notation.named("conductor(alpha=.1)", ["alpha=.1,.4"])[0].alpha == (0.1, 0.4)
    assert same(notation.named("conductor", ["alpha=[.1, .4]"], "Cu")[0], go.Conductor.preset("Cu", alpha=(0.1, 0.4)))


@pytest.mark.parametrize(
    "base",
    [
        "conductor(preset=Au,alpha=.1,albedo=.9,.8,.7)",
        '{"type": "conductor", "preset": "Au", "alpha": .1, "albedo": [0.9, 0.8, 0.7]}',
    ],
)
def test_a_material_in_a_material(base: str) -> None:
    gold = go.Conductor.preset("Au", alpha=0.1, albedo=(0.9, 0.8, 0.7))
    assert same(notation.named("kulla-conty", [f"base={base}"])[0], go.KullaConty(gold))
    assert same(notation.named(f"two-sided(base=kulla-conty(base={base}))")[0], go.two_sided(go.KullaConty(gold)))


def test_what_is_not_given_inside_is_metal() -> None:
    assert same(notation.named("kulla-conty")[0], go.KullaConty(go.Conductor(alpha=0.3)))
    assert same(notation.named("mix(weight=.3)")[0], go.mix(go.Lambert(), go.Conductor(alpha=0.3), 0.3))


def test_what_is_written_is_read_again() -> None:
    gold = go.Conductor.preset("Au", alpha=(0.3, 0.1))
    for material in (
        go.mix(go.KullaConty(gold, color="sheet"), go.Lambert((0.1, 0.2, 0.3)), 0.25),
        go.Dielectric(1.33, 0.2, transmission=False),
        go.Phong(kd=0.2, ks=0.5, p=17.0),
    ):
        again = notation.named(notation.written(material))[0]
        assert type(again) is type(material) and same(again, material)
        assert not same(again, go.Lambert())


class Strict(BSDF):
    """A user's own class without defaults."""

    tint: Value = spectrum(doc="colour")
    power: Value = number(doc="exponent")

    def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
        return self.tint * wi.z


@pytest.mark.parametrize(
    ("text", "given", "words"),
    [
        ("lamberd", [], "did you mean 'lambert'"),
        ("lambert(", [], "is no material"),
        ("lambert(albedo)", [], "sets nothing"),
        ("lambert", ["=3"], "sets nothing"),
        ("lambert", ["albdo=1"], "no parameter 'albdo'"),
        ("lambert", ["albedo=red"], "a number expected"),
        ("lambert", ["albedo=1,2,"], "a number expected"),
        ("lambert", ["albedo=-2"], "-2 given"),
        ("lambert(preset=Au)", [], "no presets"),
        ("dielectric", ["transmission=perhaps"], "true or false"),
        ("dielectric", ["ndf=gxg"], "did you mean 'ggx'"),
        ("mix", ["a=3"], "'3' is no material"),
        ("mix", ['a={"kind": "lambert"}'], "is no material"),
        ("mix", ["a={"], "is no material"),
        ("mix(a=lambert(albedo=-1))", [], "-1 given"),
    ],
)
def test_what_cannot_be_read_is_one_clear_error(text: str, given: list[str], words: str) -> None:
    with pytest.raises(InputError) as caught:
        notation.named(text, given)
    assert words in f"{caught.value} {caught.value.hint}"


def test_what_a_class_needs_is_named() -> None:
    with pytest.raises(InputError, match="needs tint, power"):
        notation.made(Strict, {})
