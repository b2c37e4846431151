"""Find what pictures of the scene need beside vrs: viser, a browser, ffmpeg."""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from pathlib import Path

from vrs_cli.errors import UsageError
from vrs_cli.extras import how_to_install

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
ELSEWHERE = (  # where they stand on systems that have no PATH for them
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)


class PictureError(UsageError, text="No picture"):
    """The scene cannot be shown, recorded or photographed."""


def check_view() -> None:
    """Raises PictureError where viser is missing."""
    if find_spec("viser") is None:
        raise PictureError("the scene needs viser, which is not installed", how_to_install("viser"))


def check_still() -> None:
    """Raises PictureError where viser or a browser is missing."""
    check_view()
    find_browser()


def check_mp4() -> None:
    """Raises PictureError where viser, a browser or ffmpeg is missing."""
    check_still()
    find_ffmpeg()


def find_browser() -> str:
    """Chromium, Chrome or Edge. Raises PictureError where there is none."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    found = found or next((path for path in ELSEWHERE if Path(path).exists()), None)
    if found is None:
        raise PictureError(
            "Chromium, Chrome or Edge draws it, and there is none",
            "install one (apt-get install chromium), or make a page, which draws itself: --to html",
        )
    return found


def find_ffmpeg() -> str:
    """Raises PictureError where there is none."""
    found = shutil.which("ffmpeg")
    if found is None:
        raise PictureError("ffmpeg makes films, and there is none", "install it (apt-get install ffmpeg), or --to gif")
    return found
