"""Write docs/scenes.md: the keys of a scene, read from its JSON Schema.

python docs/make_scenes.py [--check]      --check writes nothing and fails where the page is out of date
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from gonio import scene
from book.generated import written

PAGE = Path(__file__).parent / "scenes.md"
EXAMPLE = """\
{
  "output": {"filename": "balls.png"},
  "sampler": {"samples": 64},
  "integrator": {"type": "path", "maxDepth": 5},
  "camera": {
    "type": "pinhole",
    "transform": {"position": [0, 1.4, 5], "lookAt": [0, 0.7, 0], "up": [0, 1, 0]},
    "verticalFov": 30,
    "film": {"size": [480, 270]}
  },
  "scene": {
    "shapes": [
      {"type": "sphere", "center": [-0.9, 0.8, 0], "radius": 0.8,
       "material": {"type": "conductor", "preset": "Au", "alpha": 0.2}},
      {"type": "sphere", "center": [0.9, 0.8, 0], "radius": 0.8,
       "material": {"type": "lambert", "albedo": [0.1, 0.3, 0.6]}},
      {"type": "parallelogram", "base": [-5, 0, 5], "edge0": [10, 0, 0], "edge1": [0, 0, -10]}
    ],
    "lights": [
      {"type": "environmentLight", "radiance": [0.15, 0.18, 0.25]},
      {"type": "areaLight", "energy": 12,
       "shape": {"type": "parallelogram", "base": [-2, 4, 1], "edge0": [2, 0, 0], "edge1": [0, 0, 2]}}
    ]
  }
}"""
HEAD = """# Scenes

Written by `python docs/make_scenes.py` from the JSON Schema, which `gonio schema scene` prints for editors. A scene is
a folder with a `scene.json`, or any `.json` file; the files that it names lie in its folder or below. Unknown keys are
errors that suggest the nearest one. The format is that of the course's framework, with additions; y points up, and
colors are linear RGB. Mitsuba's XML is read as well. Copy this into `balls.json`, and change it:

```json
{example}
```

    gonio render balls.json -o balls.png

