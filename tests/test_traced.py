"""No verb opens a file that it was not given: traced by the system, in folders with files named like everything."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

import gonio
import pytest

from ball_scene import SCENE

GONIO = Path(sys.executable).with_name("gonio")
TRACE = ("strace", "-f", "-qq", "-y", "-s", "4096", "-e", "trace=open,openat,openat2,execve", "-e", "signal=none")

MODULES = (
    "numpy", "sitecustomize", "usercustomize", "drjit", "mitsuba", "gonio", "tests", "scipy", "PIL", "typing", "json",
    "rich", "typer", "click", "dask", "distributed", "matplotlib", "MaterialX", "pyoidn", "evil", "preload", "gonio_rc",
)  # fmt: skip
LIBRARIES = (
    "libLLVM.so", "libLLVM-19.so", "libLLVM.so.19.1", "libembree4.so", "libembree4.so.4", "libOpenImageDenoise.so",
    "libOpenImageDenoise.so.2", "libOpenImageDenoise_device_cpu.so.2.3.0", "libtbb.so.12", "libdrjit-core.so",
    "libdrjit-extra.so", "libnanothread.so", "libmitsuba.so", "libcuda.so", "libcuda.so.1", "libnvoptix.so.1",
    "libm.so.6", "libz.so.1", "libgcc_s.so.1", "libstdc++.so.6", "libgomp.so.1",
)  # fmt: skip
PLUGINS = (
    "sphere", "rectangle", "cube", "diffuse", "twosided", "path", "perspective", "thinlens", "hdrfilm", "box",
    "gaussian", "independent", "multijitter", "scene", "bitmap", "envmap", "point", "spot", "area", "constant", "merge",
    "d65", "srgb", "uniform", "regular", "ply", "obj",
)  # fmt: skip
SETTINGS = {
    "matplotlibrc": "backend: module://evil\ntext.usetex: True\n",
    ".matplotlib/matplotlibrc": "backend: module://evil\n",
    ".env": "PYTHONSTARTUP=evil.py\nGONIO_PLUGINS=.\n",
    ".embree4": "threads=3\n",
    "dask.yaml": "distributed: {worker: {preload: [evil.py]}, scheduler: {preload: [evil.py]}}\n",
    ".config/dask/dask.yaml": "distributed: {worker: {preload: [evil.py]}}\n",
    "pyproject.toml": "[tool.gonio]\n[tool.typer]\n",
    "setup.cfg": "[options]\n",
    "typer.toml": "x = 1\n",
    "evil.pth": "import evil\n",
    "pyvenv.cfg": "home = .\n",
    "drjit.conf": "x\n",
    "python._pth": ".\n",
    "chromium": "#!/bin/sh\nexit 1\n",
    "gcc": "#!/bin/sh\nexit 1\n",
    "ldconfig": "#!/bin/sh\nexit 1\n",
}

XML = """<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
</film></sensor><shape type="sphere"><bsdf type="diffuse"/></shape><emitter type="constant"/></scene>"""
GLTF = {"asset": {"version": "2.0"}, "materials": [{"name": "m", "pbrMetallicRoughness": {"roughnessFactor": 0.4}}]}

# Each is run in a folder of hostile files; {scene} is a folder with the same files and what it was given for.
COMMANDS = {
    "render": "render {scene}/scene.json --spp 1 --size 8x8 -o {out}/a.png",
    "render Mitsuba's": "render {scene}/scene.xml --spp 1 --size 8x8 -o {out}/a.exr",
    "render glTF": "render {scene}/m.gltf --spp 1 --size 8x8 -o {out}/a.png",
    "render and denoise": "render {scene}/scene.json --spp 1 --size 8x8 --denoise -o {out}/a.png",
    "render with workers": "render {scene}/scene.json --spp 1 --size 8x8 --workers 1 -o {out}/a.png",
    "study": "study {scene}/scene.json --vary /scene/shapes/0/material/p=4,8 --spp 1 --size 8x8 -o {out}/s.png",
    "verify": "verify lambert --quick",
    "verify a plugin": "verify mitsuba:diffuse --quick",
    "view": "view lambert --export {out}/v.html",
    "bake": "bake ggx --size 4 -o {out}/t",
    "fit": "fit {scene}/table.gonio -m lambert -o {out}/f.json",
    "emit": "emit lambert -o {out}/a.glsl",
    "plot": "plot lambert -o {out}/p.png",
    "models": "models",
}
GIVEN = {"scene.json", "scene.xml", "m.gltf", "table.gonio"}


def works() -> bool:
    """Whether processes can be traced here."""
    if shutil.which("strace") is None:
        return False
    return subprocess.run([*TRACE, "-o", os.devnull, "true"], capture_output=True, check=False).returncode == 0


pytestmark = pytest.mark.skipif(not works(), reason="NOTHING IS TRACED: install strace, and allow ptrace")


def fill(folder: Path) -> None:
    """Files named like everything that a program may load of its own accord; Python's leave a mark where they ran."""
    mark = f"open({str(folder.parent / 'ran')!r}, 'a').write(__file__ + '\\n')\n"
    files = {f"{name}.py": mark for name in MODULES} | dict.fromkeys(LIBRARIES, "no library") | SETTINGS
    for place in ("plugins", "lib", "bin", "share/matplotlib"):
        files |= {f"{place}/{name}.so": "no library" for name in PLUGINS} if place == "plugins" else {}
        files |= {f"{place}/{name}": "no library" for name in LIBRARIES[:4]}
    files |= {"gonio/__init__.py": mark, "tests/__init__.py": mark, "data/ior/Au.eta.spd": "300 1\n"}
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
        (folder / name).chmod(0o755)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("traced")
    for name in ("download", "scene"):
        fill(root / name)
    for name in ("out", "tmp", "cache"):
        (root / name).mkdir()
    scene = root / "scene"
    (scene / "scene.json").write_text(json.dumps(SCENE))
    (scene / "scene.xml").write_text(XML)
    (scene / "m.gltf").write_text(json.dumps(GLTF))
    gonio.measure("lambert", output=scene / "table.gonio")
    return root


