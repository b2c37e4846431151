"""Write a timeline as files that show the robot: HTML pages that play without a server, and pictures and films of the
page.

A page file contains a recording as JSON, and the script that computes the state of the robot at each time. Its security
policy allows only this script, identified by its hash, and no network address. Many recordings of one robot can share
one viewer file.

The pictures come from the Chromium, Chrome or Edge of this machine, which runs without a window and is controlled over
the DevTools protocol. It renders in software, so the pictures are the same on every machine.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
from base64 import b64decode, b64encode
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from html import escape
from importlib.util import find_spec
from io import BytesIO
from math import ceil, floor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, BinaryIO

from vrs_cli.engine.position import position_at
from vrs_cli.errors import UsageError
from vrs_cli.extras import BUILT_PAGE, how_to_build_page, how_to_install
from vrs_cli.files.exports import Exporter
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.render.progress import RunProgress
from vrs_cli.trajectory.timeline import Timeline

if TYPE_CHECKING:
    from websockets.sync.connection import Connection

    from vrs_cli.world.course import World

SCRIPT, SHEET = "replay.js", "replay.css"
NOT_ASCII = re.compile(r"[^\x00-\x7f]")
POLICY = "default-src 'none'; script-src 'sha256-{script}'{more}; style-src 'unsafe-inline'; img-src data: blob:; " + (
    "connect-src data: blob:; base-uri 'none'; form-action 'none'"
)


class PageError(UsageError, text="No page"):
    """The error raised if the page for the browser cannot be written."""


def page(data: Mapping[str, Any]) -> str:
    """Return the HTML file of a `recorded_page`; equal data give equal text. Raises PageError if the page is not
    built."""
    return _html(data["title"], "recording", data)


def viewer(robot: Mapping[str, Any]) -> str:
    """Return an HTML file that plays the file `replays/NAME.js` of its folder when opened as `viewer.html#NAME`;
    `replay` makes such files for the same `robot`. Raises PageError if the page is not built."""
    return _html(robot["model"]["title"], "robot", robot, " 'self' file:")


def replay(moments: Mapping[str, Any]) -> str:
    """Return JavaScript that contains a recording; the page made by `viewer` plays it."""
    return f"replay({json.dumps(moments, separators=(',', ':'))})\n"


def _html(title: str, name: str, data: Mapping[str, Any], scripts: str = "") -> str:
    """Return the page with its data. `scripts`: additional sources of scripts that the policy allows."""
    script, sheet = _page_code()
    title = escape(title).encode("ascii", "xmlcharrefreplace").decode()
    policy = POLICY.format(script=b64encode(sha256(script.encode()).digest()).decode(), more=scripts)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">\n'
        '<meta name="color-scheme" content="light dark"><meta name="referrer" content="no-referrer">\n'
        f"<title>{title}</title>\n<style>{sheet}</style></head><body>\n"
        "<noscript>This page shows a robot; it needs JavaScript.</noscript>\n"
        f'<script type="application/json" id="{name}">{in_script(data)}</script>\n'
        f"<script>{script}</script>\n</body></html>\n"
    )


def in_script(data: Mapping[str, Any]) -> str:
    """Return JSON that is safe inside a script element: no text in it ends the script or begins an HTML comment."""
    return json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")


@cache
def _page_code() -> tuple[str, str]:
    """Return the script and the style sheet in a form that can be embedded in HTML. Both are converted to ASCII,
    because a notebook may be read with an encoding other than UTF-8."""

    def escape_sign(found: re.Match[str]) -> str:
        units = found[0].encode("utf-16-be").hex()
        return "".join([f"\\u{units[k : k + 4]}" for k in range(0, len(units), 4)])

    try:
        script, sheet = (Path(BUILT_PAGE, name).read_text(encoding="utf-8") for name in (SCRIPT, SHEET))
    except OSError:
        raise PageError("the page of the browser is not built", how_to_build_page()) from None
    script = NOT_ASCII.sub(escape_sign, script.replace("</script", "<\\/script").replace("<!--", "<\\!--"))
    return script, NOT_ASCII.sub(lambda found: f"\\{ord(found[0]):06x}", sheet.replace("</style", "<\\/style"))


def check_page() -> None:
    """Raise PageError if the page is not built."""
    _page_code()


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
USUAL_PATHS = (  # usual paths of browsers that are not on PATH
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
BROWSER_TIMEOUT_S = 90.0  # [s] maximum wait for a browser; a slow machine draws the first picture in 10 s
POLL_PERIOD_S = 0.05  # [s] time between two checks of whether the browser has started
PORT_FILE = "DevToolsActivePort"  # file in the browser's profile with the port and the path of its DevTools address
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
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # keep the browser from connecting to any other host
)


class PictureError(UsageError, text="No picture"):
    """The error raised if a picture or a film of the scene cannot be made."""


def find_browser() -> str:
    """Return the path of Chromium, Chrome or Edge. Raises PictureError if there is none."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    found = found or next((path for path in USUAL_PATHS if Path(path).exists()), None)
    if found is None:
        raise PictureError(
            "Chromium, Chrome or Edge draws it, and there is none",
            "install one (apt-get install chromium), or make a page, which draws itself: --to html",
        )
    return found


