"""A distribution, a masking term and a Fresnel kind of one's own, in a file outside the package, work as Gonio's do."""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.members import Family
from gonio.ops import backend
from gonio.optics import fresnel, masking
from gonio.optics.ndf import distribution

import outside
from chi_square import SIGNIFICANCE, p_value
from sphere import SEED, at, hemisphere

OPTICS = '''
"""Optics of somebody else's."""

import gonio as go
from gonio import ops
from gonio.optics.frame import sin2


class StudentT4(go.Stretched):
    """Student-T with gamma = 4."""

    name = "student-t-4"

    @ops.function
    def density(self, n):
        """1 / (pi n_z^4 (1 + tan^2 / 3)^4)."""
        z2 = ops.sqr(n.z)
        return ops.inv_pi * ops.sqr(z2) / ops.sqr(ops.sqr(z2 + sin2(n) / 3.0))

    @ops.function
    def area(self, v):
        """(h + |v.z|)^3 (3 h - |v.z|) / (16 h^3), h^2 = v.z^2 + 3 sin^2."""
        z = ops.abs(v.z)
        h = ops.sqrt(ops.sqr(z) + 3.0 * sin2(v))
        w = z / h
        return h * ops.sqr(1.0 + w) * (1.0 + w) * (3.0 - w) / 16.0

    @ops.function
    def slope(self, u):
        """tan with tan^2 = 3 ((1 - u)^(-1/3) - 1)."""
        return ops.safe_sqrt(3.0 * (ops.pow(1.0 - u, -1.0 / 3.0) - 1.0))


class Flat(go.NDF):
    """All normals alike, whatever the width: no surface that is stretched."""

    name = "flat"

    def D(self, m, alpha):
        return ops.where(m.z > 0.0, ops.inv_pi + 0.0 * m.z, 0.0)

    def Lambda(self, v, alpha):
        return 0.5 / ops.maximum(ops.abs(v.z), 1e-9) - 0.5

    def sample(self, u1, u2, alpha):
        s, c = ops.sincos(2.0 * ops.pi * u2)
        r = ops.sqrt(u1)
        return ops.vec3(r * c, r * s, ops.safe_sqrt(1.0 - u1))


class Grooves(go.Masking):
    """V-shaped grooves (Torrance1967)."""

    name = "grooves"

    def reflected(self, ndf, wo, wi, m, alpha):
        """min(1, 2 (n.m) (n.v) / (v.m)) of the lower of both."""
        lower = ops.minimum(ops.abs(wo.z), ops.abs(wi.z))
        return ops.minimum(1.0, 2.0 * m.z * lower / ops.maximum(ops.abs(ops.dot(wo, m)), 1e-9))


class Games(go.Fresnel):
    """Schlick's curve with a Gaussian for its power."""

    name = "games"

    def curve(self, cos_i, r0):
        return r0 + (1.0 - r0) * ops.exp(-0.693147 * (5.55473 * cos_i + 6.98316) * cos_i)
'''
POINTS = {
    "gonio.distributions": "a = strangers:StudentT4\nb = strangers:Flat",
    "gonio.maskings": "a = strangers:Grooves",
    "gonio.fresnels": "a = strangers:Games",
}
NAMES = {"ndf": "student-t-4", "masking": "grooves", "fresnel": "games"}
DIRECTIONS, WEIGHTS = hemisphere(400, 120)
KIND = backend.types("float64")


@pytest.fixture
def strangers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    outside.install(tmp_path, "strangers", OPTICS, {})
    monkeypatch.syspath_prepend(tmp_path)
    module = importlib.import_module("strangers")
    families: list[tuple[Family[Any], str]] = []
    for member in (module.StudentT4, module.Flat, module.Grooves, module.Games):
        families.append((member.family, member.family.add(member)))
    yield module
    for family, name in families:
        family.remove(name)


def vector(rows: np.ndarray) -> Any:
    return backend.vector_of(rows, len(np.atleast_2d(rows)[0]), KIND)


@pytest.mark.parametrize("name", ["student-t-4", "flat"])
def test_its_facets_add_up_to_the_surface_that_a_direction_sees(strangers: Any, name: str) -> None:
    ndf, alpha, v = distribution(name), vector(np.array([0.3, 0.6])), at(70, 35)
    d = ndf.D(vector(DIRECTIONS), alpha).numpy()
    assert (d * DIRECTIONS[:, 2]) @ WEIGHTS == pytest.approx(1.0, abs=1e-6)
    visible = np.maximum(DIRECTIONS @ v, 0) * d @ WEIGHTS
    assert ndf.G1(vector(v), alpha).numpy()[0] * visible == pytest.approx(v[2], rel=1e-4)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "chosen",
    [{"ndf": "student-t-4"}, {"ndf": "flat"}, {"masking": "grooves"}, {"fresnel": "games"}, NAMES],
    ids=lambda chosen: "-".join(chosen.values()),
)
def test_a_conductor_samples_what_it_evaluates(strangers: Any, chosen: dict[str, str]) -> None:
    metal = go.Conductor.preset("Au", alpha=(0.4, 0.7), **chosen)
    wo, u = np.tile(at(55, 20), (100_000, 1)), np.random.default_rng(SEED).random((100_000, 3))
    s = metal.sample(wo, u, precision="float64")
    valid = s.pdf > 0
    weight = metal.eval(wo[valid], s.wi[valid], precision="float64") / s.pdf[valid, None]
    np.testing.assert_allclose(s.weight[valid], weight, rtol=1e-9)
    one = at(55, 20)

    def density(wi: np.ndarray) -> np.ndarray:
        return metal.pdf(np.tile(one, (len(wi), 1)), wi, precision="float64")

    assert p_value(s.wi, valid, density)[0] > SIGNIFICANCE
    integral = metal.eval(one, DIRECTIONS, precision="float64").T @ WEIGHTS
    np.testing.assert_allclose(s.weight.mean(0), integral, atol=5 * s.weight.std() / 300)
    assert np.all(integral < 1.0)


