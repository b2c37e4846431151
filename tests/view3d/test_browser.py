"""The browser that tests look through sees what is there, and notices a request that leaves the machine."""

from __future__ import annotations

import numpy as np
import pytest

from tests.examples import only_in_full
from tests.view3d.browser import Browser, alone, changed, chromium, coloured, needs_browser

pytestmark = needs_browser


RED = (220, 40, 40)


@only_in_full()  # tests/view3d/test_page.py compares all that is read of a page with what there has to be
def test_a_scene_is_read_and_seen(browser: Browser) -> None:
    viser = pytest.importorskip("viser")
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        server.scene.configure_environment_map(None)  # software takes 7 s to make one
        server.scene.add_frame("/arm", position=(0.1, 0.2, 1.0 / 3.0), wxyz=(0.0, 1.0, 0.0, 0.0), show_axes=False)
        box = server.scene.add_box("/arm/box", dimensions=(1.0, 1.0, 1.0), color=RED, position=(0.0, 0.0, 0.1))
        browser.open(f"http://127.0.0.1:{server.get_port()}", "/arm/box")
        assert browser.nodes()["/arm"].position == (0.1, 0.2, 1.0 / 3.0)
        assert browser.nodes()["/arm/box"].kind == "BoxMessage"
        T = np.diag([1.0, -1.0, -1.0, 1.0])
        T[:3, 3] = 0.1, 0.2, 1.0 / 3.0 - 0.1
        np.testing.assert_allclose(browser.pose("/arm/box"), T, atol=1e-6)

        row, column = browser.pixel(*T[:3, 3])
        browser.until(lambda: bool(browser.canvas()[row, column, 0] > browser.canvas()[row, column, 1] + 50))
        seen = browser.canvas()
        assert coloured(seen, tuple(seen[row, column])) > 0.005
        box.visible = False
        browser.until(lambda: changed(seen, browser.canvas()) > 0.005)
        assert not browser.errors()
    finally:
        server.stop()


def test_a_request_beyond_this_machine_or_of_a_file_fails_the_test_and_is_noted() -> None:
    asked = "http://beyond.invalid/picture.png", "http://127.0.0.1:9/picture.png"
    page = "".join(f"<img src='{url}'>" for url in asked)
    opened: list[Browser] = []
    with pytest.raises(AssertionError, match=r"left this machine.*beyond\.invalid.*127\.0\.0\.1"):
        look_at(f"data:text/html,{page}<script>oops()</script>", opened)
    assert tuple(asked.url for asked in opened[0].requests) == asked


def look_at(page: str, opened: list[Browser]) -> None:
    with alone(), chromium() as browser:
        opened.append(browser)
        browser.open(page)
        assert any("oops" in error for error in browser.errors())
