"""Chromium for tests of the page, driven by Playwright: one browser, and one window, which each test
leaves empty; tests that need another one open it.

Playwright's synchronous calls run an event loop in the thread of the tests while the browser is open: tests in this
folder call no `asyncio.run` of their own.
"""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from getpass import getuser
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from filelock import FileLock
from numpy.typing import NDArray

from tests.live import PATIENCE
from tests.net.serving import Serving
from vrs_cli.extras import BUILT_PAGE, built_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SIZE = (1000, 560)  # of the window [px]
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",  # root may not have one
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-sandbox",
    "--disable-gpu-compositing",  # it would draw sixty times a second what stands still
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
)
REQUIRED = "VRS_PAGE_REQUIRED"  # where this is set, nothing that these tests need may be missing
PAGE = Path(BUILT_PAGE).parent
AXE = PAGE / "node_modules" / "axe-core" / "axe.min.js"
AXE_FAULTS = """within => axe.run(within || document, {
    runOnly: ['wcag2a', 'wcag2aa', 'wcag21aa', 'wcag22aa', 'best-practice'],
}).then((found) => found.violations.map(({ id, nodes }) =>
        `${id}: ${nodes.slice(0, 4).map((n) => n.target + ' ' + n.any.map((a) => a.message))}`))"""
BUILDER = PAGE / "hatch_build.py"

Picture = NDArray[np.uint8]  # (height, width, 3)


def missing() -> str:
    """Return what a test of the page lacks on this machine; empty if nothing."""
    if CHROMIUM is None:
        return "no chromium: apt-get install chromium"
    lacking = [name for name in ("playwright", "PIL") if find_spec(name) is None]
    return f"no {', '.join(lacking)}: pip install 'vrs-cli[dev]'" if lacking else ""


def leave_out(reason: str) -> None:
    """Skip the test, or fail it if the page is required."""
    if os.environ.get(REQUIRED):
        pytest.fail(reason)
    pytest.skip(reason)


needs_chromium = pytest.mark.skipif(bool(missing()) and not os.environ.get(REQUIRED), reason=missing() or "it is there")


def page_folder() -> Path:
    """Return the page built of the current sources; the first process that needs it builds it."""
    if BUILDER.is_file():
        with FileLock(Path(tempfile.gettempdir()) / f"page-of-tests-{getuser()}.lock"):
            ended = subprocess.run([sys.executable, BUILDER], check=False, capture_output=True, text=True)
        if ended.returncode:
            leave_out(ended.stderr.strip())
    folder = built_page()
    if folder is None:
        leave_out("the page is not built, and its sources are not here")
    assert folder is not None
    return Path(folder)


def alone() -> FileLock:
    """Return the lock of browsers on this machine, because software rendering takes all cores."""
    return FileLock(Path(tempfile.gettempdir()) / f"chromium-of-tests-{getuser()}.lock")


@contextmanager
def running_chromium() -> Iterator[Browser]:
    """Start a browser without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS), headless=True)
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def window(browser: Browser, **options: Any) -> Iterator[Page]:
    """Open an empty window with its own storage for one test."""
    with unwatched(browser, **options) as page, watched(page):
        yield page


@contextmanager
def unwatched(browser: Browser, *, size: tuple[int, int] = SIZE, **options: Any) -> Iterator[Page]:
    """Open a window for many tests. `options`: those of Playwright's `new_context`."""
    width, height = size
    context = browser.new_context(viewport={"width": width, "height": height}, **options)
    context.set_default_timeout(1000 * PATIENCE)
    try:
        yield context.new_page()
    finally:
        context.close()


@contextmanager
def watched(page: Page) -> Iterator[None]:
    """Fail the test at the end if the page threw an error, wrote one to the console, broke its security policy or sent
    a request to another machine.
    """
    faults: list[str] = []
    hears: dict[Any, Callable[[Any], None]] = {
        "pageerror": lambda error: faults.append(str(error)),
        "console": lambda message: faults.append(message.text) if message.type == "error" else None,
        "request": lambda request: None if _stays(request.url) else faults.append(f"asked {request.url}"),
    }
    for event, hear in hears.items():
        page.on(event, hear)
    yield
    for event, hear in hears.items():
        page.remove_listener(event, hear)
    ended = ("ERR_CONNECTION_REFUSED", "ERR_CONNECTION_RESET")  # said of a server that a test has ended
    faults = [fault for fault in faults if not any(one in fault for one in ended)]
    assert not faults, "\n".join(faults)


def _stays(url: str) -> bool:
    """Return whether a request stays on this machine."""
    parts = urlsplit(url)
    return parts.scheme in ("blob", "data", "file", "about") or parts.hostname in ("127.0.0.1", "localhost", "::1")


def address(served: Serving, robot: str = "cell1") -> str:
    """Return the address of the page of a robot."""
    return f"{served.address.replace('ws', 'http', 1)}/view/{robot}"


def open_robot(page: Page, served: Serving, robot: str = "cell1") -> None:
    """Show a robot, and wait until it is drawn."""
    page.goto(address(served, robot))
    drawn(page)


def until(page: Page, expression: str, value: object = None) -> None:
    """Wait until an expression of JavaScript holds, which has `value` as `x`. (Playwright's own `wait_for_function`
    evaluates a string in the page, which the page's security policy forbids.)
    """
    held = page.evaluate(
        f"""x => new Promise((done) => {{
            const deadline = performance.now() + {1000 * PATIENCE};
            const look = () =>
                ({expression}) ? done(true) : performance.now() > deadline ? done(false) : setTimeout(look, 20);
            look();
        }})""",
        value,
    )
    assert held, f"not so after {PATIENCE:g} s: {expression}"


def axe(page: Page, within: str = "") -> list[str]:
    """Return the findings of an accessibility check in a page or a part of it."""
    if not AXE.is_file():
        pytest.skip("axe-core is not there: npm ci in vrs_cli/page; .ci/run runs this test after it")
    if not page.evaluate("!!window.axe"):
        page.evaluate(AXE.read_text())
    found: list[str] = page.evaluate(AXE_FAULTS, within)
    return found


def drawn(page: Page) -> None:
    """Wait until the page has drawn a picture."""
    until(page, "window.scene?.stage.pictures > 0")


def line(page: Page, text: str) -> None:
    """Type a line at the robot of a page."""
    done = page.evaluate("text => app.connection.ask('line', { text })", text)
    assert done["type"] == "done", done
    assert done.get("ok", True), done


def picture(page: Page, selector: str = "canvas") -> Picture:
    """Return a screenshot of an element."""
    from PIL import Image

    return np.array(Image.open(io.BytesIO(page.locator(selector).first.screenshot())).convert("RGB"))


def changed(a: Picture, b: Picture, by: int = 16) -> float:
    """Return the share of pixels that differ by more than `by` in a colour."""
    return float(np.mean(np.any(np.abs(a.astype(int) - b.astype(int)) > by, axis=2)))
