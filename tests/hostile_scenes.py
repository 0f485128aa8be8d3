"""A process that reads hostile scenes: `python hostile_scenes.py FOLDER`, which has `outside`, `home` and `here`.

Each scene names one file in a way that leads outside its folder. Before each, a mark is opened in vain, so that whoever
traces the process can tell the scenes apart.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import struct
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as go

from ball_scene import SCENE

MARK = "/hostile/scene/"
SQUARE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""
XML = """<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"><film type="hdrfilm">
<integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
<shape type="sphere"><bsdf type="diffuse"/></shape><emitter type="constant"/>%s</scene>"""
MTLX = """<materialx version="1.38">%s<open_pbr_surface name="s" type="surfaceshader">
<input name="base_color" type="color3" nodename="i"/></open_pbr_surface><image name="i" type="color3">
<input name="file" type="filename" value="%s"/></image><surfacematerial name="m" type="material">
<input name="surfaceshader" type="surfaceshader" nodename="s"/></surfacematerial></materialx>"""
GLSL = "%s\nfloat BRDF(vec3 L, vec3 V, vec3 N) { return 0.3; }\n"


def png() -> bytes:
    """One gray pixel."""
    parts = [(b"IHDR", struct.pack(">2I5B", 1, 1, 8, 2, 0, 0, 0)), (b"IDAT", zlib.compress(b"\0\x80\x80\x80"))]
    chunks = [
        struct.pack(">I", len(x)) + k + x + struct.pack(">I", zlib.crc32(k + x)) for k, x in (*parts, (b"IEND", b""))
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def outside(folder: Path) -> None:
    """Files that a scene would like to have: all of them are sound."""
    folder.mkdir()
    go.measure("lambert", output=folder / "a.gonio")
    files: dict[str, str | bytes] = {
        "a.obj": SQUARE, "a.ply": PLY, "a.png": png(), "a.xml": '<scene version="3.0.0"/>', "a.glsl": GLSL % "",
        "a.mtlx": MTLX % ("", "a.png"), "a.mtl": "newmtl m\nmap_Kd a.png\n", "a.bin": bytes(36),
        "a.spd": "400 1\n700 1\n",
        "a.toml": 'function = "BRDF"\n', "a.json": '{"type": "lambert"}', "a.py": "raise SystemExit\n",
        "a.gltf": json.dumps({"asset": {"version": "2.0"}, "materials": [{"name": "m"}]}),
    }  # fmt: skip
    for name, content in files.items():
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)


def lab(material: dict[str, Any] | None = None, **shape: Any) -> str:
    """The lab's scene with another material or shape."""
    scene = json.loads(json.dumps(SCENE))
    only = scene["scene"]["shapes"][0]
    if shape:
        only.clear()
        only.update(shape, material={"type": "matte"})
    only["material"] = material or only["material"]
    return json.dumps(scene)


def sky() -> str:
    scene = json.loads(lab())
    scene["scene"]["lights"] = [{"type": "environmentLight", "texture": {"type": "imageTex", "file": "@"}}]
    return json.dumps(scene)


def gltf(**parts: Any) -> str:
    texture = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    return json.dumps({"asset": {"version": "2.0"}, "materials": [{"name": "m", **texture}], **parts})


