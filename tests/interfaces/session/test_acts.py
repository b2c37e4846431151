"""Acts: what a line says in words, by value; they are done, and refused, as lines are."""

from __future__ import annotations

from math import inf, nan
from pathlib import Path
from typing import Any

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import IllegalValue, JointOutOfRange, ProgramNotExecutable, RoleWanted, UsageError, VrsError
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.interfaces.session.acts import ACTS, act_on
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.transform import Transform, translation
from vrs_cli.language.words.word import Role
from vrs_cli.values.acts import (
    Assign,
    Boundary,
    Compare,
    Define,
    DragTool,
    Evaluate,
    Execute,
    Explain,
    FollowChunk,
    Go,
    Goal,
    ListBranches,
    ListCommands,
    ListMotions,
    LookAtParts,
    LookAtProgram,
    Record,
    RecordProgram,
    Redo,
    Rest,
    ResyncBody,
    Say,
    Steer,
    Survey,
    Undo,
    Valued,
    WhyRefused,
)
from vrs_cli.values.commands import (
    AlignedTarget,
    JointOffsetTarget,
    JointTarget,
    NamedTarget,
    PoseTarget,
    Target,
    ToolOffsetTarget,
)
from vrs_cli.values.diagnostics import LineRefused
from vrs_cli.values.numbers import Value
from vrs_cli.values.results import Act, RunOutcome
from vrs_cli.wire.messages import ShowBranch

DOWN = (0.0, -0.7, 3.1, 0.0, 0.7, 0.0)
TARGETS: tuple[Target, ...] = (
    PoseTarget(translation(0.3, 0.4, -0.2)),
    JointTarget(DOWN),
    NamedTarget("ready"),
    JointOffsetTarget(2, -0.25),
    ToolOffsetTarget(translation(0.0, 0.0, -0.1)),
    AlignedTarget(),
)
EVERY: tuple[Act[Any], ...] = (
    Go(Goal(joints=DOWN)),
    Rest(),
    Undo(),
    Redo(),
    Explain(Goal(joints=DOWN), "down"),
    Compare("main", "main"),
    Evaluate("a"),
    Assign("a", Valued(real=1.0)),
    Define(""),
    Execute("none"),
    ListCommands(),
    ListBranches(),
    ListMotions(),
    LookAtParts(),
    LookAtProgram("none"),
    RecordProgram("none", 0.0, 1.0),
    Record(),
    Survey(),
    ShowBranch("main"),
    FollowChunk((1.0, 2.0), (DOWN, DOWN)),
    Steer(DOWN),
    DragTool(translation(0.3, 0.4, -0.2)),
    ResyncBody(),
    Boundary(),
    WhyRefused("MOVES part"),
)


@pytest.fixture
def session() -> Session:
    return Session(RecordingTerminal())


def done(session: Session, act: Act[Any], role: Role = Role.SUPERVISOR) -> Any:
    session.user_state.role = role
    return session.converse(act_on(session, act))


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: type(target).__name__)
def test_a_goal_is_its_target(target: Target) -> None:
    assert Goal.of(target).target == target


@pytest.mark.parametrize("value", [1.5, -0.0, "text", translation(1.0, 2.0, 3.0), DOWN], ids=repr)
def test_a_value_is_itself(value: Value) -> None:
    assert repr(Valued.of(value).value) == repr(value)


@pytest.mark.parametrize(
    "wrong",
    [
        Goal(),
        Goal(joints=(nan,) * 6),
        Goal(pose=Transform(*(0.0,) * 12)),
        Goal(offset=translation(0.0, inf, 0.0)),
        Goal(joint=1, change=inf),
    ],
    ids=repr,
)
def test_what_is_no_place_is_refused(session: Session, wrong: Goal) -> None:
    before = session.engine.timeline
    with pytest.raises(IllegalValue):
        done(session, Go(wrong))
    assert session.engine.timeline is before


@pytest.mark.parametrize("wrong", [Valued(), Valued(real=nan), Valued(location=Transform(*(0.0,) * 12))], ids=repr)
def test_what_is_no_value_is_refused(session: Session, wrong: Valued) -> None:
    with pytest.raises(IllegalValue):
        done(session, Assign("a", wrong))
    with pytest.raises(VrsError, match="a"):
        done(session, Evaluate("a"))


