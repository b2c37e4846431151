"""Carry out what a reader has read on a timeline of our own, and read from a timeline what a run did."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from typing import NamedTuple

import numpy as np

from tests.convert.readers import Frames, Input, Joints, Line, Matrix, Operation, Output, Wait
from vrs_cli import Location, Robot
from vrs_cli.engine.position import joints_at, world_pose
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import MotionKind, Start

SAME = 1e-8  # of the elements of a pose


class Done(NamedTuple):
    """The places at which motions end or round a corner, 4x4 each; the outputs in order (None: the hand); the inputs
    read.
    """

    places: list[Matrix]
    outputs: list[tuple[int | None, bool]]
    inputs: list[tuple[int, bool]]


def play(operations: Iterable[Operation], robot: Robot) -> Done:
    """Carry out operations one by one, each motion to its end."""
    places, inputs = list[Matrix](), list[tuple[int, bool]]()
    for one in operations:
        match one:
            case Joints():
                count = len(robot.where().joints)
                assert not any(one.joints[count:]), "axes that the robot has not"
                robot.move(*one.joints[:count])
                places.append(robot.where().location.matrix)
            case Line():
                if np.abs(robot.where().location.matrix - one.pose).max() > 1e-9:
                    robot.moves(Location.from_matrix(one.pose))
                places.append(robot.where().location.matrix)
            case Frames():
                robot["held"] = Location.from_matrix(one.tool)
                robot.do("TOOL held")
                turn = np.degrees(np.arctan2(one.base[1, 0], one.base[0, 0]))
                assert np.allclose(one.base[:3, 2], [0, 0, 1]), "BASE turns about Z"
                robot.do(f"BASE {', '.join(f'{x:.9f}' for x in (*one.base[:3, 3] * 1000.0, turn))}")
            case Output(None, on):
                robot.do("OPENI" if on else "CLOSEI")
            case Output(number, on):
                robot.do(f"SIGNAL {number if on else -number}")
            case Input():
                inputs.append((one.number, one.on))
            case Wait():
                robot.do(f"DELAY {one.seconds}")
    return Done(places, outputs_of(robot.timeline), inputs)


def outputs_of(timeline: Timeline) -> list[tuple[int | None, bool]]:
    """Return the changes of outputs and the hand, in order of time."""
    found, now = list[tuple[int | None, bool]](), dict[int, bool]()
    for event in timeline.events:
        on = event.value >= 0.5
        if event.channel <= 1000 and not event.observed and now.get(event.channel, False) is not on:
            now[event.channel] = on
            found.append((event.channel or None, on))
    return found


def done_in(arm: RobotArm, timeline: Timeline) -> Done:
    """Return what a run did: the end of each motion, or the place where another has cut it short."""
    places = list[Matrix]()
    motions = [list(found) for _, found in groupby(timeline, key=lambda segment: segment.motion.number)][1:]
    for segments, following in zip(motions, [*motions[1:], None], strict=True):
        motion, last = segments[0].motion, segments[-1]
        if all(segment.phase is Phase.REST for segment in segments):
            continue
        reached = world_pose(arm, motion.frames, joints_at(arm, timeline, last.finish))
        goal = reached
        if motion.kind is MotionKind.JOINT and motion.goal is not None:
            goal = world_pose(arm, motion.frames, motion.goal)
        elif motion.pose is not None and arm.model.joint_count > 2:  # of two joints places alone count
            goal = compose(inverse(motion.frames.base), motion.pose)
        slows = following and (following[0].motion.start is Start.BLEND or last.phase is Phase.DECELERATE)
        places.append(
            _matrix(goal if slows and max(abs(a - b) for a, b in zip(goal, reached, strict=True)) > SAME else reached)
        )
    return Done(places, outputs_of(timeline), [])


def _matrix(T: Transform) -> Matrix:
    return np.vstack([np.reshape(T, (3, 4)), [0.0, 0.0, 0.0, 1.0]])


def farthest(a: list[Matrix], b: list[Matrix]) -> float:
    """Return the largest distance between places [m]."""
    assert len(a) == len(b)
    return max((float(np.linalg.norm(p[:3, 3] - q[:3, 3])) for p, q in zip(a, b, strict=True)), default=0.0)


def most_turned(a: list[Matrix], b: list[Matrix]) -> float:
    """Return the largest element of the difference of rotations."""
    return max((float(np.abs(p[:3, :3] - q[:3, :3]).max()) for p, q in zip(a, b, strict=True)), default=0.0)
