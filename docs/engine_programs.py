"""Run the programs that reproduce findings of the cards without Gonio, in Chromium, with the engine's own package.

printed(package, "three-furnace.html")     the text that the page displays
"""

from __future__ import annotations

import functools
import http.server
import shutil
import tempfile
import threading
from pathlib import Path
from typing import Any

from gonio.catalog.shaders import Package
from playwright.sync_api import sync_playwright

PROGRAMS = Path(__file__).parent / "report-cards" / "engines" / "programs"
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
LIMIT = 600_000.0  # time limit of a program, in ms


class _Files(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_args: Any) -> None:
        """Print nothing, because a page requests hundreds of modules."""


def printed(package: Package, program: str) -> str:
    """Output of a program, which is served from a folder with node_modules, as its instructions require."""
    with tempfile.TemporaryDirectory(prefix="gonio-program-") as folder:
        place = Path(folder, "node_modules", package.name)
        place.parent.mkdir(parents=True)
        place.symlink_to(package.folder.resolve(), target_is_directory=True)
        shutil.copy(PROGRAMS / program, folder)
        handler = functools.partial(_Files, directory=folder)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            return _shown(f"http://127.0.0.1:{server.server_port}/{program}")
        finally:
            server.shutdown()
            server.server_close()


def _shown(address: str) -> str:
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        try:
            page = browser.new_page()
            page.add_init_script(
                "addEventListener('unhandledrejection', (event) => window.failed = String(event.reason))"
            )
            page.goto(address, wait_until="commit")
            page.wait_for_function("window.done || window.failed", timeout=LIMIT)
            if reason := page.evaluate("window.failed"):
                raise RuntimeError(f"{address}: {reason}")
            return page.inner_text("#out") + "\n"
        finally:
            browser.close()
