"""The Chromium, Chrome or Edge of this machine, without a window: it draws pages and takes pictures of them.

It is spoken to over its DevTools protocol, and draws with software alone, so that a picture is the same wherever it is
taken.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from vrs_cli.errors import UsageError

if TYPE_CHECKING:
    from websockets.sync.connection import Connection

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
ELSEWHERE = (  # where they stand on systems that have no PATH for them
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
PATIENCE = 90.0  # [s] until a browser that shows nothing is given up: a slow machine draws the first picture in 10 s
PAUSE = 0.05  # [s] between two looks whether it has begun
PORT_FILE = "DevToolsActivePort"  # in its profile: the port, and the path of the address
MAX_BYTES = 200_000_000  # of one message of the browser
FLAGS = (
    "--headless=new",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
    "--force-color-profile=srgb",
    "--force-device-scale-factor=1",
    "--hide-scrollbars",
    "--no-first-run",
    "--remote-debugging-port=0",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # of its own accord it asks nobody either
)


class PictureError(UsageError, text="No picture"):
    """The scene cannot be shown, recorded or photographed."""


def find_browser() -> str:
    """Return Chromium, Chrome or Edge. Raises PictureError where there is none."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    found = found or next((path for path in ELSEWHERE if Path(path).exists()), None)
    if found is None:
        raise PictureError(
            "Chromium, Chrome or Edge draws it, and there is none",
            "install one (apt-get install chromium), or make a page, which draws itself: --to html",
        )
    return found


class BrowserPage:
    """A page in the browser. All raise PictureError where the browser does not do it."""

    def __init__(self, socket: Connection) -> None:
        self._socket, self._id, self._session = socket, 0, ""

    def open(self, url: str, size: tuple[int, int]) -> None:
        """Open a page whose view has so many pixels in width and height."""
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        self._call("Emulation.setDeviceMetricsOverride", **metrics)
        self._call("Page.enable")
        self._call("Page.navigate", url=url)

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression of JavaScript, awaited if it is a promise."""
        told = self._call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in told:
            details = told["exceptionDetails"]
            raise PictureError("the page fails", str(details.get("exception", details).get("description", details)))
        return told["result"].get("value")

    def picture(self, form: str, **options: Any) -> bytes:
        """Return what is seen, as `png` or `jpeg`."""
        return b64decode(self._call("Page.captureScreenshot", format=form, **options)["data"])

    def _call(self, method: str, **parameters: Any) -> Any:
        self._id += 1
        session = {"sessionId": self._session} if self._session else {}
        message = {"id": self._id, "method": method, "params": parameters, **session}
        try:
            self._socket.send(json.dumps(message))
            deadline = time.monotonic() + PATIENCE
            while True:
                told = json.loads(self._socket.recv(timeout=max(deadline - time.monotonic(), 0.0)))
                if told.get("id") == self._id:
                    break
        except Exception as error:  # websockets has errors of several families
            raise PictureError("the browser draws nothing", f"{method}: {error or type(error).__name__}") from error
        if "error" in told:
            raise PictureError("the browser draws nothing", f"{method}: {told['error'].get('message')}")
        return told["result"]


@contextmanager
def browser_page() -> Iterator[BrowserPage]:
    """Start the browser, with a profile of its own, for one page. Raises PictureError."""
    from websockets.sync.client import connect

    browser, none = find_browser(), subprocess.DEVNULL
    root = ("--no-sandbox",) * (sys.platform != "win32" and os.geteuid() == 0)  # Chromium gives root none
    with TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = (browser, *FLAGS, *root, f"--user-data-dir={profile}", "about:blank")
        with subprocess.Popen(command, stdin=none, stdout=none, stderr=none) as running:
            try:
                address = _address(Path(profile) / PORT_FILE, running, browser)
                with connect(address, max_size=MAX_BYTES, open_timeout=PATIENCE, compression=None) as socket:
                    yield BrowserPage(socket)
            finally:
                running.terminate()


def _address(file: Path, running: subprocess.Popen[bytes], browser: str) -> str:
    """Return the address of the browser's protocol once it has begun."""
    for _ in range(int(PATIENCE / PAUSE)):
        try:
            port, path = file.read_text().split()
        except (OSError, ValueError):
            if running.poll() is not None:
                break
            time.sleep(PAUSE)
            continue
        return f"ws://127.0.0.1:{port}{path}"
    raise PictureError(f"{browser} shows nothing", "does it run with --headless=new and --use-angle=swiftshader?")
