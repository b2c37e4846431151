"""Where the robot is, and the locations that are defined at the prompt."""

from __future__ import annotations

from math import degrees, radians

import pytest

from tests.interfaces.monitor.people import PART, Person, at, last, location
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.api.robot import Robot
from vrs_cli.errors import IllegalValue, InvalidName, TypeMismatch, UndefinedValue, UsageError, VrsError
from vrs_cli.interfaces.monitor.locations import change_numbers
from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.language.words.values import Kind, numbers_of
from vrs_cli.values import replies, results
from vrs_cli.values.replies import MeasuredComparisonTable, MeasuredWhereabouts, WhereaboutsTable
from vrs_cli.values.results import Message


def test_where_is_g() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60", "WHERE AT 0.5")
    reply = last(session, replies.Whereabouts)
    assert reply.position == session.engine.position(0.5)
    assert reply.stamped


def test_where_over_time_ends_at_the_exact_end() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60", "WHERE FROM 0.1 STEP 0.3")
    times = [position.time for position in last(session, replies.WhereaboutsTable).positions]
    assert times == pytest.approx([0.1, 0.4, 0.7, 1.0, session.engine.end])


@pytest.mark.parametrize(
    ("line", "times"),
    [
        ("WHERE FROM 0 TO 1 STEP 0.25", [0.0, 0.25, 0.5, 0.75, 1.0]),
        ("WHERE FROM 0 TO 0.3 STEP 0.1", [0.0, 0.1, 0.2, 0.3]),
        ("WHERE FROM 1 TO 1", [1.0]),
        ("WHERE FROM 0 TO 1 STEP 9", [0.0, 1.0]),
    ],
)
def test_times_of_where(line: str, times: list[float]) -> None:
    session = at(RecordingTerminal(), line)
    assert [position.time for position in last(session, replies.WhereaboutsTable).positions] == pytest.approx(times)


@pytest.mark.parametrize(
    "line", ["WHERE FROM 2 TO 1", "WHERE FROM 0 TO 1 STEP 0", "WHERE FROM 0 TO 1 STEP 1E-9", "WHERE 2"]
)
def test_where_refuses(line: str) -> None:
    with pytest.raises(IllegalValue):
        at(RecordingTerminal(), line)


def test_where_of_a_place_leads_to_listl() -> None:
    with pytest.raises(UsageError, match="LISTL Start shows a place"):
        at(RecordingTerminal(), "SET start = HERE", "WHERE Start")


def test_changes_until_an_empty_line() -> None:
    person = Person(",,-50", "510", "")
    session = at(person, PART)
    assert location(session, "part") == [510.0, 150.0, -50.0, 90.0, 90.0, 0.0]
    assert person.asked == ["Change?"] * 3
    assert len(person.replies) == 3


def test_changes_of_joints() -> None:
    session = at(Person(",-80,100,,30", ""), "HERE #safe")
    assert location(session, "#safe") == [0.0, -80.0, 100.0, 0.0, 30.0, 0.0]


def test_a_new_point_begins_at_null() -> None:
    session = at(Person("1,2,3", "", "5", ""), "POINT new", "POINT #new")
    assert location(session, "new") == [1.0, 2.0, 3.0, 90.0, -90.0, 0.0]
    assert location(session, "#new") == [5.0, 0.0, 0.0, 0.0, 0.0, 0.0]


def test_ctrl_c_leaves_it_as_it_was() -> None:
    session = at(Person("", "1,2,3", None), PART, "POINT part")
    assert location(session, "part") == [500.0, 150.0, -100.0, 90.0, 90.0, 0.0]
    session = at(Person(None), "POINT new")
    assert session.environment.kind_of("new") is None


def test_a_change_of_a_compound_is_relative_to_its_frame() -> None:
    session = at(Person(",,7", ""), "SET table = TRANS(100,0,0)", "HERE table:inside")
    assert location(session, "inside") == [-120.32, 149.09, 7.0, 90.0, -90.0, 0.0]


@pytest.mark.parametrize("answer", ["1,2,3,4,5,6,7", "a", "1,b", "1:2"])
def test_a_wrong_change_is_asked_again(answer: str) -> None:
    person = Person(answer, "1", "")
    session = at(person, PART)
    assert location(session, "part")[0] == 1.0
    errors = [reply for reply in person.replies if isinstance(reply, results.Message)]
    assert [message.tone for message in errors] == [results.Tone.ERROR]


def test_changed_keeps_what_is_skipped() -> None:
    assert numbers_of(change_numbers(IDENTITY, ",,5")) == pytest.approx((0.0, 0.0, 5.0, 90.0, -90.0, 0.0))
    assert [round(degrees(q)) for q in change_numbers((0.1, 0.2), "10")] == [10, 11]  # type: ignore[arg-type]


def test_where_nobody_is_there_nothing_is_asked() -> None:
    terminal = RecordingTerminal()
    at(terminal, PART, "HERE start", "POINT part")
    assert terminal.asked == []
    with pytest.raises(UndefinedValue, match="nothing"):
        at(terminal, "POINT nothing")


def test_one_time_and_a_stretch_of_time_do_not_go_together() -> None:
    with pytest.raises(UsageError, match="AT and FROM"):
        at(RecordingTerminal(), "WHERE AT 1 FROM 2")