CALL = re.compile(
    r'(openat2?|open|execve)\((?:AT_FDCWD<[^>]*>, |\d+<([^>]*)>, )?"((?:[^"\\]|\\.)*)".*?(?:= \d+<([^>]*)>)?$'
)


def asked(trace: Path, folder: Path) -> Iterator[Path]:
    """Every file that was opened or run, or looked for in vain; where a link led, too."""
    for line in trace.read_text(errors="replace").splitlines():
        call = CALL.search(line)
        if call is not None:
            yield Path(os.path.normpath(os.path.join(call[2] or folder, call[3])))
            if call[4]:
                yield Path(call[4])


def trusted() -> list[Path]:
    """The packages, the system's folders, and the user's caches and settings."""
    packages = [*sysconfig.get_paths().values(), sys.prefix, sys.base_prefix, str(Path(gonio.__file__).parent)]
    packages += [path for path in sys.path if Path(path).name == "site-packages"]
    system = ["/usr", "/lib", "/lib64", "/bin", "/sbin", "/etc", "/opt", "/proc", "/sys", "/dev", "/var/lib"]
    system += [path for path in os.environ["PATH"].split(os.pathsep) if os.path.isabs(path)]
    home = [str(Path.home() / name) for name in (".drjit", ".cache", ".config", ".embree4", ".local/lib", ".nv")]
    paths = [Path(path) for path in (*packages, *system, *home)]
    return [*paths, *(path.resolve() for path in paths)]


QUICK = ("plot",)


@pytest.mark.slow
@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in COMMANDS])
def test_only_what_was_given_is_opened(name: str, place: Path) -> None:
    folder, trace = place / "download", place / f"{name}.trace"
    command = [str(GONIO), *COMMANDS[name].format(scene=place / "scene", out=place / "out").split()]
    own = {**os.environ, "TMPDIR": str(place / "tmp"), "GONIO_CACHE": str(place / "cache")}
    traced = [*TRACE, "-o", str(trace), *command]
    done = subprocess.run(traced, cwd=folder, env=own, capture_output=True, text=True, check=False, timeout=900)
    assert done.returncode in (0, 1), done.stderr  # 1: a verdict of verify
    allowed = [*trusted(), place / "out", place / "tmp", place / "cache"]
    # a folder may be listed, to find what the user names
    given = {place / "scene" / name for name in GIVEN} | {place, place / "scene", folder}
    python = Path(sys.executable)
    given |= {python.parent, Path(gonio.__file__).parents[1], Path(os.sep)}
    wrong = {
        str(path)
        for path in asked(trace, folder)
        if path not in given and not any(path.is_relative_to(root) for root in allowed)
    }
    assert wrong == set()
    assert not (place / "ran").exists(), (place / "ran").read_text()


@pytest.mark.slow
def test_hostile_scenes_open_nothing_outside_their_folder(tmp_path: Path) -> None:
    import hostile_scenes

    hostile_scenes.outside(tmp_path / "outside")
    for name in ("here", "home"):
        shutil.copytree(tmp_path / "outside", tmp_path / name)
    for name in ("tmp", "cache"):
        (tmp_path / name).mkdir()
    places = {"TMPDIR": "tmp", "GONIO_CACHE": "cache", "HOME": "home"}
    own = {**os.environ, **{variable: str(tmp_path / name) for variable, name in places.items()}}
    command = [*TRACE, "-o", str(tmp_path / "trace"), sys.executable, hostile_scenes.__file__, str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path / "here", env=own, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    names = [name for name, *_ in hostile_scenes.scenes(tmp_path)]
    assert len(done.stdout.splitlines()) == len(names) > 300
    ours = [Path(gonio.__file__).parents[1], Path(__file__).parent]  # Python lists the folders that it imports from
    allowed = [
        *trusted(),
        *ours,
        *(tmp_path / name for name in ("scene", "tmp", "cache", "home/.drjit", "home/.cache")),
    ]
    scene, wrong = "imports", set()
    for path in asked(tmp_path / "trace", tmp_path / "here"):
        if path.is_relative_to(hostile_scenes.MARK):
            scene = names[int(path.name)] if path.name != "end" else "the end"
        elif scene != "imports" and not any(path.is_relative_to(root) for root in allowed):
            wrong.add((scene, str(path)))
    assert wrong == set()
