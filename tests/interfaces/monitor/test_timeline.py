"""The timeline at the prompt."""

from __future__ import annotations

from math import degrees, radians
from pathlib import Path

import pytest

from tests.interfaces.monitor.people import at, last
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import IllegalJoint, UsageError
from vrs_cli.interfaces.monitor.timeline import SAMPLES, plot_curves, select_curves, split_file
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values import replies, results
from vrs_cli.values.commands import JointOffsetTarget, Move, NamedTarget
from vrs_cli.values.replies import Plot


def test_undo_takes_the_clock_back() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60", "UNDO")
    assert last(session, results.Message).text == "DRIVE 1, 60 is undone; the clock is at 0.000 s"
    assert session.engine.now == 0.0
    with pytest.raises(UsageError, match="no motion to undo"):
        session.perform("UNDO")


@pytest.mark.parametrize("line", ["PLOT banana", "PLOT 7", "PLOT X, 1"])
def test_a_plot_that_cannot_be_is_refused_also_before_the_first_motion(line: str) -> None:
    with pytest.raises((UsageError, IllegalJoint)):
        at(RecordingTerminal(), line)


LATER = (
    "MOVE #PPOINT(60, -90, 90, 0, 0, 0) AT 0",
    "MOVE #PPOINT(60, -60, 90, 0, 0, 0) AT 4",
    "MOVE #PPOINT(30, -60, 90, 0, 0, 0) AT 6",
)
SPLICE = ("DURATION 3.928", "MOVE #PPOINT(60, -90, 90, 0, 0, 0) AT 0.6")


def displaced(terminal: RecordingTerminal) -> list[replies.Displaced]:
    return [reply for reply in terminal.replies if isinstance(reply, replies.Displaced)]


def test_the_answer_to_a_motion_says_what_begins_later() -> None:
    terminal = RecordingTerminal()
    session = at(terminal, *LATER, *SPLICE)
    assert [one.asked for one in displaced(terminal)[-1].displacement.later] == [4.0, 6.0]
    session.perform("UNDO")
    assert [one.asked for one in displaced(terminal)[-1].displacement.earlier] == [4.0, 6.0]
    assert [(record.asked, record.executed) for record in session.engine.book.records()[1:]] == [(4.0, 4.0), (6.0, 6.0)]
    session.perform("REDO")
    assert session.engine.book.records()[1].is_displaced
    assert len(displaced(terminal)) == 3


def test_a_merge_says_what_it_moves_and_a_change_of_branch_says_nothing() -> None:
    terminal = RecordingTerminal()
    session = at(terminal, *LATER, "BRANCH trial", *SPLICE)
    assert len(displaced(terminal)) == 1
    session.perform("BRANCH main")
    session.perform("BRANCH trial")
    assert len(displaced(terminal)) == 1
    session.perform("MERGE")
    assert [one.asked for one in displaced(terminal)[-1].displacement.later] == [4.0, 6.0]


def test_a_command_file_says_it_once(tmp_path: Path) -> None:
    commands = tmp_path / "later.v2"
    commands.write_text("\n".join(SPLICE) + "\n")
    terminal = RecordingTerminal()
    at(terminal, *LATER, f"COMMANDS {commands}")
    assert len(displaced(terminal)) == 1


def test_abort_says_what_it_drops() -> None:
    terminal = RecordingTerminal()
    at(terminal, *LATER, "ABORT")
    assert [one.asked for one in displaced(terminal)[-1].displacement.dropped][-2:] == [4.0, 6.0]


@pytest.fixture(scope="module")
def engine() -> Engine:
    engine = Engine(load_robot("puma560"))
    engine.perform(Move(JointOffsetTarget(1, radians(60.0)), straight=False))
    engine.perform(Move(NamedTarget("ready"), straight=False))
    return engine


def plot(engine: Engine, *words: str) -> Plot:
    return plot_curves(engine.arm, engine.timeline, select_curves(engine.arm, words))


@pytest.mark.parametrize(
    ("words", "unit", "labels"),
    [
        ((), "deg", ["JT1", "JT2", "JT3", "JT4", "JT5", "JT6"]),
        (("1", "3"), "deg", ["JT1", "JT3"]),
        (("3", "3", "1"), "deg", ["JT3", "JT1"]),
        (("VELOCITY",), "deg/s", ["JT1", "JT2", "JT3", "JT4", "JT5", "JT6"]),
        (("vel", "2"), "deg/s", ["JT2"]),
        (("ACC", "1"), "deg/s2", ["JT1"]),
        (("TOOL",), "mm", ["X", "Y", "Z"]),
        (("X", "Z"), "mm", ["X", "Z"]),
        (("X", "TOOL"), "mm", ["X", "Y", "Z"]),
        (("SPEED",), "mm/s", ["SPEED"]),
        (("HAND",), "1 open", ["HAND"]),
    ],
)
def test_curves(engine: Engine, words: tuple[str, ...], unit: str, labels: list[str]) -> None:
    drawn = plot(engine, *words)
    assert (drawn.unit, [curve.label for curve in drawn.curves]) == (unit, labels)
    assert all(len(curve.values) == len(drawn.times) == SAMPLES for curve in drawn.curves)


@pytest.mark.parametrize(
    "words",
    [("X", "SPEED"), ("VELOCITY", "X"), ("POSITION", "VELOCITY"), ("X", "1"), ("Q",), ("P%",), ("²",), ("9" * 5000,)],
)
def test_what_cannot_be_drawn_says_what_can(engine: Engine, words: tuple[str, ...]) -> None:
    with pytest.raises(UsageError, match="PLOT POSITION, VELOCITY"):
        plot(engine, *words)


@pytest.mark.parametrize("joint", ["0", "7", "99"])
def test_joints_that_are_not_there(engine: Engine, joint: str) -> None:
    with pytest.raises(IllegalJoint, match="joints 1 to 6"):
        plot(engine, joint)


def test_curves_are_where_the_robot_is(engine: Engine) -> None:
    drawn = plot(engine, "1")
    (curve,) = drawn.curves
    for k in range(0, SAMPLES, 48):
        assert curve.values[k] == pytest.approx(degrees(engine.position(drawn.times[k]).joints[0]), abs=1e-9)
    assert max(curve.values) == pytest.approx(60.0, abs=0.01)


def test_the_tool_speed_is_that_of_the_circle_it_draws(engine: Engine) -> None:
    speed = plot(engine, "SPEED").curves[0].values
    rate = plot(engine, "VELOCITY", "1").curves[0].values
    x, y = engine.position(0.0).T_world_tool.px, engine.position(0.0).T_world_tool.py
    radius = (x * x + y * y) ** 0.5 * 1000.0
    middle = SAMPLES // 4
    assert speed[middle] == pytest.approx(radius * radians(rate[middle]), rel=1e-3)


def test_a_file_is_named_last() -> None:
    assert split_file(("1", "2", "arm.SVG")) == (("1", "2"), "arm.SVG")
    assert split_file(("arm.pdf",)) == ((), "arm.pdf")
    assert split_file(("X", "arm")) == (("X", "arm"), "")