@pytest.mark.parametrize("chosen", [{"ndf": "student-t-4"}, {"masking": "grooves"}], ids=["ndf", "masking"])
def test_kulla_conty_closes_its_furnace(strangers: Any, chosen: dict[str, str]) -> None:
    """Tables of what single scattering misses are made for it, on axes chosen by the facts that it inherits."""
    metal = go.Conductor(alpha=0.6, fresnel="one", **chosen)
    whole = go.KullaConty(metal)
    for degrees in (10.0, 50.0, 80.0):
        both = whole.eval(at(degrees), DIRECTIONS, precision="float64")[:, 0] @ WEIGHTS
        assert both == pytest.approx(1.0, abs=3e-3)
        assert metal.eval(at(degrees), DIRECTIONS, precision="float64")[:, 0] @ WEIGHTS < 0.97


def test_a_fresnel_kind_by_its_curve_alone_has_all_that_others_ask(strangers: Any) -> None:
    kind, cos = fresnel.kind("games"), np.linspace(0.0, 1.0, 2001)
    c, eta = KIND.float(cos), KIND.float(1.5)
    schlick = fresnel.kind("schlick")
    cos_t = fresnel.cos_transmitted(c, eta)
    assert np.abs((kind.dielectric(c, cos_t, eta) - schlick.dielectric(c, cos_t, eta)).numpy()).max() < 5e-3
    inside = kind.dielectric(c, fresnel.cos_transmitted(c, 1.0 / eta), 1.0 / eta).numpy()
    assert np.all(inside[cos < np.sqrt(1 - 1 / 1.5**2)] == 1.0), "total reflection"
    # 2 int F mu dmu by a sum, against the rule of ten nodes
    f = kind.conductor(c, KIND.float(0.2), KIND.float(3.0)).numpy()
    mean = np.trapezoid(2.0 * f * cos, cos)
    assert kind.conductor_average(KIND.float(0.2), KIND.float(3.0)).numpy()[0] == pytest.approx(mean, abs=1e-5)
    assert not kind.white


def test_they_are_recorded_as_shader_code_by_their_names(strangers: Any) -> None:
    text = go.emit(go.Conductor.preset("Au", **NAMES))
    assert "StudentT4_density" in text and "1 / (pi n_z^4 (1 + tan^2 / 3)^4)." in text


def test_glass_takes_them_and_keeps_its_energy(strangers: Any) -> None:
    glass = go.Dielectric(1.5, 0.4, ndf="student-t-4", fresnel="games")
    wo, u = np.tile(at(60), (50_000, 1)), np.random.default_rng(SEED).random((50_000, 3))
    power = glass.sample(wo, u, "importance", precision="float64").weight[:, 0]
    assert 0.8 < power.mean() <= 1.0 + 5 * power.std() / np.sqrt(len(power))


@pytest.mark.parametrize("field, near", [("ndf", "student-t-44"), ("masking", "groves"), ("fresnel", "gamess")])
def test_a_misspelt_name_is_an_error_that_knows_theirs(strangers: Any, field: str, near: str) -> None:
    with pytest.raises(InputError, match=f"did you mean '{NAMES[field]}'"):
        go.Conductor(**{field: near})


@pytest.mark.parametrize(
    "ask", [distribution, masking.term, fresnel.kind], ids=["distribution", "masking term", "Fresnel kind"]
)
def test_a_name_that_nobody_has_is_never_another(ask: Any) -> None:
    with pytest.raises(InputError, match=r"unknown .* 'smith-correlatd'"):
        ask("smith-correlatd")


def test_a_member_without_its_formula_says_which_is_missing(strangers: Any) -> None:
    class Hollow(go.Stretched):
        name = "hollow"

    class Empty(go.Fresnel):
        name = "empty"

    alpha = vector(np.array([0.3, 0.3]))
    with pytest.raises(NotImplementedError, match="Hollow has no `density`"):
        Hollow().D(vector(at(30)), alpha)
    with pytest.raises(NotImplementedError, match="Empty has neither `curve` nor"):
        Empty().conductor(KIND.float(1.0), KIND.float(0.2), KIND.float(3.0))


@pytest.mark.slow
def test_a_package_brings_them_to_the_command_line(tmp_path: Path) -> None:
    outside.install(tmp_path, "strangers", OPTICS, POINTS)
    command = ["verify", "conductor", "--quick", "--json", "-o", str(tmp_path / "report")]
    options = [word for name, value in NAMES.items() for word in ("-p", f"{name}={value}")]
    done = outside.gonio(tmp_path, *command, *options)
    assert done.returncode == 0, done.stdout + done.stderr
    verdicts = {v["law"]: v["status"] for v in json.loads(done.stdout)["cards"][0]["verdicts"]}
    assert {"pdf", "energy", "reciprocity", "weight"} <= set(verdicts) and "fail" not in verdicts.values()
    wrong = outside.gonio(tmp_path, *command, "-p", "ndf=student-t-5")
    assert wrong.returncode == 2 and "did you mean 'student-t-4'" in wrong.stdout + wrong.stderr
