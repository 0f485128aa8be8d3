"""A tab with the page of `gonio view`, driven from Python; tests/viewer/conftest.py opens it."""

from __future__ import annotations

import base64
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from gonio.viewer import stage

WIDE = {"width": 800, "height": 420}  # of the window: the picture's part of it is about 480 x 350
PHONE = {"width": 360, "height": 740}
COARSE = 0.5  # device pixels per CSS pixel: software draws a quarter of the pixels, and the layout stays as it is

PIXELS = """async (samples) => {
  const picture = await gonio.converge(samples);
  const bytes = new Uint8Array(picture.data.buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return [picture.width, picture.height, btoa(text), picture.samples];
}"""


def decoded(found: Any) -> np.ndarray:
    """The picture that `PIXELS` gives, (height, width, 4)."""
    width, height, text, _ = found
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(height, width, 4)


class Page:
    """A tab with the page, what it wrote on its console, and what it asked the network for."""

    def __init__(self, tab: Any, path: Path) -> None:
        self.tab, self.path = tab, path
        self.problems: list[str] = []
        self.requests: list[str] = []
        tab.on("console", lambda m: self.problems.append(m.text) if m.type in ("error", "warning") else None)
        tab.on("pageerror", lambda error: self.problems.append(str(error)))
        tab.on("request", lambda request: self.requests.append(request.url))
        self.load()

    def load(self, fragment: str = "") -> None:
        self.tab.goto("about:blank")
        self.tab.goto(self.path.as_uri() + fragment)
        self.tab.evaluate("() => gonio.ready")

    def reset(self) -> None:
        self.tab.evaluate("() => { gonio.app.store.reset(); }")

    def set(self, body: str) -> None:
        self.tab.evaluate("() => { gonio.setState((s) => {" + body + "}); }")

    def state(self, path: str) -> Any:
        return self.tab.evaluate(f"() => gonio.state.{path}")

    def picture(self, samples: int = 64) -> np.ndarray:
        """Mean radiance, (height, width, 4): RGB times coverage, coverage."""
        return decoded(self.tab.evaluate(PIXELS, samples))

    def control(self, label: str) -> Any:
        return self.tab.locator(".lil-controller", has=self.tab.locator(".lil-name", has_text=re.compile(f"^{label}")))


def rows_of_balls(picture: np.ndarray) -> np.ndarray:
    """Mean radiance of each ball of two rows of five, seen from the front."""
    height, width = picture.shape[:2]
    # ball centres in pixels; the camera is the homework's, framed for 16:9
    camera = stage.homework().framed()
    half = math.tan(math.radians(camera["fov"]) / 2) * max(1.0, 16 / 9 * height / width)
    focal = height / 2 / half / camera["distance"]
    means = np.zeros((2, 5, 3))
    rows, columns = np.mgrid[:height, :width] + 0.5
    for i, y in enumerate((0.5, -0.5)):
        for j in range(5):
            x = (j - 2) * stage.SPACING
            near = (
                np.hypot(columns - width / 2 - x * focal, rows - height / 2 + y * stage.SPACING * focal) < 0.9 * focal
            )
            means[i, j] = picture[near][:, :3].mean(axis=0)
    return means