@pytest.mark.parametrize(
    ("asked", "names"),
    [
        ("part", ["part", "part1", "part2"]),
        ("#via8", ["#via8", "#via9", "#via10"]),
        ("row[2]", ["row[2]", "row[3]", "row[4]"]),
        ("row[1, 9]", ["row[1,9]", "row[1,10]", "row[1,11]"]),
    ],
)
def test_teach_counts_names_up(asked: str, names: list[str]) -> None:
    lines = (line for _ in range(3) for line in ("DRIVE 1, 10", f"TEACH {asked}"))
    session = at(RecordingTerminal(), "READY", *lines)
    taught = {
        name: value for kind in (Kind.LOCATION, Kind.PRECISION) for name, value in session.environment.variables(kind)
    }
    assert set(taught) == set(names)
    assert len(set(map(str, taught.values()))) == 3
    assert not session.terminal.asked  # type: ignore[attr-defined]


def test_teach_says_what_cannot_be_counted_up() -> None:
    session = at(RecordingTerminal(), "TEACH abcdefghijklmno")
    with pytest.raises(InvalidName, match="at most 15 characters"):
        session.perform("TEACH abcdefghijklmno")
    with pytest.raises(IllegalValue, match="TEACH part"):
        session.perform("TEACH part:offset")


def test_a_remark_is_no_change() -> None:
    session = at(Person(",,50 ; higher", " ;nothing"), "POINT part = NULL")
    (part,) = session.environment.variables(Kind.LOCATION)
    assert numbers_of(part.value)[:3] == pytest.approx((0.0, 0.0, 50.0))  # type: ignore[arg-type]


def test_a_precision_point_needs_a_name_of_its_own() -> None:
    with pytest.raises(TypeMismatch, match=r"z cannot hold a precision point \(a real or a transformation is wanted\)"):
        at(RecordingTerminal(), "POINT z = #PPOINT(0, -90, 90)")


OFF = 0.25  # [deg] of joint 2


@pytest.fixture
def robot() -> Robot:
    it = Robot("puma560").move(10, -45, 180, 0, 45, 0).move(-40, -45, 170, 0, 45, 0)
    for k in (*range(100), *range(200, 250)):
        t = 0.01 * k
        joints = it.where(t).joints.copy()
        joints[1] += OFF if k == 220 else 0.0
        it.report(t, joints)
    return it


def test_where_the_robot_was_measured_at_a_time_and_last(robot: Robot) -> None:
    (there,) = robot.do("WHERE MEASURED AT 2.2")
    assert isinstance(there, MeasuredWhereabouts)
    assert there.at.errors[1] == pytest.approx(radians(OFF))
    assert there.at.distance > 1e-3
    (last,) = robot.do("WHERE measured")
    assert isinstance(last, MeasuredWhereabouts)
    assert (last.is_last, last.at.measured.time) == (True, 0.01 * 249)
    assert last.at.distance < 1e-9


@pytest.mark.parametrize(
    ("time", "why"),
    [("1.5", "no report for more than 0.500 s about then"), ("9", "the last report is of 2.490 s")],
)
def test_where_it_is_unknown_it_says_so(robot: Robot, time: str, why: str) -> None:
    (told,) = robot.do(f"WHERE MEASURED AT {time}")
    assert isinstance(told, Message)
    assert told.text.endswith(why)


def test_over_a_stretch_of_time_the_known_times_are_listed(robot: Robot) -> None:
    table, rest = robot.do("WHERE MEASURED FROM 0 TO 3 STEP 0.5")
    assert isinstance(table, WhereaboutsTable)
    assert [row.time for row in table.positions] == [0.0, 0.5, 2.0]
    assert rest.text == "The measured robot is unknown at 4 other times"  # type: ignore[union-attr]


def test_a_comparison_finds_the_greatest_difference_and_the_gap(robot: Robot) -> None:
    robot.do("BRANCH trial")
    robot.undo(1)  # the record stays, and is compared with any branch
    for line, branch in (("COMPARE MEASURED, main", "main"), ("COMPARE MEASURED", "trial")):
        (table,) = robot.do(line)
        assert isinstance(table, MeasuredComparisonTable)
        assert (table.branch, table.comparison.reports) == (branch, 150)
    (table,) = robot.do("COMPARE MEASURED, main")
    assert isinstance(table, MeasuredComparisonTable)
    told = table.comparison
    assert told.joints[1].greatest.distance == pytest.approx(radians(OFF))
    assert told.joints[1].greatest.time == told.tool.greatest.time == 0.01 * 220
    assert told.joints[1].rms == pytest.approx(radians(OFF) / 150**0.5)
    assert told.joints[0].greatest.distance < 1e-12
    assert told.turned.greatest.distance == pytest.approx(radians(OFF), abs=1e-6)
    assert told.unknown == pytest.approx(1.01)


def test_what_cannot_be_told_is_refused(robot: Robot) -> None:
    with pytest.raises(UsageError, match="no body has reported"):
        Robot("puma560").do("WHERE MEASURED")
    with pytest.raises(UsageError, match="no body has reported"):
        Robot("puma560").do("COMPARE MEASURED")
    with pytest.raises(UsageError, match="no branch nix"):
        robot.do("COMPARE MEASURED, nix")
    with pytest.raises(VrsError, match="take another name"):
        robot.do("BRANCH measured")
