"""Materials as text: one notation for every verb."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.catalog import notation
from gonio.cli import options
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


def test_one_value_per_ray_is_not_written_out() -> None:
    assert notation.written(np.zeros((2000, 3))) == "an array of shape (2000, 3)"


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
        ("lambert(", [], "is not a material"),
        ("lambert(albedo)", [], "NAME=VALUE expected"),
        ("lambert", ["=3"], "NAME=VALUE expected"),
        ("lambert", ["albdo=1"], "no parameter 'albdo'"),
        ("lambert", ["albedo=red"], "a number expected"),
        ("lambert", ["albedo=1,2,"], "a number expected"),
        ("lambert", ["albedo=-2"], "-2 given"),
        ("lambert(preset=Au)", [], "no presets"),
        ("dielectric", ["transmission=perhaps"], "true or false"),
        ("dielectric", ["ndf=gxg"], "did you mean 'ggx'"),
        ("mix", ["a=3"], "'3' is not a material"),
        ("mix", ['a={"kind": "lambert"}'], "is not a material"),
        ("mix", ["a={"], "is not a material"),
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


@pytest.mark.parametrize(
    ("text", "given"),
    [
        ("kulla-conty", ["base=conductor", "base.alpha=.35", "base.preset=Au"]),
        ("kulla-conty", ["base.alpha=.35", "base.preset=Au", "base=conductor"]),
        ("kulla-conty(base.preset=Au,base=conductor(alpha=.1))", ["base.alpha=.35"]),
        ("kulla-conty(base.alpha=.35,base=conductor(preset=Au))", []),
        ("kulla-conty", ['base={"type": "conductor", "preset": "Au"}', "base.alpha=.35"]),
    ],
)
def test_a_path_leads_into_a_material_whatever_the_order(text: str, given: list[str]) -> None:
    assert notation.named(text, given)[0] == go.KullaConty(go.Conductor.preset("Au", alpha=0.35))


def test_a_path_leads_through_several_materials() -> None:
    found = notation.named("mix", ["b.base.alpha=.2,.4", "b=kulla-conty", "a.albedo=.25"])[0]
    assert found == go.mix(go.Lambert(0.25), go.KullaConty(go.Conductor(alpha=(0.2, 0.4))))
    assert notation.named("kulla-conty", ["base.alpha=.2"])[0].base.alpha == 0.2  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["bse.alpha=.2"], "did you mean 'base'?"),
        (["base.alhpa=.2"], "did you mean 'alpha'?"),
        (["base.alpha.x=.2"], "'alpha' of conductor is not a material"),
        (["base=lambert", "base.alpha=.2"], "lambert has no parameter 'alpha'"),
        (["base.alpha=-1"], "-1 given"),
    ],
)
def test_a_path_that_leads_nowhere_is_one_clear_error(given: list[str], words: str) -> None:
    with pytest.raises(InputError) as caught:
        notation.named("kulla-conty", given)
    assert words in f"{caught.value} {caught.value.hint}"


def test_a_path_is_shared_by_the_materials_that_have_it() -> None:
    found = notation.several(["kulla-conty", "lambert", "mix"], ["base.alpha=.35", "b.alpha=.2"])
    assert [given for _, given in found] == [{"base.alpha": ".35"}, {}, {"b.alpha": ".2"}]
    with pytest.raises(InputError, match=r"unknown parameter 'base\.alhpa'"):
        notation.several(["kulla-conty", "turquin"], ["base.alhpa=.35"])


def test_json_is_a_material_at_the_top_too() -> None:
    assert notation.named('{"type": "gonio-conductor", "alpha": .3}(alpha=.2)')[0] == go.Conductor(alpha=0.2)
    with pytest.raises(InputError, match='an object with a "type" expected'):
        notation.named('{"kind": "lambert"}')


def test_values_of_a_material_change_by_path() -> None:
    gold = go.KullaConty(go.Conductor.preset("Au", alpha=0.35))
    found = notation.changed(gold, {"base.alpha": [0.1, 0.2], "base.ndf": "beckmann"})
    assert found == go.KullaConty(go.Conductor.preset("Au", alpha=(0.1, 0.2), ndf="beckmann"))
    with pytest.raises(InputError, match="no parameter 'alhpa'"):
        notation.changed(gold, {"base.alhpa": 0.1})


def test_naming_a_material_finds_no_tables(tmp_path: Path) -> None:
    """They take up to half a minute and hundreds of megabytes: they are found when a formula first asks."""
    program = (
        "import sys, gonio as go\n"
        "from gonio.catalog import notation\n"
        "for name in set(go.models()) - {'measured'}:  # that reads its file\n"
        "    try: notation.named(name)\n"
        "    except go.InputError: pass  # a required parameter is missing\n"
        "notation.named('coat(base=kulla-conty(base=conductor),alpha=.3)')\n"
        "assert 'drjit' not in sys.modules"
    )
    environment = {**os.environ, "GONIO_CACHE": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.rglob("*.np*"))


@pytest.mark.parametrize(
    ("text", "given", "expected"),
    [
        ("lambert+conductor(alpha=.2)", [], "sum(a=lambert,b=conductor(alpha=.2))"),
        ("lambert+ggx", ["k=1"], "sum(a=lambert,b=conductor(fresnel=schlick,eta=1.5,k=1))"),
        ("lambert+ggx(alpha=.2)", ["b.k=1"], "sum(a=lambert,b=conductor(fresnel=schlick,eta=1.5,k=1,alpha=.2))"),
        ("lambert+phong+ggx", ["k=2"], "sum(a=sum(a=lambert,b=phong),b=conductor(fresnel=schlick,eta=1.5,k=2))"),
        ("two-sided(base=lambert+phong)", ["p=9"], "two-sided(base=sum(a=lambert,b=phong(p=9)))"),
        ("lambert(albedo=1e-1)", [], "lambert(albedo=0.1)"),
    ],
)
def test_a_sum_stands_wherever_a_material_can(text: str, given: list[str], expected: str) -> None:
    assert same(notation.named(text, given)[0], notation.named(expected)[0])
    if given:  # the command line appends its options to the text
        assert same(notation.named(options.Material(param=given).text(text))[0], notation.named(expected)[0])


def test_a_name_in_several_parts_of_a_sum_is_ambiguous() -> None:
    with pytest.raises(InputError, match=r"ambiguous: a\.albedo and b\.albedo"):
        notation.named("lambert+ggx", ["albedo=.3"])
    with pytest.raises(InputError, match="no parameter 'kk'"):
        notation.named("lambert+ggx", ["kk=0"])
