"""The TSL build of three.js: materials whose WGSL the package's JavaScript writes when they are first drawn.

    generated(Path("node_modules/three"))     files by name: three-tsl-standard.wgsl, its adapter, ...

`capture.mjs` runs in Node and prints the fragment programs of WebGPURenderer; this module turns each into a function of
two directions. Its adapter is that of the WebGL build, which has the same parameters.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

from ......errors import InputError, MachineError

SECONDS = 60  # Node takes 0.3 s
MEMORY = 1024  # MiB
_BUILD = "build/three.webgpu.js"
_WITHOUT = "adopt without --tsl: the WebGL build is read without running JavaScript"
# Node's permission model, without which a package could write files and start programs; the second name is Node 20's
_PERMISSION = ("--permission", "--experimental-permission")
_BAD_OPTION = 9  # exit code
_ENTRY = re.compile(r"@fragment\s+fn main\s*\(([^{]*)\)\s*->")
_INPUT = re.compile(r"@location\(\s*\d+\s*\)\s*(\w+)\s*:\s*([\w<>]+)")
# the inputs of a fragment program on a flat surface, in the frame of the normal
_GIVEN = {
    "lampDirection": "light",
    "v_normalViewGeometry": "vec3<f32>( 0.0, 0.0, 1.0 )",
    "v_positionViewDirection": "view",
    "v_tangentView": "vec3<f32>( 1.0, 0.0, 0.0 )",
}
_TANGENT = re.compile(r"nodeVarying\d+ : vec4<f32>")  # the tangent with its handedness, an input without a name
_END = """
// By Gonio: a flat surface under a light of irradiance 1. On it the derivatives that three.js takes are 0.
fn dpdx( direction : vec3<f32> ) -> vec3<f32> { return 0.0 * direction; }
fn dpdy( direction : vec3<f32> ) -> vec3<f32> { return 0.0 * direction; }

fn lit( light : vec3<f32>, view : vec3<f32> ) -> vec3<f32> {
	return main( INPUTS ).color.rgb;
}
"""


def generated(package: Path, adapters: Path) -> dict[str, str]:
    """Shaders and adapters by file name.

    package   the folder of three.js
    adapters  the folder of our adapters to the WebGL build
    Raises InputError if the package's programs cannot be obtained or read, MachineError without Node.
    """
    files = {}
    for name, text in _programs(package / _BUILD).items():
        shader = f"three-tsl-{name}.wgsl"
        adapter = (adapters / f"three-{name}.glsl.toml").read_text(encoding="utf-8")
        files[shader] = _function(_checked(text, adapter, shader), shader)
        files[f"{shader}.toml"] = _adapter(adapter)
    return files


def _programs(build: Path) -> dict[str, str]:
    """The fragment programs by material."""
    if not build.is_file():
        raise InputError(f"no {_BUILD}", str(build.parents[1]), "npm's three has it; in a checkout, `npm run build`")
    if (node := shutil.which("node")) is None:
        raise MachineError("TSL needs Node, which was not found", "--tsl", f"install Node 20 or later, or {_WITHOUT}")
    done = _run(node, build)
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if re.match(r"\w*Error\b", line)] or done.stderr.split("\n")
        raise InputError(f"its JavaScript fails with '{said[0][:200]}'", str(build), _WITHOUT)
    try:
        programs = json.loads(done.stdout)
        return {str(name): str(text) for name, text in programs.items()}
    except (ValueError, AttributeError):
        raise InputError("its JavaScript printed more than the programs", str(build), _WITHOUT) from None


def _run(node: str, build: Path) -> subprocess.CompletedProcess[str]:
    script = Path(__file__).with_name("capture.mjs").resolve()
    folder = build.resolve().parents[1]
    read = [f"--allow-fs-read={script}", f"--allow-fs-read={folder}/*", f"--max-old-space-size={MEMORY}"]
    for permission in _PERMISSION:
        command = [node, permission, *read, str(script), str(build.resolve())]
        try:
            done = subprocess.run(
                command, stdin=subprocess.DEVNULL, capture_output=True, text=True, encoding="utf-8", timeout=SECONDS
            )
        except subprocess.TimeoutExpired:
            raise InputError(f"its JavaScript took over {SECONDS} s", str(build), _WITHOUT) from None
        if done.returncode != _BAD_OPTION:
            return done
    raise MachineError("TSL needs Node 20 or later", node, f"update Node, or {_WITHOUT}")


def _function(text: str, name: str) -> str:
    """A program with its entry point turned into a function, and `lit`, which calls it."""
    entry = _ENTRY.search(text)
    if entry is None:
        raise InputError("no fragment program in the output of three.js", name, _WITHOUT)
    inputs = [f"{one} : {kind}" for one, kind in _INPUT.findall(entry[1])]
    values = [
        "vec4<f32>( 1.0, 0.0, 0.0, 1.0 )" if _TANGENT.fullmatch(one) else _GIVEN.get(one.split(" ")[0], "")
        for one in inputs
    ]
    unknown = [one for one, value in zip(inputs, values, strict=True) if not value]
    if unknown or "light" not in values:
        what = f"unknown input {unknown[0]}" if unknown else "no direction of the light"
        raise InputError(f"{what} in the program of this release of three.js", name, _WITHOUT)
    body = f"{text[: entry.start()]}fn main( {', '.join(inputs)} ) ->{text[entry.end() :]}"
    return body + _END.replace("INPUTS", ", ".join(values))


def _checked(text: str, adapter: str, name: str) -> str:
    """A program after a check that its inputs are those of the adapter, with the adapter's name for its table."""
    textures = re.findall(r"var (\w+) : texture_2d<f32>", text)
    uniforms = set(re.findall(r"^\t(\w+) : (?:f32|vec\d<f32>),?$", text, re.MULTILINE))
    parameters = set(re.findall(r"^\[parameters\.(\w+)\]", adapter, re.MULTILINE))
    if len(textures) != 1 or uniforms != parameters:
        other = ", ".join(sorted(uniforms ^ parameters)) or f"{len(textures)} textures"
        raise InputError(f"other inputs in the program of this release of three.js: {other}", name, _WITHOUT)
    return re.sub(rf"\b{textures[0]}(?=\b|_sampler\b)", "dfgLUT", text)


def _adapter(webgl: str) -> str:
    """The adapter to a program, from that of the WebGL build."""
    doc, rest = webgl.partition("\n")[0], webgl[webgl.index("[parameters.") :]
    head = [doc.replace("Material", "NodeMaterial", 1), 'function = "lit"', 'arguments = ["light", "view"]']
    return "\n".join([*head, "cosine = true", "", rest])
