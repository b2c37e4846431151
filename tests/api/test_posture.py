"""Parts of a cell in Python, here and over a connection."""

from __future__ import annotations

from pathlib import Path

import pytest

import vrs_cli as vrs
from tests.net.serving import serving
from vrs_cli.files.cell_file import parse_cell

CELL = """
[[fixture]]
name = "table"
shape = "box"
size = [1200, 1200, 20]
at = [0, 500, -310]

[[part]]
name = "box"
shape = "box"
size = [40, 40, 60]
at = [0, 550, -270]
"""
PICK = """
.PROGRAM pick
    SET place = TRANS(0, 550, -250, 90, 90, 0)
    APPRO place, 50
    OPENI
    MOVES place
    CLOSEI
    DEPARTS 100
.END
"""


@pytest.fixture
def robot(tmp_path: Path) -> vrs.Robot:
    (tmp_path / "cell.toml").write_text(CELL)
    made = vrs.Robot(cell=tmp_path / "cell.toml")
    made.define(PICK)
    return made


def test_parts_are_told_at_any_time(robot: vrs.Robot) -> None:
    robot.execute("pick")
    box = robot.part("box")
    before, now = box.at(0.0), box.now
    assert (before.on, before.held, before.name) == ("table", False, "box")
    assert before.location is not None
    assert now.location is not None
    assert before.location.xyz.tolist() == pytest.approx([0.0, 550.0, -270.0])
    assert (now.on, now.held) == ("", True)
    assert now.location.xyz.tolist() == pytest.approx([0.0, 550.0, -170.0], abs=1e-6)
    assert robot.in_units("SI").parts["box"].location.xyz.tolist() == pytest.approx([0.0, 0.55, -0.17], abs=1e-9)
    robot.do("UNDO")  # DEPARTS
    robot.do("UNDO")  # CLOSEI
    assert not robot.parts["box"].held
    assert "box" in repr(box)


def test_a_part_that_is_not_there_is_named(robot: vrs.Robot) -> None:
    with pytest.raises(KeyError, match="there is no part 'lid'; there are box"):
        robot.part("lid")
    assert vrs.Robot().parts == {}


def test_the_cell_of_a_call_can_be_looked_at_afterwards(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(CELL)
    robot = vrs.Robot()
    robot.define(PICK)
    robot.execute("pick", cell=tmp_path / "cell.toml")
    assert robot.parts["box"].held


def test_a_served_robot_tells_of_its_parts(tmp_path: Path) -> None:
    with serving(tmp_path) as it, vrs.connect(it.address) as robot:
        it.hub.rooms["cell1"].session.driver.surround(parse_cell(CELL))
        robot.define(PICK)
        robot.execute("pick")
        assert robot.parts["box"].held
        assert robot.part("box").at(0.0).on == "table"


@pytest.mark.parametrize("named", [False, True])
def test_a_file_names_its_cell(tmp_path: Path, named: bool) -> None:
    (tmp_path / ("table.toml" if named else "pick.toml")).write_text(CELL)
    (tmp_path / "pick.v2").write_text(f"{'; cell: table.toml' * named}\n{PICK.strip()}\n")
    robot = vrs.Robot()
    robot.run(tmp_path / "pick.v2")
    assert robot.parts["box"].held
