"""A recorded trajectory is taken up as if its commands had just been given."""

from __future__ import annotations

from math import radians
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from tests.engine.wall import ManualWall
from tests.examples import examples
from tests.files.trajectories import puma
from vrs_cli.engine.branches import Branches
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import FileError, MotionError, UsageError
from vrs_cli.files.journal import Journal, bookmark_of, keep_journal, take_up
from vrs_cli.files.rebuild import history_of
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.link_data import Box, LinkShape
from vrs_cli.values.commands import JointOffsetTarget, JointTarget, Move, SetParameter, Stamp


def drive(joint: int, degrees: float, at: float | None = None) -> Move:
    stamp = None if at is None else Stamp(at)
    return Move(JointOffsetTarget(joint, radians(degrees)), straight=False, stamp=stamp, text=f"DRIVE {joint}")


moves = st.builds(drive, st.integers(1, 6), st.floats(-15.0, 15.0), st.none() | st.floats(0.0, 3.0))
acts = st.lists(moves | st.sampled_from(["undo", "redo", "ON", "OFF"]), max_size=14)


def kept(path: Path, engine: Engine) -> Journal:
    return keep_journal(take_up(path), engine)


def acted(acts: list[Move | str]) -> Engine:
    engine = Engine(puma())
    for act in acts:
        try:
            if isinstance(act, Move):
                engine.perform(act)
            elif act in ("ON", "OFF"):
                engine.perform(SetParameter("INSERT", act))
            else:
                (engine.undo if act == "undo" else engine.redo)()
        except (MotionError, UsageError):
            pass
    return engine


@examples(80)
@given(acts)
def test_what_can_be_undone_is_the_same_as_before_it_was_saved(tmp_path: Path, sequence: list[Move | str]) -> None:
    engine, path = acted(sequence), tmp_path / "t.vrst"
    write_trajectory(path, engine.model, engine.book.initial, engine.book.deltas)
    again = Engine(puma())
    again.take_up(bookmark_of(path, read_trajectory(path), again))
    assert again.book.records() == engine.book.records()
    assert again.now == again.end
    for _ in range(len(engine.book.history.undone)):
        engine.redo(), again.redo()
        assert repr(list(again.timeline)) == repr(list(engine.timeline))
    for _ in range(len(engine.book.history.done)):
        engine.undo(), again.undo()
        assert repr(list(again.timeline)) == repr(list(engine.timeline))


def steer(engine: Engine) -> None:
    """Follow a stream of targets, and stop at the last one."""
    steering, ready, begun = Steering(engine), engine.model.poses["ready"], engine.now
    for k in range(40):
        steering.to((radians(10.0 + 0.2 * k), *ready[1:]), begun + 0.02 * k)
    steering.finish()
    engine.clock.advance(engine.end)


def test_a_stream_of_targets_is_one_command_in_a_file_too(tmp_path: Path) -> None:
    path = tmp_path / "s.vrst"
    engine = Engine(puma())
    writer = kept(path, engine)
    engine.perform(drive(1, 10))
    steer(engine)
    engine.perform(drive(1, 5))
    writer.close()
    again = Engine(puma())
    again.take_up(bookmark_of(path, read_trajectory(path), again))
    assert again.timeline == engine.timeline
    assert again.book.records() == engine.book.records()
    assert [record.text for record in again.book.records()] == ["DRIVE 1", "STEER", "STEER", "STEER ends", "DRIVE 1"]
    engine.book.journal = None
    for _ in engine.book.records():
        engine.undo(), again.undo()
        assert repr(list(again.timeline)) == repr(list(engine.timeline))


