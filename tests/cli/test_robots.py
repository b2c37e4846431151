"""`vrs robots`, and `--robot` of the other subcommands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs
from vrs_cli.kinematics.robot_file import ROBOTS, robot_names

URDF = Path(__file__).parent.parent / "kinematics" / "urdf"
TILTED = """\
.PROGRAM pick
    MOVE part
    MOVE tilted
    MOVE #far
.END
.LOCATIONS
part 400 0 300 90 90 0
tilted 400 0 300 90 60 0
#far 0 90 300 0
.END
"""


def test_the_list_names_every_robot(vrs: Vrs) -> None:
    ended = vrs("robots")
    assert ended.status == 0
    assert [line.split()[0] for line in ended.out.splitlines()[1:]] == list(robot_names())


@pytest.mark.parametrize("name", robot_names())
def test_all_about_one(vrs: Vrs, name: str) -> None:
    ended = vrs("robots", name)
    assert ended.status == 0
    assert f"({name})" in ended.out.splitlines()[0]
    assert ("Inverse kinematics: closed form" in ended.out) == (name not in ("so100", "xarm6"))


def test_a_robot_of_a_file(vrs: Vrs) -> None:
    ended = vrs("robots", URDF / "seven.urdf")
    assert ended.status == 0
    assert "seven (seven), 7 joints\nInverse kinematics: closed form for each value of joint 7" in ended.out
    assert ended.out.splitlines()[-1].startswith("JT7  deg")


def test_a_robot_that_is_not_there(vrs: Vrs) -> None:
    ended = vrs("robots", "puma")
    assert ended.status == 2
    assert "no robot is called 'puma' (there is cobra600," in ended.err


def test_check_knows_what_the_robot_cannot_reach(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "pick.v2").write_text(TILTED)
    ended = vrs("check", "pick.v2", "--robot", "cobra600")
    assert "pick.v2:3:10: V610 warning: *Location out of range* tilted: this robot keeps its tool vertical" in ended.out
    assert "pick.v2:4:10: V1023 warning: *Joint 3 out of range* #far: would be 300.00 mm" in ended.out
    assert ended.out.splitlines()[-1] == "0 errors, 2 warnings"


def test_json_says_the_unit_of_a_joint_that_slides(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "go.v2").write_text(".PROGRAM go\n  DRIVE 3, 25, 100\n.END\n")
    final = json.loads(vrs("run", "go.v2", "--robot", "cobra600", "--json", "--save", "go.vrst").out)["final"]
    assert final["joints_deg"] == pytest.approx([-45, 90, 75, 45])
    assert final["joint_units"] == ["deg", "deg", "mm", "deg"]
    there = json.loads(vrs("where", "go.vrst", "--at", 100, "--json").out)[0]
    assert there["joints_deg"] == pytest.approx([-45, 90, 75, 45])
    assert "75.000" in vrs("where", "go.vrst", "--at", 100).out
    (tmp_path / "go.v2").write_text(".PROGRAM go\n  DRIVE 1, 25, 100\n.END\n")
    final = json.loads(vrs("run", "go.v2", "--robot", "ur5e", "--json").out)["final"]
    assert "joint_units" not in final


def test_a_plot_and_a_table_of_four_joints(vrs: Vrs, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    (tmp_path / "go.v2").write_text(".PROGRAM go\n  DRIVE 3, 25, 100\n  NEST\n.END\n")
    assert vrs("run", "go.v2", "--robot", "cobra600", "--plot", "go.svg", "--csv", "go.csv").status == 0
    drawn = (tmp_path / "go.svg").read_text()
    assert "joints [deg, mm]" in drawn
    assert "joint velocities [deg/s, mm/s]" in drawn
    assert (tmp_path / "go.csv").read_text().startswith("t,jt1,jt2,jt3,jt4,x,y,z,")


TWO = """<robot name="two">
  <joint name="a" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1"/></joint>
  <joint name="b" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1"/></joint>
  <joint name="c" type="fixed"><parent link="b"/><child link="nose"/><origin xyz="0.3 0 0"/></joint>
  <joint name="jaw" type="revolute"><parent link="b"/><child link="jaw"/><origin xyz="0.2 0 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" velocity="1"/></joint>
</robot>
"""


def test_base_and_tip_of_a_urdf_file(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "two.urdf").write_text(TWO)
    (tmp_path / "go.v2").write_text(".PROGRAM go\nDRIVE 1, 30, 100\n.END\n")
    ended = vrs("run", "go.v2", "--robot", "two.urdf", "--json")
    assert "vrs run: note: joint jaw at the end of the chain moves the hand" in ended.err
    assert len(json.loads(ended.out)["final"]["joints_deg"]) == 2
    for command in ("run", "check"):
        asked = vrs(command, "go.v2", "--robot", "two.urdf", "--tip", "nose")
        assert (asked.status, "jaw" in asked.err) == (0, False)
    shown = vrs("robots", "two.urdf", "--tip", "jaw")
    assert "two (two), 3 joints" in shown.out
    wrong = vrs("robots", "two.urdf", "--tip", "ear")
    assert (wrong.status, "no joint has a link 'ear' (links are a, b, base, jaw, nose)" in wrong.err) == (1, True)
    assert "the links of puma560 have no names" in vrs("robots", "puma560", "--base", "ear").err
    assert "--base and --tip are links of a robot's file" in vrs("shell", "--tip", "a").err


def test_the_task_of_a_toml_file_that_names_none_is_told(vrs: Vrs, tmp_path: Path) -> None:
    own = Path(ROBOTS, "so100.toml").read_text()
    (tmp_path / "named.toml").write_text(own)
    (tmp_path / "unnamed.toml").write_text(own.replace('task = "steady"\n', ""))
    assert vrs("robots", "named.toml").err == ""
    assert "note: 5 joints: the task is steady" in vrs("robots", "unnamed.toml").err
    assert vrs("robots", "unnamed.toml", "--task", "position").err == ""
