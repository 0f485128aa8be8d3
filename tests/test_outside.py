"""A material, a distribution, a masking term, a Fresnel kind and a verb from outside the package, end to end: one file
each, and every verb takes them as it takes Gonio's own."""

from __future__ import annotations

import json
import pickle
from collections.abc import Iterator
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.bridge import engine
from gonio.catalog import outside as files
from gonio.members import Family
from gonio.pictures import images

import outside

WARD = '''
import gonio as go
from gonio.ops import exp, inv_pi, maximum, sqr, sqrt, where
from gonio.optics.frame import half_vector


@go.register
class OwnWard(go.BSDF):
    """Ward's Gaussian gloss on a diffuse floor."""

    kd: go.Colour = go.spectrum(0.3, "diffuse share", low=0.0, high=1.0)
    ks: go.Colour = go.spectrum(0.2, "glossy share", low=0.0)
    alpha: go.Width = go.width(0.2, "width of the lobe", low=0.02)

    def eval(self, wo, wi, mode="radiance"):
        """(kd / pi + ks exp(-tan^2 / alpha^2) / (4 pi ax ay sqrt(cos cos))) cos theta_i."""
        above = (wo.z > 0.0) & (wi.z > 0.0)
        h = half_vector(wo, wi)
        tan2 = (sqr(h.x / self.alpha.x) + sqr(h.y / self.alpha.y)) / maximum(sqr(h.z), 1e-9)
        area = 4.0 * go.ops.pi * self.alpha.x * self.alpha.y
        lobe = exp(-tan2) * wi.z / (area * sqrt(maximum(wo.z * wi.z, 1e-9)))
        return self.kd * where(above, wi.z * inv_pi, 0.0) + self.ks * where(above, lobe, 0.0)
'''

FACETS = '''
import gonio as go
from gonio.ops import abs, inv_pi, where
from gonio.optics.warp import square_to_cosine_hemisphere


@go.register
class Flat(go.NDF):
    """All normals alike."""

    name = "own-flat"

    def D(self, m, alpha):
        return where(m.z > 0.0, inv_pi + 0.0 * m.z, 0.0)

    def Lambda(self, v, alpha):
        return (1.0 + abs(v.z)) / (2.0 * abs(v.z)) - 1.0

    def sample(self, u1, u2, alpha):
        return square_to_cosine_hemisphere(u1, u2)


@go.register
class Open(go.Masking):
    """Cavities of V: the nearer wall hides (Torrance1967)."""

    name = "own-open"

    def reflected(self, ndf, wo, wi, m, alpha):
        return ndf.G1(wo, alpha) * ndf.G1(wi, alpha)


@go.register
class Steep(go.Fresnel):
    """A steeper curve than Schlick's."""

    name = "own-steep"

    def curve(self, cos_i, r0):
        c = 1.0 - cos_i
        return r0 + (1.0 - r0) * (c * c * c * c * c * c)
'''

VERB = '''
from typing import Annotated

from gonio.cli.verbs.base import SUPPORT, verb
from typer import Argument


@verb(SUPPORT)
def salute(name: Annotated[str, Argument()]) -> None:
    """Salute somebody."""
    print(f"Hail, {name}")
'''


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with the user's files, the current one; what they register is taken back."""
    (tmp_path / "ward.py").write_text(WARD)
    (tmp_path / "facets.py").write_text(FACETS)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    families: list[tuple[Family, str]] = [(go.BSDF.family, "own-ward"), (go.NDF.family, "own-flat")]
    families += [(go.Masking.family, "own-open"), (go.Fresnel.family, "own-steep")]
    for family, name in families:
        family.remove(name)


def gonio(*arguments: object) -> int:
    with pytest.raises(SystemExit) as caught:
        cli.main([str(argument) for argument in arguments])
    return int(caught.value.code or 0)


