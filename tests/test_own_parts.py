"""A distribution, a masking term or a Fresnel kind in a file of the user's: wherever a material may stand, one text or
class names it; and what goes wrong in it is one error with its line."""

from __future__ import annotations

import json
import pickle
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import cli, scene
from gonio.catalog import notation, outside
from gonio.material import tree
from gonio.pictures import images
from gonio.render import tiles
from gonio.render.request import Request
from gonio.render.request_json import described as described_request
from gonio.scene.materials import BY_TYPE
from gonio.verify import subject, targets
from gonio.verify.isolation import child

PARTS = '''
import gonio as go
from gonio import ops
from helpers import sqr


class OwnTail(go.NDF):
    """GTR with gamma = 1.5, by D alone."""

    def __init__(self, scale=1.0):
        self.scale = scale

    def D(self, m, alpha):
        spread = sqr(alpha.x) * sqr(m.z) + sqr(m.x) + sqr(m.y)
        return self.scale * 0.5 * alpha.x * (1.0 + alpha.x) * ops.inv_pi * ops.pow(spread, -1.5)


class OwnGrooves(go.Masking):
    """V-shaped grooves."""

    smith = False

    def reflected(self, ndf, wo, wi, m, alpha):
        lower = ops.minimum(ops.abs(wo.z), ops.abs(wi.z))
        return ops.minimum(2.0 * m.z * ops.safe_div(lower, ops.abs(ops.dot(wo, m))), 1.0)


class OwnCurve(go.Fresnel):
    """A steep curve."""

    def curve(self, cos_i, r0):
        return r0 + (1.0 - r0) * ops.pow(1.0 - cos_i, 6.0)


NAMED = OwnTail(scale=1.0)
'''
HELPERS = "from gonio.ops import sqr\n"
MATERIAL = '''
import gonio as go


class OwnMetal(go.BSDF):
    """A metal with a distribution of its own."""

    metal: go.BSDF = go.bsdf("the metal", go.Conductor(alpha=0.3, ndf="parts.py:OwnTail"))
    fresnel: str = go.choice("parts.py:OwnCurve", "its curve", go.Fresnel.family)

    def eval(self, wo, wi, mode="radiance"):
        return self.metal.eval(wo, wi, mode)


class OwnPower(go.BSDF):
    """A lobe by **."""

    kd: go.Colour = go.spectrum(0.5, "share", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        return self.kd * go.ops.where((wo.z > 0) & (wi.z > 0), wi.z ** 2.5, 0.0)
'''
LOOP = '''
import drjit as dr
import gonio as go


class Looked(go.BSDF):
    """It looks at its values, which no loop can."""

    kd: go.Colour = go.spectrum(0.5, "share", low=0.0, high=1.0)

    def eval(self, wo, wi, mode="radiance"):
        value = self.kd * go.ops.where((wo.z > 0) & (wi.z > 0), wi.z * go.ops.inv_pi, 0.0)
        return value if float(dr.sum(wo.z)[0]) > 0.0 else 0.5 * value
'''
NAMES = {"ndf": "own-tail", "masking": "own-grooves", "fresnel": "own-curve"}
CODE = {"ndf": "sub/parts.py:OwnTail", "masking": "sub/parts.py:OwnGrooves", "fresnel": "sub/parts.py:OwnCurve"}
WO, WI = np.array([[0.0, 0.6, 0.8]]), np.array([[0.48, -0.36, 0.8]])


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder whose sub-folder has the user's files; the current folder is another one beside it."""
    (tmp_path / "sub").mkdir()
    (tmp_path / "else").mkdir()
    for name, text in {"parts": PARTS, "helpers": HELPERS, "mine": MATERIAL, "loop": LOOP}.items():
        (tmp_path / "sub" / f"{name}.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    families = (go.NDF.family, go.Masking.family, go.Fresnel.family)
    before = [set(family.all()) for family in families]
    yield tmp_path
    for family, names in zip(families, before, strict=True):
        for name in set(family.all()) - names:
            family.remove(name)


def gonio(*arguments: object) -> int:
    with pytest.raises(SystemExit) as caught:
        cli.main([str(argument) for argument in arguments])
    return int(caught.value.code or 0)


def described(material: dict[str, Any]) -> dict[str, Any]:
    return {
        "output": {"filename": "ball.exr"},
        "sampler": {"type": "independent", "samples": 2},
        "camera": {
            "type": "pinhole",
            "transform": {"position": [0, 1, 4], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
            "verticalFov": 40,
            "film": {"size": [12, 8]},
        },
        "integrator": {"type": "path", "maxDepth": 3},
        "scene": {
            "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": material}],
            "lights": [{"type": "environmentLight", "radiance": 1}],
        },
    }


# --------------------------------------------------------------------------- scenes


