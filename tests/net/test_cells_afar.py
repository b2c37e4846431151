"""A robot in a cell, seen from afar: the cell comes with the welcome, and the state of its world with each window."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from random import Random

import pytest

import vrs_cli as vrs
from tests.live import PATIENCE
from tests.net.serving import serving
from tests.world.cells import BOX, TABLE
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.interfaces.monitor.explaining import Sight
from vrs_cli.net.client import hello_of
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.values.replies import BodyKind
from vrs_cli.world.course import WorldCourse

CELL = f"""
{TABLE}{BOX}
[hand]
signal = 1010
[[sensor]]
name = "barrier"
signal = 1001
kind = "beam"
from = [150, 350, -180]
to = [150, 650, -180]
"""
LINES = (
    "SET part = TRANS(0,550,-250,90,90,0)",
    "SET place = TRANS(300,450,-200,90,90,90)",
    *(
        "OPENI",
        "MOVE part",
        "CLOSEI",
        "MOVE place",
        "MOVE part",
        "MOVE place",
        "MOVE part",
        "MOVE place",
        "OPENI",
        "DEPART 100",
        "DELAY 1",
    ),
)


def check(part: WorldCourse, whole: WorldCourse, begins: float) -> None:
    """Both say the same from a time on, to the bit."""
    source, end = Random(4), whole.timeline.end
    spans = part.spans("box", end)
    assert spans == whole.spans("box", end)[-len(spans) :]
    for t in (begins, *(source.uniform(begins, end) for _ in range(50))):
        assert part.state("box", t) == whole.state("box", t)
        assert part.T_tool_part(t) == whole.T_tool_part(t)
        assert part.opening(t) == whole.opening(t)
        assert [part.signal(n, t) for n in (1001, 1010)] == [whole.signal(n, t) for n in (1001, 1010)]


@pytest.mark.parametrize("early", [False, True])
def test_a_window_shows_parts_and_sensors_as_the_robot_does(tmp_path: Path, *, early: bool) -> None:
    """For who comes late, and for who was there and has forgotten the beginning (`early`)."""
    with serving(tmp_path, journal=False, cell=parse_cell(CELL)) as it:
        connect = partial(SocketPort.connect, it.address, hello_of(), window=2.0)
        port = connect() if early else None
        with vrs.connect(it.address) as robot:
            for line in LINES:
                robot.do(line)
            assert list(robot.parts) == ["box"]
        course = it.hub.rooms["cell1"].session.driver.course
        assert course is not None
        port = port or connect()
        try:
            mirror, world, changes = port.follow(), port.far.world, port.subscribe()
            while mirror.timeline.version < course.timeline.version:
                assert changes.take(PATIENCE) is not None
            assert world is not None
            assert mirror.world is world
            held = course.spans("box", course.timeline.end)[1]
            assert held.begin <= mirror.begins, "it does not know the grip"
            check(world.course(mirror.timeline), course, mirror.begins)
            with vrs.connect(it.address) as robot:
                assert robot.held.port.world is not None
            sight = Sight(mirror.arm, port.world)
            assert [one.kind for one in sight.picture(mirror.timeline, mirror.now).bodies].count(BodyKind.PART) == 1
        finally:
            port.close()


def test_a_cell_that_is_too_large_is_not_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.wire.cells.MAX_CELL_BYTES", 100)
    with serving(tmp_path, journal=False, cell=parse_cell(CELL)) as it:
        assert [line for line in it.told if "too large" in line]
        port = SocketPort.connect(it.address, hello_of(), window=4.0)
        assert port.far.world is None
        port.close()
