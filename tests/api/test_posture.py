"""Test parts of a cell, measured joints and the model in Python, here and over a connection."""

from __future__ import annotations

import warnings
from math import radians
from pathlib import Path

import numpy as np
import pytest

import vrs_cli as vrs
from tests.net.serving import serving
from vrs_cli.api.location import Units
from vrs_cli.errors import IllegalValue
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.kinematics.robot_file import load_robot

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


HERE = np.array([1.0, -45.0, 180.0, 0.0, 45.0, 0.0])


def test_reports_are_read_in_the_units_of_the_robot() -> None:
    robot = vrs.Robot("puma560")
    before = robot.measured
    assert (len(before), before.unknown_since, before.at(0.0)) == (0, None, None)
    robot.report(1.0, HERE, np.full(6, 10.0), np.arange(6.0), mode="holds").report(1.5, HERE + 5.0, np.full(6, 10.0))
    seen = robot.measured
    assert (len(before), len(seen), seen.unknown_since) == (0, 2, 1.5)
    assert seen.at(1.25) == pytest.approx(HERE + 2.5)
    assert seen.at(1.5000001) is None
    several = seen.at([0.5, 1.0, 1.5])
    assert several is not None
    assert np.isnan(several[0]).all()
    assert several[1:] == pytest.approx(np.array([HERE, HERE + 5.0]))
    assert seen.times.tolist() == [1.0, 1.5]
    assert seen.joints == pytest.approx(np.array([HERE, HERE + 5.0]))
    assert seen.velocity == pytest.approx(np.full((2, 6), 10.0), rel=1e-6)
    assert seen.effort[0].tolist() == list(range(6))
    assert np.isnan(seen.effort[1]).all()
    assert seen.modes == ("holds", "follows")
    assert robot.in_units("SI").measured.at(1.0) == pytest.approx(np.radians(HERE))


def test_undo_leaves_the_record_and_a_file_keeps_it(tmp_path: Path) -> None:
    robot = vrs.Robot("puma560").move(HERE)
    robot.report(0.5, HERE).report(0.25, HERE + 1.0)
    robot.undo()
    robot.save(tmp_path / "day.vrst")
    again = vrs.load(tmp_path / "day.vrst").measured
    assert again.timeline == robot.measured.timeline
    assert again.times.tolist() == [0.25, 0.5]


def test_what_is_no_report_is_refused() -> None:
    robot = vrs.Robot("puma560")
    with pytest.raises(ValueError, match="mode: follows, holds, stopped are known, not 'sleeps'"):
        robot.report(0.0, HERE, mode="sleeps")
    with pytest.raises(ValueError, match="velocity"):
        robot.report(0.0, HERE, [1.0, 2.0])
    with pytest.raises(ValueError, match="velocity: one row"):
        robot.report(0.0, HERE, np.zeros((2, 6)))
    with pytest.raises(IllegalValue, match="time 1e\\+09 s"):
        robot.report(1e9, HERE)
    assert len(robot.measured) == 0


PART = vrs.trans(300, 450, -200, 90, 90, 0)
JOINTS = (0, -45, 180, 0, 45, 0)


def test_robots_are_those_that_robot_takes() -> None:
    assert "puma560" in vrs.robots()
    assert vrs.Robot("cobra600").model.name in vrs.robots()


@pytest.mark.parametrize("name", ["puma560", "cobra600"])
def test_a_model_tells_limits_and_poses_in_the_units_of_its_robot(name: str) -> None:
    model, si = load_robot(name), vrs.Robot(name, units="SI").model
    assert si.limits.tolist() == [list(pair) for pair in zip(model.lower, model.upper, strict=True)]
    shown = vrs.Robot(name).model
    assert shown.dof == len(shown.names) == model.joint_count
    scales = Units.VAL.scales(model.units, model.joint_count)
    assert shown.max_velocity == pytest.approx(si.max_velocity * scales)
    r = vrs.Robot(name)
    assert r.joints == pytest.approx(shown.poses["ready"])


def test_a_matrix_is_a_location_wherever_one_is_taken() -> None:
    a, b = vrs.Robot(), vrs.Robot()
    a.move(PART).moves(PART @ vrs.trans(0, 0, -50))
    b.move(PART.matrix).moves((PART @ vrs.trans(0, 0, -50)).matrix)
    assert a.where().joints == pytest.approx(b.where().joints, abs=1e-9)
    assert np.array_equal(a.ik(PART).usable, a.ik(PART.matrix).usable)
    many = vrs.trans([300, 310], 450, -200, 90, 90, 0)
    assert a.ik(many.matrix).joints.shape == a.ik(many).joints.shape
    b["part"] = PART.matrix
    assert np.allclose(b["part"].matrix, PART.matrix)  # type: ignore[union-attr]
    with pytest.raises(ValueError, match="a rotation and a position"):
        a.move(2.0 * PART.matrix)


def test_a_tool_is_read_and_changed() -> None:
    r = vrs.Robot()
    r.tool = vrs.trans(0, 0, 100)
    assert r.tool == vrs.trans(0, 0, 100)
    assert r.fk() == r.where().location
    r.tool = vrs.trans(0, 0, 50).matrix
    assert r.tool.xyz.tolist() == pytest.approx([0, 0, 50])
    with pytest.raises(TypeError, match="tool: a Location is wanted"):
        r.tool = 5


def test_the_frame_of_the_last_link_is_the_flange() -> None:
    r = vrs.Robot()
    rows = np.array([JOINTS, r.joints])
    assert np.allclose(r.fk(rows, link=6).matrix, r.fk(rows).matrix)
    r.tool = vrs.trans(10, 0, 100, 20, 30, 40)
    r.do("BASE 100, 0, 50, 30")
    assert np.allclose((r.fk(rows, link=6) @ r.tool).matrix, r.fk(rows).matrix)
    assert r.fk(JOINTS, link=0).shape == ()
    for wrong in (-1, 7):
        with pytest.raises(ValueError, match=r"link: 0 \(the base\) to 6 \(the flange\)"):
            r.fk(link=wrong)


def test_radians_and_metres_are_warned_of() -> None:
    r = vrs.Robot()
    with pytest.warns(UserWarning, match=r"joints are in degrees: Robot\(units=\"SI\"\)"):
        r.move(np.radians(JOINTS))
    with pytest.warns(UserWarning, match="is in mm"), pytest.raises(vrs.MotionError):
        r.move(vrs.trans(0.3, 0.45, -0.2))


def test_degrees_and_millimetres_are_not_warned_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        r = vrs.Robot()
        r.move(JOINTS).move(0, 0, 0, 0, 0, 0).move(1, 2, 3, 0.5, 0, 0).move(1.23456, 2, 3, 0.5, 0, 0)
        r.ready().move(1, 2, 3, 0.5, 0.1, -0.7).ready().move(PART).moves(PART @ vrs.trans(0, 0, 0.5))
        vrs.Robot(units="SI").move([radians(x) for x in JOINTS])


def test_samples_end_after_their_start() -> None:
    with pytest.raises(ValueError, match="end: 1 s is before the start, 5 s"):
        vrs.Robot().sample(100, 5, 1)
    assert vrs.Robot().sample(100, 1, 1).t.tolist() == [1.0]
