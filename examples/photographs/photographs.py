"""The photographs with their lamps on one sheet: python examples/photographs/photographs.py writes photographs.jpg."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from gonio.pictures import images
from matplotlib.figure import Figure

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
import sheets  # noqa: E402

PICTURE = "photographs.jpg"  # in the current folder
LAMP = "#ffe08a"
SIDES = ("right", "lower right", "below", "lower left", "left", "upper left", "above", "upper right")  # y is downward


def lamp_angles(calibration: dict[str, dict]) -> dict[str, tuple[float, np.ndarray]]:
    """For each lamp, the angle between it and the camera as seen from the ball, and its direction in the picture.

    The angle is in degrees, the direction a unit vector with x to the right and y downward, as for pixels.
    """
    center = np.array(calibration["ball"]["center"])
    found = {}
    for name, lamp in calibration["lights"].items():
        toward = np.array(lamp["position"]) - center
        cosine = toward @ -center / (np.linalg.norm(toward) * np.linalg.norm(center))
        found[name] = float(np.degrees(np.arccos(cosine))), toward[:2] / np.linalg.norm(toward[:2])
    return found


def side_of(toward: np.ndarray) -> str:
    """The direction of a lamp in the picture, in words."""
    return SIDES[round(float(np.degrees(np.arctan2(toward[1], toward[0]))) / 45.0) % 8]


def outline(calibration: dict[str, dict], size: int) -> tuple[np.ndarray, float]:
    """Center (x, y) and radius of the ball in the picture, in pixels."""
    camera, ball = calibration["camera"], calibration["ball"]
    x, y, distance = ball["center"]
    scale = camera["focal"] / camera["pixel"]
    middle = 0.5 * (size - 1) + scale / distance * np.array([x, y])
    return middle, scale * ball["radius"] / float(np.sqrt(distance**2 - ball["radius"] ** 2))


def main(stops: float = 1.0) -> None:
    calibration = json.loads((HERE / "calibration.json").read_text(encoding="utf-8"))
    count, width = len(calibration["lights"]), sheets.WIDTH / sheets.DPI
    side = (width - sheets.GAP) / count - sheets.GAP
    height = side + 2.2 * sheets.LINE + sheets.GAP
    figure = Figure(figsize=(width, height), facecolor=sheets.BACKGROUND, dpi=sheets.DPI)
    for number, (name, (angle, toward)) in enumerate(lamp_angles(calibration).items()):
        left = sheets.GAP + number * (side + sheets.GAP)
        axes = figure.add_axes((left / width, sheets.GAP / height, side / width, side / height))
        pixels = images.read(HERE / f"{name}.png").pixels
        middle, radius = outline(calibration, len(pixels))
        x, y = np.meshgrid(*[np.arange(len(pixels))] * 2)
        outside = np.hypot(x - middle[0], y - middle[1]) > radius
        # the ball's unlit side is black, so the background must not be
        shown = np.where(outside[..., None], sheets.BACKDROP, pixels * 2.0**stops)
        axes.imshow(images.to_screen(shown), interpolation="nearest")
        style = {"arrowstyle": "-|>", "color": LAMP, "lw": 4.0, "mutation_scale": 26, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", middle + 1.04 * radius * toward, middle + 1.31 * radius * toward, arrowprops=style)
        axes.set_axis_off()
        for above, line in enumerate((f"{angle:.0f}° off the axis", f"lamp {side_of(toward)},")):
            base = sheets.GAP + side + (above + 0.33) * sheets.LINE
            place = (left + side / 2.0) / width, base / height
            figure.text(*place, line, color=sheets.TEXT, fontsize=sheets.POINTS, ha="center")
    print(sheets.save(figure, PICTURE))


if __name__ == "__main__":
    main()
