"""Provide the page in a real browser, beside a robot served by this process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.net.serving import Serving, serving
from tests.page.browser import alone, leave_out, missing, open_robot, page_folder, running_chromium, unwatched, watched
from vrs_cli.net.http import ServedPage

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page


@pytest.fixture(scope="session")
def built() -> Path:
    """Return the folder of the built page."""
    return page_folder()


_opened = ExitStack()  # the browser and its window


@cache
def _browser() -> Browser:
    return _opened.enter_context(running_chromium())


@cache
def _window() -> Page:
    return _opened.enter_context(unwatched(_browser()))


@pytest.hookimpl(trylast=True)  # after the fixtures of the test
def pytest_runtest_teardown(nextitem: pytest.Item | None) -> None:
    """Close the browser after the last test of this folder: until then an event loop runs in this thread."""
    if nextitem is None or nextitem.path.parent != Path(__file__).parent:
        _window.cache_clear()
        _browser.cache_clear()
        _opened.close()


@pytest.fixture
def chromium(built: Path) -> Browser:  # noqa: ARG001
    """Provide one browser for the tests of this folder."""
    if missing():
        leave_out(missing())
    return _browser()


@pytest.fixture
def desktop(chromium: Browser) -> Page:  # noqa: ARG001
    """Provide a window that tests use one after the other: a new one takes a process and a second of CPU."""
    return _window()


@pytest.fixture
def page(desktop: Page) -> Iterator[Page]:
    """Provide an empty window for one test, which has the machine for itself. Each server has its own port, so storage
    is empty.
    """
    with alone(), watched(desktop):
        try:
            yield desktop
        finally:
            for other in desktop.context.pages[1:]:
                other.close()
            desktop.goto("about:blank")
            desktop.context.clear_cookies()


@pytest.fixture
def served(built: Path, tmp_path: Path) -> Iterator[Serving]:
    """Serve the robot `cell1` with the page."""
    with serving(tmp_path, pages=ServedPage.read(built)) as it:
        yield it


@pytest.fixture
def shown(page: Page, served: Serving) -> Page:
    """Return the drawn page of that robot."""
    open_robot(page, served)
    return page
