"""A headless Chromium for tests: WebGL2 and WebGPU in software (SwiftShader), where there is a browser to be had.

    with browser.page() as page:
        page.evaluate("() => 1 + 1")

Looks for Debian's Chromium, then for Playwright's own. Where there is none the tests that need it are skipped, and the
reason says what was not tried.
"""

from __future__ import annotations

import contextlib
import functools
import http.server
import shutil
import threading
from collections.abc import Iterator
from typing import Any

import pytest

FLAGS = [
    "--headless",
    "--no-sandbox",  # the tests may run as root, where Chromium's sandbox does not start
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--ignore-gpu-blocklist",
]


@functools.cache
def missing() -> str:
    """Why there is no browser, or ""."""
    try:
        import playwright.sync_api as api
    except ImportError:
        return "NOT TRIED in a browser: the package playwright is not installed"
    if executable() is not None:
        return ""
    with api.sync_playwright() as started:
        from pathlib import Path

        if Path(started.chromium.executable_path).exists():
            return ""
    return "NOT TRIED in a browser: no chromium on the PATH, and none of Playwright's (`playwright install chromium`)"


def executable() -> str | None:
    """A Chromium of the system."""
    return next(
        (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
    )


class _Empty(http.server.BaseHTTPRequestHandler):
    """An empty page: WebGPU is there in a secure context only, such as this machine's own pages."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><title>test</title>")

    def log_message(self, *args: Any) -> None:
        pass


@contextlib.contextmanager
def serving(handler: Any = _Empty) -> Iterator[str]:
    """The address of a server on this machine that answers by the handler."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()


@contextlib.contextmanager
def chromium(*flags: str) -> Iterator[Any]:
    """A Playwright browser; the test is skipped, with the reason, where there is none."""
    if missing():
        pytest.skip(missing())
    import playwright.sync_api as api

    with api.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=executable(), args=[*FLAGS, *flags], headless=True)
        try:
            yield browser
        finally:
            browser.close()


@contextlib.contextmanager
def page(*flags: str) -> Iterator[Any]:
    """An empty page in a secure context; what it writes on its console comes with a failing test."""
    with chromium(*flags) as browser, serving() as address:
        opened = browser.new_page()
        opened.on("console", lambda message: print(f"console: {message.text}"))
        opened.on("pageerror", lambda error: print(f"page error: {error}"))
        opened.goto(address)
        yield opened
