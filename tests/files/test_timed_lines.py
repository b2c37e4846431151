"""The stream of targets: joints or poses, a line each, read as they come."""

from __future__ import annotations

from collections.abc import Iterator
from math import radians

import pytest

from vrs_cli.errors import FileDamaged
from vrs_cli.files.timed_lines import TimedTarget, read_targets
from vrs_cli.kinematics.joints import JointKind, JointUnits
from vrs_cli.kinematics.transform import Transform


def read(text: str, joint_count: int = 6) -> list[TimedTarget]:
    return list(read_targets(text.splitlines(), joint_count, "t.csv"))


def test_a_time_and_the_joints() -> None:
    first, second = read("; taught by hand\n0, 0,-90,90,0,0,0\n\n0.02, 10,-90,90,0,0,0 # moved\n")
    assert (first.line, first.t) == (2, 0.0)
    assert second.target == pytest.approx(tuple(map(radians, (10, -90, 90, 0, 0, 0))))


def test_columns_may_be_named_in_any_order() -> None:
    (only,) = read("note,jt2,jt1,t\nhello,20,10,1.5\n", joint_count=2)
    assert (only.t, only.target) == (1.5, pytest.approx((radians(10), radians(20))))


def test_times_may_count_from_the_first() -> None:
    lines = ["1700000000.5,1,2", "1700000000.52,1,2", "1700000001.5,1,2"]
    assert [it.t for it in read_targets(lines, 2, relative=True)] == pytest.approx([0.0, 0.02, 1.0])
    with pytest.raises(FileDamaged, match=r"1700000000\.5 s is no time from 0.*--relative"):
        list(read_targets(lines, 2))


def test_poses() -> None:
    (only,) = read("t,x,y,z,o,a,t_angle\n0,100,200,-50,90,90,0\n")
    assert isinstance(only.target, Transform)
    assert (only.target.px, only.target.py, only.target.pz) == pytest.approx((0.1, 0.2, -0.05))


def test_of_a_table_with_both_the_joints_count() -> None:
    (only,) = read("t,jt1,jt2,x,y,z,o,a,t_angle\n0,1,2,100,200,-50,90,90,0\n", joint_count=2)
    assert only.target == pytest.approx((radians(1), radians(2)))


def test_lines_are_read_one_by_one() -> None:
    taken: list[int] = []

    def lines() -> Iterator[str]:
        for k in range(1000):
            taken.append(k)
            yield f"{k},1,2"

    targets = read_targets(lines(), 2)
    next(targets)
    assert taken == [0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,1,2\n1,2", r"t\.csv:2: 2 fields where 3 are wanted"),
        ("0,1,2\n1,2,up", r"t\.csv:2: 'up' is no number"),
        ("0,1,2\n1,2,nan", r"t\.csv:2: 'nan' is no number"),
        ("2,1,2\n1,2,3", r"t\.csv:2: 1\.0 s comes after 2\.0 s"),
        ("-1,2,3", r"t\.csv:1: -1\.0 s is no time"),
        ("2,1,2\n99999,1,2", r"t\.csv:2: 99999\.0 s is a jump from 2\.0 s"),
        ("t,jt1,jt2,jt3\n0,1,2,3", r"t\.csv:1: jt3 of another robot \(this one has jt1, jt2\)"),
        ("{" + ",".join(f'"column{k}":0' for k in range(999)), r"t\.csv:1: the columns are \{\"column0.{,60}\.\.\. \("),
        ("t,jt1\n0,1", r"t\.csv:1: the columns are t, jt1 .*t,jt1,jt2 or t,x,y,z,o,a,t_angle"),
    ],
)
def test_a_wrong_line_is_named(text: str, message: str) -> None:
    with pytest.raises(FileDamaged, match=message):
        read(text, joint_count=2)


def test_who_wants_the_wrong_lines_gets_them_and_the_targets_go_on() -> None:
    wrong: list[FileDamaged] = []
    lines = ["who is there?", "0,1,2", "0.02,1", "0.01,1,2", "9e9,1,2", "0.02,1,2", "0.01,1,2", "0.04,1,2"]
    targets = list(read_targets(lines, 2, "t.csv", wrong=wrong.append))
    assert [it.line for it in targets] == [2, 4, 6, 8], "one time far ahead does not shut out those that follow"
    assert [str(error).split(": ")[0].rpartition(" ")[2] for error in wrong] == [f"t.csv:{n}" for n in (1, 3, 5, 7)]


def test_joints_that_slide_are_in_mm() -> None:
    units = JointUnits((JointKind.PRISMATIC, JointKind.REVOLUTE))
    (only,) = read_targets(["0, 250, 90"], 2, units=units)
    assert only.target == pytest.approx((0.25, radians(90)))
