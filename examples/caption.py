"""Write names below the balls of a picture.

    python examples/caption.py examples/conductor-ggx/print.json conductor-ggx.png 0.01 0.25 0.5 0.75 0.99

takes one text for each sphere of the scene, in order ("" for none), and draws it below the sphere in the picture.
`--rows` labels rows of balls along the left edge, from the top; `--outlines` draws a dashed outline of each ball, for
balls that cannot be seen. The picture is replaced unless `-o` names another.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

TEXT_HEIGHT = 0.024  # relative to the picture's width: 31 pixels for 1,280
LIGHT, DARK = (235, 235, 235), (40, 40, 40)


def spheres(scene: dict) -> np.ndarray:
    """Centers and radii of a scene's spheres, (n, 4)."""
    shapes = [shape for shape in scene["scene"]["shapes"] if shape["type"] == "sphere"]
    return np.array([[*shape["center"], shape["radius"]] for shape in shapes])


def projected(points: np.ndarray, camera: dict, width: int, height: int) -> np.ndarray:
    """Pixels (x, y) at which a pinhole camera sees points (n, 3)."""
    place = {key: np.array(value, float) for key, value in camera["transform"].items()}
    forward = place["lookAt"] - place["position"]
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, place["up"])
    right /= np.linalg.norm(right)
    seen = (points - place["position"]) @ np.stack([right, -np.cross(right, forward), forward], 1)
    scale = height / 2 / math.tan(math.radians(camera["verticalFov"]) / 2)
    return np.array([width / 2, height / 2]) + scale * seen[:, :2] / seen[:, 2:]


def font(size: float) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(str(Path(matplotlib.get_data_path(), "fonts/ttf/DejaVuSans.ttf")), round(size))


def write(picture: Image.Image, at: tuple[float, float], text: str, size: float, anchor: str) -> None:
    """Write text at a pixel: light on dark or dark on light, and on a plate if the background has structure."""
    draw = ImageDraw.Draw(picture, "RGBA")
    left, top, right, bottom = draw.textbbox(at, text, font(size), anchor)
    plate = (left - 0.3 * size, top - 0.2 * size, right + 0.3 * size, bottom + 0.2 * size)
    ground = np.asarray(picture.convert("L").crop([round(value) for value in plate]), float)
    ink, back = (LIGHT, DARK) if ground.mean() < 140 else (DARK, LIGHT)
    if ground.std() > 20:
        draw.rounded_rectangle(plate, 0.25 * size, (*back, 190))
    draw.text(at, text, ink, font(size), anchor)


def dashed(picture: Image.Image, center: np.ndarray, radius: float, dashes: int = 36) -> None:
    """Draw a dashed circle."""
    box = [*(center - radius), *(center + radius)]
    for start in np.arange(dashes) * 360 / dashes:
        ImageDraw.Draw(picture).arc(box, start, start + 180 / dashes, (120, 120, 120), 2)


def caption(scene: dict, picture: Image.Image, names: list[str], rows: list[str], outlines: bool) -> Image.Image:
    """The picture with a name below each sphere and, along its left edge, a name for each row."""
    picture = picture.convert("RGB")
    balls = spheres(scene)
    if len(names) > len(balls):
        raise SystemExit(f"{len(names)} names for {len(balls)} spheres")
    up = np.array(scene["camera"]["transform"]["up"], float)
    centers = projected(balls[:, :3], scene["camera"], *picture.size)
    lowest = projected(balls[:, :3] - balls[:, 3:] * up, scene["camera"], *picture.size)
    size = TEXT_HEIGHT * picture.width
    for center, foot in zip(centers, lowest, strict=True):
        if outlines:
            dashed(picture, center, foot[1] - center[1])
    for name, center, foot in zip(names, centers, lowest, strict=False):
        if name:
            write(picture, (center[0], foot[1] + 0.45 * size), name, size, "ma")
    levels = np.unique(np.round(centers[:, 1] / size / 2)) * size * 2
    if rows and len(rows) != len(levels):
        raise SystemExit(f"{len(rows)} names for {len(levels)} rows")
    pitch = min(np.diff(levels), default=picture.height)
    longest = max((font(size).getlength(name) for name in rows), default=1.0)
    small = size * min(0.9, 0.65 * pitch / longest)  # so that adjacent names do not run together
    for name, level in zip(rows, levels, strict=False):
        turned = picture.rotate(-90, expand=True)  # so that the text reads upward
        write(turned, (picture.height - level, 0.9 * size), name, small, "mm")
        picture = turned.rotate(90, expand=True)
    return picture


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, help="the scene's JSON file")
    parser.add_argument("picture", type=Path, help="its picture")
    parser.add_argument("names", nargs="*", help="a name for each sphere")
    parser.add_argument("--rows", nargs="+", default=[], help="a name for each row, from the top")
    parser.add_argument("--outlines", action="store_true", help="draw the outline of each sphere")
    parser.add_argument("-o", "--output", type=Path, help="where to write it; the picture itself by default")
    asked = parser.parse_args()
    with Image.open(asked.picture) as picture:
        done = caption(json.loads(asked.scene.read_text()), picture, asked.names, asked.rows, asked.outlines)
    done.save(asked.output or asked.picture, quality=90)


if __name__ == "__main__":
    main()