def forms() -> dict[str, tuple[str, dict[str, str]]]:
    """By name: the ending of the file that is asked for, and the files; @ stands for its path, ^ for its folder."""
    shader, beside = lab({"type": "shader", "file": "my.glsl"}), {"my.glsl": GLSL % ""}
    documents = {kind: lab({"type": kind, "file": "m." + kind, "material": "m"}) for kind in ("gltf", "materialx")}
    pictures = {"images": [{"uri": "@"}], "textures": [{"source": 0}]}
    buffers = {
        "images": [{"bufferView": 0, "mimeType": "image/png"}], "textures": [{"source": 0}],
        "buffers": [{"uri": "@", "byteLength": 36}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
    }  # fmt: skip
    bitmap = '<texture name="reflectance" type="bitmap"><string name="filename" value="@"/></texture>'
    mtlx = documents["materialx"].replace("m.materialx", "m.mtlx")
    named = {
        "mesh.obj": ("obj", {"scene.json": lab(type="mesh", file="@")}),
        "mesh.ply": ("ply", {"scene.json": lab(type="triangle", file="@")}),
        "obj and mtl": ("mtl", {"scene.json": lab(type="mesh", file="b.obj"), "b.obj": "mtllib @\n" + SQUARE}),
        "texture": ("png", {"scene.json": lab({"type": "matte", "albedo": {"type": "imageTex", "file": "@"}})}),
        "bumps": ("png", {"scene.json": lab({"type": "matte", "normalmap": {"file": "@"}})}),
        "sky": ("png", {"scene.json": sky()}),
        "measured": ("gonio", {"scene.json": lab({"type": "measured", "file": "@"})}),
        "shader": ("glsl", {"scene.json": lab({"type": "shader", "file": "@"})}),
        "shader and include": ("glsl", {"scene.json": shader, "my.glsl": GLSL % '#include "@"'}),
        "shader and table": ("png", {"scene.json": shader, **beside, "my.glsl.toml": '[textures.t]\nfile = "@"\n'}),
        "shader and adapter": ("toml", {"scene.json": shader, **beside, "my.glsl.toml": "->@"}),
        "gltf": ("gltf", {"scene.json": lab({"type": "gltf", "file": "@", "material": "m"})}),
        "gltf and picture": ("png", {"scene.json": documents["gltf"], "m.gltf": gltf(**pictures)}),
        "gltf and buffer": ("bin", {"scene.json": documents["gltf"], "m.gltf": gltf(**buffers)}),
        "mtlx": ("mtlx", {"scene.json": lab({"type": "materialx", "file": "@", "material": "m"})}),
        "mtlx and picture": ("png", {"scene.json": mtlx, "m.mtlx": MTLX % ("", "@")}),
        "mtlx and include": ("mtlx", {"scene.json": mtlx, "m.mtlx": MTLX % (
            '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="@"/>', "b.png")}),
        "class in a file": ("py", {"scene.json": lab({"type": "@:Mine"})}),
        "distribution in a file": ("py", {"scene.json": lab({"type": "gonio-conductor", "ndf": "@:Mine"})}),
        "result of a fit": ("json", {"scene.json": lab({"type": "json", "file": "@"})}),
        "xml include": ("xml", {"scene.xml": XML % '<include filename="@"/>'}),
        "xml mesh": ("obj", {"scene.xml": XML % '<shape type="obj"><string name="filename" value="@"/></shape>'}),
        "xml ply": ("ply", {"scene.xml": XML % '<shape type="ply"><string name="filename" value="@"/></shape>'}),
        "xml texture": ("png", {"scene.xml": XML % f'<shape type="cube"><bsdf type="diffuse">{bitmap}</bsdf></shape>'}),
        "xml sky": ("png", {"scene.xml": XML.replace('<emitter type="constant"/>', "") %
            '<emitter type="envmap"><string name="filename" value="@"/></emitter>'}),
        "xml spectrum": ("spd", {"scene.xml": XML %
            '<emitter type="point"><spectrum name="intensity" filename="@"/></emitter>'}),
        "xml default": ("xml", {"scene.xml": XML % '<default name="f" value="@"/><include filename="$f"/>'}),
        "xml resolver": ("obj", {"scene.xml": XML %
            '<path value="^"/><shape type="obj"><string name="filename" value="a.obj"/></shape>'}),
    }  # fmt: skip
    return named


def paths(root: Path, ending: str) -> dict[str, str]:
    """Ways to write the path of the file outside; those with `link` go by links within the scene's folder."""
    file = f"a.{ending}"
    return {
        "above": f"../outside/{file}",
        "absolute": str(root / "outside" / file),
        "in and out": f"sub/../../outside/{file}",
        "doubled": f"..//outside/.//{file}",
        "link": f"link.{ending}",
        "link of a folder": f"sub/link/{file}",
        "link and up": f"sub/link/../outside/{file}",
        "home": f"~/{file}",
        "variable": f"$HOME/{file}",
        "url": f"file://{root / 'outside' / file}",
        "escaped": f"%2e%2e/outside/{file}",
        "backslashes": f"..\\outside\\{file}",
        "current folder": file,
    }


def scenes(root: Path) -> Iterator[tuple[str, dict[str, str], str, str]]:
    for name, (ending, files) in forms().items():
        for way, path in paths(root, ending).items():
            yield f"{name}, {way}", files, path, ending


def place(root: Path, files: dict[str, str], path: str, ending: str) -> Path:
    """Write a scene's folder anew; returns the scene."""
    folder = root / "scene"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "sub").mkdir(parents=True)
    (folder / "sub" / "link").symlink_to(root / "outside")
    (folder / f"link.{ending}").symlink_to(root / "outside" / f"a.{ending}")
    (folder / "b.png").write_bytes(png())
    for name, text in files.items():
        if text.startswith("->"):
            (folder / name).symlink_to(text[2:].replace("@", path))
        else:
            quoted = json.dumps(path)[1:-1] if name.endswith((".json", ".gltf")) else path
            (folder / name).write_text(text.replace("@", quoted).replace("^", os.path.dirname(quoted) or "."))
    return folder / next(iter(files))


def mark(name: str) -> None:
    with contextlib.suppress(OSError):
        open(MARK + name).close()


def main(root: Path) -> None:
    for number, (_, files, path, ending) in enumerate(scenes(root)):
        scene = place(root, files, path, ending)
        mark(str(number))
        try:
            go.render(scene, spp=1, size=(4, 4))
            print(number, "rendered", flush=True)
        except go.GonioError as error:
            print(number, "refused", f"{error.where}: {error.what}".replace("\n", " "), flush=True)
    mark("end")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
