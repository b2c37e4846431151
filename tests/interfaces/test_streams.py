"""Streams of targets: joints or poses, at their times, with what became of them."""

from __future__ import annotations

from math import cos, pi, radians

import pytest

from tests.engine.wall import ManualWall
from vrs_cli.api.control import ChunkSteering
from vrs_cli.api.robot import Robot
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import LocationOutOfRange, PowerOff
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import distance, from_oat

MODEL = load_robot("puma560")
READY = MODEL.poses["ready"]


def swing(t: float) -> Joints:
    return (READY[0] + radians(20.0) * (1.0 - cos(pi * t / 2.0)), *READY[1:])


def follow(steering: Steering | ChunkSteering, seconds: float) -> None:
    for k in range(round(seconds * 50)):
        steering.to(swing(k * 0.02), k * 0.02)


@pytest.mark.parametrize("wall", [None, ManualWall()])
def test_the_same_in_virtual_and_in_real_time(wall: ManualWall | None) -> None:
    engine = Engine(MODEL, clock=None if wall is None else wall.clock())
    steering = Steering(engine)
    follow(steering, 4.0)
    steering.finish()
    assert engine.now == pytest.approx(3.98)
    assert steering.following.targets == 200
    assert steering.following.turning.rms < radians(0.15)
    assert engine.position(engine.end).joints == pytest.approx(swing(3.98))
    if wall is not None:
        assert sum(wall.slept) == pytest.approx(3.98)


def test_a_late_target_is_followed_from_the_present_instant() -> None:
    wall = ManualWall()
    engine = Engine(MODEL, clock=wall.clock())
    steering = Steering(engine)
    follow(steering, 1.0)
    assert steering.following.lag.worst == 0.0
    wall.seconds += 5.0
    steering.to(swing(1.0), 1.0)
    assert engine.book.deltas[-1].executed == pytest.approx(5.98, abs=0.001)
    assert steering.following.lag.worst == pytest.approx(4.98, abs=0.001)
    wall.seconds += 5.0
    steering.finish()
    assert engine.book.deltas[-1].executed == pytest.approx(10.98, abs=0.001)


def test_its_time_still_says_how_fast_the_targets_move() -> None:
    """A burst that was held up: they are followed at the speed at which they were sent, not at which they came."""
    wall = ManualWall()
    engine = Engine(MODEL, clock=wall.clock())
    steering = Steering(engine)
    steering.to(READY, 0.0)
    wall.seconds += 3.0
    for k in range(1, 26):
        steering.to((READY[0] + radians(0.2 * k), *READY[1:]), 0.02 * k)
    assert engine.now == pytest.approx(3.0)
    assert max(segment.path.velocity(0.0)[0] for segment in engine.timeline) < radians(80.0)


def test_between_targets_that_come_in_bunches_the_robot_goes_on() -> None:
    wall = ManualWall(0.0)
    engine = Engine(MODEL, clock=wall.clock())
    steering = Steering(engine)
    for bunch in range(20):
        wall.seconds = 0.2 * (bunch + 1)
        for k in range(10 * bunch, 10 * bunch + 10):
            steering.to(swing(0.02 * k), 0.02 * k)
    off = [
        abs(joints_at(engine.arm, engine.timeline, t)[0] - swing(t - 0.2)[0]) for t in (1.1, 1.5, 2.1, 2.5, 3.1, 3.5)
    ]
    assert max(off) < radians(5.0)


def test_without_a_time_a_target_is_for_now() -> None:
    wall = ManualWall()
    engine = Engine(MODEL, clock=wall.clock())
    steering = Steering(engine)
    for k in range(50):
        steering.to(swing(k * 0.02))
        wall.seconds += 0.02
    executed = [delta.executed for delta in engine.book.deltas]
    assert executed == pytest.approx([k * 0.02 for k in range(50)], abs=1e-6)
    assert steering.following.turning.worst < radians(1.0)


def test_poses_are_followed_too() -> None:
    engine = Engine(MODEL, start=tuple(map(radians, (-70.0, -135.0, -26.0, 0.0, -18.0, -70.0))))
    steering = Steering(engine)
    for k in range(200):
        pose = from_oat(0.0, 0.45, -0.15 + 0.05 * (1.0 - cos(pi * k * 0.01)), pi / 2, pi / 2, 0.0)
        steering.to(pose, k * 0.02)
    steering.finish()
    assert distance(engine.position(engine.end).T_world_tool, pose) < 1e-9
    assert distance(engine.position(2.0).T_world_tool, from_oat(0.0, 0.45, -0.05, 0.0, 0.0, 0.0)) < 1e-3


def test_a_pose_out_of_reach_changes_nothing() -> None:
    engine = Engine(MODEL)
    steering = Steering(engine)
    steering.to(READY, 0.0)
    timeline = engine.timeline
    with pytest.raises(LocationOutOfRange):
        steering.to(from_oat(3.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.02)
    assert engine.timeline is timeline
    assert steering.following.targets == 1


def test_targets_far_apart_are_reached_one_by_one() -> None:
    engine = Engine(MODEL)
    steering = Steering(engine)
    for k in range(3):
        goal = (READY[0] + radians(20.0 * k), *READY[1:])
        steering.to(goal, 3.0 * k)
        assert engine.position(engine.end).joints == pytest.approx(goal)


def test_beyond_a_range_it_stops_at_the_end() -> None:
    engine = Engine(MODEL)
    steering = Steering(engine)
    for k in range(400):
        steering.to((READY[0] + radians(k), *READY[1:]), k * 0.02)
    steering.finish()
    assert steering.following.held == 400 - 161
    assert engine.position(engine.end).joints[0] == pytest.approx(MODEL.upper[0])


def test_chunks_lead_through_the_same_places_without_rest_between() -> None:
    robot = Robot("puma560").held
    steering = ChunkSteering(robot, 0.4)
    follow(steering, 4.0)
    steering.finish()
    followed = steering.followed
    assert (followed.targets, followed.late, followed.held, followed.lost) == (200, 0, 0, 0)
    assert 10 <= followed.chunks <= 20
    assert followed.turning.mean < radians(0.1)
    assert followed.turning.worst < radians(0.3)
    for k in range(10, 200, 7):
        assert robot.at(0.4 + k * 0.02).joints == pytest.approx(swing(k * 0.02), abs=radians(0.3))
    slow = [abs(robot.at(0.4 + k * 0.01).velocity[0]) for k in range(60, 140)]
    assert min(slow) > radians(20.0), "it does not rest between chunks"
    assert robot.at(robot.timeline.end).joints == pytest.approx(swing(3.98))


def test_after_a_gap_of_the_stream_the_robot_goes_to_the_next_target_alone() -> None:
    robot = Robot("puma560").held
    steering = ChunkSteering(robot, 0.0)
    steering.to(swing(0.0), 0.0)
    steering.to(swing(1.0), 3.0)
    steering.finish()
    assert robot.at(2.99).joints == pytest.approx(swing(0.0))
    assert robot.at(robot.timeline.end).joints == pytest.approx(swing(1.0))
    assert steering.followed.chunks == 2


def test_what_the_robot_refuses_ends_the_stream() -> None:
    robot = Robot("puma560")
    robot.do("DISABLE POWER")
    steering = ChunkSteering(robot.held, 0.0)
    follow(steering, 0.5)
    with pytest.raises(PowerOff):
        steering.finish()
    assert steering.refused is not None