class BrowserPage:
    """A page in the browser. All methods raise PictureError if the browser fails."""

    def __init__(self, socket: Connection) -> None:
        self._socket, self._id, self._session = socket, 0, ""

    def open(self, url: str, size: tuple[int, int]) -> None:
        """Open a page. `size`: width and height of its view [px]."""
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        self._call("Emulation.setDeviceMetricsOverride", **metrics)
        self._call("Page.enable")
        self._call("Page.navigate", url=url)

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression. If the value is a promise, wait for its result."""
        reply = self._call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in reply:
            details = reply["exceptionDetails"]
            raise PictureError("the page fails", str(details.get("exception", details).get("description", details)))
        return reply["result"].get("value")

    def picture(self, form: str, **options: Any) -> bytes:
        """Return a screenshot as `png` or `jpeg`."""
        return b64decode(self._call("Page.captureScreenshot", format=form, **options)["data"])

    def _call(self, method: str, **parameters: Any) -> Any:
        self._id += 1
        session = {"sessionId": self._session} if self._session else {}
        try:
            self._socket.send(json.dumps({"id": self._id, "method": method, "params": parameters, **session}))
            deadline = time.monotonic() + BROWSER_TIMEOUT_S
            while True:
                reply = json.loads(self._socket.recv(timeout=max(deadline - time.monotonic(), 0.0)))
                if reply.get("id") == self._id:
                    break
        except Exception as error:  # websockets raises errors with no common base class
            raise PictureError("the browser draws nothing", f"{method}: {error or type(error).__name__}") from error
        if "error" in reply:
            raise PictureError("the browser draws nothing", f"{method}: {reply['error'].get('message')}")
        return reply["result"]


@contextmanager
def browser_page() -> Iterator[BrowserPage]:
    """Start the browser with a separate profile for one page. Raises PictureError."""
    from websockets.sync.client import connect

    browser, none = find_browser(), subprocess.DEVNULL
    # run without Chromium's sandbox if root starts it, because the sandbox then does not work
    root = ("--no-sandbox",) * (sys.platform != "win32" and os.geteuid() == 0)
    with TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = (browser, *FLAGS, *root, f"--user-data-dir={profile}", "about:blank")
        with subprocess.Popen(command, stdin=none, stdout=none, stderr=none) as running:
            try:
                address = _address(Path(profile) / PORT_FILE, running, browser)
                with connect(address, max_size=200_000_000, open_timeout=BROWSER_TIMEOUT_S, compression=None) as socket:
                    yield BrowserPage(socket)
            finally:
                running.terminate()


def _address(file: Path, running: subprocess.Popen[bytes], browser: str) -> str:
    """Return the address of the browser's protocol as soon as the browser has started."""
    for _ in range(int(BROWSER_TIMEOUT_S / POLL_PERIOD_S)):
        try:
            port, path = file.read_text().split()
        except (OSError, ValueError):
            if running.poll() is not None:
                break
            time.sleep(POLL_PERIOD_S)
        else:
            return f"ws://127.0.0.1:{port}{path}"
    raise PictureError(f"{browser} shows nothing", "does it run with --headless=new and --use-angle=swiftshader?")


