"""An integrator from outside the package: registered by a program, or brought by an installed package."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from gonio.bridge import engine
from gonio.errors import InputError
from gonio.pictures import images
from gonio.render import request_json
from gonio.render.prepare import prepare
from gonio.render.request import Request
from gonio.transport import integrators

mi = engine.load()

OCCLUSION = '''
import drjit as dr
from gonio.transport.integrators import Integrator, Path
from gonio.transport.integrators.base import FIRST_FREE


class Occlusion(Integrator):
    """The share of the sky that a surface sees, weighted by the cosine."""

    name = "strangersOcclusion"

    def show(self, si, key, index):
        u = self.mi.Point2f(*self.direction_pair(key, index, FIRST_FREE))
        local = self.mi.warp.square_to_cosine_hemisphere(u)
        local.z = dr.mulsign(local.z, si.wi.z)
        ray = self.surfaces.offsets.ray(si, si.to_world(local))
        hidden = self.surfaces.blocked(ray, si.is_valid())
        return self.mi.Color3f(dr.select(hidden, 0.0, 1.0))


class Shallow(Path):
    """Paths that end at a third surface, whatever they carry."""

    name = "shallow"
    takes_depth = True

    @classmethod
    def depth(cls, settings):
        return min(settings.max_depth, 3)
'''

SCENE = {
    "output": {"filename": "picture.exr"},
    "sampler": {"type": "independent", "samples": 64},
    "camera": {
        "type": "pinhole",
        "transform": {"position": [0, 0, 3], "lookAt": [0, 0, 0], "up": [0, 1, 0]},
        "verticalFov": 20,
        "film": {"size": [8, 8]},
    },
    "integrator": {"type": "strangersOcclusion"},
    "scene": {
        "shapes": [{"type": "parallelogram", "base": [-9, -9, 0], "edge0": [18, 0, 0], "edge1": [0, 18, 0]}],
        "lights": [{"type": "environmentLight", "radiance": 1}],
    },
}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(SCENE))
    return path


@pytest.fixture
def registered(tmp_path: Path) -> Iterator[dict[str, type]]:
    space: dict[str, type] = {"__name__": "strangers"}  # type: ignore[dict-item]
    exec(compile(OCCLUSION, str(tmp_path / "occlusion.py"), "exec"), space)
    members = [space["Occlusion"], space["Shallow"]]
    names = [integrators.Integrator.family.add(member) for member in members]
    yield space
    for name in names:
        integrators.Integrator.family.remove(name)


def _picture(scene: Path, **options: object) -> np.ndarray:
    prepared = prepare(Request(scene, **options))  # type: ignore[arg-type]
    prepared.render.advance(prepared.spp)
    return prepared.render.image()


def test_a_registered_integrator_renders_by_the_scenes_word_and_by_the_options(
    scene: Path, registered: dict[str, type]
) -> None:
    assert np.all(_picture(scene) == 1.0), "nothing hides the sky from a plane"
    paths = _picture(scene, integrator="path", max_depth=3)
    assert np.array_equal(_picture(scene, integrator="shallow", max_depth=9), paths)
    assert prepare(Request(scene, integrator="shallow")).settings["max_depth"] == 5


def test_an_integrator_that_is_not_there_is_one_clear_error(scene: Path) -> None:
    with pytest.raises(InputError, match=r"(?s)unknown type 'strangersOcclusion'"):
        prepare(Request(scene))
    scene.write_text(json.dumps({**SCENE, "integrator": {"type": "normal"}}))
    with pytest.raises(InputError, match=r"(?s)--integrator: unknown integrator 'whited'.*did you mean 'whitted'"):
        _picture(scene, integrator="whited")


def test_the_base_class_is_found_by_its_old_name() -> None:
    with pytest.warns(DeprecationWarning, match="Transport is now Path"):
        old = integrators.Transport
    assert issubclass(old, integrators.Path) and old.depth(integrators.Settings("path")) == 2


def test_names_are_taken_once(registered: dict[str, type]) -> None:
    class Another(integrators.Path):
        """Another one."""

        name = "path"

    with pytest.raises(InputError, match="the integrator 'path' already exists"):
        integrators.Integrator.family.add(Another)


def test_a_file_brings_one_without_being_installed(scene: Path, tmp_path: Path) -> None:
    scene.write_text(json.dumps({**SCENE, "integrator": {"type": "normal"}}))
    file = tmp_path / "files" / "ao.py"
    file.parent.mkdir()
    file.write_text(OCCLUSION.replace("strangersOcclusion", "ambient_of_a_file"))
    try:
        assert np.all(_picture(scene, integrator=f"{file}:Occlusion", spp=4) == 1.0)
        with pytest.raises(InputError, match="no class 'Occlude'") as refused:
            _picture(scene, integrator=f"{file}:Occlude", spp=4)
        assert "Occlusion" in refused.value.hint
        file.write_text("import gonio as go\nclass Red(go.Lambert):\n    pass\n")
        with pytest.raises(InputError, match="Red is a material, an integrator expected"):
            _picture(scene, integrator=f"{file}:Red", spp=4)
    finally:
        integrators.Integrator.family.remove("ambient_of_a_file")


def test_a_checkpoint_runs_no_file_without_permission(scene: Path, tmp_path: Path) -> None:
    facts = request_json.described(Request(scene, integrator="ao.py:Occlusion"))
    with pytest.raises(InputError, match="Python files"):
        request_json.request_of(facts, "a.checkpoint", allow_code=False)
    # a process in another folder finds the file, too
    assert request_json.request_of(facts, "a.checkpoint", allow_code=True).integrator == f"{Path.cwd()}/ao.py:Occlusion"


@pytest.mark.slow
def test_an_installed_package_brings_one_for_the_command_line(scene: Path, tmp_path: Path) -> None:
    package = tmp_path / "site"
    metadata = package / "occlusion-1.0.dist-info"
    metadata.mkdir(parents=True)
    (package / "occlusion.py").write_text(OCCLUSION)
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: occlusion\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[gonio.integrators]\nocclusion = occlusion:Occlusion\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(package), os.environ.get("PYTHONPATH", "")])}

    def gonio(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "gonio.cli", *words]
        return subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path, timeout=120)

    done = gonio("render", str(scene), "--integrator", "strangersOcclusion", "--spp", "4", "-o", "sky.exr")
    assert done.returncode == 0, done.stderr
    picture = images.read(tmp_path / "sky.exr")
    assert np.all(picture.pixels == 1.0) and picture.metadata["integrator"] == "strangersOcclusion"
    choices = json.loads(gonio("schema").stdout)["$defs"]["Integrator"]["properties"]["type"]["oneOf"]
    title = "The share of the sky that a surface sees, weighted by the cosine"
    assert {"const": "strangersOcclusion", "description": title} in choices