def scene(material: dict) -> dict:
    return {
        "output": {"filename": "ball.exr"},
        "sampler": {"type": "independent", "samples": 4},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 1, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
            "verticalFov": 40,
            "film": {"size": [24, 16]},
        },
        "integrator": {"type": "directSampleLight"},
        "scene": {
            "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": material}],
            "lights": [{"type": "spotLight", "position": [2, 3, 4], "energy": [40, 40, 40]}],
        },
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        "plot ward.py:OwnWard -o w.png",
        "plot ward.py:OwnWard lambert --kind slice -o w.png",
        "emit ward.py:OwnWard --lang wgsl -o w.wgsl",
        "bake ward.py:OwnWard --resolution 4 -o tables",
        "bake facets.py:Flat --resolution 4 --lut E -o tables",
        "explain ward.py:OwnWard",
        "render ward.py:OwnWard -p alpha=.1,.3 --spp 1 --size 16x16 -o w.exr",
        "render mix(a=ward.py:OwnWard,b=mirror) --spp 1 --size 16x16 -o m.exr",
        pytest.param("compensation ward.py:OwnWard --samples 1000", marks=pytest.mark.slow),  # tabulates at 20 widths
        "view ward.py:OwnWard -o w.html",
        "view kulla-conty(base=conductor(ndf=facets.py:Flat)) -o k.html",
        "emit conductor(preset=Au,masking=facets.py:Open,fresnel=facets.py:Steep)",
        "plot conductor -p ndf=facets.py:Flat -p preset=Au -o d.png",
        "verify ward.py:OwnWard --quick -p kd=.2 -p ks=.1 --law linearity",
        "verify conductor -p preset=Au -p ndf=facets.py:Flat -p masking=facets.py:Open --quick --law positivity",
    ],
)
def test_every_verb_takes_what_stands_in_a_file(here: Path, command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio(*command.split()) == 0, capsys.readouterr().err


def test_a_scene_takes_a_file_where_code_is_allowed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "scene.json").write_text(json.dumps(scene({"type": "ward.py:OwnWard", "alpha": [0.1, 0.3]})))
    assert gonio("render", "scene.json") == 2
    told = capsys.readouterr().err
    assert "--allow-code" in told and "shapes/0/material/type" in told
    assert gonio("render", "scene.json", "--allow-code") == 0
    own = images.read(here / "ball.exr").pixels
    assert own.max() > 0.1
    # a file that is relative to the scene, seen from elsewhere, gives the same picture as the registered name
    picture = go.render(here / "scene.json", allow_code=True)
    np.testing.assert_array_equal(picture, own)


@pytest.mark.slow
def test_what_is_registered_is_known_by_name_everywhere(here: Path) -> None:
    (here / "scene.json").write_text(json.dumps(scene({"type": "conductor", "roughness": 0.2, "eta": 1, "k": 2})))
    before = go.render(here / "scene.json")
    from gonio.catalog.outside import load

    own = load("ward.py:OwnWard")
    assert go.models()["own-ward"] is own and go.OwnWard is own and "OwnWard" in dir(go)
    (here / "named.json").write_text(json.dumps(scene({"type": "own-ward", "kd": [0.5, 0.1, 0.1]})))
    by_name = go.render(here / "named.json")
    assert by_name.max() > 0.1 and not np.array_equal(by_name, before)
    mi = engine.load()
    import gonio.mitsuba

    assert isinstance(mi.load_dict({"type": "gonio_own_ward", "kd": 0.2}), mi.BSDF)
    assert gonio.mitsuba is not None
    assert go.plot("own-ward", kind="slice") is not None
    compensated = go.KullaConty(go.OwnWard(kd=0.2))
    assert np.all(compensated.eval([[0, 0.6, 0.8]], [[0.0, 0.0, 1.0]]) > 0)


def test_a_program_renders_materials_and_sets_them_in_scenes(here: Path) -> None:
    (here / "scene.json").write_text(json.dumps(scene({"type": "matte"})))
    grey = go.render(here / "scene.json")
    same = go.render(here / "scene.json", overrides={"shapes.0.material": go.Lambert(0.5)})
    np.testing.assert_array_equal(same, grey)
    gold = go.KullaConty(go.Conductor.preset("Au", alpha=(0.1, 0.4)))
    assert not np.array_equal(go.render(here / "scene.json", overrides={"shapes.*.material": gold}), grey)
    assert go.render(gold, size=(16, 16), spp=1).shape == (16, 16, 3)


