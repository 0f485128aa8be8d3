"""Take docs/images/viewer.png: the page of `gonio view` in Chromium, with the shader left and the reference right of
the wipe.

python docs/make_viewer_picture.py
"""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

from gonio.bridge import engine
from gonio.viewer import server, stage

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
import browser  # noqa: E402

OUTPUT = ROOT / "docs" / "images" / "viewer.png"
SETTINGS = """() => gonio.setState((state) => {
  state.compare.mode = "wipe";
  state.compare.wipe = 0.5;
  state.dock.open = "lobe";
  state.dock.height = 250;
  state.selection = { slot: 0, ball: 3 };
})"""


def main() -> None:
    engine.load()  # first, so that an LLVM that works is used
    access = server.AccessControl("127.0.0.1")
    one = server.Server(server.Application(stage.opening(), access), "127.0.0.1", 0, quiet=True)
    thread = threading.Thread(target=one.serve_until_interrupted, daemon=True)
    thread.start()
    while not one.started:
        time.sleep(0.01)
    with browser.chromium() as chromium:
        tab = chromium.new_page(viewport={"width": 1280, "height": 720})
        tab.goto(one.url)
        while not tab.evaluate("window.gonio?.frames > 0"):
            time.sleep(0.1)
        tab.evaluate(SETTINGS)
        time.sleep(1.0)
        while not tab.evaluate("gonio.live.status.samples >= 256"):
            time.sleep(0.1)
        time.sleep(2.0)
        tab.screenshot(path=str(OUTPUT))
    one.should_exit = True
    thread.join()
    print(OUTPUT)


if __name__ == "__main__":
    main()
