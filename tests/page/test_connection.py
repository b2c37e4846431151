"""Test the page's connection: a server that ends and comes back, and a page that leaves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pytest

from tests.live import until as until_here
from tests.net.serving import Serving, serving
from tests.page.browser import drawn, line, open_robot, until
from vrs_cli.net.http import ServedPage

if TYPE_CHECKING:
    from playwright.sync_api import Page

END = "app.connection.timeline.end"


def test_a_server_that_comes_back_is_found_again(page: Page, built: Path, tmp_path: Path) -> None:
    pages = ServedPage.read(built)
    with serving(tmp_path, pages=pages) as first:
        port = int(urlsplit(first.address).port or 0)
        open_robot(page, first)
        line(page, "DRIVE 1, 30")
        until(page, f"{END} > 0.2")
        moved = page.evaluate(END)
    until(page, "app.connection.state === 'cut'")
    refused = page.evaluate("app.connection.ask('line', { text: 'DRIVE 1, 30' })")
    assert refused["type"] == "refused"
    assert "not sent" in refused["refusal"]["message"]
    with serving(tmp_path, pages=pages, port=port):
        until(page, "app.connection.state === 'open'")
        until(page, f"{END} === x", moved)
        line(page, "DRIVE 2, 10")
        until(page, f"{END} > x", moved)


@pytest.mark.long
def test_a_page_that_leaves_is_forgotten_at_once(shown: Page, served: Serving) -> None:
    line(shown, "DRIVE 1, 10")
    key = shown.evaluate("app.connection.welcome.connection")
    shown.reload()
    drawn(shown)
    assert shown.evaluate("app.connection.welcome.connection") != key
    until_here(lambda: len(served.server._links) == 1, "one connection is left")
    line(shown, "DRIVE 1, 10")  # the lease is free


@pytest.mark.long
def test_a_silent_socket_is_left_for_another(shown: Page) -> None:
    line(shown, "DRIVE 1, 10")
    before = shown.evaluate(END)
    shown.evaluate("app.connection.reopen()")
    until(shown, "app.connection.state === 'open'")
    assert shown.evaluate("app.connection.welcome.resumed") is True
    line(shown, "DRIVE 1, 10")
    until(shown, f"{END} > x", before)