def test_a_historic_model_gives_its_name_to_a_users_own(tmp_path: Path) -> None:
    file = tmp_path / "ward.py"
    file.write_text("import gonio as go\n\nclass Ward(go.BSDF):\n    def eval(self, wo, wi): return wi.z + 0.0 * wi\n")
    ours = go.model("ward")
    own = files.load(f"{file}:Ward")
    go.register(own)
    try:
        assert go.model("ward") is own
    finally:
        go.BSDF.family.remove("ward")
    assert go.model("ward") is ours


def test_a_name_of_gonios_own_is_not_taken(here: Path) -> None:
    class Lambert(go.BSDF):
        """Not Gonio's."""

        def eval(self, wo, wi, mode="radiance"):
            return 0.0 * wi

    with pytest.raises(go.InputError, match="the material 'lambert' already exists"):
        go.register(Lambert)
    with pytest.raises(go.InputError, match="not a member of a family"):
        go.register(int)


def test_a_saved_file_takes_the_place_of_its_former_self(here: Path) -> None:
    from gonio.catalog.outside import load

    first = load("ward.py:OwnWard")
    assert load("ward.py:OwnWard") is first
    (here / "ward.py").write_text(WARD.replace("go.spectrum(0.3", "go.spectrum(0.35"))
    second = load("ward.py:OwnWard")
    assert second is not first and second().kd == 0.35 and go.OwnWard is second


@pytest.mark.parametrize(
    ("body", "what", "hint"),
    [
        ("return wi.z", "eval returned a float, a spectrum expected", "color"),
        ("return 1 / zero", "NameError", "correct"),
        ("if wo.z > 0:\n            return self.kd\n        return self.kd", "Python `if`", "where"),
        ("for _ in range(wo.z):\n            pass\n        return self.kd", "integer", "must not depend on values"),
        ("return (", "SyntaxError", "correct"),
    ],
)
def test_a_faulty_formula_is_one_error_with_its_line(
    here: Path, body: str, what: str, hint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "import gonio as go\n\n\nclass Bad(go.BSDF):\n    kd: go.Colour = go.spectrum(0.5, 'share')\n\n"
    (here / "bad.py").write_text(f"{text}    def eval(self, wo, wi, mode='radiance'):\n        {body}\n")
    assert gonio("emit", "bad.py:Bad") == 2
    told = capsys.readouterr().err
    assert what in told and hint in told and "bad.py:" in told


def test_a_package_brings_members_by_entry_points(tmp_path: Path) -> None:
    plain = WARD.replace("@go.register\n", "")
    points = {"gonio.models": "own-ward = wardpackage:OwnWard", "gonio.verbs": "salute = saluteverb:salute"}
    outside.install(tmp_path, "wardpackage", plain, {"gonio.models": points["gonio.models"]})
    outside.install(tmp_path, "saluteverb", VERB, {"gonio.verbs": points["gonio.verbs"]})
    done = outside.gonio(tmp_path, "explain", "own-ward")
    assert done.returncode == 0 and "gonio_own_ward" in done.stdout, done.stderr
    assert outside.gonio(tmp_path, "salute", "Ward").stdout == "Hail, Ward\n"


def test_a_material_equals_its_pickled_copy() -> None:
    for material in (
        go.KullaConty(go.Conductor.preset("Au", alpha=(0.1, 0.4))),
        go.mix(go.Lambert(np.array([0.1, 0.2, 0.3])), go.Mirror(), 0.25),
    ):
        copy = pickle.loads(pickle.dumps(material))
        assert copy == material and hash(copy) == hash(material)
        wo, wi = [[0, 0.6, 0.8]], [[0.6, 0.0, 0.8]]
        np.testing.assert_array_equal(copy.eval(wo, wi), material.eval(wo, wi))
    assert go.Lambert(0.5) != go.Lambert(0.4) and go.Lambert(0.5) != go.Mirror(0.5)


def test_directions_must_be_unit_vectors() -> None:
    with pytest.raises(go.InputError, match="row 1 has length 2, unit vectors expected"):
        go.Lambert(0.5).eval([[0, 0, 1], [0, 0, 2]], [[0, 0, 1]])
    with pytest.raises(go.InputError, match="row 0 has length 0"):
        go.Lambert(0.5).sample([[0, 0, 0]], [[0.5, 0.5, 0.5]])