def test_a_merge_does_not_leave_the_clock_behind_that_of_the_file(tmp_path: Path) -> None:
    """Motions of a robot in real time begin at times of their own, and the clock goes on over them."""
    path, wall = tmp_path / "r.vrst", ManualWall()
    live = Engine(puma(), clock=wall.clock())
    live.clock.advance(5.0)
    live.redirect((0.1, *live.model.poses["ready"][1:]), text="JOG 1, 5")
    write_trajectory(path, live.model, live.book.initial, live.book.deltas)
    engine = Engine(puma())
    branches = Branches(engine)
    engine.perform(drive(3, 10))
    branches.add("r", bookmark_of(path, read_trajectory(path), engine))
    assert branches.merge("r") == 1
    assert engine.now == engine.end > live.end > 5.0


def test_a_merge_does_not_turn_the_clock_back(tmp_path: Path) -> None:
    path, short = tmp_path / "r.vrst", Engine(puma())
    short.perform(drive(1, 5, at=0.0))
    write_trajectory(path, short.model, short.book.initial, short.book.deltas)
    engine = Engine(puma())
    branches = Branches(engine)
    engine.perform(drive(3, 90))
    now = engine.now
    branches.add("r", bookmark_of(path, read_trajectory(path), engine))
    branches.merge("r")
    assert engine.now == now > short.end


def test_an_override_is_told_from_an_insertion() -> None:
    engine = acted([drive(1, 20), drive(2, 10), drive(3, -10, at=0.1), "OFF", drive(4, 10, at=0.05), drive(5, 10)])
    assert [step.insert for step in history_of(engine.book.initial, engine.book.deltas).done] == [
        True,
        True,
        True,
        False,
        True,
    ]


def test_a_journal_goes_on_where_it_ended(tmp_path: Path) -> None:
    path, first = tmp_path / "j.vrst", Engine(puma())
    writer = kept(path, first)
    first.perform(drive(1, 60))
    writer.close()
    second = Engine(puma())
    writer = kept(path, second)
    assert second.now == first.end
    second.perform(drive(2, 10))
    second.undo()
    second.perform(drive(3, 10))
    writer.close()
    recording = read_trajectory(path)
    assert recording.timeline == second.timeline
    assert [delta.motion.number for delta in recording.deltas] == [1, 2, 2, 3]


def test_a_journal_has_one_writer(tmp_path: Path) -> None:
    path = tmp_path / "j.vrst"
    first = kept(path, Engine(puma()))
    before = path.read_bytes()
    with pytest.raises(FileError, match="is being written by this vrs"):
        kept(path, Engine(puma()))
    assert path.read_bytes() == before
    first.close()
    kept(path, Engine(puma())).close()


def test_a_robot_that_looks_different_is_the_same_robot(tmp_path: Path) -> None:
    path = tmp_path / "j.vrst"
    kept(path, Engine(structs.replace(puma(), shapes=(LinkShape(0, Box((0.1, 0.1, 0.1))),)))).close()
    kept(path, Engine(puma())).close()


def test_a_file_of_another_robot_is_refused_and_left_alone(tmp_path: Path) -> None:
    path, engine = tmp_path / "j.vrst", Engine(puma())
    for model, told in (
        (structs.replace(puma(), name="other"), "is of a other, this robot is a puma560"),
        (structs.replace(puma(), linear_speed=0.1), "is of a puma560 with other figures"),
    ):
        write_trajectory(path, model, engine.book.initial, ())
        before = path.read_bytes()
        with pytest.raises(UsageError, match=told):
            kept(path, engine)
        assert path.read_bytes() == before
        assert engine.book.journal is None


def test_a_pose_that_is_not_ready_is_taken_up_too(tmp_path: Path) -> None:
    path, engine = tmp_path / "j.vrst", Engine(puma(), start=(0.1, -1.0, 1.5, 0.0, 0.2, 0.0))
    engine.perform(Move(JointTarget((0.0, -1.0, 1.5, 0.0, 0.2, 0.0)), straight=False))
    write_trajectory(path, engine.model, engine.book.initial, engine.book.deltas)
    again = Engine(puma())
    writer = kept(path, again)
    again.undo()
    writer.close()
    assert again.position().joints == engine.book.initial[0].path.joints(0.0)
