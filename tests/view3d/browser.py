"""A real browser for tests: Chromium without a window, driven by selenium, with a log of all that it asks the network.

It takes seconds to begin: the fixture `browser` is one for all tests of a process. One at a time draws on a machine,
over all workers: pictures are drawn by software, which takes all the cores that there are.
"""

from __future__ import annotations

import base64
import io
import json
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from getpass import getuser
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import numpy as np
import pytest
from filelock import FileLock
from numpy.typing import NDArray

from tests.live import PATIENCE

PAUSE = 0.05  # [s] between two looks: each takes the time of the page
SIZE = (640, 400)  # of the page [px]: software draws it fast enough
LOOPBACK = ("127.0.0.1", "localhost", "::1")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")

FLAGS = (
    "--headless=new",
    "--no-sandbox",  # root may not have one
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--disable-background-timer-throttling",  # the window behind another goes on too
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
    "--no-first-run",
    "--hide-scrollbars",
)

NOBODY = "not an origin"  # so Chromium calls what no page has asked for

CALMLY = """
    const held = [];
    window.__drawsNot = false;
    requestAnimationFrame = draw => setTimeout(() => __drawsNot ? held.push(draw) : draw(performance.now()), 150);
    window.__drawsAgain = () => { __drawsNot = false; held.splice(0).forEach(draw => requestAnimationFrame(draw)); };
    const often = setInterval;
    setInterval = (act, pause, ...rest) => often(act, Math.max(pause || 0, 60), ...rest);
"""  # a page draws 7 frames a second at most: software that draws without a pause lets nobody else have a turn

PHOTOGRAPH = """
    const canvas = __viserMutable.canvas, picture = document.createElement('img');
    __drawsNot = true;
    picture.id = 'photograph';
    picture.src = canvas.toDataURL('image/png');
    picture.style.cssText = 'position:absolute;inset:0;width:100%;height:100%;pointer-events:none';
    canvas.style.display = 'none';
    canvas.parentElement.append(picture);
    return picture.decode();
"""  # of the scene, in its place: a page that draws is not photographed in time, or white
DEVELOPED = """
    document.getElementById('photograph').remove();
    __viserMutable.canvas.style.display = 'block';
    __drawsAgain();
"""

Picture = NDArray[np.uint8]  # (height, width, 3)


def missing() -> str:
    """What a test in a browser lacks here; empty where nothing is missing."""
    if CHROMIUM is None or DRIVER is None:
        return "no chromium or no chromedriver: apt-get install chromium chromium-driver"
    lacking = [name for name in ("selenium", "viser", "PIL") if find_spec(name) is None]
    return f"no {', '.join(lacking)}: pip install 'vrs-cli[dev]'" if lacking else ""


needs_browser = pytest.mark.skipif(bool(missing()), reason=missing())


class Asked(NamedTuple):
    """A request over the network: its address, and who asked for it."""

    url: str
    initiator: str

    @property
    def leaves(self) -> bool:
        """Whether it goes beyond this machine."""
        return (urlsplit(self.url).hostname or "") not in LOOPBACK

    @property
    def of_a_file(self) -> bool:
        """Whether the page that asked has no server: it is to have all in itself."""
        return urlsplit(self.initiator).hostname is None


class Node(NamedTuple):
    """A node of viser's scene as the page has it: its pose in its parent, and what it is."""

    kind: str  # such as MeshMessage
    visible: bool
    position: tuple[float, float, float]  # [m]
    wxyz: tuple[float, float, float, float]


