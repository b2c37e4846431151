"""The view is an extra: where viser is not installed, its tests are left out."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.net.serving import serving
from vrs_cli.kinematics.robot_file import load_robot

if TYPE_CHECKING:
    import viser

    from vrs_cli.net.hosted import Hosted
    from vrs_cli.view3d.app import App

collect_ignore_glob = [] if find_spec("viser") else ["test_*.py"]


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    """A page that no browser looks at."""
    import viser

    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


@pytest.fixture
def hosted(tmp_path: Path) -> Iterator[Hosted]:
    """A robot of this process."""
    from vrs_cli.net.hosted import Hosted

    hosted = Hosted(load_robot("puma560"), folder=tmp_path)
    yield hosted
    hosted.close()


@pytest.fixture
def app(hosted: Hosted) -> Iterator[App]:
    """The view of it."""
    from vrs_cli.view3d.app import App

    app = App(hosted.hold)
    yield app
    app.close()


@pytest.fixture
def shared(tmp_path: Path) -> Iterator[App]:
    """The view of a robot that is served to many: who commands it drives it."""
    from vrs_cli.net.client import hello_of
    from vrs_cli.net.socket_port import SocketPort
    from vrs_cli.view3d.app import App

    with serving(tmp_path) as it:
        app = App(lambda told: SocketPort.connect(it.address, hello_of(name="browser", attended=True), told=told))
        yield app
        app.close()