SIZE, FILM_SIZE, GIF_SIZE = (960, 640), (1280, 720), (640, 420)  # [px] sizes of a picture, a film and an animation
FINE, FAST = 1, 3  # quality of the page: FINE has shadows, FAST has none
FRAMES_A_SECOND = 10.0  # [1/s] frame rate of a film
MAX_FRAMES = 600  # maximum number of frames of a film; drawing one takes 0.1 s to 1 s
# [1/s] time steps in a caption: digits that change faster would be unreadable in a film
TIME_STEPS_A_SECOND = 10
JPEG = {"quality": 92, "optimizeForSpeed": True}
H264 = ("-c:v", "libx264", "-preset", "fast", "-pix_fmt", "yuv420p", "-fflags", "+bitexact", "-movflags", "+faststart")
READY = "new Promise((done) => { const look = () => (window.ready ? ready.then(done) : setTimeout(look, 20)); look() })"


def write_page(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None, title: str = ""
) -> None:
    """Write an HTML file that plays a timeline at `rate` robot seconds per second."""
    stream.write(_recording_page(arm, timeline, world, title=title, rate=rate).encode())


def _recording_page(arm: RobotArm, timeline: Timeline, world: World | None, **more: Any) -> str:
    """Return the HTML file that plays a timeline."""
    from vrs_cli.net.page_data import recorded_page  # imported only here, because exports of numbers do not need it

    return page(recorded_page(arm, timeline, cell=None if world is None else world.cell, **more))


def write_still(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, t: float, world: World | None = None, title: str = ""
) -> None:
    """Write a PNG that shows time t [s], with a caption. Raises PictureError if there is no browser."""
    with _open_scene(arm, timeline, SIZE, FINE, world) as seen:
        seen.evaluate(_picture_script(arm, timeline, t, title or arm.model.title))
        stream.write(seen.picture("png"))


def write_gif(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None, title: str = ""
) -> None:
    """Write an endlessly repeated animation with `rate` frames per second. Raises PictureError."""
    from PIL import Image

    def in_few_colours(frame: bytes) -> Image.Image:
        """Return a frame with 256 colours. An octree keeps the colours of thin lines; median cut would spend its
        colours on large surfaces."""
        picture = Image.open(BytesIO(frame)).convert("RGB")
        return picture.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)

    with _frames(arm, timeline, rate, GIF_SIZE, world, title, "png") as frames:
        first, *others = map(in_few_colours, frames)
    first.save(stream, "gif", save_all=True, append_images=others, duration=round(1000.0 / rate), loop=0)


def write_mp4(
    stream: BinaryIO, arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None, title: str = ""
) -> None:
    """Write a film with `rate` frames per second, with the ffmpeg of this machine. Raises PictureError."""
    come = ("-f", "image2pipe", "-c:v", "mjpeg", "-framerate", f"{rate:.6g}", "-i", "-")
    with TemporaryDirectory() as folder, _frames(arm, timeline, rate, FILM_SIZE, world, title, "jpeg") as frames:
        made = Path(folder) / "film.mp4"
        command = (find_ffmpeg(), "-loglevel", "error", *come, *H264, str(made))
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as running:
            assert running.stdin is not None, "it is piped"
            with suppress(BrokenPipeError):  # ignore a broken pipe here, because ffmpeg itself reports why it stopped
                for frame in frames:
                    running.stdin.write(frame)
            _, said = running.communicate()
        if running.returncode:
            raise PictureError("ffmpeg makes no film", said.decode(errors="replace").strip())
        stream.write(made.read_bytes())