class Browser:
    """Chromium with a page. `driver` is selenium's, for all that has no method here."""

    def __init__(self, driver: Any, *, calm: bool = True) -> None:
        self.driver = driver
        if calm:
            self._calm()
        self.requests: tuple[Asked, ...] = ()  # all that pages asked for: there when the browser is closed

    def blank(self) -> None:
        """As it began: one window, no page, and no error."""
        first, *others = self.driver.window_handles
        for window in others:
            self.back(window)
            self.driver.close()
        self.back(first)
        self.driver.get("about:blank")
        self.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        self.errors()

    # --- pages ---

    def open(self, url: str, *nodes: str) -> None:
        """Show a page. With names of nodes: a page of viser, which has got them when this returns."""
        self.driver.get(url)
        if nodes:
            self.has(*nodes)
            self.hide_notices()

    def has(self, *nodes: str) -> None:
        """Wait until the scene has nodes, and has drawn them."""
        self.until_page("window.__viserSceneTree && arguments[0].every(n => n in __viserSceneTree.getState())", nodes)
        self.drawn()

    def hide_notices(self) -> None:
        """Take viser's notice of drawing by software off the picture."""
        self.run("document.head.insertAdjacentHTML('beforeend', '<style>.mantine-Notifications-root{display:none}')")

    def _calm(self) -> None:
        self.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": CALMLY})

    def size(self, width: int, height: int) -> None:
        """Of the page [px]."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        self.until_page("innerWidth == arguments[0] && innerHeight == arguments[1]", width, height)

    def another(self) -> str:
        """Open a second window, and go there; `back` goes to one by its name."""
        self.driver.switch_to.new_window("window")
        self._calm()
        return str(self.driver.current_window_handle)

    def back(self, window: str) -> None:
        self.driver.switch_to.window(window)

    # --- what happens in a page ---

    def run(self, script: str, *values: object) -> Any:
        """What a function of JavaScript with this body returns; it has the values as `arguments`."""
        return self.driver.execute_script(script, *values)

    def drawn(self, frames: int = 2) -> None:
        """Wait until viser has drawn the scene anew, so many times: the first frame may be of what was before."""
        drawn = "__viserMutable.requestRender(); return __viserTestpoints.rendererInfo.render.frame"
        wanted = self.run(drawn) + frames
        self.until(lambda: self.run(drawn) >= wanted, what="the scene is drawn")

    def until_page(self, expression: str, *values: object, patience: float = PATIENCE) -> None:
        """Wait until an expression of JavaScript holds."""
        self.until(lambda: bool(self.run(f"return {expression}", *values)), patience, expression)

    def until(self, condition: Callable[[], bool], patience: float = PATIENCE, what: str = "") -> None:
        """Wait until a condition holds."""
        deadline = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < deadline, f"not so after {patience:g} s: {what or condition}"
            time.sleep(PAUSE)

    def errors(self) -> tuple[str, ...]:
        """What the console calls errors, since this was asked last."""
        return tuple(entry["message"] for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE")

    # --- viser's scene, as the page has it ---

    def nodes(self) -> dict[str, Node]:
        """All nodes by their names, such as `/robot/link1`."""
        rows = self.run(
            """
            const tree = __viserSceneTree.getState(), poses = __viserMutable.nodePoseData;
            return Object.entries(tree).filter(([name, node]) => name && node && node.message).map(([name, node]) => {
                const pose = poses[name] || {position: [0, 0, 0], wxyz: [1, 0, 0, 0]};
                return [name, node.message.type, node.visibility !== false, pose.position, pose.wxyz];
            });"""
        )
        return {name: Node(kind, visible, tuple(position), tuple(wxyz)) for name, kind, visible, position, wxyz in rows}

    def pose(self, node: str) -> NDArray[np.float64]:
        """(4, 4): T_scene_node, as it is drawn."""
        elements = self.run(
            """
            const drawn = __viserMutable.nodeRefFromName, root = drawn[''].matrixWorld.clone();
            drawn[arguments[0]].updateWorldMatrix(true, false);
            return root.invert().multiply(drawn[arguments[0]].matrixWorld).elements;""",
            node,
        )
        return np.array(elements, dtype=float).reshape(4, 4).T

    def pixel(self, x: float, y: float, z: float) -> tuple[int, int]:
        """(row, column) on the canvas of a point of the scene [m]."""
        row, column = self.run(
            """
            const {camera, canvas, nodeRefFromName} = __viserMutable;
            const seen = camera.position.clone().set(...arguments)
                .applyMatrix4(nodeRefFromName[''].matrixWorld).project(camera);
            return [(1 - seen.y) / 2 * canvas.height, (1 + seen.x) / 2 * canvas.width];""",
            x,
            y,
            z,
        )
        return int(row), int(column)

    # --- pictures ---

    def canvas(self) -> Picture:
        """The scene alone, as it is drawn."""
        data = self.run("return __viserMutable.canvas.toDataURL('image/png')")
        return _picture(base64.b64decode(data.partition(",")[2]))

    def screen(self) -> Picture:
        """The whole page with its panels, as it is drawn."""
        self.drawn()
        self.run(PHOTOGRAPH)
        try:
            return _picture(self.driver.get_screenshot_as_png())
        finally:
            self.run(DEVELOPED)


def _picture(png: bytes) -> Picture:
    from PIL import Image

    drawn = Image.open(io.BytesIO(png)).convert("RGBA")
    return np.array(Image.alpha_composite(Image.new("RGBA", drawn.size, "white"), drawn).convert("RGB"))


def changed(a: Picture, b: Picture, by: int = 16) -> float:
    """Which part of two pictures differs by more than that in a colour."""
    return float(np.mean(np.any(np.abs(a.astype(int) - b.astype(int)) > by, axis=2)))


def coloured(picture: Picture, like: tuple[int, int, int], within: int = 40) -> float:
    """Which part of a picture has about this colour."""
    return float(np.mean(np.all(np.abs(picture.astype(int) - like) <= within, axis=2)))


# --- the browser itself ---------------------------------------------------------------------------------------------


def alone() -> FileLock:
    """One browser at a time on this machine: `with alone(): ...`."""
    return FileLock(Path(tempfile.gettempdir()) / f"chromium-of-tests-{getuser()}.lock")


@contextmanager
def chromium(*, calm: bool = True) -> Iterator[Browser]:
    """A browser with a profile of its own; its pages draw as often as they like unless they are `calm`. When it is
    closed, `requests` has all that pages asked the network for, and the test fails where one of them went beyond this
    machine, or came of a page that was opened from a file.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        log = Path(folder) / "network.json"
        browser = Browser(_driver(Path(folder) / "profile", log), calm=calm)
        try:
            yield browser
        finally:
            with suppress(Exception):
                browser.driver.get("about:blank")  # a page that plays keeps it from hearing that it is to go
            browser.driver.quit()
            browser.requests = tuple(_asked(log))
        left = [asked for asked in browser.requests if asked.leaves or asked.of_a_file]
        assert not left, f"requests left this machine, or the file of their page: {left}"


