"""No file runs as native code unless the user named its folder.

A plugin in these tests is a file that no system can load: whoever tries is told so by an error.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from gonio.bridge import adapter, engine, plugin_search
from gonio.errors import InputError
from gonio.render import doctor
from gonio.render.request import Request
from gonio.scene import mitsuba_scene
from gonio.verify import targets

from ball_scene import SCENE

XML = """<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective"><film type="hdrfilm"/></sensor>
%s</scene>"""
SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
TRIED = "Error while loading plugin"  # Mitsuba's words where it has opened a file and the system refuses it


def plugin(folder: Path, name: str) -> Path:
    """A file that Mitsuba would load as the plugin of that name, from that folder."""
    file = folder / "plugins" / (name + SUFFIX)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(b"no library")
    return file


def load(file: Path, content: str, allow_code: bool = False) -> object:
    file.write_text(XML % content)
    mi = engine.load("cpu")
    request = Request(file, allow_code=allow_code)
    return mitsuba_scene.load(
        mi, request.scene, mitsuba_scene.read(request.scene, {}, request.allow_outside, request.allow_code)
    )


@pytest.mark.parametrize(
    "content",
    [
        '<shape type="evil"/>',
        '<default name="kind" value="evil"/><shape type="$kind"/>',
        '<shape type="cube"><bsdf type="diffuse"><spectrum name="reflectance" type="evil"/></bsdf></shape>',
        '<include filename="more.xml"/>',
    ],
)
def test_a_scene_runs_no_plugin_of_its_folder(tmp_path: Path, content: str) -> None:
    plugin(tmp_path, "evil")
    (tmp_path / "more.xml").write_text('<scene version="3.0.0"><shape type="evil"/></scene>')
    with pytest.raises(InputError, match=r"native code.*which scenes may not run by default") as caught:
        load(tmp_path / "a.xml", content)
    assert "--allow-code" in caught.value.hint


def test_a_scene_runs_a_plugin_of_its_folder_where_that_is_allowed(tmp_path: Path) -> None:
    plugin(tmp_path, "evil")
    with pytest.raises(InputError, match=TRIED):
        load(tmp_path / "a.xml", '<shape type="evil"/>', allow_code=True)


@pytest.mark.parametrize("kind", ["../evil", "sub/../../evil", "evil.x", "..", ""])
def test_a_plugin_is_no_path(tmp_path: Path, kind: str) -> None:
    plugin(tmp_path / "plugins", "evil")
    with pytest.raises(InputError, match="is not a plugin type"):
        load(tmp_path / "a.xml", f'<shape type="{kind}"/>')
    with pytest.raises(InputError, match="is not a plugin type"):
        load(tmp_path / "a.xml", f'<shape type="{tmp_path}/evil"/>')


def test_a_scene_gives_no_addresses_of_memory(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="memory addresses"):
        load(tmp_path / "a.xml", '<shape type="blender"/>')


def test_the_current_folder_gives_no_plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mi = engine.load("cpu")
    scene = tmp_path / "scene"
    scene.mkdir()
    monkeypatch.chdir(tmp_path)
    file = plugin(tmp_path, "evil")
    for ask in (
        lambda: load(scene / "a.xml", '<shape type="evil"/>'),
        lambda: targets.resolve("mitsuba:evil"),
        lambda: targets.resolve('{"type": "twosided", "bsdf": {"type": "evil"}}'),
    ):
        with pytest.raises(InputError, match="native code in the current folder"):
            ask()
    file.unlink()
    # `load_dict` asks for the kind of each plugin in a variant for which Python has not registered it
    plugin(tmp_path, "gonio_lambert")
    with pytest.raises(InputError, match=r"gonio_lambert.*native code in the current folder"):
        adapter.register(mi)


def test_a_description_adds_no_folders() -> None:
    with pytest.raises(InputError, match="resources"):
        targets.resolve('{"type": "diffuse", "a": {"type": "resources", "path": "."}}')
    with pytest.raises(InputError, match="is not a plugin type"):
        targets.resolve("mitsuba:../evil")


def test_a_folder_that_the_user_names_gives_plugins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plugin(tmp_path, "evil")
    monkeypatch.setenv(plugin_search.VARIABLE, os.pathsep.join(["", str(tmp_path)]))
    assert plugin_search.check("evil", "here") is None
    assert plugin_search.trusted() == [plugin_search.package(), tmp_path]


@pytest.mark.slow
def test_any_scene_renders_in_a_folder_with_plugins_named_as_mitsubas(tmp_path: Path) -> None:
    """In a process of its own: Mitsuba remembers the folder in which it was imported, and plugins once loaded."""
    for name in ("sphere", "spot", "path", "perspective", "hdrfilm", "independent", "srgb", "diffuse", "merge"):
        plugin(tmp_path, name)
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    (tmp_path / "a.xml").write_text(XML % '<shape type="sphere"/><emitter type="constant"/>')
    code = """
import gonio as go
from pathlib import Path
from gonio.render import run
go.render("scene.json", spp=1)
run.prepare(run.Request(Path("a.xml")))
import mitsuba as mi
print([str(path) for path in mi.file_resolver()] == [str(Path(mi.__file__).parent)])
"""
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "True\n"), done.stderr


def test_the_doctors_trial_runs_no_python_of_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "numpy.py").write_text("raise SystemExit('the wrong file')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(doctor, "_TRIAL", "import numpy")
    assert doctor._try("cpu") == ("", "")
