"""Photographs of a scene: by the Chromium, Chrome or Edge of this machine, without a window and with software alone, so
that a picture is the same wherever it is taken.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import Empty, Queue
from tempfile import TemporaryDirectory

import numpy as np
import viser
from numpy.typing import NDArray

from vrs_cli.render.browser import PictureError, find_browser
from vrs_cli.view3d.studio import server

TRIES = 20  # of the first picture
PAUSE = 0.1  # [s] between two looks whether it has come
PATIENCE = 90.0  # [s] until a browser that shows nothing is given up: a slow machine draws the first picture in 10 s
FLAGS = (
    "--headless=new",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
    "--no-first-run",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # of its own accord it asks nobody either
)

Pixels = NDArray[np.uint8]  # (height, width, 3)


@contextmanager
def photographing(size: tuple[int, int]) -> Iterator[tuple[viser.ClientHandle, Callable[[], Pixels]]]:
    """A scene to fill, and what takes a picture of it. Raises PictureError."""
    browser = find_browser()
    arrived: Queue[viser.ClientHandle] = Queue()
    with server() as seen:
        seen.on_client_connect(arrived.put)
        with _looking(browser, f"http://127.0.0.1:{seen.get_port()}", size) as running:
            client = _awaited(arrived, running, browser)
            yield client, Camera(client, size).take


@contextmanager
def _looking(browser: str, url: str, size: tuple[int, int]) -> Iterator[subprocess.Popen[bytes]]:
    """The browser at a page, somewhat larger than the pictures, with a profile of its own."""
    width, height = size
    root = ("--no-sandbox",) * (sys.platform != "win32" and os.geteuid() == 0)  # Chromium gives root none
    with TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        # wider than the picture in proportion, or the background does not reach its sides
        command = (browser, *FLAGS, *root, f"--window-size={width + 120},{height + 160}", f"--user-data-dir={profile}")
        none = subprocess.DEVNULL
        with subprocess.Popen([*command, url], stdin=none, stdout=none, stderr=none) as running:
            try:
                yield running
            finally:
                running.terminate()


def _awaited(arrived: Queue[viser.ClientHandle], running: subprocess.Popen[bytes], browser: str) -> viser.ClientHandle:
    """The browser as viser knows it. Raises PictureError where it does not come."""
    for _ in range(int(PATIENCE / PAUSE)):
        try:
            return arrived.get(timeout=PAUSE)
        except Empty:
            if running.poll() is not None:
                break
    raise PictureError(f"{browser} shows nothing", "does it run with --headless=new and --use-angle=swiftshader?")


class Camera:
    """Takes pictures of what a browser shows."""

    def __init__(self, client: viser.ClientHandle, size: tuple[int, int]) -> None:
        self._client, self._size, self._warm = client, size, False

    def take(self) -> Pixels:
        """The scene as it is now. The first picture is taken until it stays the same, and is not blank: a browser
        shows a new scene in parts. Raises PictureError.
        """
        taken = self._taken()
        for _ in range(0 if self._warm else TRIES):
            before, taken = taken, self._taken()
            if np.ptp(taken) and np.array_equal(before, taken):
                break
        self._warm = True
        return taken

    def _taken(self) -> Pixels:
        width, height = self._size
        try:
            drawn = self._client.get_render(height, width, transport_format="png", timeout=PATIENCE)
        except (TimeoutError, RuntimeError) as error:
            raise PictureError("the browser takes no picture", str(error)) from error
        opaque = drawn[:, :, 3:] / 255.0
        return np.round(drawn[:, :, :3] * opaque + 255.0 * (1.0 - opaque)).astype(np.uint8)