@contextmanager
def _frames(
    arm: RobotArm,
    timeline: Timeline,
    rate: float,
    size: tuple[int, int],
    world: World | None,
    title: str,
    form: str,
) -> Iterator[Iterator[bytes]]:
    """Provide an iterator over pictures of the whole timeline, as `png` or `jpeg`. Raises PictureError for too many
    frames."""
    count = ceil((timeline.end - timeline.start) * rate)
    if count > MAX_FRAMES:
        raise PictureError(
            f"{count} frames are more than a film has ({MAX_FRAMES}), as each takes a moment to draw",
            f"give --rate {floor(10.0 * MAX_FRAMES / (timeline.end - timeline.start)) / 10.0:g}, or --to html",
        )
    name, options = title or arm.model.title, JPEG if form == "jpeg" else {}
    with _open_scene(arm, timeline, size, FAST, world) as seen, RunProgress("drawing", timeline.end) as progress:

        def take(t: float) -> bytes:
            progress(t)
            seen.evaluate(_picture_script(arm, timeline, t, name))
            return seen.picture(form, **options)

        yield (take(min(timeline.start + k / rate, timeline.end)) for k in range(count + 1))


@contextmanager
def _open_scene(
    arm: RobotArm, timeline: Timeline, size: tuple[int, int], quality: int, world: World | None
) -> Iterator[BrowserPage]:
    """Show the page in a browser. Raises PictureError."""
    with TemporaryDirectory() as folder, browser_page() as seen:
        file = Path(folder) / "page.html"
        file.write_text(_recording_page(arm, timeline, world, picture=quality), encoding="utf-8")
        seen.open(file.as_uri(), size)
        seen.evaluate(READY)
        yield seen


def _picture_script(arm: RobotArm, timeline: Timeline, t: float, title: str) -> str:
    """Return the JavaScript expression that shows a time with its caption."""
    return f"take({t!r}, {json.dumps(caption(arm, timeline, t, title))})"


def caption(arm: RobotArm, timeline: Timeline, t: float, title: str) -> str:
    """Return a caption such as `PUMA 560 3.2 s MOVES part`. It shows the command only while the command moves the
    robot."""
    here = position_at(arm, timeline, t)
    shown = floor(t * TIME_STEPS_A_SECOND + 1e-6) / TIME_STEPS_A_SECOND
    return f"{title}   {shown:.1f} s   {here.text if here.moving else ''}".rstrip()


def check_still() -> None:
    """Raise UsageError if a browser or the page is missing."""
    check_page()
    find_browser()


def check_gif() -> None:
    """Raise UsageError if a browser, the page or Pillow is missing."""
    check_still()
    if find_spec("PIL") is None:
        raise PictureError("moving pictures need Pillow, which is not installed", how_to_install("pillow"))


def check_mp4() -> None:
    """Raise UsageError if a browser, the page or ffmpeg is missing."""
    check_still()
    find_ffmpeg()


def find_ffmpeg() -> str:
    """Return the path of ffmpeg. Raises PictureError if there is none."""
    found = shutil.which("ffmpeg")
    if found is None:
        raise PictureError("ffmpeg makes films, and there is none", "install it (apt-get install ffmpeg), or --to gif")
    return found


def _picture(
    name: str, summary: str, write: Callable[..., None], check: Callable[[], None], usual: Callable[[Timeline], float]
) -> Exporter:
    return Exporter(name, f".{name}", summary, write, check, usual, of_moment=name == "png", shows_cell=True)


PICTURES: Mapping[str, Exporter] = {
    exporter.name: exporter
    for exporter in (
        _picture("html", "a page that plays in a browser, offline", write_page, check_page, lambda _: 1.0),
        _picture("png", "a picture of one moment", write_still, check_still, lambda timeline: timeline.end),
        _picture("gif", "an animation", write_gif, check_gif, lambda _: FRAMES_A_SECOND),
        _picture("mp4", "a film, made by ffmpeg", write_mp4, check_mp4, lambda _: FRAMES_A_SECOND),
    )
}
