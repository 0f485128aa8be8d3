"""Take docs/images/three.png: the page of docs/guides/three.html in Chromium, with the bundle that the guide emits.

python docs/make_three_picture.py          needs three.js (`npm ci` in web/)
"""

from __future__ import annotations

import functools
import http.server
import shutil
import sys
import tempfile
from pathlib import Path

import gonio as go
from gonio.shaders import bundle

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
import browser  # noqa: E402

OUTPUT = ROOT / "docs" / "images" / "three.png"
THREE = ROOT / "web" / "node_modules" / "three"
ALPHA = 0.14  # as in the guide's command
SIZE = {"width": 1280, "height": 720}


def main() -> None:
    if not THREE.exists():
        raise SystemExit(f"{THREE} is not there: run `npm ci` in web/")
    material = go.material(f"kulla-conty(base=conductor(preset=Au,alpha={ALPHA}))")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(ROOT / "docs" / "guides" / "three.html", folder)
        (folder / "node_modules").mkdir()
        (folder / "node_modules" / "three").symlink_to(THREE)
        bundle(material, "glsl").write(folder / "gold")
        serve = functools.partial(http.server.SimpleHTTPRequestHandler, directory=name)
        with browser.serving(serve) as root, browser.chromium() as chromium:
            tab = chromium.new_page(viewport=SIZE)
            tab.goto(f"{root}three.html")
            tab.wait_for_function("window.drawn")
            tab.screenshot(path=str(OUTPUT))
    print(OUTPUT)


if __name__ == "__main__":
    main()