@pytest.mark.parametrize("kind", NAMES)
def test_a_scene_names_a_part_by_its_file_where_code_is_allowed(here: Path, kind: str) -> None:
    file = here / "scene.json"
    file.write_text(json.dumps(described({"type": "gonio-conductor", "alpha": 0.3, kind: CODE[kind]})))
    with pytest.raises(go.InputError) as caught:
        scene.read(file)
    assert str(caught.value).count("error") == 0 and f"material/{kind}" in caught.value.where
    assert f"'{CODE[kind]}' is code, which a scene alone does not run" in caught.value.what
    assert "--allow-code" in caught.value.hint and "\n" not in caught.value.what
    assert NAMES[kind] not in {**go.NDF.family.all(), **go.Masking.family.all(), **go.Fresnel.family.all()}
    read = scene.read(file, allow_code=True)
    material = read.contents.shapes[0].material.instance()
    assert getattr(material, kind) == NAMES[kind]
    # whoever does a part of it far away gets the file, and what it imports
    named = scene.sources(read)[1]
    assert {"sub/parts.py", "sub/helpers.py"} <= set(named)


def test_it_is_rendered_from_another_folder(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (here / "scene.json").write_text(json.dumps(described({"type": "gonio-conductor", "alpha": 0.3, **CODE})))
    monkeypatch.chdir(here / "else")
    assert gonio("render", "../scene.json", "-o", "a.exr") == 2
    assert gonio("render", "../scene.json", "-o", "a.exr", "--allow-code") == 0
    picture = images.read(here / "else" / "a.exr").pixels
    outside.member(f"{here}/sub/parts.py:OwnTail")
    same = go.render(
        here / "scene.json",
        overrides={"shapes.0.material": {"type": "gonio-conductor", "alpha": 0.3, **NAMES}},
    )
    np.testing.assert_array_equal(same, picture)


def test_a_part_of_another_kind_is_refused_by_its_kind(here: Path) -> None:
    file = here / "scene.json"
    file.write_text(json.dumps(described({"type": "conductor", "roughness": 0.3, "ndf": CODE["masking"]})))
    with pytest.raises(go.InputError, match="OwnGrooves is a masking term, a microfacet distribution expected"):
        scene.read(file, allow_code=True)
    file.write_text(json.dumps(described({"type": "conductor", "roughness": 0.3, "ndf": "gggx"})))
    with pytest.raises(go.InputError, match="did you mean 'ggx'"):
        scene.read(file, allow_code=True)


def test_what_was_registered_since_is_a_name_in_scenes(here: Path) -> None:
    assert BY_TYPE["gonio-conductor"]  # its class is made
    outside.member("sub/parts.py:OwnTail")
    (here / "scene.json").write_text(json.dumps(described({"type": "gonio-conductor", "ndf": "own-tail"})))
    assert scene.read(here / "scene.json")


@pytest.mark.slow
def test_workers_get_files_with_what_they_import(here: Path) -> None:
    material = notation.named("sub/mine.py:OwnMetal")[0]
    described_material = scene.of_material(material, {})
    files = scene.sources(described_material)[1].values()
    assert {file.name for file in files} == {"mine.py", "parts.py", "helpers.py"}


# --------------------------------------------------------------------------- Python


def test_a_program_gives_classes_instances_and_files(here: Path) -> None:
    program = here / "sub" / "program.py"
    program.write_text(
        "import gonio as go\n"
        "METALS = [go.Conductor(ndf='parts.py:OwnTail'), go.Conductor.preset('Au', ndf='parts.py:OwnTail')]\n"
    )
    space: dict[str, Any] = {}
    exec(compile(program.read_text(), str(program), "exec"), space)
    assert [metal.ndf for metal in space["METALS"]] == ["own-tail", "own-tail"]
    cls: Any = outside.thing("sub/parts.py:OwnTail")
    same = go.Conductor(ndf=cls)
    other = go.Conductor(ndf=cls(scale=0.5), masking=outside.thing("sub/parts.py:OwnGrooves"))
    assert same == space["METALS"][0] and other.ndf == "own-tail-scale-0.5" and other.masking == "own-grooves"
    assert other.eval(WO, WI)[0, 0] < same.eval(WO, WI)[0, 0]
    assert pickle.loads(pickle.dumps(same)) == same and pickle.loads(pickle.dumps(other)) == other
    assert notation.named("conductor(ndf=sub/parts.py:NAMED)")[0].ndf == "own-tail-scale-1.0"


def test_only_a_programs_own_line_runs_a_file(here: Path) -> None:
    """What scenes, pages and documents say reaches a constructor by Gonio's own lines."""
    metal = go.Conductor()
    for change in (
        lambda: tree.replace(metal, {"ndf": f"{here}/sub/parts.py:OwnTail"}),
        lambda: tree.rebuild_from(go.Conductor, {"ndf": f"{here}/sub/parts.py:OwnTail"}),
    ):
        with pytest.raises(go.InputError, match="is code, which is not run from here"):
            change()
    assert "own-tail" not in go.NDF.family.all()


def test_a_material_names_parts_beside_its_own_file(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(here / "else")
    material = notation.named("../sub/mine.py:OwnMetal")[0]
    assert material.metal.ndf == "own-tail" and material.fresnel == "own-curve"


def test_other_processes_know_it_by_its_file(here: Path) -> None:
    material = notation.named("conductor(preset=Au,ndf=sub/parts.py:OwnTail)")[0]
    text = f"{here}/sub/parts.py:OwnTail"
    assert notation.as_json(material)["ndf"] == text and f"ndf={text}" in notation.written(material)
    assert notation.from_json(notation.as_json(material)) == material
    assert f"ndf={text}" in child.item_of(material).settings
    request = Request(Path("conductor"), material=material)
    assert described_request(request)["material"]["$material"]["ndf"] == text


# --------------------------------------------------------------------------- verbs


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    "command",
    [
        "plot conductor -p preset=Au -p ndf=parts.py:OwnTail -o a.png",
        "emit mine.py:OwnMetal -o a.glsl",
        "emit dielectric(ndf=parts.py:OwnTail,masking=parts.py:OwnGrooves) --lang wgsl -o a.wgsl",
        "bake ggx --masking parts.py:OwnGrooves --resolution 4 --lut E -o tables",
        "bake parts.py:OwnTail --resolution 4 --lut E -o tables",
        "explain mine.py:OwnMetal",
        "view kulla-conty(base=conductor(ndf=parts.py:OwnTail,preset=Au)) -o k.html",
        "render conductor(ndf=parts.py:OwnTail,preset=Au) --spp 1 --size 8x8 -o a.exr",
    ],
)
def test_every_verb_takes_it(
    here: Path, command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(here / "sub")
    assert gonio(*command.split()) == 0, capsys.readouterr().err


def test_a_fit_holds_it_fixed(here: Path) -> None:
    from gonio.fitting.fit import moving_of

    material, moving = moving_of("conductor", fixed={"ndf": "sub/parts.py:OwnTail", "k": "2,3,4", "albedo": 1.0})
    assert material.ndf == "own-tail" and material.k == (2.0, 3.0, 4.0)
    assert not any(one.path.startswith("k") for one in moving)


def test_the_command_that_shows_a_failure_again_can_be_run(here: Path) -> None:
    (one,) = targets.resolve("conductor", ["ndf=sub/parts.py:OwnTail", "alpha=0.2"])
    words = shlex.split(one.command("--law", "pdf"))
    assert words[3:7] == ["--param", "ndf=sub/parts.py:OwnTail", "--param", "alpha=0.2"]
    inner = subject.of(go.KullaConty(notation.named("conductor(ndf=sub/parts.py:OwnTail)")[0]))
    words = shlex.split(inner.command())
    (again,) = targets.resolve(words[2], [words[4]])
    assert again.model == inner.model


# --------------------------------------------------------------------------- errors


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "command",
    ["emit sub/mine.py:OwnPower", "verify sub/mine.py:OwnPower --quick", "view sub/mine.py:OwnPower -o p"],
)
def test_a_power_by_two_stars_is_one_message(here: Path, command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio(*command.split()) == 2
    told = capsys.readouterr().err
    assert "`**` on a value" in told and "ops.pow" in told and "mine.py:21" in told


@pytest.mark.slow
def test_an_error_in_a_loop_names_the_users_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gonio("render", "sub/loop.py:Looked", "--spp", "1", "--size", "8x8", "-o", "a.exr") == 2
    told = capsys.readouterr().err
    assert "loop.py:13" in told and "see above" not in told and "bug in Gonio" not in told
    with pytest.raises(go.InputError, match=r"loop\.py:13"):
        go.render(notation.named("sub/loop.py:Looked")[0], spp=1, size=(8, 8))
    # a notebook keeps the error, which must not keep the scene: virtual calls would go to its material too
    with pytest.raises(go.InputError) as kept:
        go.render(notation.named("sub/loop.py:Looked")[0], spp=1, size=(8, 8))
    assert go.render(Path(__file__).parents[1] / "examples" / "shading-balls", spp=1, size=(8, 8)).mean() > 0.0, kept
    # of a worker, which has the file elsewhere
    tiles._copies["/given/loop.py"] = here / "sub" / "loop.py"
    with pytest.raises(go.InputError, match=r"/given/loop\.py:13"), tiles._places_as_given():
        go.render(notation.named("sub/loop.py:Looked")[0], spp=1, size=(8, 8))
    tiles._copies.clear()


def test_a_class_that_comes_by_a_pipe_is_judged_although_its_file_cannot_be_opened() -> None:
    program = """
import gonio as go
from gonio.catalog import outside

class Pale(go.BSDF):
    def eval(self, wo, wi, mode="radiance"):
        return wi.z * go.ops.inv_pi

outside.check_operators(Pale())
"""
    done = subprocess.run([sys.executable, "-"], input=program, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