Further scenes, each with its picture, are the folders of [examples](../examples).
"""
SECTIONS = {
    "The file": ["SceneDescription", "Output", "Sampler", "Integrator", "Contents"],
    "The camera": ["Camera", "Film", "CameraTransform"],
    "Shapes": ["Sphere", "Parallelogram", "Cube", "Cylinder", "Cone", "Disk", "Mesh", "Transform", "Rotation"],
    "Lights": ["SpotLight", "DirectionalLight", "AreaLight", "EnvironmentLight"],
    "Spectra of lights": ["Daylight", "Blackbody", "Led", "MeasuredLight"],
    "Textures and relief": ["ImageTexture", "BumpMap", "gonio__scene__values__NormalMap"],
}
TITLES = {
    "SceneDescription": "The file itself", "Output": "output", "Sampler": "sampler", "Integrator": "integrator",
    "Contents": "scene", "Camera": "camera", "Film": "film", "CameraTransform": "transform of the camera",
    "Transform": "transform", "Rotation": "rotate", "ImageTexture": "imageTex: an image", "BumpMap": "bump",
    "gonio__scene__values__NormalMap": "normalmap",
}  # fmt: skip
# what a union of objects is called where a key takes any of them
UNIONS = {
    "a shape": SECTIONS["Shapes"][:7],
    "a light": SECTIONS["Lights"],
    "a spectrum of a light": SECTIONS["Spectra of lights"],
    "a material": ["AnyMaterial", "DocumentPart"],
}


def main() -> int:
    """Write or check the page; returns the exit code."""
    return written(PAGE, page(scene.json_schema()))


def page(schema: dict[str, Any]) -> str:
    """The page, in Markdown. Raises AssertionError for an object of the format that no section shows."""
    parts = schema["$defs"]
    materials = {one["$ref"].rpartition("/")[2] for one in parts["AnyMaterial"]["oneOf"] if "$ref" in one}
    shown = {name for names in SECTIONS.values() for name in names}
    hidden = set(parts) - shown - materials - {"AnyMaterial", "MaterialPart", "DocumentPart"}
    assert not hidden, f"in no section: {hidden}"
    lines = [HEAD.replace("{example}", EXAMPLE)]
    for title, names in SECTIONS.items():
        lines.append(f"## {title}")
        for name in names:
            lines += _object(TITLES.get(name, ""), schema if name == "SceneDescription" else parts[name])
    named = sorted({_type(parts[name]) for name in materials})
    lines += [
        "## Materials",
        "A `type` of this list, with the parameters that `gonio explain NAME` prints and the keys below. A number or a",
        'color may be an image. A material from a file is `{"type": TYPE, "file": ...}`: `json` for a fit that Gonio',
        "wrote, `gltf` and `materialx` ([documents](documents.md)), `measured` ([tables](measured.md)), `shader`",
        "([shaders](shaders.md)); with `--allow-code` also a class, as `FILE.py:CLASS`.",
        "",
        ", ".join(f"`{name}`" for name in named) + ".",
        "",
        *_object("Keys of every material", {**parts["MaterialPart"], "description": "Beside its parameters."}),
    ]
    return "\n".join(lines).rstrip() + "\n"


def _type(part: dict[str, Any]) -> str:
    return str(_allowed(part.get("properties", {}).get("type", {})).strip('`"').split('"')[0])


def _object(title: str, part: dict[str, Any]) -> list[str]:
    """Heading, description, and a table of the keys of an object."""
    kind = part.get("properties", {}).get("type", {})
    names = [kind["const"]] if "const" in kind else kind.get("enum", [])
    heading = title or ", ".join(names) or str(part.get("title", ""))
    lines = [f"### {heading}", *([" ".join(part["description"].split())] if "description" in part else []), ""]
    lines += ["| key | value | default | meaning |", "|---|---|---|---|"]
    required = part.get("required", [])
    for key, about in part.get("properties", {}).items():
        if key == "type" and names:
            continue
        default = "required" if key in required else f"`{json.dumps(about['default'])}`" if "default" in about else "-"
        each = [f"`{one['const']}`: {one['description']}" for one in about.get("oneOf", ()) if "description" in one]
        meaning = " ".join((about.get("description", "") or "; ".join(each) or "-").split()).replace("|", "\\|")
        lines.append(f"| `{key}` | {_allowed(about)} | {default} | {meaning} |")
    return [*lines, ""]


def _allowed(about: dict[str, Any]) -> str:
    """The values of a key, in words."""
    if "$ref" in about:
        name = about["$ref"].rpartition("/")[2]
        union = next((union for union, members in UNIONS.items() if name in members), "")
        return union or f"an object, `{TITLES.get(name, name).partition(':')[0]}`"
    for several in ("oneOf", "anyOf"):
        if several in about:
            return " or ".join(dict.fromkeys(_allowed(one) for one in about[several]))
    if "const" in about:
        return f"`{json.dumps(about['const'])}`"
    if "enum" in about:
        return ", ".join(f"`{json.dumps(one)}`" for one in about["enum"])
    if about.get("type") == "array":
        count = about.get("minItems") if about.get("minItems") == about.get("maxItems") else None
        inner = about.get("prefixItems", [about.get("items", {})])[0]
        return f"{count} numbers" if count else f"a list, each {_allowed(inner)}"
    words = {"number": "a number", "integer": "a whole number", "string": "a text", "boolean": "true or false"}
    limits = [
        f"{sign} {about[key]:g}"
        for key, sign in (("ge", ">="), ("minimum", ">="), ("gt", ">"), ("exclusiveMinimum", ">"), ("le", "<="))
        if key in about
    ]
    return " ".join([words.get(str(about.get("type")), "an object"), *limits])


if __name__ == "__main__":
    raise SystemExit(main())