@pytest.mark.parametrize(("speed", "executed"), [(0.0, None), (1.5, None), (nan, None), (None, nan), (None, -1.0)])
def test_numbers_of_a_motion_are_checked(session: Session, speed: float | None, executed: float | None) -> None:
    with pytest.raises(IllegalValue):
        done(session, Go(Goal(joints=DOWN), speed=speed, executed=executed))


def test_a_motion_is_that_of_the_line(session: Session) -> None:
    done(
        session,
        Go(Goal(joints=session.units.read((0, -45, 180, 0, 45, 0))), text="MOVE #PPOINT(0, -45, 180, 0, 45, 0)"),
    )
    typed = Session(RecordingTerminal())
    typed.perform("MOVE #PPOINT(0, -45, 180, 0, 45, 0)")
    assert session.engine.timeline == typed.engine.timeline
    with pytest.raises(JointOutOfRange):
        done(session, Go(Goal(joints=(9.0,) * 6)))


def test_undo_and_what_is_listed(session: Session) -> None:
    done(session, Go(Goal(joints=DOWN), text="MOVE down"))
    assert [one.text for one in done(session, ListCommands()).commands] == ["MOVE down"]
    assert done(session, ListMotions()).commands == done(session, ListCommands()).commands
    done(session, Undo())
    assert not done(session, ListCommands()).commands
    done(session, Redo())
    assert len(done(session, ListCommands()).commands) == 1
    assert [row.name for row in done(session, ListBranches()).rows] == ["main"]
    assert done(session, Explain(Goal(joints=DOWN), "down")).name == "down"


def test_what_is_recorded_is_a_trajectory_file(session: Session, tmp_path: Path) -> None:
    done(session, Go(Goal(joints=DOWN), text="MOVE down"))
    done(session, Undo())
    path = tmp_path / "t.vrst"
    path.write_bytes(done(session, Record()).data)
    assert read_trajectory(path).timeline == session.engine.timeline
    session.perform(f"SAVE {tmp_path / 'other.vrst'}")
    assert path.read_bytes() == (tmp_path / "other.vrst").read_bytes()


def test_a_line_is_refused_by_what_it_says(session: Session) -> None:
    done(session, Say("MOVE #PPOINT(0, -45, 180, 0, 45, 0)"))
    assert len(session.engine.timeline) > 1
    done(session, Say("WHERE"), Role.OBSERVER)
    with pytest.raises(RoleWanted, match="MOVE is for a designer"):
        done(session, Say("MOVE #PPOINT(0, -45, 180, 0, 45, 0)"), Role.OBSERVER)
    with pytest.raises(LineRefused):
        done(session, Say("MOVEE a"))


def test_programs_and_values(session: Session) -> None:
    text = ".PROGRAM twice()\n  b = 2*a\n  TYPE b\n.END\n"
    assert done(session, Define(text)).names == ("twice",)
    done(session, Assign("a", Valued.of(4.0)))
    run = done(session, Execute("twice"))
    assert (run.outcome, run.typed) == (RunOutcome.COMPLETED, (" 8",))
    assert done(session, Evaluate("b+1")).value == 9.0
    with pytest.raises(ProgramNotExecutable, match="line 2: "):
        done(session, Define(".PROGRAM wrong()\n  MOVEE a\n.END\n"))
    with pytest.raises(UsageError, match="is no variable"):
        done(session, Assign("a+1", Valued.of(4.0)))


@pytest.mark.parametrize("act", EVERY, ids=lambda act: type(act).__name__)
def test_the_role_is_that_of_the_word(session: Session, act: Act[Any]) -> None:
    assert {type(one) for one in EVERY} == set(ACTS)
    wanted = ACTS[type(act)].role
    for role in (Role.OBSERVER, Role.DESIGNER, Role.SUPERVISOR):
        try:
            done(session, act, role)
        except RoleWanted:
            assert wanted not in role
        except VrsError:
            assert wanted in role
        else:
            assert wanted in role


def test_what_waits_until_a_program_stops(session: Session) -> None:
    session.load_text(".PROGRAM slow()\n  WAIT SIG(1001)\n.END\n")
    session.let_run(session.begin("slow"), lambda _result: None)
    assert session.running
    with pytest.raises(UsageError, match="MOVE has to wait until the program stops"):
        done(session, Go(Goal(joints=DOWN)))
    done(session, Assign("a", Valued.of(1.0)))
    assert done(session, Evaluate("a")).value == 1.0
