"""Record docs/images/viewer.webp: the page of `gonio view`, with the studio rotating around the balls, then a furnace.

python docs/make_viewer_animation.py
"""

from __future__ import annotations

import io
import math
import sys
import tempfile
from pathlib import Path
from typing import Any

from gonio.viewer import page, stage
from PIL import Image

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
import browser  # noqa: E402

OUTPUT = ROOT / "docs" / "images" / "viewer.webp"
SIZE = {"width": 1280, "height": 560}  # wide enough for the whole bar of terms
TURNS, STILLS = 32, 10  # frames of the rotating studio, and of the furnace
MILLISECONDS = 110
SAMPLES = 16  # samples per pixel, for smooth silhouettes; the split sum itself has no noise
QUALITY = 95  # lower values show blocks on the rough balls
MAX_BYTES = 2_000_000


def main() -> None:
    save(frames())


def frames() -> list[Image.Image]:
    """The page at each rotation of the studio, then in the furnace."""
    with tempfile.TemporaryDirectory() as folder, browser.chromium() as chromium:
        path = page.export(stage.opening(), Path(folder) / "page.html")
        tab = chromium.new_page(viewport=SIZE)
        tab.goto(path.as_uri())
        tab.wait_for_function("() => window.gonio?.frames > 0")
        tab.evaluate("() => gonio.setState((state) => { state.environment = 'split-sum'; })")
        tab.wait_for_function(f"() => gonio.app.picture().samples >= {4 * SAMPLES}", timeout=300_000)  # maps too
        turning = [_frame(tab, f"state.lights[0].rotation = {2 * math.pi * turn / TURNS}") for turn in range(TURNS)]
        return turning + [_frame(tab, "state.furnace = true")] * STILLS


def save(shown: list[Image.Image]) -> None:
    """Write the animation. Raises an error if it is too large for a page."""
    first, *others = shown
    first.save(OUTPUT, save_all=True, append_images=others, duration=MILLISECONDS, loop=0, quality=QUALITY, method=6)
    size = OUTPUT.stat().st_size
    if size > MAX_BYTES:
        raise SystemExit(f"{OUTPUT}: {size} bytes, more than {MAX_BYTES}")
    print(f"{OUTPUT}  {len(shown)} frames, {size / 1e6:.2f} MB")


def _frame(tab: Any, change: str) -> Image.Image:
    tab.evaluate(f"() => gonio.setState((state) => {{ {change} }})")
    tab.wait_for_timeout(150)
    tab.wait_for_function(f"() => gonio.app.picture().samples >= {SAMPLES}", timeout=120_000)
    return Image.open(io.BytesIO(tab.screenshot())).convert("RGB")


if __name__ == "__main__":
    main()