def _driver(profile: Path, log: Path) -> Any:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    width, height = SIZE
    for flag in (*FLAGS, f"--window-size={width},{height}", f"--user-data-dir={profile}", f"--log-net-log={log}"):
        options.add_argument(flag)
    options.binary_location = str(CHROMIUM)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    driver.set_script_timeout(2.0 * PATIENCE)  # a page that draws is long in answering
    return driver


def _asked(log: Path) -> Iterator[Asked]:
    """The requests of pages in Chromium's own log, workers' too. What the browser asks of its own accord (is there an
    update?), and what the test itself opens, has no page that initiates it.
    """
    first, *lines = log.read_text(encoding="utf-8").splitlines()
    begins = json.loads(first.rstrip(",") + "}")["constants"]["logEventTypes"]["URL_REQUEST_START_JOB"]
    for line in lines:
        with suppress(ValueError):  # brackets round the list; and the end may be missing
            event = json.loads(line.rstrip(","))
            given = event.get("params", {})
            if event["type"] == begins and given.get("initiator", NOBODY) != NOBODY:
                yield Asked(given["url"], given["initiator"])


@pytest.fixture(scope="session")
def running_browser() -> Iterator[Browser]:
    with chromium() as it:
        yield it


@pytest.fixture
def browser(running_browser: Browser) -> Iterator[Browser]:
    """With no page, for this test alone."""
    with alone():
        yield running_browser
        running_browser.blank()
